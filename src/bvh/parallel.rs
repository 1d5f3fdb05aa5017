//! The tree of a scene, on all cores if it is large: primitives are divided into parts, whose trees
//! are built each by one thread and joined below common nodes.
//!
//! Parts follow from the primitives alone, so that the tree is the same on any number of threads.
//! Large primitives, as the walls around a fine mesh, are leaves among the parts, for they would
//! make any of these much larger.

use std::{
    ops::Range,
    panic::resume_unwind,
    sync::atomic::{AtomicU64, AtomicUsize, Ordering},
    thread,
};

use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use super::{
    BvhChild, MAX_LEAF,
    binary::build_binary,
    convert::{Binary, MAX_HEIGHT, convert, height},
};
use crate::{
    error::Result,
    layout::even_height,
    progress::{Progress, Stage},
    scene::Bounds,
};

/// Number of primitives from which on they are divided.
pub(super) const LARGE: usize = 100_000;
/// A part has at most this fraction of the primitives, and each side of a division about a third of
/// what is divided at least: there are hardly more than three times as many parts.
const PARTS: usize = 32;
const SMALLER_SIDE: usize = 3;
/// Fraction of the area of the scene's box from which on a primitive's box is large, and maximum
/// number of those that are in no part.
const LARGE_BOX: f32 = 1.0 / 128.0;
const MAX_APART: usize = 256;
/// Intervals along an axis between which primitives are divided.
const BINS: usize = 32;
/// Levels of the common nodes at most.
const LEVELS: u32 = 11;
const _: () = assert!(2 * PARTS * SMALLER_SIDE + MAX_APART < capacity(0));
/// Primitives that decide about a division.
const SAMPLE: usize = 1 << 15;

/// Progress of all trees of a scene.
pub(super) struct Watch<'a> {
    progress: &'a dyn Progress,
    done: AtomicU64,
    primitives: u64,
}

impl<'a> Watch<'a> {
    pub(super) fn new(progress: &'a dyn Progress, primitives: usize) -> Self {
        Self { progress, done: AtomicU64::new(0), primitives: primitives as u64 }
    }

    /// The tree over a part of the primitives is there.
    fn add(&self, primitives: usize) {
        let primitives = primitives as u64;
        let done = self.done.fetch_add(primitives, Ordering::Relaxed) + primitives;
        self.progress.report(Stage::Bvh, done.min(self.primitives), self.primitives);
    }
}

/// The tree over two or more boxes, of `limit` levels at most.
pub(super) fn tree(bounds: &[Bounds], limit: u32, watch: &Watch<'_>) -> Result<Binary> {
    watch.progress.check()?;
    let is_low = LEVELS + even_height(bounds.len().div_ceil(PARTS)) <= limit;
    if bounds.len() < LARGE || !is_low { Ok(part(bounds, limit, Curve::Whole)) } else { joined(bounds, limit, watch) }
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

/// The tree by one thread, of `height` levels at most.
pub(super) fn part(bounds: &[Bounds], height: u32, curve: Curve) -> Binary {
    let all = bounds.iter().copied().fold(Bounds::EMPTY, Bounds::union);
    let within = match curve {
        Curve::Whole => all,
        Curve::Cube => Bounds { max: all.min + (all.max - all.min).max_element(), ..all },
    };
    convert(&build_binary(bounds, within, MAX_LEAF), bounds, height)
}

fn joined(bounds: &[Bounds], limit: u32, watch: &Watch<'_>) -> Result<Binary> {
    let (parts, apart) = divide(bounds);
    let of = |indices: &[u32], height: u32| {
        let own: Vec<Bounds> = indices.iter().map(|i| bounds[*i as usize]).collect();
        let mut tree = part(&own, height, Curve::Cube);
        tree.order.iter_mut().for_each(|i| *i = indices[*i as usize]);
        tree
    };
    let apart = if apart.is_empty() { Binary { nodes: Vec::new(), order: Vec::new() } } else { of(&apart, MAX_HEIGHT) };
    let leaves = apart.nodes.iter().flatten().filter(|child| child.count > 0);
    let mut all = entries(bounds, &parts);
    all.extend(leaves.map(|leaf| Entry {
        bounds: leaf.bounds,
        primitives: leaf.count as usize,
        content: Content::Leaf(*leaf),
    }));
    let Top { mut nodes, places } = Top::new(&all, parts.len());
    let built = on_all_cores(parts.len(), |i| {
        watch.progress.check()?;
        let tree = of(&parts[i], limit - places[i].depth);
        watch.add(parts[i].len());
        Ok(tree)
    });
    let built: Vec<Binary> = built.into_iter().collect::<Result<_>>()?;
    nodes.reserve_exact(built.iter().map(|tree| tree.nodes.len()).sum());
    let mut order = apart.order;
    order.reserve_exact(bounds.len() - order.len());
    for (tree, place) in built.into_iter().zip(places) {
        let (before, first) = (nodes.len() as u32, order.len() as u32);
        let moved =
            |child: BvhChild| BvhChild { first: child.first + if child.count > 0 { first } else { before }, ..child };
        nodes[place.parent][place.side].first = before;
        nodes.extend(tree.nodes.into_iter().map(|children| children.map(moved)));
        order.extend(tree.order);
    }
    Ok(Binary { nodes, order })
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

/// The parts, each the indices of two or more primitives, and the large primitives that are in
/// none: two or more, or none.
fn divide(bounds: &[Bounds]) -> (Vec<Vec<u32>>, Vec<u32>) {
    let all = bounds.par_iter().copied().reduce(|| Bounds::EMPTY, Bounds::union);
    let area = |i: &u32| bounds[*i as usize].half_area();
    let is_large = |i: &u32| area(i) > LARGE_BOX * all.half_area();
    let (mut apart, mut rest): (Vec<u32>, Vec<u32>) = (0..bounds.len() as u32).into_par_iter().partition(is_large);
    apart.sort_by(|a, b| area(b).total_cmp(&area(a)));
    let kept = if apart.len() < 2 { 0 } else { apart.len().min(MAX_APART) };
    rest.extend(apart.drain(kept..));
    (split(bounds, rest, bounds.len().div_ceil(PARTS)), apart)
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
    let centers = Bounds::around(sample.iter().map(middle));
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

/// A part, by its index, or a leaf of large primitives.
#[derive(Clone, Copy)]
enum Content {
    Part(usize),
    Leaf(BvhChild),
}

/// What lies below the common nodes.
#[derive(Clone, Copy)]
struct Entry {
    bounds: Bounds,
    primitives: usize,
    content: Content,
}

fn entries(bounds: &[Bounds], parts: &[Vec<u32>]) -> Vec<Entry> {
    let of_part = |(part, indices): (usize, &Vec<u32>)| Entry {
        bounds: indices.iter().map(|i| bounds[*i as usize]).fold(Bounds::EMPTY, Bounds::union),
        primitives: indices.len(),
        content: Content::Part(part),
    };
    parts.par_iter().enumerate().map(of_part).collect()
}

/// The child of a common node that a part is, and the number of common nodes above it.
#[derive(Clone, Copy, Default)]
struct Place {
    parent: usize,
    side: usize,
    depth: u32,
}

/// The common nodes.
struct Top {
    nodes: Vec<[BvhChild; 2]>,
    places: Vec<Place>,
}

impl Top {
    /// The nodes above all entries, as the builder of the parts arranges them if that is not too
    /// high.
    fn new(entries: &[Entry], parts: usize) -> Self {
        let boxes: Vec<Bounds> = entries.iter().map(|entry| entry.bounds).collect();
        let all = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union);
        let tree = build_binary(&boxes, all, 1);
        let mut top = Self { nodes: Vec::new(), places: vec![Place::default(); parts] };
        if height(&tree) <= LEVELS as usize {
            top.copy(&tree, entries, 0, 0);
        } else {
            top.node(entries.to_vec(), 0);
        }
        top
    }

    /// Appends an interior node of a tree over the entries, and all below it.
    fn copy(&mut self, tree: &Bvh2, entries: &[Entry], index: u32, depth: u32) -> usize {
        let first = tree.nodes[index as usize].first_index;
        let parent = self.push();
        for side in 0..2 {
            let node = &tree.nodes[first as usize + side];
            if node.is_leaf() {
                let entry = entries[tree.primitive_indices[node.first_index as usize] as usize];
                self.put(entry, Place { parent, side, depth: depth + 1 });
            } else {
                let child = self.copy(tree, entries, first + side as u32, depth + 1);
                let [left, right] = self.nodes[child].map(|below| below.bounds);
                self.nodes[parent][side] = BvhChild { bounds: left.union(right), first: child as u32, count: 0 };
            }
        }
        parent
    }

    fn push(&mut self) -> usize {
        self.nodes.push([BvhChild { bounds: Bounds::EMPTY, first: 0, count: 0 }; 2]);
        self.nodes.len() - 1
    }

    /// Makes an entry a child of a node.
    fn put(&mut self, entry: Entry, place: Place) {
        let child = match entry.content {
            Content::Part(part) => {
                self.places[part] = place;
                BvhChild { bounds: entry.bounds, first: 0, count: 0 }
            }
            Content::Leaf(leaf) => leaf,
        };
        self.nodes[place.parent][place.side] = child;
    }

    /// Appends the node above two or more entries, and all common nodes below it.
    fn node(&mut self, entries: Vec<Entry>, depth: u32) -> usize {
        let most = capacity(depth + 1);
        let mut halves = halved(&entries, 1..entries.len());
        if halves.iter().any(|half| half.len() > most) {
            halves = halved(&entries, entries.len() / 2..entries.len() / 2 + 1);
        }
        let parent = self.push();
        for (side, half) in halves.into_iter().enumerate() {
            match half[..] {
                [entry] => self.put(entry, Place { parent, side, depth: depth + 1 }),
                _ => {
                    let bounds = around(&half).0;
                    let first = self.node(half, depth + 1) as u32;
                    self.nodes[parent][side] = BvhChild { bounds, first, count: 0 };
                }
            }
        }
        parent
    }
}

/// Entries that fit below a common node at that depth.
const fn capacity(depth: u32) -> usize {
    1 << (LEVELS - depth)
}

/// Box around entries, and their primitives.
fn around(entries: &[Entry]) -> (Bounds, usize) {
    let add = |(all, count): (Bounds, usize), entry: &Entry| (all.union(entry.bounds), count + entry.primitives);
    entries.iter().fold((Bounds::EMPTY, 0), add)
}

/// Two or more entries divided where the surface area heuristic says, at one of the `borders`
/// between them in the order along an axis.
fn halved(entries: &[Entry], borders: Range<usize>) -> [Vec<Entry>; 2] {
    let along = |axis: usize| {
        let mut sorted = entries.to_vec();
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
    let (axis, border) = best.unwrap_or((0, borders.start));
    let (left, right) = sorted[axis].split_at(border);
    [left.to_vec(), right.to_vec()]
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn boxes_in_one_place_are_divided_too() {
        let (parts, apart) = divide(&vec![Bounds { min: Vec3::ZERO, max: Vec3::ONE }; LARGE + 7]);
        let mut all = [parts.concat(), apart].concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..LARGE as u32 + 7));
        assert!(parts.iter().all(|part| part.len() > 1 && part.len() <= LARGE / PARTS + 1), "{}", parts.len());
    }
}
