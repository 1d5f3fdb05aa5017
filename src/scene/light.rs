//! Lights.

use std::f32::consts::PI;

use glam::Vec3;

use crate::settings::LightUnit;

/// Lumens in a watt of green light: what a photometric unit is divided by.
pub const LUMENS_PER_WATT: f32 = 683.0;

/// A point light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    pub name: String,
    pub position: Vec3,
    /// Radiant intensity, W/sr in each channel, as the file's candela are read.
    pub intensity: Vec3,
}

impl Light {
    /// Radiant intensity, W/sr, in the unit that the file's numbers are taken for.
    #[must_use]
    pub fn intensity_in(&self, unit: LightUnit) -> Vec3 {
        match unit {
            LightUnit::Radiometric => self.intensity,
            LightUnit::Photometric => self.intensity / LUMENS_PER_WATT,
        }
    }

    /// Power, W in each channel: 4π I.
    #[must_use]
    pub fn power(&self) -> Vec3 {
        4.0 * PI * self.intensity
    }
}
