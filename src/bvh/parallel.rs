//! The tree of a scene, on all cores if it is large: primitives are divided into parts, whose trees
//! are built each by one thread and joined below common nodes.
//!
//! Parts follow from the primitives alone, so that the tree is the same on any number of threads.
//! Large primitives, as the walls around a fine mesh, are a part of their own, for they would make
//! any other much larger.

use std::{
    panic::resume_unwind,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

use rayon::prelude::*;

use super::{WIDTH, binary::build_binary, convert, widen};
use crate::layout::{BVH_STACK, BvhNode};
use crate::scene::Bounds;

/// Number of primitives from which on they are divided.
pub(super) const LARGE: usize = 100_000;
/// A part has at most this fraction of the primitives, and each side of a division about a third of
/// what is divided at least: there are hardly more than three times as many parts.
const PARTS: usize = 32;
const SMALLER_SIDE: usize = 3;
/// Fraction of the area of the scene's box from which on a primitive's box is large.
const LARGE_BOX: f32 = 1.0 / 128.0;
/// Intervals along an axis between which primitives are divided.
const BINS: usize = 32;
/// Levels of the common nodes at most.
const LEVELS: u32 = 5;
const _: () = assert!(2 * PARTS * SMALLER_SIDE < capacity(0));
/// Primitives that decide about a division.
const SAMPLE: usize = 1 << 15;

/// Nodes, parents before children, and the indices of the boxes in leaf order.
pub(super) fn tree(bounds: &[Bounds]) -> (Vec<BvhNode>, Vec<u32>) {
    if bounds.len() < LARGE { subtree(bounds, BVH_STACK as u32, Curve::Whole) } else { joined(bounds) }
}

/// Box through which the curve runs along which the builder sorts.
#[derive(Clone, Copy, Debug)]
pub(super) enum Curve {
    /// That around everything.
    Whole,
    /// A cube: the box of a part may be much flatter than that of a scene, and the shorter axes
    /// must not count as much as the longest.
    Cube,
}

/// The tree by one thread. A traversal defers `room` children at most.
pub(super) fn subtree(bounds: &[Bounds], room: u32, curve: Curve) -> (Vec<BvhNode>, Vec<u32>) {
    let all = bounds.iter().copied().fold(Bounds::EMPTY, Bounds::union);
    let within = match curve {
        Curve::Whole => all,
        Curve::Cube => Bounds { max: all.min + (all.max - all.min).max_element(), ..all },
    };
    widen::widen(&convert::convert(&build_binary(bounds, within), bounds, widen::height_for(room)), room)
}

fn joined(bounds: &[Bounds]) -> (Vec<BvhNode>, Vec<u32>) {
    let parts = divide(bounds);
    let mut top = Top { nodes: vec![BvhNode::default()], places: vec![Place::default(); parts.len()] };
    top.node(0, boxes_of(bounds, &parts), 0, BVH_STACK as u32);
    let Top { mut nodes, places } = top;
    let built = on_all_cores(parts.len(), |part| {
        let indices = &parts[part];
        let own: Vec<Bounds> = indices.iter().map(|i| bounds[*i as usize]).collect();
        let (nodes, mut order) = subtree(&own, places[part].room, Curve::Cube);
        order.iter_mut().for_each(|i| *i = indices[*i as usize]);
        (nodes, order)
    });
    nodes.reserve_exact(built.iter().map(|(below, _)| below.len() - 1).sum());
    let mut order = Vec::with_capacity(bounds.len());
    for ((below, own), place) in built.into_iter().zip(places) {
        // The root of a part lies beside its siblings, all others behind each other.
        let (before, first) = (nodes.len() as u32 - 1, order.len() as u32);
        nodes[place.root] = below[0].moved(before, first);
        nodes.extend(below[1..].iter().map(|node| node.moved(before, first)));
        order.extend(own);
    }
    (nodes, order)
}

/// Results of `work` for 0 to `count`, in their order.
fn on_all_cores<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let worker = || {
        let taken = std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed)).take_while(|i| *i < count);
        taken.map(|i| (i, work(i))).collect::<Vec<_>>()
    };
    // Not tasks of the pool: while one waits for a pool of its own, its thread would begin others.
    let mut done = thread::scope(|scope| {
        let spawn = |_| thread::Builder::new().spawn_scoped(scope, worker).ok();
        let others: Vec<_> = (1..rayon::current_num_threads().min(count)).filter_map(spawn).collect();
        let mut done = worker();
        others.into_iter().for_each(|other| done.extend(other.join().unwrap_or_else(|panic| resume_unwind(panic))));
        done
    });
    done.sort_by_key(|(i, _)| *i);
    done.into_iter().map(|(_, result)| result).collect()
}

/// The parts, each the indices of its primitives, two or more.
fn divide(bounds: &[Bounds]) -> Vec<Vec<u32>> {
    let all = bounds.par_iter().copied().reduce(|| Bounds::EMPTY, Bounds::union);
    let most = bounds.len().div_ceil(PARTS);
    let area = |i: &u32| bounds[*i as usize].half_area();
    let is_large = |i: &u32| area(i) > LARGE_BOX * all.half_area();
    let (mut large, mut rest): (Vec<u32>, Vec<u32>) = (0..bounds.len() as u32).into_par_iter().partition(is_large);
    large.sort_by(|a, b| area(b).total_cmp(&area(a)));
    let kept = if large.len() < 2 { 0 } else { large.len().min(most) };
    rest.extend(large.drain(kept..));
    let mut parts = split(bounds, rest, most);
    parts.extend((!large.is_empty()).then_some(large));
    parts
}

fn split(bounds: &[Bounds], indices: Vec<u32>, most: usize) -> Vec<Vec<u32>> {
    if indices.len() <= most {
        return vec![indices];
    }
    let [left, right] = halves(bounds, indices);
    let (mut parts, others) = rayon::join(|| split(bounds, left, most), || split(bounds, right, most));
    parts.extend(others);
    parts
}

/// Twice the centre of a box.
fn middle(bounds: &Bounds) -> glam::Vec3 {
    bounds.min + bounds.max
}

/// Divides primitives where the surface area heuristic says, as far as neither side becomes too
/// small, both by a sample of them.
fn halves(bounds: &[Bounds], mut indices: Vec<u32>) -> [Vec<u32>; 2] {
    let step = indices.len().div_ceil(SAMPLE);
    let sample: Vec<Bounds> = indices.iter().step_by(step).map(|i| bounds[*i as usize]).collect();
    let centers = sample.iter().map(middle).fold(Bounds::EMPTY, |all, p| all.union(Bounds { min: p, max: p }));
    let scale = BINS as f32 / (centers.max - centers.min);
    // Not a number without an extent: 0.
    let bin = |b: &Bounds, axis: usize| (((middle(b)[axis] - centers.min[axis]) * scale[axis]) as usize).min(BINS - 1);
    let mut bins = [[(Bounds::EMPTY, 0); BINS]; 3];
    let add = |(all, count): &mut (Bounds, usize), (more, others): (Bounds, usize)| {
        (*all, *count) = (all.union(more), *count + others);
    };
    for b in &sample {
        (0..3).for_each(|axis| add(&mut bins[axis][bin(b, axis)], (*b, 1)));
    }
    let cost = |axis: usize, border: usize| {
        let side = |bins: &[(Bounds, usize)]| {
            let mut sum = (Bounds::EMPTY, 0);
            bins.iter().for_each(|more| add(&mut sum, *more));
            sum
        };
        let sides = [side(&bins[axis][..border]), side(&bins[axis][border..])];
        let large = sides.iter().all(|(_, count)| count * SMALLER_SIDE >= sample.len());
        large.then(|| sides.iter().map(|(all, count)| all.half_area() * *count as f32).sum::<f32>())
    };
    let borders = (0..3).flat_map(|axis| (1..BINS).map(move |border| (axis, border)));
    let costs = borders.filter_map(|(axis, border)| Some((cost(axis, border)?, axis, border)));
    match costs.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((_, axis, border)) => {
            let (left, right) = indices.into_par_iter().partition(|i| bin(&bounds[*i as usize], axis) < border);
            [left, right]
        }
        None => {
            let axis = (centers.max - centers.min).max_position();
            let along = |i: u32| middle(&bounds[i as usize])[axis];
            let half = indices.len() / 2;
            indices.select_nth_unstable_by(half, |a, b| along(*a).total_cmp(&along(*b)).then(a.cmp(b)));
            let right = indices.split_off(half);
            [indices, right]
        }
    }
}

/// A part as the common nodes know it.
#[derive(Clone, Copy)]
struct Entry {
    bounds: Bounds,
    primitives: usize,
    part: usize,
}

fn boxes_of(bounds: &[Bounds], parts: &[Vec<u32>]) -> Vec<Entry> {
    let of_part = |(part, indices): (usize, &Vec<u32>)| Entry {
        bounds: indices.iter().map(|i| bounds[*i as usize]).fold(Bounds::EMPTY, Bounds::union),
        primitives: indices.len(),
        part,
    };
    parts.par_iter().enumerate().map(of_part).collect()
}

/// Place of the root of a part among the nodes, and number of children that a traversal may defer
/// from there on.
#[derive(Clone, Copy, Default)]
struct Place {
    root: usize,
    room: u32,
}

/// The common nodes.
struct Top {
    nodes: Vec<BvhNode>,
    places: Vec<Place>,
}

impl Top {
    /// Writes the node above `entries`, and all common nodes below it.
    fn node(&mut self, at: usize, entries: Vec<Entry>, level: u32, room: u32) {
        let groups = groups(entries, level);
        let room = room - (groups.len() - 1) as u32;
        let boxes: Vec<Bounds> = groups.iter().map(|group| around(group).0).collect();
        let first = self.nodes.len();
        self.nodes[at] = BvhNode::new(&boxes, &[], first as u32, 0);
        self.nodes.resize(first + groups.len(), BvhNode::default());
        for (slot, group) in (first..).zip(groups) {
            match group[..] {
                [Entry { part, .. }] => self.places[part] = Place { root: slot, room },
                _ => self.node(slot, group, level + 1, room),
            }
        }
    }
}

/// Entries that fit below a common node of that level.
const fn capacity(level: u32) -> usize {
    WIDTH.pow(LEVELS - level)
}

/// The contents of the children of a node: the group of the largest area is divided while there is
/// room; evenly where that would lead too deep.
fn groups(entries: Vec<Entry>, level: u32) -> Vec<Vec<Entry>> {
    let divided = |halve: fn(Vec<Entry>) -> [Vec<Entry>; 2]| {
        let mut groups = vec![entries.clone()];
        while groups.len() < WIDTH {
            let many = (0..groups.len()).filter(|i| groups[*i].len() > 1);
            let area = |i: &usize| around(&groups[*i]).0.half_area();
            let Some(largest) = many.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
            let halves = halve(std::mem::take(&mut groups[largest]));
            groups.splice(largest..=largest, halves);
        }
        groups
    };
    let groups = divided(|group| halved(group, false));
    if groups.iter().all(|group| group.len() == 1 || group.len() <= capacity(level + 1)) {
        return groups;
    }
    let halves = halved(entries, true);
    halves.into_iter().flat_map(|half| if half.len() > 1 { halved(half, true).to_vec() } else { vec![half] }).collect()
}

/// Box around entries, and their primitives.
fn around(entries: &[Entry]) -> (Bounds, usize) {
    let add = |(all, count): (Bounds, usize), entry: &Entry| (all.union(entry.bounds), count + entry.primitives);
    entries.iter().fold((Bounds::EMPTY, 0), add)
}

/// Two or more entries divided where the surface area heuristic says, or in the middle.
fn halved(entries: Vec<Entry>, evenly: bool) -> [Vec<Entry>; 2] {
    let borders = if evenly { entries.len() / 2..entries.len() / 2 + 1 } else { 1..entries.len() };
    let along = |axis: usize| {
        let mut sorted = entries.clone();
        sorted.sort_by(|a, b| middle(&a.bounds)[axis].total_cmp(&middle(&b.bounds)[axis]));
        sorted
    };
    let sorted = [0, 1, 2].map(along);
    let cost = |(axis, border): &(usize, usize)| {
        let (left, right) = sorted[*axis].split_at(*border);
        [left, right].map(around).iter().map(|(all, count)| all.half_area() * *count as f32).sum::<f32>()
    };
    let choices = (0..3).flat_map(|axis| borders.clone().map(move |border| (axis, border)));
    let best = choices.min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let (axis, border) = best.unwrap_or((0, entries.len() / 2));
    let mut left = sorted[axis].clone();
    let right = left.split_off(border);
    [left, right]
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn boxes_in_one_place_are_divided_too() {
        let parts = divide(&vec![Bounds { min: Vec3::ZERO, max: Vec3::ONE }; LARGE + 7]);
        let mut all = parts.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..LARGE as u32 + 7));
        assert!(parts.iter().all(|part| part.len() > 1 && part.len() <= LARGE / PARTS + 1), "{}", parts.len());
    }
}
