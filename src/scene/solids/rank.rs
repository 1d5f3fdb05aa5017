//! Ranks of solids, and slots by rank.

use glam::{Quat, Vec3};

use super::solid::{NO_SLOT, NONE, Solid};
use crate::{
    layout::MEDIA_WORDS,
    scene::{Bounds, CompleteTree, Visit},
};

/// Orientations in which boxes are measured, the axes' own first.
const ORIENTATIONS: usize = 32;

/// Boxes around points in the same orientations for all solids. The smallest of them measures a
/// solid, upright or tilted, and what lies inside of another solid has the smaller one.
#[derive(Clone, Debug)]
pub(super) struct BoundingVolume(Vec<Bounds>);

impl Default for BoundingVolume {
    fn default() -> Self {
        Self(vec![Bounds::EMPTY; ORIENTATIONS])
    }
}

impl BoundingVolume {
    pub(super) fn add(&mut self, point: Vec3) {
        for (bounds, axes) in self.0.iter_mut().zip(orientations()) {
            let p = *axes * point;
            *bounds = bounds.union(Bounds { min: p, max: p });
        }
    }

    /// Volume of the smallest box, m³.
    pub(super) fn smallest(&self) -> f64 {
        let volume = |bounds: &Bounds| (bounds.max - bounds.min).as_dvec3().max(glam::DVec3::ZERO).element_product();
        self.0.iter().map(volume).fold(f64::INFINITY, f64::min)
    }
}

/// Rotations spread over all orientations by a Kronecker sequence; uniform quaternions by
/// Shoemake 1992, "Uniform Random Rotations".
fn orientations() -> &'static [Quat; ORIENTATIONS] {
    use std::f32::consts::TAU;
    static ALL: std::sync::OnceLock<[Quat; ORIENTATIONS]> = std::sync::OnceLock::new();
    ALL.get_or_init(|| {
        std::array::from_fn(|i| {
            if i == 0 {
                return Quat::IDENTITY;
            }
            let [u, v, w] = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step: f32| (i as f32 * step).fract());
            let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
            Quat::from_xyzw(a * (TAU * v).sin(), a * (TAU * v).cos(), b * (TAU * w).sin(), b * (TAU * w).cos())
                .normalize()
        })
    })
}

/// Gives each solid a slot. Slots rise as ranks fall; solids of a slot have one material and do not
/// overlap. Returns the slots, the material of each slot, and the number of solids for which there
/// was none left.
pub(super) fn slots(solids: &[Solid]) -> (Vec<u8>, Vec<u32>, usize) {
    let mut by_rank: Vec<usize> = (0..solids.len()).filter(|i| solids[*i].material != NONE).collect();
    by_rank.sort_by(|a, b| {
        let (x, y) = (&solids[*a], &solids[*b]);
        y.priority.cmp(&x.priority).then(x.volume.total_cmp(&y.volume)).then(a.cmp(b))
    });
    let mut placed = Placed::new(solids);
    let mut slot_of = vec![NO_SLOT as u8; solids.len()];
    let (mut materials, mut without): (Vec<u32>, usize) = (Vec::new(), 0);
    for solid in by_rank {
        let material = solids[solid].material;
        let around = placed.slots_around(solid, &slot_of);
        let is_around = |slot: &usize| around[slot / 32] >> (slot % 32) & 1 == 1;
        // Among equal media either may fill the space; of others those before it rank higher.
        let others = (0..materials.len()).rev().find(|slot| is_around(slot) && materials[*slot] != material);
        let first = others.map_or(0, |slot| slot + 1);
        let free = |slot: &usize| materials[*slot] == material && !is_around(slot);
        let slot = match (first..materials.len()).find(free) {
            Some(slot) => slot,
            None if materials.len() < NO_SLOT as usize => {
                materials.push(material);
                materials.len() - 1
            }
            None => {
                without += 1;
                materials.iter().rposition(|m| *m == material).unwrap_or(materials.len() - 1)
            }
        };
        slot_of[solid] = slot as u8;
        placed.add(solid, slot);
    }
    (slot_of, materials, without)
}

/// Solids in a tree over their boxes, with the slots that those below each node have so far.
struct Placed<'a> {
    solids: &'a [Solid],
    tree: CompleteTree<Bounds>,
    leaves: Vec<usize>,
    slots: Vec<[u32; MEDIA_WORDS]>,
}

impl<'a> Placed<'a> {
    fn new(solids: &'a [Solid]) -> Self {
        let tree = CompleteTree::of_boxes(&solids.iter().map(|solid| solid.bounds).collect::<Vec<_>>());
        Self { solids, leaves: tree.leaves(solids.len()), slots: vec![[0; MEDIA_WORDS]; tree.nodes.len()], tree }
    }

    /// The slots of the solids so far whose boxes overlap or touch that of one.
    fn slots_around(&self, solid: usize, slot_of: &[u8]) -> [u32; MEDIA_WORDS] {
        let bounds = &self.solids[solid].bounds;
        let mut found = [0; MEDIA_WORDS];
        self.tree.visit(|visit| match visit {
            // Where thousands overlap, most have slots that are known.
            Visit::Node(i, node) => {
                let is_new = self.slots[i].iter().zip(&found).any(|(below, known)| below & !known != 0);
                is_new && node.touches(bounds)
            }
            Visit::Leaf(others) => {
                for other in others.iter().map(|i| *i as usize) {
                    let slot = u32::from(slot_of[other]);
                    if slot != NO_SLOT && self.solids[other].bounds.touches(bounds) {
                        found[slot as usize / 32] |= 1 << (slot % 32);
                    }
                }
                true
            }
        });
        found
    }

    fn add(&mut self, solid: usize, slot: usize) {
        let mut node = Some(self.leaves[solid]);
        while let Some(i) = node {
            self.slots[i][slot / 32] |= 1 << (slot % 32);
            node = (i > 0).then(|| (i - 1) / 2);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    fn solid(material: u32, center: f32, half: f32) -> Solid {
        let (center, half) = (Vec3::splat(center), Vec3::splat(half));
        let bounds = Bounds { min: center - half, max: center + half };
        Solid { material, priority: 0, volume: f64::from(8.0 * half.x.powi(3)), bounds, is_cover: false }
    }

    #[test]
    fn the_smaller_solid_fills_the_space_and_strangers_share_a_slot() {
        let row: Vec<Solid> = (0..1000).map(|i| solid(0, 3.0 * i as f32, 1.0)).collect();
        assert_eq!(slots(&row), (vec![0; 1000], vec![0], 0));
        let nested: Vec<Solid> = (0..12).map(|i| solid(0, 0.0, 12.0 - i as f32)).collect();
        let (of, media, _) = slots(&nested);
        assert_eq!((of, media), ((0..12).rev().collect(), vec![0; 12]));
        // Ice in water in a bowl, and a bowl beside it that is smaller than all.
        let bowl = [solid(2, 0.0, 3.0), solid(1, 0.0, 2.0), solid(0, 0.0, 1.0), solid(2, 50.0, 0.5)];
        assert_eq!(slots(&bowl), (vec![3, 2, 1, 0], vec![2, 0, 1, 2], 0));
        let mut first = bowl;
        first[0].priority = 1;
        assert_eq!(slots(&first).0[0], 0, "explicit priority ranks before size");
    }

    #[test]
    fn more_ways_to_overlap_than_slots_are_counted() {
        let nested: Vec<Solid> = (0..130).map(|i| solid(i, 0.0, 1.0 + i as f32)).collect();
        assert_eq!(slots(&nested).2, 3);
        assert_eq!(slots(&nested[..127]).2, 0, "control");
    }

    #[test]
    fn a_tilted_rod_is_small() {
        let mut rod = BoundingVolume::default();
        let (along, aside) = (vec3(1.0, 1.0, 1.0), vec3(0.01, -0.01, 0.0));
        [along + aside, along - aside, -along + aside, -along - aside].into_iter().for_each(|p| rod.add(p));
        assert!(rod.smallest() < 2.0, "{} of the 8 of its upright box", rod.smallest());
    }
}
