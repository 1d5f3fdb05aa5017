//! Lights of emissive triangles and spheres. A triangle whose emission varies is several lights, so
//! that paths start where it is bright.

use std::{collections::BTreeMap, f64::consts::PI};

use glam::{DVec3, Vec2, Vec3};

use crate::{
    layout,
    scene::{Cut, EmissionMap, Emitted, Scene, Subtriangle},
};

/// A light of a surface, without its emission.
pub(super) struct SurfaceLight {
    pub light: layout::Light,
    pub emitted: Emitted,
}

/// The lights of the emissive surfaces of a scene.
pub(super) struct SurfaceLights<'a> {
    scene: &'a Scene,
    map: EmissionMap<'a>,
    /// The primitives of varied emission, by index.
    cut: BTreeMap<usize, Cut>,
}

impl<'a> SurfaceLights<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let map = EmissionMap::new(scene);
        let cut = map.cut();
        Self { scene, map, cut }
    }

    /// Whether the emission of a material varies.
    pub fn is_varied(&self, material: u32) -> bool {
        self.map.is_varied(material)
    }

    /// Lights of an emissive primitive; none if nothing of it shines.
    pub fn of(&self, primitive: usize) -> Vec<SurfaceLight> {
        let whole = surface_light(self.scene, primitive);
        // A degenerate surface emits nothing.
        if whole.area <= 0.0 {
            return Vec::new();
        }
        let Some(Cut { side, subtriangles }) = self.cut.get(&primitive) else {
            return vec![SurfaceLight { light: whole, emitted: Emitted { mean: DVec3::ONE, is_lit: true } }];
        };
        if subtriangles.iter().all(|subtriangle| !subtriangle.is_lit) {
            return Vec::new();
        }
        let triangle = self.scene.triangles.get(primitive);
        let material = match triangle {
            Some(triangle) => triangle.material,
            None => self.scene.spheres[primitive - self.scene.triangles.len()].material,
        };
        let attributes = triangle.map_or(0, |triangle| triangle.attributes);
        let whole = layout::Light { material: material + 1, attributes, side: *side, ..whole };
        let subtriangle = |(subtriangle, emitted): (Subtriangle, &Emitted)| SurfaceLight {
            light: cut_out(&whole, subtriangle),
            emitted: *emitted,
        };
        Subtriangle::all(*side).zip(subtriangles).map(subtriangle).collect()
    }
}

/// Shape of the primitive with that index in the scene; triangles come before spheres.
fn surface_light(scene: &Scene, primitive: usize) -> layout::Light {
    if let Some(triangle) = scene.triangles.get(primitive) {
        let [a, b, c] = triangle.positions;
        let area = 0.5 * (b - a).as_dvec3().cross((c - a).as_dvec3()).length();
        let (e1, e2) = ((b - a).to_array(), (c - a).to_array());
        let kind = layout::TRIANGLE_LIGHT;
        return layout::Light { position: a.to_array(), kind, e1, e2, area: area as f32, ..Default::default() };
    }
    let sphere = &scene.spheres[primitive - scene.triangles.len()];
    let (position, e1) = (sphere.center.to_array(), [sphere.radius, 0.0, 0.0]);
    let area = 4.0 * PI * f64::from(sphere.radius).powi(2);
    layout::Light { position, kind: layout::SPHERE_LIGHT, e1, area: area as f32, ..Default::default() }
}

/// A subtriangle of a light that is a whole triangle.
fn cut_out(whole: &layout::Light, subtriangle: Subtriangle) -> layout::Light {
    if whole.side <= 1 {
        return *whole;
    }
    let [position, e1, e2] = [whole.position, whole.e1, whole.e2].map(|v| Vec3::from_array(v).as_dvec3());
    let corner = subtriangle.weights(whole.side, Vec2::ZERO).as_dvec2();
    let (side, sign) = (f64::from(whole.side), if subtriangle.is_turned { -1.0 } else { 1.0 });
    let edge = |e: DVec3| (sign / side * e).as_vec3().to_array();
    layout::Light {
        position: (position + corner.x * e1 + corner.y * e2).as_vec3().to_array(),
        e1: edge(e1),
        e2: edge(e2),
        area: whole.area / (whole.side * whole.side) as f32,
        subtriangle: layout::subtriangle_word(subtriangle.column, subtriangle.row, subtriangle.is_turned),
        ..*whole
    }
}
