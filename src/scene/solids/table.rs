//! The solids of a scene and their slots.

use glam::Vec3;

use super::{
    plates::{Plates, plates},
    rank::{self, BoundingVolume},
    shells::Shells,
    solid::{COVER_BIT, NO_SLOT, NONE, SPHERE_BIT, Solid, glass},
};
use crate::scene::{Bounds, Medium, Scene};

/// Slots of all surfaces of a scene, and what fills each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solids {
    /// Slot of each triangle, then of each sphere; empty if there is no solid.
    slots: Vec<u8>,
    /// Medium that fills the solids of each slot, the highest rank first.
    pub media: Vec<Medium>,
    /// The slots of covers, see `covers.rs`: a bit for each.
    covers: u128,
    plates: Plates,
    /// Solids that found no slot: there are more kinds that overlap than slots.
    pub without_slot: usize,
}

impl Solids {
    /// The solids of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let is_glass = glass(&scene.materials);
        let mut of_surface = match scene.shells.len() == scene.triangles.len() {
            true => scene.shells.clone(),
            false => Shells::of_materials(&scene.triangles, &scene.spheres, &is_glass).solids(),
        };
        let mut found: Vec<Solid> = Vec::new();
        let mut volumes: Vec<BoundingVolume> = Vec::new();
        let plates = plates(&scene.triangles, &of_surface, &scene.materials);
        let is_own = |solid: u32| solid != NONE && solid & SPHERE_BIT == 0;
        for (triangle, solid) in scene.triangles.iter().zip(&of_surface).filter(|(_, solid)| is_own(**solid)) {
            let index = (*solid & !COVER_BIT) as usize;
            while found.len() <= index {
                found.push(Solid { material: NONE, priority: 0, volume: 0.0, bounds: Bounds::EMPTY, is_cover: false });
                volumes.push(BoundingVolume::default());
            }
            if found[index].material == NONE {
                found[index].material = triangle.material;
            }
            found[index].is_cover |= *solid & COVER_BIT != 0;
            found[index].bounds = found[index].bounds.union(Bounds::from(triangle));
            triangle.positions.iter().for_each(|corner| volumes[index].add(*corner));
        }
        for (solid, volume) in found.iter_mut().zip(&volumes) {
            solid.volume = volume.smallest();
            if solid.is_cover {
                solid.volume = f64::INFINITY;
                solid.bounds = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
            }
        }
        for sphere in &scene.spheres {
            let solid = if is_glass[sphere.material as usize] { found.len() as u32 } else { NONE };
            of_surface.push(solid);
            if solid != NONE {
                let volume = f64::from(2.0 * sphere.radius).powi(3);
                found.push(Solid {
                    material: sphere.material,
                    priority: 0,
                    volume,
                    bounds: Bounds::from(sphere),
                    is_cover: false,
                });
            }
        }
        // Cavities in spheres.
        for i in 0..scene.triangles.len() {
            if of_surface[i] != NONE && !is_own(of_surface[i]) {
                of_surface[i] = of_surface[scene.triangles.len() + (of_surface[i] & !SPHERE_BIT) as usize];
            }
        }
        if found.is_empty() {
            return Self::default();
        }
        for solid in found.iter_mut().filter(|solid| solid.material != NONE) {
            solid.priority = scene.materials[solid.material as usize].priority;
        }
        let (slot_of, materials, without_slot) = rank::slots(&found);
        let slot = |solid: u32| match solid {
            NONE => NO_SLOT as u8,
            _ => slot_of[(solid & !COVER_BIT) as usize],
        };
        let of_covers = found.iter().zip(&slot_of).filter(|(solid, _)| solid.is_cover);
        let covers = of_covers.fold(0, |covers, (_, slot)| covers | 1 << slot);
        let media = materials.iter().filter_map(|material| scene.materials[*material as usize].medium());
        Self { slots: of_surface.into_iter().map(slot).collect(), media: media.collect(), covers, plates, without_slot }
    }

    /// Slot of the triangle with that index in the scene, or of a sphere, which follow them.
    #[must_use]
    pub fn slot(&self, primitive: u32) -> u32 {
        self.slots.get(primitive as usize).map_or(NO_SLOT, |slot| u32::from(*slot))
    }

    /// Whether a slot is that of a sheet which stands for all that lies behind it.
    #[must_use]
    pub fn is_cover(&self, slot: u32) -> bool {
        slot < NO_SLOT && self.covers >> slot & 1 == 1
    }

    /// Whether the triangle with that index in the scene is a face of a clear plate.
    #[must_use]
    pub fn is_face_of_plate(&self, primitive: u32) -> bool {
        self.plates.is_face.get(primitive as usize) == Some(&true)
    }

    /// Whether there are plates.
    #[must_use]
    pub fn has_plates(&self) -> bool {
        !self.plates.is_face.is_empty()
    }

    /// Whether all solids of triangles are plates.
    #[must_use]
    pub fn are_plates(&self) -> bool {
        self.plates.are_all
    }

    /// Whether the scene has no solid.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.media.is_empty()
    }

    /// Warning for solids without a slot.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        (self.without_slot > 0).then(|| {
            format!(
                "{} glass solids overlap in more than {NO_SLOT} ways: they count as part of others",
                self.without_slot
            )
        })
    }
}
