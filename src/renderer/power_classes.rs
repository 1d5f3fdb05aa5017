//! Photons of a map by their powers. The nearest photons of a point estimate its light well where
//! they carry about as much: one of great power among many of little shows as a spot. A glass that
//! has more photons than its size asks for, beside a mirror that fills a wall, has such photons, so
//! that each class of powers has a map of its own, over its own nearest photons.

use crate::layout::Photon;

/// Ratio of the powers of a class, and number of classes: what is below is in the last one.
const RATIO: f32 = 4.0;
const CLASSES: usize = 4;
/// Fraction of the photons above the power that stands for the first class.
const ABOVE: f64 = 0.01;
/// Fewest photons of a class, as a fraction of all.
const LEAST: f64 = 0.01;

/// The photons, by classes of power from the greatest to the least, each in the order given.
pub(super) fn power_classes(photons: Vec<Photon>) -> Vec<Vec<Photon>> {
    let mut powers: Vec<f32> = photons.iter().map(power).collect();
    let above = (ABOVE * powers.len() as f64) as usize;
    if powers.is_empty() {
        return Vec::new();
    }
    let (_, &mut greatest, _) = powers.select_nth_unstable_by(above, |a, b| b.total_cmp(a));
    let mut classes = vec![Vec::new(); CLASSES];
    let all = photons.len();
    for photon in photons {
        let steps = (greatest / power(&photon).max(f32::MIN_POSITIVE)).log(RATIO) + 0.5;
        classes[(steps.max(0.0) as usize).min(CLASSES - 1)].push(photon);
    }
    joined(classes, (LEAST * all as f64) as usize)
}

/// Mean of the channels.
fn power(photon: &Photon) -> f32 {
    photon.flux.iter().sum::<f32>() / 3.0
}

/// Classes of at least so many photons: those of fewer are joined with the class before them.
fn joined(classes: Vec<Vec<Photon>>, least: usize) -> Vec<Vec<Photon>> {
    let mut kept: Vec<Vec<Photon>> = Vec::new();
    for class in classes {
        match kept.last_mut() {
            Some(before) if class.len() <= least || before.len() <= least => before.extend(class),
            _ => kept.push(class),
        }
    }
    kept.retain(|class| !class.is_empty());
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photons(power: f32, count: usize) -> Vec<Photon> {
        vec![Photon { flux: [power, 0.5 * power, 1.5 * power], ..Photon::default() }; count]
    }

    #[test]
    fn photons_of_like_power_stay_together() {
        let sizes = |parts: &[Vec<Photon>]| power_classes(parts.concat()).iter().map(Vec::len).collect::<Vec<_>>();
        assert_eq!(sizes(&[photons(1.0, 500), photons(0.7, 500)]), [1000]);
        assert_eq!(sizes(&[photons(1.0, 300), photons(0.01, 700)]), [300, 700]);
        assert_eq!(sizes(&[photons(1.0, 300), photons(0.2, 300), photons(1e-6, 400)]), [300, 300, 400]);
        // Few of great power do not decide, nor do they stay alone.
        assert_eq!(sizes(&[photons(1e4, 5), photons(1.0, 995)]), [1000]);
        assert_eq!(sizes(&[photons(0.0, 10)]), [10]);
        assert!(power_classes(Vec::new()).is_empty());
    }

    #[test]
    fn no_photon_is_lost() {
        let all: Vec<Photon> = (0..1000).flat_map(|i| photons(0.99_f32.powi(i), 1)).collect();
        let sum = |photons: &[Photon]| photons.iter().map(|p| f64::from(power(p))).sum::<f64>();
        let classes = power_classes(all.clone());
        assert_eq!(classes.len(), CLASSES);
        let found: f64 = classes.iter().map(|class| sum(class)).sum();
        assert!((found - sum(&all)).abs() < 1e-9 * found);
    }
}
