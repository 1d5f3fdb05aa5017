//! Cameras.

use glam::{Quat, Vec3};
use serde::Serialize;

use super::Bounds;

/// Projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Projection {
    /// Perspective projection; `yfov` is the full vertical field of view, radians, 0 < yfov < π.
    Perspective {
        /// Full vertical field of view, radians.
        yfov: f32,
    },
    /// Orthographic projection; `ymag` is half the height of the view, metres, > 0.
    Orthographic {
        /// Half the height of the view, metres.
        ymag: f32,
    },
}

impl Projection {
    /// Half the height of the view at a distance along the camera's axis, metres.
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
    /// Name in the file, or of the camera that frames the scene.
    pub name: String,
    /// Position, metres.
    pub position: Vec3,
    /// Unit vectors of the camera frame: right, up, and the viewing direction.
    pub right: Vec3,
    /// Upward unit vector.
    pub up: Vec3,
    /// Unit vector of the viewing direction.
    pub forward: Vec3,
    /// Projection.
    pub projection: Projection,
    /// Aspect ratio, width over height, if the file gives one.
    pub aspect: Option<f32>,
    /// Depth along the viewing direction at which the view begins, metres: nearer surfaces are not
    /// seen, but take part in the light. 0 for none of a perspective camera; that of an
    /// orthographic one may be below 0.
    pub near: f32,
    /// Depth at which the view ends, metres, > `near`; infinite for none.
    pub far: f32,
    /// Keeps the horizontal field of view of a square picture if the picture is higher than wide,
    /// so that nothing is cut off at the sides.
    pub keeps_width: bool,
}

/// Angles of [`Camera::framing`], degrees: azimuth from +Z towards +X, elevation above the horizon,
/// and vertical field of view.
const AZIMUTH: f32 = 30.0;
const ELEVATION: f32 = 22.0;
const ANGLE_OF_VIEW: f32 = 35.0;

/// Fraction of the picture that the bounding box may fill.
const FILL: f32 = 0.94;

impl Camera {
    /// Camera that sees all of `bounds` in a picture of any aspect ratio: from the front, which is
    /// +Z in glTF, slightly from the right and from above.
    #[must_use]
    pub fn framing(bounds: Bounds) -> Self {
        let is_empty = bounds.min.x > bounds.max.x;
        let (center, half) = if is_empty {
            (Vec3::ZERO, Vec3::ZERO)
        } else {
            (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min))
        };
        let half = if half == Vec3::ZERO { Vec3::ONE } else { half };
        let rotation = Quat::from_rotation_y(AZIMUTH.to_radians()) * Quat::from_rotation_x(-ELEVATION.to_radians());
        let [right, up, back] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| rotation * axis);
        let yfov = ANGLE_OF_VIEW.to_radians();
        let slope = FILL * (0.5 * yfov).tan();
        // Each corner of the box requires a distance at which it is in view.
        let distance = (0..8)
            .map(|i| half * Vec3::from_array([1, 2, 4].map(|bit| if i & bit == 0 { -1.0 } else { 1.0 })))
            .map(|corner| corner.dot(right).abs().max(corner.dot(up).abs()) / slope + corner.dot(back))
            .fold(0.0, f32::max);
        Self {
            name: "framing".to_owned(),
            position: center + back * distance,
            right,
            up,
            forward: -back,
            projection: Projection::Perspective { yfov },
            aspect: None,
            near: 0.0,
            far: f32::INFINITY,
            keeps_width: true,
        }
    }

    /// Half the height of the view at a distance along the axis, in a picture of `width` × `height`
    /// pixels, metres.
    #[must_use]
    pub fn half_height_at(&self, depth: f32, (width, height): (u32, u32)) -> f32 {
        let stretch = if self.keeps_width { (height as f32 / width as f32).max(1.0) } else { 1.0 };
        stretch * self.projection.half_height_at(depth)
    }
}
