//! Meshes that are held once, and their places.

use std::collections::{HashMap, HashSet};

use glam::{DMat3, DMat4, DVec3};

use super::mesh_cache::MeshInstance;
use super::meshes::MeshPrimitive;
use crate::scene::{Attributes, Bounds, Instance, SharedMesh, Triangle};

/// Largest product of the norms of a transform and its inverse: rounding of a ray on the way to the
/// mesh is less than this many times that of its origin.
const MAX_CONDITION: f64 = 1e4;

/// Triangles, and the attributes to which they refer by index plus one.
pub(super) type Lists<'l> = (&'l mut Vec<Triangle>, &'l mut Vec<Attributes>);

/// Appends the triangles of a primitive, moved by a transform.
type Place<'p> = &'p dyn Fn(&MeshPrimitive, DMat4, Lists<'_>);

/// Shared meshes and their places.
#[derive(Debug, Default)]
pub(super) struct Shared {
    pub(super) meshes: Vec<SharedMesh>,
    pub(super) attributes: Vec<Attributes>,
    pub(super) instances: Vec<Instance>,
    /// Copies that lie exactly where others do, left out.
    pub(super) copies: usize,
    /// By the mesh of the file, and whether it is mirrored.
    known: HashMap<(usize, bool), Known>,
    places: HashSet<(u32, [u32; 12])>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    index: usize,
    /// Origin of its coordinates in those of the file: its middle, so that these lose no digits.
    center: DVec3,
}

impl Shared {
    /// Adds a copy of a mesh and returns the number of its triangles; `None` if a transform like
    /// that leaves too few digits.
    pub(super) fn add(&mut self, copy: &MeshInstance<'_>, to_scene: DMat4, place: Place<'_>) -> Option<usize> {
        let linear = DMat3::from_mat4(to_scene);
        let norm = |m: DMat3| m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        let condition = norm(linear) * norm(linear.inverse());
        if condition.is_nan() || condition > MAX_CONDITION {
            return None;
        }
        let is_mirrored = linear.determinant() < 0.0;
        let mirror = if is_mirrored { DVec3::new(-1.0, 1.0, 1.0) } else { DVec3::ONE };
        let Known { index, center } = self.mesh(copy, is_mirrored, mirror, place);
        let instance = Instance {
            mesh: index as u32,
            object: copy.node as u32,
            linear: (linear * DMat3::from_diagonal(mirror)).as_mat3(),
            offset: to_scene.transform_point3(center).as_vec3(),
        };
        let numbers = [instance.linear.x_axis, instance.linear.y_axis, instance.linear.z_axis, instance.offset];
        let mut bits = [0; 12];
        bits.iter_mut().zip(numbers.iter().flat_map(|v| v.to_array())).for_each(|(to, x)| *to = (x + 0.0).to_bits());
        if self.places.insert((instance.mesh, bits)) {
            self.instances.push(instance);
        } else {
            self.copies += 1;
        }
        Some(self.meshes[index].triangles.len())
    }

    fn mesh(&mut self, copy: &MeshInstance<'_>, is_mirrored: bool, mirror: DVec3, place: Place<'_>) -> Known {
        if let Some(known) = self.known.get(&(copy.mesh, is_mirrored)) {
            return *known;
        }
        let shown = || copy.primitives.iter().zip(copy.shared).filter(|(_, shared)| **shared).map(|(p, _)| p);
        let Bounds { min, max } = Bounds::around(shown().flat_map(|primitive| primitive.positions.iter().copied()));
        let center = if min.x <= max.x { 0.5 * (min.as_dvec3() + max.as_dvec3()) } else { DVec3::ZERO };
        let to_own = DMat4::from_scale(mirror) * DMat4::from_translation(-center);
        let mut triangles = Vec::new();
        shown().for_each(|primitive| place(primitive, to_own, (&mut triangles, &mut self.attributes)));
        let known = Known { index: self.meshes.len(), center };
        self.meshes.push(SharedMesh { triangles });
        self.known.insert((copy.mesh, is_mirrored), known);
        known
    }
}
