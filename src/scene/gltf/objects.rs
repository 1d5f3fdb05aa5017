//! What nodes carry besides meshes and cameras: lights, spheres. Positions are still the world's, in f64.

use glam::{DMat4, DVec3, Vec3};
use gltf::json;
use json::extensions::scene::khr_lights_punctual::Type as LightType;
use json::validation::Checked;
use serde::Deserialize;
use serde_json::Value;

use super::fault::{Notes, Read, fault};
use super::nodes::{self, Placed};
use crate::scene::{Light, LightKind};

/// Largest relative difference of a transform's axes that still counts as a uniform scale.
const UNIFORM: f64 = 1e-4;

/// A sphere in the world.
#[derive(Debug)]
pub(super) struct PlacedSphere {
    pub(super) center: DVec3,
    pub(super) radius: f64,
    /// Index into the file's materials, valid; `None` for the default one.
    pub(super) material: Option<usize>,
}

/// Light of a node: a point light in the world, or the kind that is not read.
pub(super) enum PlacedLight {
    Point(DVec3, Light),
    Unread(&'static str),
    Dark,
}

/// The light that a node carries.
pub(super) fn light(root: &json::Root, placed: &Placed, notes: &mut Notes) -> Read<Option<PlacedLight>> {
    let node = &root.nodes[placed.node];
    let Some(reference) = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref())
    else {
        return Ok(None);
    };
    let index = reference.light.value();
    let lights = root.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    let lights = lights.map_or(&[][..], |extension| &extension.lights);
    let Some(light) = lights.get(index) else {
        let at = format!("nodes[{}].extensions.KHR_lights_punctual.light", placed.node);
        return fault(at, format!("{index} of {}", lights.len()));
    };
    let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
    match light.type_ {
        Checked::Valid(LightType::Point) => {}
        Checked::Valid(LightType::Spot) => return Ok(Some(PlacedLight::Unread("spot light"))),
        Checked::Valid(LightType::Directional) => return Ok(Some(PlacedLight::Unread("directional light"))),
        Checked::Invalid => return fault(format!("{place}.type"), "is not point, spot or directional"),
    }
    let intensity = Vec3::from_array(light.color) * light.intensity;
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return fault(
            place,
            format!("intensity {} times color {:?} is not a positive number", light.intensity, light.color),
        );
    }
    let name = nodes::name(node, "light", index);
    if intensity == Vec3::ZERO {
        notes.add(format!("light {name:?} has no intensity"));
        return Ok(Some(PlacedLight::Dark));
    }
    if light.range.is_some() {
        notes.add("the range of lights is not read: they reach everywhere");
    }
    Ok(Some(PlacedLight::Point(
        placed.world.w_axis.truncate(),
        Light { name, kind: LightKind::Point, position: Vec3::ZERO, direction: Vec3::NEG_Z, intensity },
    )))
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

/// Radius of a sphere where the draft's file says none, metres.
fn default_radius() -> f64 {
    0.5
}

#[derive(Deserialize)]
struct Extras {
    material: Option<usize>,
}

/// The exact sphere that a node carries (draft extension KHR_implicit_shapes).
pub(super) fn sphere(root: &json::Root, placed: &Placed, notes: &mut Notes) -> Read<Option<PlacedSphere>> {
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
    let shape = Shape::deserialize(shape).or_else(|error| fault(&place, error.to_string()))?;
    if shape.kind != "sphere" {
        notes.add(format!("implicit shapes of type {:?} are not drawn, only spheres", shape.kind));
        return Ok(None);
    }
    let scale = uniform_scale(placed.world);
    let Some(scale) = scale else {
        return fault(at, "scales its sphere differently along its axes, or not at all; spheres take a uniform scale");
    };
    let radius = scale * shape.sphere.radius;
    // In f32, as it is rendered: neither zero nor infinite.
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
    Ok(Some(PlacedSphere { center: placed.world.w_axis.truncate(), radius, material }))
}

/// Factor of a transform that scales alike in all directions, mirrored or not.
fn uniform_scale(world: DMat4) -> Option<f64> {
    let axes = [world.x_axis, world.y_axis, world.z_axis].map(|axis| axis.truncate());
    let [x, y, z] = axes;
    let scale = (x.length() * y.length() * z.length()).cbrt();
    let like = |length: f64| (length - scale).abs() <= UNIFORM * scale;
    let square = |a: DVec3, b: DVec3| a.dot(b).abs() <= UNIFORM * scale * scale;
    let uniform = axes.iter().all(|axis| like(axis.length())) && square(x, y) && square(y, z) && square(z, x);
    (scale > 0.0 && uniform).then_some(scale)
}
