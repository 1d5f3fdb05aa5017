//! Settings of progressive passes: which of them are rendered, and how their radii shrink.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{
    EstimateSettings, Search, Settings,
    range::{Range, fail},
    render_settings::{check_sample_count, most_samples},
};
use crate::error::Result;

/// Area of a closer estimate, relative to that of a pass. The bias of even curvature is in
/// proportion to it, that of edges, as the root of the mean square over pixels, to its fourth root.
const CLOSER_AREA: f32 = 1.0 / 16.0;

/// Settings that all passes of a picture have in common.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PassSettings {
    /// Fraction of the photons that a pass keeps, α, in [`Self::ALPHA`]: the smaller, the faster
    /// radii shrink, and the more noise is left. 1: they do not shrink.
    pub alpha: f64,
}

impl Default for PassSettings {
    fn default() -> Self {
        Self { alpha: 2.0 / 3.0 }
    }
}

impl PassSettings {
    /// Range of [`Self::alpha`].
    pub const ALPHA: Range<f64> = Range::above(0.0, 1.0);
    /// Minimum number of neighbours of a shrunken estimate. Few photons are weighed softly, over 12
    /// of them at least ([`crate::density::Density::of_few`]), so that fewer neighbours than about
    /// this would not make the radius smaller.
    pub const MIN_NEIGHBORS: u32 = 5;
    /// Radius from which irradiance is taken at least, pixels.
    const MIN_GATHER_RADIUS: f32 = 0.5;
    /// Reach of records of later passes, relative to that of the first. What is smoothed away in
    /// contact shadows and corners stays over all passes, noise does not.
    const LATER_REACH: f32 = 1.0 / 6.0;

    /// Squared radius of pass `index`, relative to that of pass 0: Π (j + α)/(j + 1) over j = 1 to
    /// `index` (Knaus and Zwicker 2011, "Progressive Photon Mapping: A Probabilistic Approach").
    #[must_use]
    pub fn shrinkage(&self, index: u32) -> f64 {
        (1..=index).map(f64::from).map(|j| (j + self.alpha) / (j + 1.0)).product()
    }

    /// Estimate of pass `index`. The squared radius of k nearest photons is proportional to k.
    #[must_use]
    pub fn estimate(&self, first: &EstimateSettings, index: u32) -> EstimateSettings {
        let area = self.shrinkage(index);
        let shrunken = |radius: f32| (f64::from(radius) * area.sqrt()) as f32;
        let neighbors = (f64::from(first.neighbors) * area).round() as u32;
        EstimateSettings {
            neighbors: neighbors.max(Self::MIN_NEIGHBORS.min(first.neighbors)),
            radius: first.radius.map(shrunken),
            max_radius: first.max_radius.map(shrunken),
            gather_radius: shrunken(first.gather_radius).max(Self::MIN_GATHER_RADIUS),
            gather_reach: if index == 0 {
                first.gather_reach
            } else {
                shrunken(Self::LATER_REACH * first.gather_reach)
            },
            ..first.clone()
        }
    }

    /// Estimate of a pass with less bias, for few pixels: by a sixteenth of the area, and of rays
    /// of final gathering without records and cells.
    #[must_use]
    pub fn closer(shrunken: &EstimateSettings) -> EstimateSettings {
        let narrow = |radius: f32| radius * f32::sqrt(CLOSER_AREA);
        let neighbors = (shrunken.neighbors as f32 * CLOSER_AREA) as u32;
        EstimateSettings {
            neighbors: neighbors.max(Self::MIN_NEIGHBORS.min(shrunken.neighbors)),
            radius: shrunken.radius.map(narrow),
            max_radius: shrunken.max_radius.map(narrow),
            gather_spacing: 0,
            irradiance_cells: 0.0,
            share_reach: 0.0,
            ..shrunken.clone()
        }
    }

    /// Squared radius of the estimate of pass `index`, relative to that of pass 0: the shrinkage,
    /// but for whole numbers of neighbours.
    #[must_use]
    pub fn bandwidth(&self, first: &EstimateSettings, index: u32) -> f64 {
        match first.search {
            Search::Radius => self.shrinkage(index),
            _ => f64::from(self.estimate(first, index).neighbors) / f64::from(first.neighbors),
        }
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        Self::ALPHA.check("passes.alpha", self.alpha)
    }
}

/// Passes from `first` to `end`, the latter left out, by their index among all passes of a picture.
/// Displayed as `3..8`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PassRange {
    /// First pass.
    pub first: u32,
    /// The pass behind the last one.
    pub end: u32,
}

impl PassRange {
    /// Range of [`Self::end`].
    pub const END: Range<u32> = Range::closed(1, 1_000_000);

    /// Number of passes.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.end - self.first
    }

    /// Maximum number of passes: as many as 32-bit indices of the numbers for sampling suffice for.
    #[must_use]
    pub fn longest(settings: &Settings) -> Self {
        let each = settings.picture.spp.max(settings.picture.extra_samples()).max(1);
        let most = most_samples(&settings.photons, &settings.picture) / u64::from(each);
        Self { first: 0, end: (most.max(1)).min(Self::END.most().into()) as u32 }
    }

    /// Checks that there is a pass, and that 32-bit indices of the numbers for sampling suffice for
    /// all of them.
    ///
    /// # Errors
    /// [`crate::Error::Setting`].
    pub fn check(&self, settings: &Settings) -> Result<()> {
        if self.first >= self.end || !Self::END.contains(self.end) {
            let problem = format!("must be of at least one pass, with an end {}", Self::END);
            return fail("passes.range", self.to_string(), &problem);
        }
        check_sample_count(&settings.photons, &settings.picture, self.end.into(), ("passes.range", self.to_string()))
    }
}

impl fmt::Display for PassRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.first, self.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squared_radii_shrink_by_the_index_alone() {
        let settings = PassSettings::default();
        assert_eq!(settings.shrinkage(0), 1.0);
        // Γ(i + 1 + α) / (Γ(1 + α) (i + 1)!) is about i^(α − 1) / Γ(1 + α), with Γ(5/3) = 0.902745.
        let expected = 1e6_f64.powf(-1.0 / 3.0) / 0.902_745;
        assert!((settings.shrinkage(1_000_000) / expected - 1.0).abs() < 1e-5);
        assert!((PassSettings { alpha: 0.5 }.shrinkage(1_000_000) / expected - 1.0).abs() > 0.5, "control");
        assert_eq!(PassSettings { alpha: 1.0 }.shrinkage(1000), 1.0);
    }

    #[test]
    fn each_kind_of_radius_shrinks() {
        let first = EstimateSettings { radius: Some(2.0), max_radius: Some(4.0), ..EstimateSettings::default() };
        let passes = PassSettings::default();
        assert_eq!(passes.estimate(&first, 0), first);
        let tenth = passes.estimate(&first, 10);
        let area = passes.shrinkage(10);
        assert_eq!(tenth.neighbors, (100.0 * area).round() as u32);
        assert!((f64::from(tenth.radius.expect("one")).powi(2) / 4.0 - area).abs() < 1e-6);
        assert!((f64::from(tenth.max_radius.expect("one")).powi(2) / 16.0 - area).abs() < 1e-6);
        assert!((f64::from(tenth.gather_radius).powi(2) / 64.0 - area).abs() < 1e-6);
        assert!((f64::from(tenth.gather_reach).powi(2) - 0.0625 * area).abs() < 1e-6, "{}", tenth.gather_reach);
        assert_eq!(passes.bandwidth(&first, 10), f64::from(tenth.neighbors) / 100.0);
        assert_eq!(passes.bandwidth(&EstimateSettings { search: Search::Radius, ..first.clone() }, 10), area);
        assert_eq!(passes.estimate(&first, 1_000_000).neighbors, PassSettings::MIN_NEIGHBORS);
        let single = EstimateSettings { neighbors: 1, ..EstimateSettings::default() };
        assert_eq!(passes.estimate(&single, 1_000_000).neighbors, 1, "none are added");
    }

    #[test]
    fn ranges_out_of_reach_are_refused() {
        let check = |first, end, spp| {
            PassRange { first, end }
                .check(&Settings::default().with(|s| s.picture.spp = spp))
                .map_err(|e| e.to_string())
        };
        assert_eq!(check(3, 8, 4), Ok(()));
        let longest = |spp: u32| PassRange::longest(&Settings::default().with(|s| s.picture.spp = spp)).end;
        assert_eq!((longest(4), longest(2000)), (1_000_000, 536_870));
        assert_eq!(check(0, longest(2000), 2000), Ok(()));
        for (first, end, spp) in [(3, 3, 4), (4, 3, 4), (0, 0, 4), (0, 1_000_001, 4), (0, 1_000_000, 2000)] {
            let message = check(first, end, spp).expect_err("out of reach");
            assert!(message.starts_with(&format!("passes.range {first}..{end}: must ")), "{message}");
        }
    }
}
