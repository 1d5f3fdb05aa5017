//! Punctual lights. Area lights are geometry with an emissive [`Material`](super::Material); light
//! from all directions is an [`Environment`](super::Environment).

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::settings::LightUnit;

/// Luminous efficacy of green light, lm/W: divisor of photometric units.
pub const LUMENS_PER_WATT: f32 = 683.0;

/// Kind of a punctual light (KHR_lights_punctual).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightKind {
    /// Isotropic.
    Point,
    /// Full intensity within the inner cone, none outside the outer one; half angles in radians,
    /// 0 ≤ inner < outer ≤ π/2.
    Spot {
        /// Half angle of the inner cone, radians.
        inner: f32,
        /// Half angle of the outer cone, radians.
        outer: f32,
    },
    /// Parallel light from infinitely far away.
    Directional,
}

/// Punctual light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name in the file.
    pub name: String,
    /// Group that it is counted to in layers of lights, `extras.caustica.group` of the node or the
    /// light; `None`: one of its own, by its name.
    pub group: Option<String>,
    /// Kind of the light.
    pub kind: LightKind,
    /// Metres; unused by a directional light.
    pub position: Vec3,
    /// Unit vector along which it shines; unused by a point light.
    pub direction: Vec3,
    /// Point: radiant intensity, W/sr in each channel. Spot: the same, along its axis. Directional:
    /// irradiance of a surface that faces it, W/m². The candela or lux of the file are taken as
    /// these units.
    pub intensity: Vec3,
}

impl Light {
    /// Intensity, with the numbers of the file read in the given unit.
    #[must_use]
    pub fn intensity_in(&self, unit: LightUnit) -> Vec3 {
        match unit {
            LightUnit::Radiometric => self.intensity,
            LightUnit::Photometric => self.intensity / LUMENS_PER_WATT,
        }
    }

    /// Integral over the sphere of the relative intensity, sr; 0 for a directional light.
    #[must_use]
    pub fn solid_angle(&self) -> f32 {
        match self.kind {
            LightKind::Point => 4.0 * PI,
            LightKind::Spot { inner, outer } => spot_solid_angle(inner, outer),
            LightKind::Directional => 0.0,
        }
    }

    /// Power, W in each channel: intensity times solid angle. For a directional light, the power
    /// through a disc of radius `scene_radius`, metres.
    #[must_use]
    pub fn power(&self, scene_radius: f32) -> DVec3 {
        // Computes in f64: the product of the brightest lights overflows f32.
        let factor = match self.kind {
            LightKind::Point | LightKind::Spot { .. } => f64::from(self.solid_angle()),
            LightKind::Directional => std::f64::consts::PI * f64::from(scene_radius).powi(2),
        };
        factor * self.intensity.as_dvec3()
    }
}

/// 1 − cos outer and cos inner − cos outer of a spot's cones. Accurate for narrow cones, whose
/// cosines round to 1, and for cones that lie close to each other.
pub(crate) fn spot_heights(inner: f32, outer: f32) -> [f64; 2] {
    let (inner, outer) = (f64::from(inner), f64::from(outer));
    let between = |a: f64, b: f64| 2.0 * (0.5 * (b + a)).sin() * (0.5 * (b - a)).sin();
    [between(0.0, outer), between(inner, outer).max(0.0)]
}

/// Integral over the sphere of a spot's falloff, sr. The falloff is
/// `clamp((cos θ − cos outer) / (cos inner − cos outer), 0, 1)²`, its integral
/// 2π ((1 − cos inner) + (cos inner − cos outer)/3).
fn spot_solid_angle(inner: f32, outer: f32) -> f32 {
    let [height, width] = spot_heights(inner, outer);
    (std::f64::consts::TAU * (height - width + width / 3.0)) as f32
}
