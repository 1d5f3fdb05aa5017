//! Settings of the lights: how the file's are read, and how photons are dealt to them.

use serde::{Deserialize, Serialize};

use super::fail;
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
    pub sampling: LightSampling,
    /// Lights by name, and the factor on their share of the photons, each > 0.
    pub photon_weights: Vec<(String, f64)>,
    pub unit: LightUnit,
}

impl LightSettings {
    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        if let Some((light, weight)) = self.photon_weights.iter().find(|(_, w)| !(*w > 0.0 && w.is_finite())) {
            return fail("light-photons", format!("{light}={weight}"), "the weight must be above 0");
        }
        Ok(())
    }
}
