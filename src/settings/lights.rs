//! Settings of the lights: the unit of the file's intensities, and the distribution of photons over
//! lights.

use serde::{Deserialize, Serialize};

use super::range::{Range, fail};
use crate::error::Result;

/// Distribution of photon paths over lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightSampling {
    /// In proportion to power: all photons start with similar flux.
    #[default]
    Power,
    /// In turn, whatever the power. All surfaces of one emissive material are one light.
    Uniform,
}

/// Unit in which the file's light intensities are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightUnit {
    /// Candela read as W/sr in each channel.
    #[default]
    Radiometric,
    /// Candela divided by 683 lm/W.
    Photometric,
}

/// Settings of the light table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LightSettings {
    /// Distribution of photon paths over lights.
    pub sampling: LightSampling,
    /// Names of lights, and the factor on the number of photons of each, in
    /// [`Self::PHOTON_WEIGHT`]. An emissive material or the environment counts as a light of its
    /// name.
    pub photon_weights: Vec<(String, f64)>,
    /// Unit in which the file's light intensities are read.
    pub unit: LightUnit,
}

impl LightSettings {
    /// Range of the factors in [`Self::photon_weights`].
    pub const PHOTON_WEIGHT: Range<f64> = Range::above(0.0, f64::MAX);

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        let range = Self::PHOTON_WEIGHT;
        if let Some((light, weight)) = self.photon_weights.iter().find(|(_, weight)| !range.contains(*weight)) {
            return fail("lights.photon_weights", format!("{light}={weight}"), &format!("the weight must be {range}"));
        }
        Ok(())
    }
}
