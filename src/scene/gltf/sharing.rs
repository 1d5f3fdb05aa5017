//! Meshes that are held once for all their copies: which ones, and their places.

use std::collections::{HashMap, HashSet};

use glam::{DMat3, DMat4, DVec3, Vec3};

use super::mesh_cache::MeshInstance;
use super::placing::{Placed, place_rigid};
use crate::{
    layout::{TREE_HEIGHTS, even_height},
    scene::{Attributes, Instance, Material, SharedMesh},
};

/// Triangles from which on a copy takes less memory than a mesh of its own.
const MIN_TRIANGLES: usize = 64;
/// Largest product of the norms of a transform and its inverse: rounding of a ray on the way to the
/// mesh is less than this many times that of its origin.
const MAX_CONDITION: f64 = 1e4;

/// Whether surfaces of a material may belong to instances. Lights and the surfaces of solids are
/// listed one by one.
pub(super) fn is_sharable(material: &Material) -> bool {
    material.emission == Vec3::ZERO && !material.surface.transmits()
}

/// Whether a mesh of `triangles` that may be shared is, in a scene with so many others.
pub(super) fn is_worth_it(triangles: usize, copies: usize, others: usize, from: usize) -> bool {
    let heights = even_height(triangles) + even_height(others.saturating_add(copies));
    let least = if from == 0 { 1 } else { MIN_TRIANGLES };
    copies > 1 && triangles >= least && triangles.saturating_mul(copies) >= from && heights + 2 <= TREE_HEIGHTS
}

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
    pub(super) fn add(&mut self, copy: &MeshInstance<'_>, to_scene: DMat4) -> Option<usize> {
        let linear = DMat3::from_mat4(to_scene);
        let norm = |m: DMat3| m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        let condition = norm(linear) * norm(linear.inverse());
        // Also refuses what is no number.
        if !(condition <= MAX_CONDITION) {
            return None;
        }
        let is_mirrored = linear.determinant() < 0.0;
        let mirror = if is_mirrored { DVec3::new(-1.0, 1.0, 1.0) } else { DVec3::ONE };
        let Known { index, center } = self.mesh(copy, is_mirrored, mirror);
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

    fn mesh(&mut self, copy: &MeshInstance<'_>, is_mirrored: bool, mirror: DVec3) -> Known {
        if let Some(known) = self.known.get(&(copy.mesh, is_mirrored)) {
            return *known;
        }
        let shown = || copy.primitives.iter().zip(copy.shared).filter(|(_, shared)| **shared).map(|(p, _)| p);
        let positions = || shown().flat_map(|primitive| &primitive.positions);
        let (min, max) = positions().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), position| {
            (min.min(*position), max.max(*position))
        });
        let center = if min.x <= max.x { 0.5 * (min.as_dvec3() + max.as_dvec3()) } else { DVec3::ZERO };
        let mut own = Placed { attributes: std::mem::take(&mut self.attributes), ..Placed::default() };
        let to_own = DMat4::from_scale(mirror) * DMat4::from_translation(-center);
        shown().for_each(|primitive| place_rigid(primitive, to_own, &mut own));
        self.attributes = own.attributes;
        let known = Known { index: self.meshes.len(), center };
        self.meshes.push(SharedMesh { triangles: own.triangles });
        self.known.insert((copy.mesh, is_mirrored), known);
        known
    }
}
