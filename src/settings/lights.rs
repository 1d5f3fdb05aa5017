//! Settings of the lights: how the file's are read, and how photons are dealt to them.

use serde::{Deserialize, Serialize};

use super::{Range, fail};
use crate::error::Result;

/// How photon paths are dealt to lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightSampling {
    /// In proportion to power: all photons start with like flux.
    #[default]
    Power,
    /// In turn, whatever the power. What shines by one material is one light.
    Uniform,
}

/// How the file's light intensities are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightUnit {
    /// Candela read as W/sr in each channel.
    #[default]
    Radiometric,
    /// Candela divided by 683 lm/W.
    Photometric,
}

/// What the light table is made by.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LightSettings {
    /// How photon paths are dealt to lights.
    pub sampling: LightSampling,
    /// Names of lights, and the factor on the photons of each, in [`Self::PHOTON_WEIGHT`]. An
    /// emissive material or the environment is a light of its name.
    pub photon_weights: Vec<(String, f64)>,
    /// How light intensities of the file are read.
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
