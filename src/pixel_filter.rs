//! Pixel filters: weights of camera samples around the centre of a pixel.
//!
//! Camera samples are distributed as the filter and have equal weights (filter importance sampling:
//! Ernst et al. 2006, "Filter Importance Sampling"). Each filter is the product of one function of
//! x and the same function of y, and is nowhere negative.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

/// Filter shape: weight of an offset from the centre of a pixel, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PixelFilter {
    /// 1 within the square of the pixel.
    #[default]
    Box,
    /// exp(-x² / 2σ²), σ = 0.5, truncated at 1.5 pixels.
    Gaussian,
    /// The four-term window of Harris 1978, "On the Use of Windows for Harmonic Analysis with the
    /// Discrete Fourier Transform", 3 pixels wide.
    BlackmanHarris,
}

/// Standard deviation of the Gaussian filter, pixels.
const SIGMA: f64 = 0.5;
/// Steps of the offset table of a filter other than the box.
const TABLE_STEPS: usize = 1 << 12;
/// Steps of the integral from which the table is computed.
const INTEGRAL_STEPS: usize = 1 << 16;

impl PixelFilter {
    /// Filter radius along each axis, pixels.
    #[must_use]
    pub fn radius(self) -> f64 {
        match self {
            PixelFilter::Box => 0.5,
            PixelFilter::Gaussian | PixelFilter::BlackmanHarris => 1.5,
        }
    }

    /// Value along one axis, not normalised; `x` in pixels from the centre.
    #[must_use]
    pub fn weight(self, x: f64) -> f64 {
        if x.abs() > self.radius() {
            return 0.0;
        }
        match self {
            PixelFilter::Box => 1.0,
            PixelFilter::Gaussian => (-0.5 * (x / SIGMA).powi(2)).exp(),
            PixelFilter::BlackmanHarris => {
                let t = PI * x / self.radius();
                0.358_75 + 0.488_29 * t.cos() + 0.141_28 * (2.0 * t).cos() + 0.011_68 * (3.0 * t).cos()
            }
        }
    }

    /// Inverse CDF along one axis: the offsets at which the integral of the filter reaches 0, 1/n,
    /// 2/n … 1 of its total, interpolated linearly in between. Two entries for the box, which is
    /// exact.
    #[must_use]
    pub fn offsets(self) -> Vec<f32> {
        let radius = self.radius();
        if self == PixelFilter::Box {
            return vec![-radius as f32, radius as f32];
        }
        let width = 2.0 * radius / INTEGRAL_STEPS as f64;
        let edge = |i: usize| -radius + i as f64 * width;
        let mut integral = vec![0.0];
        for i in 0..INTEGRAL_STEPS {
            integral.push(integral[i] + width * self.weight(edge(i) + 0.5 * width));
        }
        let offset = |step: usize| {
            let wanted = integral[INTEGRAL_STEPS] * step as f64 / TABLE_STEPS as f64;
            let part = integral.partition_point(|&sum| sum < wanted).clamp(1, INTEGRAL_STEPS) - 1;
            (edge(part) + width * (wanted - integral[part]) / (integral[part + 1] - integral[part])) as f32
        };
        (0..=TABLE_STEPS).map(offset).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and variance of the distribution that the table gives, by its linear interpolation.
    fn moments(offsets: &[f32]) -> (f64, f64) {
        let parts = offsets.windows(2).map(|w| (f64::from(w[0]), f64::from(w[1])));
        let n = (offsets.len() - 1) as f64;
        let mean = parts.clone().map(|(a, b)| 0.5 * (a + b)).sum::<f64>() / n;
        let square = parts.map(|(a, b)| (a * a + a * b + b * b) / 3.0).sum::<f64>() / n;
        (mean, square - mean * mean)
    }

    /// Variance of the filter itself.
    fn variance(filter: PixelFilter) -> f64 {
        let x = |i: usize| (i as f64 + 0.5) / 5000.0 - 2.0;
        let whole: f64 = (0..20_000).map(|i| filter.weight(x(i))).sum();
        (0..20_000).map(|i| x(i) * x(i) * filter.weight(x(i))).sum::<f64>() / whole
    }

    #[test]
    fn offsets_are_distributed_as_the_filter() {
        use PixelFilter::{BlackmanHarris, Box, Gaussian};
        assert_eq!(Box.offsets(), [-0.5, 0.5]);
        for filter in [Box, Gaussian, BlackmanHarris] {
            let offsets = filter.offsets();
            assert!(offsets.windows(2).all(|w| w[0] < w[1]), "{filter:?} is not rising");
            let (mean, found) = moments(&offsets);
            assert!(mean.abs() < 1e-5, "{filter:?}: mean {mean}");
            assert!((found / variance(filter) - 1.0).abs() < 0.005, "{filter:?}: variance {found}");
        }
        let (_, gaussian) = moments(&Gaussian.offsets());
        assert!((gaussian / variance(BlackmanHarris) - 1.0).abs() > 0.05, "control: one filter passes for another");
    }
}
