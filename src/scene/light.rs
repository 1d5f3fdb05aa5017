//! Lights without extent. Those with one are geometry: a [`Material`](super::Material) with emission; or all around:
//! [`Environment`](super::Environment).

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::settings::LightUnit;

/// Lumens in a watt of green light: what a photometric unit is divided by.
pub const LUMENS_PER_WATT: f32 = 683.0;

/// How a light without extent shines (KHR_lights_punctual).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightKind {
    /// Alike in all directions.
    Point,
    /// Full within the inner cone, nothing outside the outer one; half angles in radians, 0 ≤ inner < outer ≤ π/2.
    Spot { inner: f32, outer: f32 },
    /// From infinitely far away.
    Directional,
}

/// A light without extent.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    pub name: String,
    pub kind: LightKind,
    /// Metres; of no meaning for a directional light.
    pub position: Vec3,
    /// Unit vector along which it shines; of no meaning for a point light.
    pub direction: Vec3,
    /// Point: radiant intensity, W/sr in each channel. Spot: the same along its axis. Directional: irradiance of a
    /// surface that faces it, W/m². As the file's candela or lux are read.
    pub intensity: Vec3,
}

impl Light {
    /// `intensity` in the unit that the file's numbers are taken for.
    #[must_use]
    pub fn intensity_in(&self, unit: LightUnit) -> Vec3 {
        match unit {
            LightUnit::Radiometric => self.intensity,
            LightUnit::Photometric => self.intensity / LUMENS_PER_WATT,
        }
    }

    /// Integral over all directions of the share of `intensity` that goes there, sr; 0 for a directional light.
    #[must_use]
    pub fn solid_angle(&self) -> f32 {
        match self.kind {
            LightKind::Point => 4.0 * PI,
            LightKind::Spot { inner, outer } => spot_solid_angle(inner, outer),
            LightKind::Directional => 0.0,
        }
    }

    /// Power, W in each channel: intensity times solid angle. A directional light sends as much as a disc of
    /// `scene_radius`, metres, catches.
    #[must_use]
    pub fn power(&self, scene_radius: f32) -> DVec3 {
        // In f64: of the brightest lights of f32 the product leaves its range.
        let factor = match self.kind {
            LightKind::Point | LightKind::Spot { .. } => f64::from(self.solid_angle()),
            LightKind::Directional => std::f64::consts::PI * f64::from(scene_radius).powi(2),
        };
        factor * self.intensity.as_dvec3()
    }
}

/// Least width, in cosines, of the falloff between a spot's cones (KHR_lights_punctual, "Inner and Outer Cone Angles").
pub const LEAST_FALLOFF: f32 = 0.001;

/// Integral over the sphere of a spot's falloff `clamp((cos θ − cos outer) / (cos inner − cos outer), 0, 1)²`,
/// steradians: 2π ((1 − cos inner) + (cos inner − cos outer)/3).
fn spot_solid_angle(inner: f32, outer: f32) -> f32 {
    let (inner, outer) = (f64::from(inner).cos(), f64::from(outer).cos());
    let width = (inner - outer).max(f64::from(LEAST_FALLOFF));
    // A cone so narrow that the falloff reaches past its axis never gets to full intensity.
    let reached = ((1.0 - outer) / width).min(1.0);
    let full = (1.0 - outer - width).max(0.0);
    (std::f64::consts::TAU * (full + width * reached.powi(3) / 3.0)) as f32
}
