//! Meshes that are held once for all their copies: which ones.

use glam::Vec3;

use crate::{
    layout::{TREE_HEIGHTS, even_height},
    scene::Material,
};

/// Triangles from which on a copy takes less memory than a mesh of its own.
const MIN_TRIANGLES: usize = 64;

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
