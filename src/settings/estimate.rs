//! Settings of the radiance estimate.

use serde::{Deserialize, Serialize};

use super::range::{Range, fail};
use crate::{
    density::{Density, DensityKernel},
    error::Result,
};

/// Photons that an estimate sums, and the search that finds them. The pictures of grid and kd-tree
/// differ only by rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Search {
    /// The nearest photons, by the grid on the device.
    #[default]
    Grid,
    /// The nearest photons, by the kd-tree of [`crate::reference`] on the CPU. Always makes the raw
    /// estimate.
    KdTree,
    /// All photons within [`EstimateSettings::radius`], by the grid.
    Radius,
}

/// Settings of the radiance estimate at a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EstimateSettings {
    /// Number of photons in the estimate, in [`Self::NEIGHBORS`].
    pub neighbors: u32,
    /// Shape of the kernel that weighs the photons.
    pub kernel: DensityKernel,
    /// Constant C of the cone filter, in [`Self::CONE_CONSTANT`].
    pub cone_constant: f32,
    /// Maximum radius of the search, metres, in [`Self::RADIUS`]; `None`: no limit.
    pub max_radius: Option<f32>,
    /// Search that finds the photons.
    pub search: Search,
    /// Radius of the estimate with [`Search::Radius`], metres, in [`Self::RADIUS`]; `None` with the
    /// other searches.
    pub radius: Option<f32>,
    /// Makes the raw estimate, that of the report: photons of neighbouring surfaces count, and the
    /// disc is taken as whole.
    pub raw: bool,
    /// Distance within which visible points on one surface share an estimate, as a fraction of the
    /// estimate's radius, in [`Self::SHARE_REACH`]; 0: every camera sample has an estimate of its
    /// own.
    pub share_reach: f32,
    /// Width of the cells whose points share the irradiance at the ends of final-gather rays, as a
    /// fraction of the estimate's radius, in [`Self::IRRADIANCE_CELLS`]; 0: every end has an
    /// estimate of its own.
    pub irradiance_cells: f32,
    /// Pixels between the visible points at which final gathering is done, in
    /// [`Self::GATHER_SPACING`]; others take the irradiance of those around them. 0: at every
    /// camera sample.
    pub gather_spacing: u32,
    /// Radius around a visible point from which it takes irradiance then, pixels, in
    /// [`Self::GATHER_RADIUS`].
    pub gather_radius: f32,
    /// Distance from a visible point within which others take its irradiance, as a fraction of the
    /// harmonic mean distance to what its rays meet, in [`Self::GATHER_REACH`].
    pub gather_reach: f32,
}

impl Default for EstimateSettings {
    fn default() -> Self {
        Self {
            neighbors: 100,
            kernel: DensityKernel::Cone,
            cone_constant: 2.0,
            max_radius: None,
            search: Search::Grid,
            radius: None,
            raw: false,
            share_reach: 2.0,
            irradiance_cells: 1.0,
            gather_spacing: 0,
            gather_radius: 8.0,
            gather_reach: 1.5,
        }
    }
}

impl EstimateSettings {
    /// Range of [`Self::neighbors`].
    pub const NEIGHBORS: Range<u32> = Range::closed(1, 1000);
    /// Range of [`Self::cone_constant`].
    pub const CONE_CONSTANT: Range<f32> = Range::at_least(1.0);
    /// Range of [`Self::radius`] and [`Self::max_radius`], metres. The square of the maximum, 1e36,
    /// is well below the largest f32.
    pub const RADIUS: Range<f32> = Range::above(0.0, 1e18);
    /// Range of [`Self::share_reach`].
    pub const SHARE_REACH: Range<f32> = Range::closed(0.0, 2.0);

    /// Range of [`Self::irradiance_cells`].
    pub const IRRADIANCE_CELLS: Range<f32> = Range::closed(0.0, 2.0);

    /// Range of [`Self::gather_spacing`], pixels.
    pub const GATHER_SPACING: Range<u32> = Range::closed(0, 16);
    /// Range of [`Self::gather_radius`], pixels.
    pub const GATHER_RADIUS: Range<f32> = Range::closed(0.5, 64.0);
    /// Range of [`Self::gather_reach`].
    pub const GATHER_REACH: Range<f32> = Range::above(0.0, 16.0);

    /// Whether irradiance is kept in cells. Estimates to compare with are made at each point.
    pub(crate) fn keeps_irradiance(&self) -> bool {
        self.irradiance_cells > 0.0 && self.search != Search::KdTree && !self.raw
    }

    /// The kernel with its constant.
    #[must_use]
    pub fn density(&self) -> Density {
        Density { kernel: self.kernel, cone_constant: self.cone_constant }
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        Self::NEIGHBORS.check("estimate.neighbors", self.neighbors)?;
        Self::CONE_CONSTANT.check("estimate.cone_constant", self.cone_constant)?;
        self.max_radius.map_or(Ok(()), |radius| Self::RADIUS.check("estimate.max_radius", radius))?;
        Self::SHARE_REACH.check("estimate.share_reach", self.share_reach)?;
        Self::IRRADIANCE_CELLS.check("estimate.irradiance_cells", self.irradiance_cells)?;
        Self::GATHER_SPACING.check("estimate.gather_spacing", self.gather_spacing)?;
        Self::GATHER_RADIUS.check("estimate.gather_radius", self.gather_radius)?;
        Self::GATHER_REACH.check("estimate.gather_reach", self.gather_reach)?;
        match (self.search, self.radius) {
            (Search::Radius, None) => fail("estimate.search", "radius".to_string(), "needs a radius"),
            (Search::Radius, Some(radius)) => Self::RADIUS.check("estimate.radius", radius),
            (_, None) => Ok(()),
            (_, Some(radius)) => fail("estimate.radius", radius.to_string(), "goes with the search by radius only"),
        }
    }
}
