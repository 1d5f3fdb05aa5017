//! Lights of nodes (KHR_lights_punctual), in world space and f64, before the scene's centre is
//! subtracted.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DVec3, Vec3};
use gltf::json;
use json::extensions::scene::khr_lights_punctual as punctual;
use json::validation::Checked;
use punctual::{Spot, Type};

use super::extras;
use super::fault::{Notes, Read, fault};
use super::nodes::PlacedNode;
use crate::scene::{Light, LightKind};

/// Largest outer angle that is taken for a right angle that was rounded up, radians.
const ROUNDED_RIGHT_ANGLE: f32 = 1.01 * FRAC_PI_2;

/// A light and its world position; a directional light has none.
pub(super) type PlacedLight = (Option<DVec3>, Light);

/// Light of a node, which may have no intensity.
pub(super) fn read(root: &json::Root, placed: &PlacedNode, notes: &mut Notes) -> Read<Option<PlacedLight>> {
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
    let name = [&node.name, &light.name].into_iter().flatten().find(|name| !name.is_empty());
    let name = name.cloned().unwrap_or_else(|| format!("light {index}"));
    let kind = match light.type_ {
        Checked::Valid(Type::Point) => LightKind::Point,
        Checked::Valid(Type::Spot) => spot(light.spot.as_ref(), &name, &place, notes)?,
        Checked::Valid(Type::Directional) => LightKind::Directional,
        Checked::Invalid => return fault(format!("{place}.type"), "is not point, spot or directional"),
    };
    let intensity = Vec3::from_array(light.color) * light.intensity;
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return fault(
            place,
            format!("intensity {} times color {:?} is not a positive number", light.intensity, light.color),
        );
    }
    if intensity == Vec3::ZERO {
        notes.about("light", &name, " has no intensity: it gives no light");
        let dark = Light {
            name,
            group: None,
            kind: LightKind::Point,
            position: Vec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity,
        };
        return Ok(Some((None, dark)));
    }
    if light.range.is_some() {
        notes.add("the range of lights is not read: they reach everywhere");
    }
    let group = match extras::group(&node.extras, &format!("nodes[{}]", placed.node))? {
        None => extras::group(&light.extras, &place)?,
        own => own,
    };
    let direction = match kind {
        LightKind::Point => Vec3::NEG_Z,
        LightKind::Spot { .. } | LightKind::Directional => {
            let direction = -placed.world.z_axis.truncate().normalize_or_zero();
            if direction == DVec3::ZERO {
                return fault(format!("nodes[{}]", placed.node), "its transform leaves its light no direction");
            }
            direction.as_vec3()
        }
    };
    let position = (kind != LightKind::Directional).then(|| placed.world.w_axis.truncate());
    Ok(Some((position, Light { name, group, kind, position: Vec3::ZERO, direction, intensity })))
}

/// Cones of the spot light at JSON path `place`.
fn spot(spot: Option<&Spot>, name: &str, place: &str, notes: &mut Notes) -> Read<LightKind> {
    let (inner, given) = spot.map_or((0.0, FRAC_PI_4), |spot| (spot.inner_cone_angle, spot.outer_cone_angle));
    if !(given > 0.0 && given <= ROUNDED_RIGHT_ANGLE) {
        return fault(format!("{place}.spot.outerConeAngle"), format!("{given} is not above 0 and at most pi/2"));
    }
    let outer = given.min(FRAC_PI_2);
    if outer != given {
        notes.about("light", name, &format!(": outer cone angle {given} is read as pi/2"));
    }
    if !(inner >= 0.0 && inner.is_finite()) {
        let problem = format!("{inner} is not between 0 and the outer angle, {outer}");
        return fault(format!("{place}.spot.innerConeAngle"), problem);
    }
    if inner < outer {
        return Ok(LightKind::Spot { inner, outer });
    }
    // The specification requires an inner angle below the outer one, but exporters write equal ones
    // for an edge without falloff, and angles that were edited one by one.
    let edge = format!(": inner cone angle {inner} is not below the outer, {outer}: an edge without falloff");
    notes.about("light", name, &edge);
    Ok(LightKind::Spot { inner: outer.next_down(), outer })
}
