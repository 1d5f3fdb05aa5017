//! FLIP: perceived difference between two pictures in alternation (Andersson et al. 2020, "FLIP: A
//! Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2)), in
//! the variant for displayed colours. Names and constants are those of the paper.

use rayon::prelude::*;

use super::Tonemap;

/// Pixels per degree of the observer in the paper: 0.7 m from a screen 0.7 m wide with 3840 pixels.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Exponent of the colour difference; emphasizes small differences.
const QC: f32 = 0.7;
/// Fraction of the largest colour difference that is mapped to the lower [`PT`] of the range.
const PC: f32 = 0.4;
const PT: f32 = 0.95;
/// Width of the feature detectors, degrees.
const FEATURE_WIDTH: f32 = 0.082;
/// Exponent of the feature difference.
const QF: f32 = 0.5;

/// Linear Rec.709 to XYZ: the matrix of the code that accompanies the paper.
const TO_XYZ: [[f32; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];
/// Inverse of [`TO_XYZ`].
const FROM_XYZ: [[f32; 3]; 3] = [
    [3.241_003_2, -1.537_399, -0.498_615_9],
    [-0.969_224_3, 1.875_93, 0.041_554_23],
    [0.055_639_42, -0.204_011_21, 1.057_149],
];
/// XYZ of the white point.
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

type Color = [f32; 3];

/// Mean FLIP error of a picture against its reference: 0 (no visible difference) to 1. Both are
/// scene-linear radiance, multiplied by 2^`exposure` and tone mapped first, in rows of `width`
/// pixels. 0 for an empty picture.
///
/// # Panics
/// If the lengths differ or are no multiple of the width.
#[must_use]
pub fn flip(image: &[Color], reference: &[Color], width: u32, exposure: f32, curve: Tonemap) -> f64 {
    let displayed = |pixels: &[Color]| -> Vec<Color> {
        let scale = exposure.exp2();
        pixels.par_iter().map(|p| curve.apply(p.map(|x| x * scale))).collect()
    };
    let errors = flip_map(&displayed(image), &displayed(reference), width, PIXELS_PER_DEGREE);
    errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len().max(1) as f64
}

/// FLIP error of each pixel, 0 to 1, between pictures of linear display values in [0, 1].
///
/// # Panics
/// If the lengths differ or are no multiple of the width.
#[must_use]
pub fn flip_map(image: &[Color], reference: &[Color], width: u32, pixels_per_degree: f32) -> Vec<f32> {
    assert_eq!(image.len(), reference.len(), "a picture and its reference have the same size");
    let width = width as usize;
    assert!(image.is_empty() || (width > 0 && image.len().is_multiple_of(width)), "whole rows");
    let [image, reference] = [image, reference].map(|p| p.par_iter().map(|&c| to_ycxcz(c)).collect::<Vec<_>>());
    let [colors, other_colors] = [&image, &reference].map(|p| perceived(p, width, pixels_per_degree));
    let [features, other_features] = [&image, &reference].map(|p| features(p, width, pixels_per_degree));
    let largest = hyab(hunt(to_lab([0.0, 1.0, 0.0])), hunt(to_lab([0.0, 0.0, 1.0]))).powf(QC);
    (0..image.len())
        .into_par_iter()
        .map(|i| {
            let color = redistribute(hyab(colors[i], other_colors[i]).powf(QC), largest);
            let apart = |which: usize| (features[i][which] - other_features[i][which]).abs();
            let feature = (apart(0).max(apart(1)) / std::f32::consts::SQRT_2).powf(QF).clamp(0.0, 1.0);
            color.powf(1.0 - feature)
        })
        .collect()
}

/// Filters the picture by the contrast sensitivity of the eye and converts it to Hunt-adjusted
/// CIELAB.
fn perceived(ycxcz: &[Color], width: usize, ppd: f32) -> Vec<Color> {
    // Sums of Gaussians (amplitude, width): table 1 of the paper. Each sum is normalised over the
    // plane.
    const ACHROMATIC: [(f32, f32); 2] = [(1.0, 0.0047), (0.0, 1e-5)];
    const RED_GREEN: [(f32, f32); 2] = [(1.0, 0.0053), (0.0, 1e-5)];
    const BLUE_YELLOW: [(f32, f32); 2] = [(34.1, 0.04), (13.5, 0.025)];
    const WIDEST: f32 = 0.04;
    let pi = std::f32::consts::PI;
    let radius = (3.0 * (WIDEST / (2.0 * pi * pi)).sqrt() * ppd).ceil() as i32;
    let mut filtered = vec![[0.0; 3]; ycxcz.len()];
    for (channel, gaussians) in [ACHROMATIC, RED_GREEN, BLUE_YELLOW].into_iter().enumerate() {
        let plane: Vec<f32> = ycxcz.iter().map(|p| p[channel]).collect();
        let parts = gaussians.into_iter().filter(|(a, _)| *a > 0.0).map(|(a, b)| {
            let taps: Vec<f32> = taps(radius).map(|x| (-pi * pi * (x / ppd).powi(2) / b).exp()).collect();
            let weight = a * (pi / b).sqrt() * taps.iter().sum::<f32>().powi(2);
            (normalised(taps), weight)
        });
        let parts: Vec<(Vec<f32>, f32)> = parts.collect();
        let total: f32 = parts.iter().map(|(_, weight)| weight).sum();
        for (taps, weight) in parts {
            for (sum, x) in filtered.iter_mut().zip(convolve(&plane, width, &taps, &taps)) {
                sum[channel] += x * weight / total;
            }
        }
    }
    let to_hunt = |p: &Color| hunt(to_lab(from_ycxcz(*p).map(|x| x.clamp(0.0, 1.0))));
    filtered.par_iter().map(to_hunt).collect()
}

/// Strength of edges and points at each pixel.
fn features(ycxcz: &[Color], width: usize, ppd: f32) -> Vec<[f32; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH * ppd;
    let radius = (3.0 * deviation).ceil() as i32;
    let gauss = |x: f32| (-x * x / (2.0 * deviation * deviation)).exp();
    let smooth = normalised(taps(radius).map(gauss).collect());
    let edge = normalised(taps(radius).map(|x| -x * gauss(x)).collect());
    let point = normalised(taps(radius).map(|x| (x * x / (deviation * deviation) - 1.0) * gauss(x)).collect());
    // Luminance in [0, 1].
    let plane: Vec<f32> = ycxcz.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
    let strength = |detector: &[f32]| -> Vec<f32> {
        let across = convolve(&plane, width, detector, &smooth);
        let down = convolve(&plane, width, &smooth, detector);
        across.iter().zip(down).map(|(x, y)| x.hypot(y)).collect()
    };
    strength(&edge).into_iter().zip(strength(&point)).map(|(e, p)| [e, p]).collect()
}

fn taps(radius: i32) -> impl Iterator<Item = f32> {
    (-radius..=radius).map(|x| x as f32)
}

/// Normalises the positive weights to the sum 1 and the negative ones, if any, to the sum -1.
fn normalised(taps: Vec<f32>) -> Vec<f32> {
    let positive: f32 = taps.iter().filter(|t| **t > 0.0).sum();
    let negative: f32 = -taps.iter().filter(|t| **t < 0.0).sum::<f32>();
    taps.into_iter().map(|t| if t < 0.0 { t / negative } else { t / positive }).collect()
}

/// Separable convolution. Pixels beyond the border have the value of the nearest border pixel.
fn convolve(plane: &[f32], width: usize, across: &[f32], down: &[f32]) -> Vec<f32> {
    if plane.is_empty() {
        return Vec::new();
    }
    let height = plane.len() / width;
    let at = |i: usize, tap: usize, taps: usize, end: usize| (i + tap).saturating_sub(taps / 2).min(end - 1);
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        for (x, sum) in out.iter_mut().enumerate() {
            *sum = (0..across.len()).map(|t| across[t] * row[at(x, t, across.len(), width)]).sum();
        }
    });
    let mut result = vec![0.0; plane.len()];
    result.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (tap, weight) in down.iter().enumerate() {
            let row = at(y, tap, down.len(), height) * width;
            out.iter_mut().zip(&rows[row..row + width]).for_each(|(sum, x)| *sum += weight * x);
        }
    });
    result
}

/// Maps the colour differences to [0, 1], with most of the range for the common ones.
fn redistribute(difference: f32, largest: f32) -> f32 {
    let bend = PC * largest;
    if difference < bend {
        PT / bend * difference
    } else {
        (PT + (difference - bend) / (largest - bend) * (1.0 - PT)).min(1.0)
    }
}

/// HyAB distance for large colour differences: city block in lightness, Euclidean in chroma.
fn hyab(a: Color, b: Color) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Hunt effect: colourfulness grows with lightness.
fn hunt([l, a, b]: Color) -> Color {
    [l, 0.01 * l * a, 0.01 * l * b]
}

fn times(m: &[[f32; 3]; 3], v: Color) -> Color {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ relative to the white point.
fn relative_xyz(linear: Color) -> Color {
    let xyz = times(&TO_XYZ, linear);
    std::array::from_fn(|i| xyz[i] / WHITE[i])
}

fn to_ycxcz(linear: Color) -> Color {
    let [x, y, z] = relative_xyz(linear);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_ycxcz([luma, cx, cz]: Color) -> Color {
    let y = (luma + 16.0) / 116.0;
    let relative = [y + cx / 500.0, y, y - cz / 200.0];
    times(&FROM_XYZ, std::array::from_fn(|i| relative[i] * WHITE[i]))
}

/// Converts a linear colour to CIELAB.
fn to_lab(linear: Color) -> Color {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |t: f32| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = relative_xyz(linear).map(f);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: u32 = 32;

    /// Inverse of the sRGB transfer function.
    fn srgb_decode(encoded: f32) -> f32 {
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    }

    /// Picture of sRGB-encoded values, decoded to linear ones.
    fn picture(pixel: impl Fn(u32, u32) -> Color) -> Vec<Color> {
        (0..24).flat_map(|y| (0..WIDTH).map(move |x| (x, y))).map(|(x, y)| pixel(x, y).map(srgb_decode)).collect()
    }

    fn ramp(x: u32, y: u32) -> Color {
        [x as f32 / 31.0, y as f32 / 23.0, 0.5]
    }

    fn mean_and_max(image: &[Color], reference: &[Color]) -> (f32, f32) {
        let errors = flip_map(image, reference, WIDTH, PIXELS_PER_DEGREE);
        (errors.iter().sum::<f32>() / errors.len() as f32, errors.iter().copied().fold(0.0, f32::max))
    }

    #[test]
    fn values_are_those_of_the_published_evaluator() {
        // Values of `flip_evaluator` 1.7 by the authors of the paper.
        let reference = picture(ramp);
        let checked = picture(|x, y| [ramp(x, y)[0], ramp(x, y)[1], if (x / 4 + y / 4) % 2 == 1 { 0.5 } else { 0.6 }]);
        let dot = picture(|x, y| if (x, y) == (16, 12) { [1.0, 0.2, 0.1] } else { ramp(x, y) });
        let plain = |color: Color| picture(move |_, _| color);
        for (image, reference, mean, max) in [
            (&checked, &reference, 0.180_543, 0.284_824),
            (&reference, &checked, 0.180_543, 0.284_824),
            (&dot, &reference, 0.005_087_5, 0.224_67),
            (&plain([0.0, 0.0, 1.0]), &plain([0.0, 1.0, 0.0]), 1.0, 1.0),
            (&plain([1.0; 3]), &plain([0.0; 3]), 0.967_39, 0.967_39),
        ] {
            let found = mean_and_max(image, reference);
            assert!((found.0 - mean).abs() < 3e-4 && (found.1 - max).abs() < 2e-3, "{found:?} not {mean}, {max}");
        }
        assert!((mean_and_max(&checked, &dot).0 - 0.180_543).abs() > 3e-4, "the comparison can fail");
    }

    #[test]
    fn the_error_is_zero_for_equal_pictures_and_grows() {
        let reference: Vec<Color> = picture(ramp);
        let error = |strength: f32| {
            let wrong: Vec<Color> = reference.iter().map(|p| p.map(|x| x * (1.0 + strength))).collect();
            flip(&wrong, &reference, WIDTH, 0.0, Tonemap::None)
        };
        assert_eq!(error(0.0), 0.0);
        let errors = [0.0, 0.05, 0.1, 0.2, 0.4].map(error);
        assert!(errors.windows(2).all(|w| w[0] < w[1]), "{errors:?}");
        assert!(errors[4] < 1.0);
    }

    #[test]
    fn noise_too_fine_to_see_counts_less_than_patches() {
        let grey = vec![[0.2; 3]; 32 * 24];
        let checks_of = |side: usize| -> f64 {
            let pixel = |i: usize| if (i % 32 / side + i / 32 / side).is_multiple_of(2) { [0.3; 3] } else { [0.1; 3] };
            flip(&(0..grey.len()).map(pixel).collect::<Vec<_>>(), &grey, WIDTH, 0.0, Tonemap::None)
        };
        assert!(checks_of(1) < checks_of(8));
    }

    #[test]
    fn an_empty_picture_has_no_error() {
        assert_eq!(flip(&[], &[], 0, 0.0, Tonemap::Neutral), 0.0);
    }
}
