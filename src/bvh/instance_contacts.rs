//! Search for primitives of instances that lie in those of a scene, and of other instances.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::{
    build::bounds,
    contact_search::{Search, Touched},
    overlap::{Shape, coincide, reach},
    plane_tree::Asked,
};
use crate::layout::{INSTANCE, Instance, Primitive};

/// Primitives of instances that are asked at most whether they lie in those of other ones, and
/// steps of the search for them.
const MAX_ASKED: usize = 1 << 25;
const MAX_STEPS: usize = 1 << 27;

impl<A: Fn(&Primitive) -> Option<u32> + Sync> Search<'_, A> {
    /// Adds the primitives of all instances that lie in one of the scene.
    pub(super) fn touching_instances(&self, asked: &Asked<'_>, most: usize, found: &mut Touched) {
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            if found.steps >= most {
                return;
            }
            for child in self.bvh.nodes[node as usize].children() {
                found.steps += 1;
                if child.count == 0 {
                    if self.has_instances[child.first as usize] && asked.shape.may_meet(&child.bounds) {
                        waiting.push(child.first);
                    }
                    continue;
                }
                let leaf = &self.bvh.primitives[child.first as usize..(child.first + child.count) as usize];
                let boxes = leaf.iter().filter(|p| p.emitter == INSTANCE && asked.shape.meets(&bounds(p)));
                boxes.for_each(|other| self.touching_instance(asked.primitive, other.material, found));
            }
        }
    }

    /// Adds the primitives of an instance that lie in the surface of one in scene coordinates.
    fn touching_instance(&self, primitive: &Primitive, number: u32, found: &mut Touched) {
        let instance = &self.bvh.instances[number as usize];
        let shape = Shape::new(primitive);
        let in_mesh = shape_in_mesh(primitive, instance);
        let mut waiting = vec![instance.root];
        while let Some(node) = waiting.pop() {
            found.steps += 1;
            for child in self.bvh.nodes[node as usize].children().filter(|child| in_mesh.meets(&child.bounds)) {
                if child.count == 0 {
                    waiting.push(child.first);
                }
                for stored in &self.bvh.primitives[child.first as usize..(child.first + child.count) as usize] {
                    if self.patch(stored).is_none() || found.of_instances.contains(&stored.id) {
                        continue;
                    }
                    let other = instance.primitive(stored);
                    found.steps += 1;
                    if shape.is_parallel(&other) && !shape.is_beside(&other) && coincide(primitive, &other) {
                        found.of_instances.insert(stored.id);
                    }
                }
            }
        }
    }

    /// Primitives of instances that lie in those of other ones, each with those; `None` if there
    /// are too many to ask.
    pub fn among_instances(&self) -> Option<Vec<(u32, Touched)>> {
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
        let size = |p: &Primitive| stored(p.material).len();
        // Whether a sum exceeds its limit does not depend on the order of threads.
        let asked = AtomicUsize::new(0);
        let count = |own: &Primitive, other: &Primitive| {
            let more = size(own).min(size(other));
            asked.fetch_add(more, Ordering::Relaxed) + more <= MAX_ASKED
        };
        if !boxes.par_iter().all(|own| self.boxes_met(own, &mut |other| count(own, other))) {
            return None;
        }
        let steps = AtomicUsize::new(0);
        let is_over = |more: usize| steps.fetch_add(more, Ordering::Relaxed) + more > MAX_STEPS;
        let of_box = |own: &&Primitive| -> Option<Vec<(u32, Touched)>> {
            let mut all = Vec::new();
            let mut ask = |other: &Primitive| {
                let (small, other) = if size(own) <= size(other) { (*own, other) } else { (other, *own) };
                let (instance, its_box) = (&self.bvh.instances[small.material as usize], bounds(other));
                for stored in &self.bvh.primitives[stored(small.material)] {
                    let own = instance.primitive(stored);
                    let mut found = Touched { steps: 1, ..Touched::default() };
                    if self.patch(stored).is_some() && bounds(&own).touches(&its_box) {
                        self.touching_instance(&own, other.material, &mut found);
                    }
                    if is_over(found.steps) {
                        return false;
                    }
                    if !found.is_empty() {
                        all.push((stored.id, found));
                    }
                }
                true
            };
            self.boxes_met(own, &mut ask).then_some(all)
        };
        let found: Option<Vec<_>> = boxes.par_iter().map(of_box).collect();
        Some(found?.into_iter().flatten().collect())
    }

    /// Calls `ask` for each box of an instance of a higher number that meets that of one, until it
    /// says no; returns whether it never did.
    fn boxes_met(&self, own: &Primitive, ask: &mut impl FnMut(&Primitive) -> bool) -> bool {
        let its_bounds = bounds(own);
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            for child in self.bvh.nodes[node as usize].children().filter(|child| child.bounds.touches(&its_bounds)) {
                if child.count == 0 {
                    waiting.push(child.first);
                }
                let leaf = &self.bvh.primitives[child.first as usize..(child.first + child.count) as usize];
                let others = leaf.iter().filter(|p| p.emitter == INSTANCE && p.material > own.material);
                if !others.filter(|other| bounds(other).touches(&its_bounds)).all(&mut *ask) {
                    return false;
                }
            }
        }
        true
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
