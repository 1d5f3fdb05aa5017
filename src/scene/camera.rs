//! Cameras.

use glam::Vec3;
use serde::Serialize;

use super::Bounds;

/// How a camera maps what it sees to a picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Projection {
    /// From one point; `yfov` is the full vertical angle of view, radians, 0 < yfov < π.
    Perspective { yfov: f32 },
    /// Along parallel rays; `ymag` is half the height of what is seen, metres, > 0.
    Orthographic { ymag: f32 },
}

impl Projection {
    /// Half the height of what is seen at a distance along the camera's axis, metres.
    #[must_use]
    pub fn half_height_at(&self, depth: f32) -> f32 {
        match *self {
            Projection::Perspective { yfov } => depth * (0.5 * yfov).tan(),
            Projection::Orthographic { ymag } => ymag,
        }
    }
}

/// A camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    pub name: String,
    pub position: Vec3,
    /// Unit axes: right, up, and the direction of view.
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
    pub projection: Projection,
    /// Width over height, where the file says.
    pub aspect: Option<f32>,
}

/// Angles of [`Camera::framing`], degrees: above the horizon, and of view.
const ELEVATION: f32 = 15.0;
const ANGLE_OF_VIEW: f32 = 40.0;

impl Camera {
    /// A camera that sees all of `bounds` in a square picture, along -Z and slightly from above.
    #[must_use]
    pub fn framing(bounds: Bounds) -> Self {
        let (radius, yfov) = (0.5 * bounds.diagonal(), ANGLE_OF_VIEW.to_radians());
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let center = if bounds.min.x <= bounds.max.x { 0.5 * (bounds.min + bounds.max) } else { Vec3::ZERO };
        let (sin, cos) = ELEVATION.to_radians().sin_cos();
        let back = Vec3::new(0.0, sin, cos);
        Self {
            name: "framing".to_owned(),
            position: center + back * (radius / (0.5 * yfov).sin()),
            right: Vec3::X,
            up: Vec3::new(0.0, cos, -sin),
            forward: -back,
            projection: Projection::Perspective { yfov },
            aspect: None,
        }
    }
}
