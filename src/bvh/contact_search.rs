//! Search of the hierarchy for surfaces that lie in each other.

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Bvh,
    build::bounds,
    overlap::{Shape, coincide, reach},
};
use crate::{
    layout::{INSTANCE, Instance, MAX_RANK, Primitive, SPHERE_BIT},
    scene::Bounds,
};

/// Primitives of instances that are asked at most whether they lie in those of other ones.
const MAX_ASKED: usize = 1 << 25;

/// Patches that are looked for in the surface of a primitive of the scene at most: there are no
/// more ranks to tell them apart.
const MAX_TOUCHED: usize = MAX_RANK as usize + 1;

/// The hierarchy as it is searched.
pub(super) struct Search<'a> {
    pub bvh: &'a Bvh,
    /// The patch of each primitive by its index in the scene.
    pub patches: &'a [u32],
    /// The patch of all that is below each node; `None` where there are several.
    pub of_nodes: Vec<Option<u32>>,
}

/// What lies in a primitive: a patch, and for one of an instance the index of the primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Touched {
    pub patch: u32,
    pub of_instance: Option<u32>,
}

impl Search<'_> {
    fn patch(&self, primitive: &Primitive) -> Option<u32> {
        self.patches.get(primitive.id as usize).copied()
    }

    /// What lies in the surface of a primitive of the scene, but for the patch `apart`; of a crowd,
    /// some.
    pub fn touching(&self, primitive: &Primitive, apart: Option<u32>) -> Vec<Touched> {
        let is_apart = |patch: Option<u32>| patch.is_some() && patch == apart;
        if is_apart(self.of_nodes[0]) {
            return Vec::new();
        }
        let shape = Shape::new(primitive);
        let (mut found, mut waiting) = (Vec::new(), vec![0]);
        while let Some(node) = waiting.pop() {
            for child in self.bvh.nodes[node as usize].children() {
                if child.count == 0 {
                    if !is_apart(self.of_nodes[child.first as usize]) && shape.may_meet(&child.bounds) {
                        waiting.push(child.first);
                    }
                    continue;
                }
                let leaf = &self.bvh.primitives[child.first as usize..(child.first + child.count) as usize];
                let boxes = leaf.iter().filter(|other| other.emitter == INSTANCE && shape.meets(&bounds(other)));
                boxes.for_each(|other| self.touching_instance(primitive, other.material, &mut found));
                // The box is only asked for those that pass a cheaper test.
                let others = leaf.iter().filter(|other| {
                    let patch = self.patch(other);
                    patch.is_some() && !is_apart(patch) && shape.is_parallel(other)
                });
                let mut others = others.peekable();
                if others.peek().is_none() || !shape.meets(&child.bounds) {
                    continue;
                }
                for other in others {
                    let Some(patch) = self.patch(other) else { continue };
                    let touched = Touched { patch, of_instance: None };
                    if !found.contains(&touched) && coincide(primitive, other) {
                        found.push(touched);
                        if found.len() >= MAX_TOUCHED {
                            return found;
                        }
                    }
                }
            }
        }
        found
    }

    /// Adds the primitives of an instance that lie in the surface of one in scene coordinates.
    fn touching_instance(&self, primitive: &Primitive, number: u32, found: &mut Vec<Touched>) {
        if primitive.material & SPHERE_BIT != 0 {
            return;
        }
        let instance = &self.bvh.instances[number as usize];
        let shape = Shape::new(primitive);
        let in_mesh = shape_in_mesh(primitive, instance);
        let mut waiting = vec![instance.root];
        while let Some(node) = waiting.pop() {
            for child in self.bvh.nodes[node as usize].children().filter(|child| in_mesh.meets(&child.bounds)) {
                if child.count == 0 {
                    waiting.push(child.first);
                }
                for stored in &self.bvh.primitives[child.first as usize..(child.first + child.count) as usize] {
                    let Some(patch) = self.patch(stored) else { continue };
                    let touched = Touched { patch, of_instance: Some(stored.id) };
                    let other = instance.primitive(stored);
                    if !found.contains(&touched) && shape.is_parallel(&other) && coincide(primitive, &other) {
                        found.push(touched);
                    }
                }
            }
        }
    }

    /// Primitives of instances that lie in those of other ones, each with those; `None` if there
    /// are too many to ask.
    pub fn among_instances(&self) -> Option<Vec<(u32, Vec<Touched>)>> {
        let listed = &self.bvh.primitives[..self.bvh.scene_part().1];
        let boxes: Vec<&Primitive> = listed.iter().filter(|p| p.emitter == INSTANCE).collect();
        let mut firsts: Vec<usize> = self.bvh.instances.iter().skip(1).map(|i| i.stored as usize).collect();
        firsts.sort_unstable();
        firsts.dedup();
        firsts.push(self.bvh.primitives.len());
        let stored = |number: u32| {
            let first = self.bvh.instances[number as usize].stored as usize;
            first..firsts[firsts.partition_point(|other| *other <= first)]
        };
        let pairs: Vec<[&Primitive; 2]> = boxes.par_iter().flat_map_iter(|own| self.boxes_met(own)).collect();
        let size = |p: &Primitive| stored(p.material).len();
        let asked = pairs.iter().map(|[a, b]| size(a).min(size(b))).sum::<usize>();
        if asked > MAX_ASKED {
            return None;
        }
        let ask = |&[a, b]: &[&Primitive; 2]| {
            let (small, other) = if size(a) <= size(b) { (a, b) } else { (b, a) };
            let (instance, its_box) = (&self.bvh.instances[small.material as usize], bounds(other));
            let of_one = |stored: &Primitive| {
                let own = instance.primitive(stored);
                let mut found = Vec::new();
                if self.patch(stored).is_some() && touch(&bounds(&own), &its_box) {
                    self.touching_instance(&own, other.material, &mut found);
                }
                (!found.is_empty()).then_some((stored.id, found))
            };
            self.bvh.primitives[stored(small.material)].iter().filter_map(of_one).collect::<Vec<_>>()
        };
        Some(pairs.par_iter().flat_map_iter(ask).collect())
    }

    /// The box of an instance with each of an instance of a higher number that meets it.
    fn boxes_met<'b>(&'b self, own: &'b Primitive) -> Vec<[&'b Primitive; 2]> {
        let its_bounds = bounds(own);
        let (mut found, mut waiting) = (Vec::new(), vec![0]);
        while let Some(node) = waiting.pop() {
            for child in self.bvh.nodes[node as usize].children().filter(|child| touch(&child.bounds, &its_bounds)) {
                if child.count == 0 {
                    waiting.push(child.first);
                }
                let leaf = &self.bvh.primitives[child.first as usize..(child.first + child.count) as usize];
                let others = leaf.iter().filter(|p| p.emitter == INSTANCE && p.material > own.material);
                found.extend(others.filter(|other| touch(&bounds(other), &its_bounds)).map(|other| [own, other]));
            }
        }
        found
    }
}

/// A primitive of the scene, in whose box the tree of an instance's mesh is searched.
fn shape_in_mesh(primitive: &Primitive, instance: &Instance) -> Shape {
    let offset = instance.offset();
    let linear = |v: Vec3| instance.vector_from_scene(v);
    let [v0, e1, e2] = [primitive.v0, primitive.e1, primitive.e2].map(Vec3::from);
    let stretch = instance.inverse_rows().iter().map(|row| row.length_squared()).sum::<f32>().sqrt();
    let in_mesh = Primitive {
        v0: linear(v0 - offset).to_array(),
        e1: linear(e1).to_array(),
        e2: linear(e2).to_array(),
        ..*primitive
    };
    Shape::new(&in_mesh).widened(reach(primitive).max(f64::from(offset.abs().max_element())) * f64::from(stretch))
}

fn touch(a: &Bounds, b: &Bounds) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}
