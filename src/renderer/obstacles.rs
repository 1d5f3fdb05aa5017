//! What stands between points of a scene, by rays on the host.

use glam::Vec3;

use crate::{
    bvh::Bvh,
    scene::{Alpha, Material, Scene},
};

/// Surfaces that a ray passes at most.
const MAX_PASSED: usize = 64;

/// A scene, and its hierarchy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Obstacles<'a> {
    pub scene: &'a Scene,
    pub bvh: &'a Bvh,
}

impl Obstacles<'_> {
    /// Metres from one point to the first surface that hides another from it; `None` if none does.
    pub fn first_between(&self, from: Vec3, to: Vec3) -> Option<f32> {
        let reach = from.distance(to);
        let direction = (to - from).try_normalize()?;
        let mut origin = from;
        for _ in 0..MAX_PASSED {
            let hit = self.bvh.nearest_hit(origin, direction)?;
            let distance = hit.position.distance(from);
            if distance >= reach {
                return None;
            }
            if hides(&self.scene.materials[hit.material as usize]) {
                return Some(distance);
            }
            origin = hit.position;
        }
        Some(origin.distance(from))
    }
}

fn hides(material: &Material) -> bool {
    !material.surface.transmits() && material.alpha == Alpha::Opaque
}
