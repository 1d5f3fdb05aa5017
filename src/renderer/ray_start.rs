//! Start of a camera's rays, and the media there.
//!
//! Rays of a perspective camera start at its lens, in the media around the middle of it. Rays of an
//! orthographic camera start all over its plane. If a solid with a medium cuts the plane, or if the
//! camera sees what lies behind the plane, they start behind the whole scene instead, outside of
//! all solids, and pass what comes before the near plane unseen, into and out of media.

use glam::Vec3;

use crate::{
    bvh::Media,
    scene::{Camera, NO_SLOT, Projection, Scene, Solids},
};

/// Pixels by which rays reach beyond the picture at most: those of pixel filters, and of the
/// margins of tiles.
const BEYOND_PICTURE: f32 = 16.0;

/// Start of a camera's rays.
pub(super) struct RayStart {
    pub media: Media,
    /// Depth along the axis, metres, at most 0.
    pub depth: f32,
}

/// Start of the rays of a camera in a picture of that size. `media` are those around the middle of
/// the camera.
pub(super) fn ray_start(
    (scene, solids): (&Scene, &Solids),
    (camera, media): (&Camera, Media),
    size: (u32, u32),
) -> RayStart {
    let at_camera = RayStart { media, depth: 0.0 };
    if !matches!(camera.projection, Projection::Orthographic { .. }) {
        return at_camera;
    }
    let (center, radius) = scene.bounding_sphere();
    let behind_all = (center - camera.position).dot(camera.forward) - 1.01 * radius;
    if behind_all < 0.0 && (camera.near < 0.0 || cuts_solid(scene, solids, camera, size)) {
        return RayStart { media: Media::default(), depth: behind_all };
    }
    at_camera
}

/// Whether a surface that bounds a medium cuts the part of the camera's plane that is in view, by
/// its bounding box in the frame of the camera.
fn cuts_solid(scene: &Scene, solids: &Solids, camera: &Camera, (width, height): (u32, u32)) -> bool {
    let pixel = 2.0 * camera.half_height_at(0.0, (width, height)) / height as f32;
    let half_side = |pixels: u32| pixel * (0.5 * pixels as f32 + BEYOND_PICTURE);
    let half = Vec3::new(half_side(width), half_side(height), 0.0);
    let in_frame = |point: Vec3| {
        let from = point - camera.position;
        Vec3::new(from.dot(camera.right), from.dot(camera.up), from.dot(camera.forward))
    };
    let overlaps = |min: Vec3, max: Vec3| min.cmple(half).all() && max.cmpge(-half).all();
    let is_of_solid = |i: u32| solids.slot(i) != NO_SLOT;
    let triangles = scene.triangles.iter().zip(0..).filter(|(_, i)| is_of_solid(*i));
    let cuts_triangle = triangles.map(|(triangle, _)| triangle).any(|triangle| {
        let [a, b, c] = triangle.positions.map(in_frame);
        overlaps(a.min(b).min(c), a.max(b).max(c))
    });
    let mut spheres = scene.spheres.iter().zip(scene.triangles.len() as u32..).filter(|(_, i)| is_of_solid(*i));
    cuts_triangle
        || spheres.any(|(sphere, _)| {
            let center = in_frame(sphere.center);
            overlaps(center - sphere.radius, center + sphere.radius)
        })
}
