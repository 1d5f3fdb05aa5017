//! Meshes that are held once and shown in several places.

use std::collections::HashMap;

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::{Bounds, Triangle, vertex_bits};

/// A mesh, or a part of one, that [`Instance`]s share. Its surfaces are opaque and emit no light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SharedMesh {
    /// Triangles in coordinates of their own; [`Triangle::object`] is not used.
    pub triangles: Vec<Triangle>,
}

/// A [`SharedMesh`] in one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::meshes`](super::Scene::meshes).
    pub mesh: u32,
    /// Index into [`Scene::objects`](super::Scene::objects).
    pub object: u32,
    /// Linear part of the transform to scene coordinates: invertible, and with a positive
    /// determinant, so that fronts stay fronts.
    pub linear: Mat3,
    /// Where the mesh's origin lies, metres.
    pub offset: Vec3,
}

impl Instance {
    /// A point of the mesh in scene coordinates.
    #[must_use]
    pub fn position(&self, point: Vec3) -> Vec3 {
        self.linear * point + self.offset
    }
}

/// Boxes of instances, scene coordinates.
pub(crate) fn instance_bounds(meshes: &[SharedMesh], instances: &[Instance]) -> Vec<Bounds> {
    let vertices: Vec<Vec<Vec3>> = meshes.par_iter().map(vertices).collect();
    let bounds = |instance: &Instance| {
        let points = vertices[instance.mesh as usize].iter().map(|vertex| instance.position(*vertex));
        let box_ = Bounds::around(points);
        // Covers the rounding of the transform, there and back.
        let slack = 8.0 * f32::EPSILON * (box_.min.abs().max(box_.max.abs()) + (box_.max - box_.min));
        Bounds { min: box_.min - slack, max: box_.max + slack }
    };
    instances.par_iter().map(bounds).collect()
}

/// Largest distance of a vertex of the instances from a point, metres.
pub(crate) fn reach_of_instances(meshes: &[SharedMesh], instances: &[Instance], from: Vec3) -> f32 {
    let vertices: Vec<Vec<Vec3>> = meshes.par_iter().map(vertices).collect();
    let reach = |instance: &Instance| {
        let points = vertices[instance.mesh as usize].iter();
        points.map(|vertex| instance.position(*vertex).distance(from)).fold(0.0, f32::max)
    };
    instances.par_iter().map(reach).reduce(|| 0.0, f32::max)
}

/// The different vertices of a mesh.
fn vertices(mesh: &SharedMesh) -> Vec<Vec3> {
    let mut known = HashMap::new();
    for position in mesh.triangles.iter().flat_map(|triangle| triangle.positions) {
        known.insert(vertex_bits(position), position);
    }
    known.into_values().collect()
}
