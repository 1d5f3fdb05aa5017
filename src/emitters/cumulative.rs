//! Discrete CDFs, from which the shaders sample one of several choices.

/// Number of values that a random number of the shaders can have: multiples of 1 / `STEPS` in [0,
/// 1).
const STEPS: u64 = 1 << 24;
/// Maximum number of weights above 0 in a table: each needs a step of its own.
pub const MAX_CHOICES: usize = 1 << 22;

/// CDF of `weights`, each ≥ 0. The first entry above a random number is the choice. Entries are
/// multiples of 1 / `STEPS`, as random numbers are, so that the difference of an entry to its
/// predecessor is exactly the probability of its choice. A weight above 0 gets at least one step, a
/// weight of 0 gets none. From the last weight above 0 on, all entries are 1.
///
/// # Panics
/// If more than [`MAX_CHOICES`] weights are above 0.
#[must_use]
pub fn cumulative(weights: &[f64]) -> Vec<f32> {
    let positive = weights.iter().filter(|w| **w > 0.0).count();
    assert!(positive <= MAX_CHOICES, "{positive} choices are too many");
    let total: f64 = weights.iter().sum();
    let shared = (STEPS - positive as u64) as f64;
    let (mut sum, mut own_steps) = (0.0, 0);
    let mut table: Vec<f32> = weights
        .iter()
        .map(|weight| {
            sum += weight;
            own_steps += u64::from(*weight > 0.0);
            let fraction = if total > 0.0 { (sum / total).min(1.0) } else { 0.0 };
            ((shared * fraction).round() as u64 + own_steps) as f32 / STEPS as f32
        })
        .collect();
    // Both sums add the same f64 values in the same order, but nothing guarantees that they end in
    // the same bits.
    if let Some(last) = weights.iter().rposition(|w| *w > 0.0) {
        table[last..].fill(1.0);
    }
    table
}

/// Probability of each entry of a table of [`cumulative`].
#[must_use]
pub fn probabilities(cumulative: &[f32]) -> Vec<f32> {
    let before = [0.0].iter().chain(cumulative);
    cumulative.iter().zip(before).map(|(this, before)| this - before).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_follow_the_weights() {
        let weights: Vec<f64> = (0..10_000).map(|i| if i % 3 == 0 { 0.0 } else { f64::from(i % 7) + 1e-9 }).collect();
        let table = cumulative(&weights);
        let total: f64 = weights.iter().sum();
        assert!(table.is_sorted() && table.last() == Some(&1.0));
        for (weight, probability) in weights.iter().zip(probabilities(&table)) {
            let (probability, expected) = (f64::from(probability), weight / total);
            assert!((probability - expected).abs() < 2e-7, "{probability} for {expected}");
            assert_eq!(*weight > 0.0, probability > 0.0, "weight {weight}");
        }
    }

    #[test]
    fn zeros_at_the_end_are_never_chosen() {
        let table = cumulative(&[0.0, 1.0, 3.0, 0.0]);
        assert_eq!([table[0], table[2], table[3]], [0.0, 1.0, 1.0]);
        assert!((table[1] - 0.25).abs() < 2e-7, "{table:?}");
        assert_eq!(probabilities(&table)[3], 0.0);
        assert_eq!(cumulative(&[0.0, 0.0]), [0.0, 0.0]);
    }
}
