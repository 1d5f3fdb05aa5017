//! Error metrics of a picture against a reference, over linear radiance; all pixels and channels
//! have equal weight.

/// Relative mean squared error: mean of (I − R)² / (R² + 0.01). With a mask, only pixels whose
/// entry is `true` count.
///
/// # Panics
/// If the lengths differ or no pixel counts.
#[must_use]
pub fn rel_mse(image: &[[f32; 3]], reference: &[[f32; 3]], mask: Option<&[bool]>) -> f64 {
    average(image, reference, mask, |i, r| (i - r).powi(2) / (r * r + 0.01))
}

/// Root mean squared error. `mask` as in [`rel_mse`].
///
/// # Panics
/// If the lengths differ or no pixel counts.
#[must_use]
pub fn rmse(image: &[[f32; 3]], reference: &[[f32; 3]], mask: Option<&[bool]>) -> f64 {
    average(image, reference, mask, |i, r| (i - r).powi(2)).sqrt()
}

/// Mean absolute error: mean of |I − R|. `mask` as in [`rel_mse`].
///
/// # Panics
/// If the lengths differ or no pixel counts.
#[must_use]
pub fn mae(image: &[[f32; 3]], reference: &[[f32; 3]], mask: Option<&[bool]>) -> f64 {
    average(image, reference, mask, |i, r| (i - r).abs())
}

/// Mean of each channel over all pixels; zero for an empty picture.
#[must_use]
pub fn mean(image: &[[f32; 3]]) -> [f64; 3] {
    let count = image.len().max(1) as f64;
    std::array::from_fn(|c| image.iter().map(|pixel| f64::from(pixel[c])).sum::<f64>() / count)
}

/// Mean of `measure(image, reference)` over the channels of the pixels that count.
fn average(
    image: &[[f32; 3]],
    reference: &[[f32; 3]],
    mask: Option<&[bool]>,
    measure: impl Fn(f64, f64) -> f64,
) -> f64 {
    assert_eq!(image.len(), reference.len(), "a picture and its reference have the same size");
    assert!(mask.is_none_or(|m| m.len() == image.len()), "a mask has the size of its picture");
    let counts = |pixel: usize| mask.is_none_or(|m| m[pixel]);
    let pixels: Vec<usize> = (0..image.len()).filter(|&p| counts(p)).collect();
    assert!(!pixels.is_empty(), "no pixel to compare");
    let of_pixel = |&p: &usize| (0..3).map(|c| measure(image[p][c].into(), reference[p][c].into())).sum::<f64>();
    pixels.iter().map(of_pixel).sum::<f64>() / (3 * pixels.len()) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMAGE: [[f32; 3]; 2] = [[1.0, 0.5, 0.0], [2.0, 0.0, 0.0]];
    const REFERENCE: [[f32; 3]; 2] = [[0.5, 0.5, 0.1], [2.0, 0.0, 1.0]];

    #[test]
    fn measures_agree_with_a_hand_computation() {
        // Squared differences: 0.25, 0, 0.01 | 0, 0, 1; their divisors: 0.26, -, 0.02 | -, -, 1.01.
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-7, "{a} is not {b}");
        near(rel_mse(&IMAGE, &REFERENCE, None), (0.25 / 0.26 + 0.01 / 0.02 + 1.0 / 1.01) / 6.0);
        near(rel_mse(&IMAGE, &REFERENCE, Some(&[true, false])), (0.25 / 0.26 + 0.01 / 0.02) / 3.0);
        near(rmse(&IMAGE, &REFERENCE, None), (1.26_f64 / 6.0).sqrt());
        near(mae(&IMAGE, &REFERENCE, None), 1.6 / 6.0);
        near(mean(&IMAGE)[0], 1.5);
        assert_eq!(rel_mse(&IMAGE, &IMAGE, None), 0.0);
    }

    #[test]
    fn the_reference_divides_and_not_the_image() {
        let swapped = rel_mse(&REFERENCE, &IMAGE, None);
        assert!((swapped - rel_mse(&IMAGE, &REFERENCE, None)).abs() > 0.1);
    }
}
