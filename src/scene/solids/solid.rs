//! A solid, and the names of what is none.

use crate::scene::{Bounds, Material, Surface};

pub use crate::layout::NO_SLOT;

/// A closed surface of glass, or several with their cavities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Solid {
    pub material: u32,
    pub priority: i32,
    /// Volume of the smallest of its boxes, see `rank::BoundingVolume`, m³.
    pub volume: f64,
    pub bounds: Bounds,
    /// Only a face of it is there.
    pub is_cover: bool,
}

/// Set in the index of a solid of which only a face is there, as of the water of a pool: it lies
/// behind that face, however far.
pub(super) const COVER_BIT: u32 = 0x8000_0000;

/// Set in the index of a sphere of the scene, as the solid of a cavity in it.
pub(super) const SPHERE_BIT: u32 = 0x4000_0000;

/// No solid.
pub(super) const NONE: u32 = u32::MAX;

/// Whether each material bounds solids.
pub(super) fn glass(materials: &[Material]) -> Vec<bool> {
    materials.iter().map(|material| matches!(material.surface, Surface::Glass { .. })).collect()
}
