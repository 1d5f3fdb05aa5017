//! Cameras of nodes, in world space and f64, before the scene's centre is subtracted.

use std::f32::consts::PI;

use glam::{DMat4, DVec3, Vec3};
use gltf::json;
use json::camera::Type;
use json::validation::Checked;

use super::fault::{Read, fault};
use super::nodes::PlacedNode;
use crate::scene::{Camera, Projection};

/// Camera of a node, with its index in the file and its world position.
pub(super) fn read(root: &json::Root, placed: &PlacedNode) -> Read<Option<(usize, DVec3, Camera)>> {
    let node = &root.nodes[placed.node];
    let Some(index) = node.camera.map(|camera| camera.value()) else { return Ok(None) };
    let camera = &root.cameras[index];
    let own_name = camera.name.clone().unwrap_or_else(|| format!("camera {index}"));
    let name = node.name.clone().filter(|name| !name.is_empty()).unwrap_or(own_name);
    let (projection, aspect) = projection(camera, &format!("cameras[{index}]"))?;
    let Some([right, up, forward]) = axes(placed.world) else {
        return fault(format!("nodes[{}]", placed.node), "its transform leaves its camera no direction");
    };
    let camera = Camera { name, position: Vec3::ZERO, right, up, forward, projection, aspect, keeps_width: false };
    Ok(Some((index, placed.world.w_axis.truncate(), camera)))
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
            let (xmag, ymag) = (orthographic.xmag, orthographic.ymag);
            for (key, mag) in [("xmag", xmag), ("ymag", ymag)] {
                if !positive(mag) {
                    return fault(format!("{place}.orthographic.{key}"), format!("{mag} is not a positive number"));
                }
            }
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
