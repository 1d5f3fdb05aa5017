//! Cameras of nodes, in world space and f64, before the scene's centre is subtracted.

use std::{collections::HashSet, f32::consts::PI};

use glam::{DMat4, DVec3, Vec3};
use gltf::json;
use json::camera::Type;
use json::validation::Checked;

use super::fault::{Notes, Read, fault};
use super::nodes::PlacedNode;
use crate::scene::{Bounds, Camera, Projection};

/// Camera of a node, with its index in the file and its world position.
pub(super) fn read(root: &json::Root, placed: &PlacedNode, notes: &mut Notes) -> Read<Option<(usize, DVec3, Camera)>> {
    let node = &root.nodes[placed.node];
    let Some(index) = node.camera.map(|camera| camera.value()) else { return Ok(None) };
    let camera = &root.cameras[index];
    let own_name = camera.name.clone().unwrap_or_else(|| format!("camera {index}"));
    let name = node.name.clone().filter(|name| !name.is_empty()).unwrap_or(own_name);
    let (projection, aspect) = projection(camera, &format!("cameras[{index}]"))?;
    let Some([right, up, forward]) = axes(placed.world) else {
        return fault(format!("nodes[{}]", placed.node), "its transform leaves its camera no direction");
    };
    let [near, far] = clipping(camera, &name, notes);
    let [mirrored_x, mirrored_y] = mirrored(camera, &name, notes);
    let camera = Camera {
        right: if mirrored_x { -right } else { right },
        up: if mirrored_y { -up } else { up },
        name,
        position: Vec3::ZERO,
        forward,
        projection,
        aspect,
        keeps_width: false,
        near,
        far,
    };
    Ok(Some((index, placed.world.w_axis.truncate(), camera)))
}

/// Depths at which the view of a camera begins and ends, metres. Planes between which nothing lies
/// are left out.
fn clipping(camera: &json::Camera, name: &str, notes: &mut Notes) -> [f32; 2] {
    let (near, far) = match (&camera.type_, &camera.perspective, &camera.orthographic) {
        (Checked::Valid(Type::Perspective), Some(perspective), _) => {
            (perspective.znear.max(0.0), perspective.zfar.unwrap_or(f32::INFINITY))
        }
        (Checked::Valid(Type::Orthographic), _, Some(orthographic)) => (orthographic.znear, orthographic.zfar),
        _ => (0.0, f32::INFINITY),
    };
    if near < far {
        return [near, far];
    }
    notes.add(format!("camera {name:?}: zfar {far} is not beyond znear {near}: nothing is clipped"));
    [0.0, f32::INFINITY]
}

/// Whether a camera mirrors the picture left to right, and upside down, by a negative
/// magnification.
fn mirrored(camera: &json::Camera, name: &str, notes: &mut Notes) -> [bool; 2] {
    let orthographic = camera.orthographic.as_ref().filter(|_| camera.type_ == Checked::Valid(Type::Orthographic));
    let mirrored = orthographic.map_or([false; 2], |view| [view.xmag < 0.0, view.ymag < 0.0]);
    let ways = match mirrored {
        [false, false] => return mirrored,
        [true, false] => "left to right",
        [false, true] => "upside down",
        [true, true] => "left to right and upside down",
    };
    notes.add(format!("camera {name:?}: a negative magnification mirrors the picture, {ways}"));
    mirrored
}

/// Notes names that several cameras have. [`crate::scene::Scene::camera`] finds the first.
pub(super) fn note_equal_names(cameras: &[Camera], notes: &mut Notes) {
    let mut known = HashSet::new();
    let repeated = cameras.iter().filter(|camera| !known.insert(&camera.name));
    repeated.for_each(|camera| {
        notes.add(format!("camera {:?}: others have this name too; it chooses the first, an index any", camera.name));
    });
}

/// Notes where the view of a camera ends before the scene does.
pub(super) fn note_end(camera: &Camera, bounds: Bounds, notes: &mut Notes) {
    let depth = |i: usize| {
        let corner = Vec3::from_array([0, 1, 2].map(|k| if i >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] }));
        (corner - camera.position).dot(camera.forward)
    };
    let end = (0..8).map(depth).fold(f32::NEG_INFINITY, f32::max);
    if end > 1.001 * camera.far {
        notes.add(format!("camera {:?}: sees to zfar, {} m; the scene reaches to {end} m", camera.name, camera.far));
    }
}

/// Projection of the camera at JSON path `place`, and the aspect ratio (width over height) if the
/// file gives one.
fn projection(camera: &json::Camera, place: &str) -> Read<(Projection, Option<f32>)> {
    let positive = |x: f32| x.is_normal() && x > 0.0;
    let view = match (&camera.type_, &camera.perspective, &camera.orthographic) {
        (Checked::Valid(Type::Perspective), Some(perspective), _) => {
            let yfov = perspective.yfov;
            if !(yfov > 0.0 && yfov < PI) {
                return fault(format!("{place}.perspective.yfov"), format!("{yfov} is not between 0 and pi"));
            }
            if perspective.aspect_ratio.is_some_and(|aspect| !positive(aspect)) {
                return fault(format!("{place}.perspective.aspectRatio"), "is not a positive number");
            }
            (Projection::Perspective { yfov }, perspective.aspect_ratio)
        }
        (Checked::Valid(Type::Orthographic), _, Some(orthographic)) => {
            for (key, mag) in [("xmag", orthographic.xmag), ("ymag", orthographic.ymag)] {
                if !mag.is_normal() {
                    return fault(format!("{place}.orthographic.{key}"), format!("{mag} is not a positive number"));
                }
            }
            let (xmag, ymag) = (orthographic.xmag.abs(), orthographic.ymag.abs());
            if !positive(xmag / ymag) {
                return fault(format!("{place}.orthographic"), "xmag / ymag is not a positive number");
            }
            (Projection::Orthographic { ymag }, Some(xmag / ymag))
        }
        (Checked::Valid(Type::Perspective), None, _) => return fault(place, "perspective is missing"),
        (Checked::Valid(Type::Orthographic), _, None) => return fault(place, "orthographic is missing"),
        (Checked::Invalid, ..) => return fault(place, "type is not perspective or orthographic"),
    };
    Ok(view)
}

/// Unit axes of a camera: right, up and the view direction. `None` if the transform is degenerate.
fn axes(world: DMat4) -> Option<[Vec3; 3]> {
    let (forward, up) = (-world.z_axis.truncate().normalize_or_zero(), world.y_axis.truncate());
    let right = forward.cross(up.normalize_or_zero()).normalize_or_zero();
    (right != DVec3::ZERO).then(|| [right, right.cross(forward), forward].map(|axis| axis.as_vec3()))
}
