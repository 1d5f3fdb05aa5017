//! Settings of the radiance estimate.

use serde::{Deserialize, Serialize};

use super::fail;
use crate::{
    density::{Density, DensityKernel},
    error::Result,
};

/// Largest radius of an estimate, metres: its square is far from the largest float.
const MAX_RADIUS: f32 = 1e18;

/// Which photons an estimate sums, and how they are found. Grid and kd-tree give the same picture but for rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Search {
    /// The nearest, by the grid on the device.
    #[default]
    Grid,
    /// The nearest, by the kd-tree of [`crate::reference`] on the CPU; makes the raw estimate always.
    KdTree,
    /// All within [`EstimateSettings::radius`], by the grid.
    Radius,
}

/// What light is estimated by at a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EstimateSettings {
    /// Neighbours in the radiance estimate, 1 to 1000.
    pub neighbors: u32,
    /// Shape of the kernel that weighs the photons.
    pub kernel: DensityKernel,
    /// Constant C of the cone filter, ≥ 1.
    pub cone_constant: f32,
    /// Bound of the search radius, metres.
    pub max_radius: Option<f32>,
    pub search: Search,
    /// Radius of the estimate with [`Search::Radius`], metres; `None` with the others.
    pub radius: Option<f32>,
    /// Photons of neighbouring surfaces count, and the disc is taken to be there as a whole: the estimate of the report.
    pub raw: bool,
    /// Distance within which visible points on one surface share an estimate, as a fraction of its radius, 0 to 2;
    /// 0: every camera sample has its own.
    pub share_reach: f32,
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
        }
    }
}

impl EstimateSettings {
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
        if !(1..=1000).contains(&self.neighbors) {
            return fail("neighbors", self.neighbors.to_string(), "must be from 1 to 1000");
        }
        if !(self.cone_constant >= 1.0 && self.cone_constant.is_finite()) {
            return fail("cone-constant", self.cone_constant.to_string(), "must be at least 1");
        }
        if let Some(r) = self.max_radius.filter(|r| !(*r > 0.0 && *r <= MAX_RADIUS)) {
            return fail("max-radius", r.to_string(), "must be above 0, at most 1e18");
        }
        if !(0.0..=2.0).contains(&self.share_reach) {
            return fail("share", self.share_reach.to_string(), "must be from 0 to 2");
        }
        match (self.search, self.radius) {
            (Search::Radius, None) => fail("search", "radius".to_string(), "needs a radius"),
            (Search::Radius, Some(r)) if !(r > 0.0 && r <= MAX_RADIUS) => {
                fail("radius", r.to_string(), "must be above 0, at most 1e18")
            }
            (Search::Radius, Some(_)) | (_, None) => Ok(()),
            (_, Some(r)) => fail("radius", r.to_string(), "goes with the search by radius only"),
        }
    }
}
