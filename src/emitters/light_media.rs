//! The media that a light's paths start in.

use glam::{DVec3, Vec3};

use crate::{
    bvh::MediaProbe,
    layout::{self, Light, OFFSET_SCALE},
};

/// Notes the media around a light. One point of a surface speaks for all of it, just off each side:
/// the middle of a triangle, a point of a sphere.
pub fn set_media(light: &mut Light, probe: &MediaProbe) {
    let [position, e1, e2] = [light.position, light.e1, light.e2].map(|v| Vec3::from_array(v).as_dvec3());
    let (point, normal, reach) = match light.kind {
        layout::POINT_LIGHT | layout::SPOT_LIGHT => (position, DVec3::ZERO, 0.0),
        layout::TRIANGLE_LIGHT => {
            // That of the whole triangle, whose rounding rays meet.
            let edges = e1.abs().max(e2.abs()) * f64::from(light.side.max(1));
            let reach = position.abs().max(edges).max_element();
            (position + (e1 + e2) / 3.0, e1.cross(e2).normalize_or_zero(), reach)
        }
        layout::SPHERE_LIGHT => {
            let outward = DVec3::ONE.normalize();
            (position + e1.x * outward, outward, position.abs().max_element() + e1.x)
        }
        // Light from infinitely far away starts outside of all.
        _ => return,
    };
    let at = |side: f64| probe.at(point + side * reach * f64::from(OFFSET_SCALE) * normal);
    (light.media, light.back_media) = (at(1.0), at(-1.0));
}
