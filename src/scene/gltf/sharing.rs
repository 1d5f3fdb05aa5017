//! Meshes that are held once for all their copies: which ones.

use glam::Vec3;

use super::fault::{Read, fault};
use crate::{
    layout::{TREE_HEIGHTS, even_height},
    scene::{Material, Scene},
};

/// Triangles from which on a copy takes less memory than a mesh of its own.
const MIN_TRIANGLES: usize = 64;

/// Whether surfaces of a material may belong to instances. Lights and the surfaces of solids are
/// listed one by one.
pub(super) fn is_sharable(material: &Material) -> bool {
    material.emission == Vec3::ZERO && !material.surface.transmits()
}

/// Refuses a scene whose tree and those of its shared meshes would be too high together: more
/// copies have triangles of their own than [`is_worth_it`] could know.
pub(super) fn check_heights(scene: &Scene) -> Read<()> {
    let others = scene.triangles.len() + scene.spheres.len() + scene.instances.len();
    match scene.meshes.iter().map(|mesh| mesh.triangles.len()).max() {
        Some(largest) if !fits(largest, others) => {
            fault("scene", format!("{others} triangles and instances are too many beside a shared mesh of {largest}"))
        }
        _ => Ok(()),
    }
}

/// Whether a mesh of `triangles` that may be shared is, in a scene with so many others.
pub(super) fn is_worth_it(triangles: usize, copies: usize, others: usize, from: usize) -> bool {
    let least = if from == 0 { 1 } else { MIN_TRIANGLES };
    copies > 1
        && triangles >= least
        && triangles.saturating_mul(copies) >= from
        && fits(triangles, others.saturating_add(copies))
}

/// Whether the trees over a shared mesh and over all others are low enough together; each may have
/// one level more than an even one.
fn fits(triangles: usize, others: usize) -> bool {
    even_height(triangles) + even_height(others) + 2 <= TREE_HEIGHTS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_worth_it_fits() {
        // 2^18 leaves below 2^18 leaves.
        assert!(is_worth_it(1 << 20, 1000, (1 << 20) - 1000, 200_000) && fits(1 << 20, 1 << 20));
        assert!(!is_worth_it(1 << 20, 1000, 1 << 20, 200_000) && !fits(1 << 20, (1 << 20) + 1));
        let worth = |triangles, copies| is_worth_it(triangles, copies, 100, 200_000);
        assert!(worth(100, 2000) && !worth(100, 1999) && !worth(63, 9000) && !worth(300_000, 1));
    }
}
