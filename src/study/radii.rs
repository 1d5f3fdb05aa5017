//! Radii of the radiance estimate over all visible points of a picture.

use serde::{Deserialize, Serialize};

use crate::layout::Gathered;

/// Radii of one map's estimates, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Radii {
    /// Minimum, metres.
    pub min: f32,
    /// Median, to within 0.1 %, metres.
    pub median: f32,
    /// Maximum, metres.
    pub max: f32,
}

/// Leading bits of a squared radius that select its bin: sign, exponent and 9 bits of mantissa, a
/// relative resolution of 2⁻¹⁰ in radius.
const SHIFT: u32 = 14;

/// Histogram of radii, in memory independent of the picture's size.
pub(super) struct Counts {
    bins: Vec<u64>,
    total: u64,
    min: f32,
    max: f32,
}

impl Default for Counts {
    fn default() -> Self {
        Self { bins: vec![0; 1 << (32 - SHIFT)], total: 0, min: f32::INFINITY, max: 0.0 }
    }
}

impl Counts {
    /// Points without a photon have no radius and are not counted.
    pub fn add(&mut self, gathered: &[Gathered]) {
        let squares = gathered.iter().filter(|g| g.count > 0).map(|g| g.radius_squared);
        for square in squares.filter(|s| s.is_finite() && *s >= 0.0) {
            self.bins[(square.to_bits() >> SHIFT) as usize] += 1;
            self.total += 1;
            self.min = self.min.min(square);
            self.max = self.max.max(square);
        }
    }

    /// Statistics of the counted radii; `None` if there are none.
    pub fn finish(&self) -> Option<Radii> {
        let mut below = 0;
        let bin = self.bins.iter().position(|count| {
            below += count;
            2 * below >= self.total && self.total > 0
        })?;
        // Centre of the bin, clamped to the minimum and maximum radius counted.
        let middle = f32::from_bits(((bin as u32) << SHIFT) | (1 << (SHIFT - 1)));
        let median = middle.clamp(self.min, self.max).sqrt();
        Some(Radii { min: self.min.sqrt(), median, max: self.max.sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(radii: &[f32], count: u32) -> Option<Radii> {
        let mut counts = Counts::default();
        let points: Vec<_> =
            radii.iter().map(|r| Gathered { radius_squared: r * r, count, ..Gathered::default() }).collect();
        points.chunks(3).for_each(|part| counts.add(part));
        counts.finish()
    }

    #[test]
    fn the_median_is_that_of_a_sort() {
        let radii: Vec<f32> = (0..1001).map(|i| 1e-3 * 1.01_f32.powi((i * 7919) % 1001)).collect();
        let found = of(&radii, 5).unwrap();
        let mut sorted = radii;
        sorted.sort_by(f32::total_cmp);
        assert!((found.median / sorted[500] - 1.0).abs() < 2e-3, "{found:?} and {}", sorted[500]);
        assert!((found.median / sorted[503] - 1.0).abs() > 2e-3, "the control");
        assert!((found.min / sorted[0] - 1.0).abs() < 1e-6 && (found.max / sorted[1000] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn points_without_photons_or_bounds_have_no_radius() {
        assert_eq!(of(&[], 5), None);
        assert_eq!(of(&[0.5], 0), None);
        assert_eq!(of(&[f32::INFINITY, f32::NAN], 5), None);
        assert_eq!(of(&[0.5], 1), Some(Radii { min: 0.5, median: 0.5, max: 0.5 }));
    }
}
