//! Exact spheres of nodes, in world space and f64, before the scene's centre is subtracted.

use glam::{DMat4, DVec3};
use gltf::json;
use serde::Deserialize;
use serde_json::Value;

use super::fault::{Notes, Read, fault};
use super::nodes::PlacedNode;
use super::strict_json::typed;

/// Largest relative difference of a transform's axes that still counts as a uniform scale.
const UNIFORM: f64 = 1e-4;

/// A sphere in the world.
#[derive(Debug)]
pub(super) struct PlacedSphere {
    /// Index into the file's nodes.
    pub(super) node: usize,
    pub(super) center: DVec3,
    pub(super) radius: f64,
    /// Valid index into the file's materials; `None` for the default material.
    pub(super) material: Option<usize>,
}

#[derive(Deserialize)]
struct Shape {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    sphere: Ball,
}

#[derive(Deserialize)]
struct Ball {
    #[serde(default = "default_radius")]
    radius: f64,
}

impl Default for Ball {
    fn default() -> Self {
        Self { radius: default_radius() }
    }
}

/// Default radius of a sphere in the draft extension, metres.
fn default_radius() -> f64 {
    0.5
}

#[derive(Deserialize)]
struct Extras {
    material: Option<usize>,
}

/// Exact sphere of a node (draft extension KHR_implicit_shapes).
pub(super) fn read(root: &json::Root, placed: &PlacedNode, notes: &mut Notes) -> Read<Option<PlacedSphere>> {
    const NAME: &str = "KHR_implicit_shapes";
    let node = &root.nodes[placed.node];
    let Some(extension) = node.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME)) else {
        return Ok(None);
    };
    let at = format!("nodes[{}]", placed.node);
    let shapes = root.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME)?.get("shapes"));
    let shapes = shapes.and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let index = extension.get("shape").and_then(Value::as_u64).unwrap_or(u64::MAX);
    let Some(shape) = usize::try_from(index).ok().and_then(|index| shapes.get(index)) else {
        let shape = extension.get("shape").unwrap_or(&Value::Null);
        return fault(format!("{at}.extensions.{NAME}.shape"), format!("{shape} of {}", shapes.len()));
    };
    let place = format!("extensions.{NAME}.shapes[{index}]");
    let shape = typed::<Shape>(shape, &place)?;
    if shape.kind != "sphere" {
        notes.add(format!("implicit shapes of type {:?} are not drawn, only spheres", shape.kind));
        return Ok(None);
    }
    let scale = uniform_scale(placed.world);
    let Some(scale) = scale else {
        return fault(at, "scales its sphere differently along its axes, or not at all; spheres take a uniform scale");
    };
    let radius = scale * shape.sphere.radius;
    // The radius is rendered in f32, where it must be neither zero nor infinite.
    if !(radius as f32).is_normal() || radius < 0.0 {
        return fault(format!("{place}.sphere.radius"), format!("{} is not a positive number", shape.sphere.radius));
    }
    let material = match &node.extras {
        None => None,
        Some(extras) => {
            let extras: Option<Extras> = serde_json::from_str(extras.get()).ok();
            extras.and_then(|extras| extras.material)
        }
    };
    if let Some(material) = material.filter(|material| *material >= root.materials.len()) {
        return fault(format!("{at}.extras.material"), format!("{material} of {}", root.materials.len()));
    }
    Ok(Some(PlacedSphere { center: placed.world.w_axis.truncate(), radius, material, node: placed.node }))
}

/// Scale factor of a uniform transform, mirrored or not.
fn uniform_scale(world: DMat4) -> Option<f64> {
    let axes = [world.x_axis, world.y_axis, world.z_axis].map(|axis| axis.truncate());
    let [x, y, z] = axes;
    let scale = (x.length() * y.length() * z.length()).cbrt();
    let like = |length: f64| (length - scale).abs() <= UNIFORM * scale;
    let square = |a: DVec3, b: DVec3| a.dot(b).abs() <= UNIFORM * scale * scale;
    let uniform = axes.iter().all(|axis| like(axis.length())) && square(x, y) && square(y, z) && square(z, x);
    (scale > 0.0 && uniform).then_some(scale)
}
