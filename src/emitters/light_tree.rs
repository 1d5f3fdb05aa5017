//! Trees of lights, by which direct light chooses one for each point that it lights, in proportion
//! to what it may give there (Pharr et al. 2023, "Physically Based Rendering", section 12.6.3,
//! after Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting"). `shaders/lib/transport/light_tree.wesl` descends them.

use glam::Vec3;

use super::light_bounds::LightBounds;
use crate::{
    layout::{LEAF_BIT, LIGHT_ROOTS, LightNode, NO_LEAF},
    scene::Bounds,
};

/// Intervals along an axis between which lights are divided.
const BUCKETS: usize = 12;
/// Depth from which on lights are divided in halves, so that no descent is longer than this and the
/// binary logarithm of their number.
const MAX_UNEVEN_DEPTH: u32 = 32;
/// Number of lights from which on both parts are built at once.
const PARALLEL: usize = 1 << 12;

/// The trees of a scene. Their roots are the first [`LIGHT_ROOTS`] nodes; a root of intensity 0 has
/// no lights.
#[derive(Clone, Debug, Default)]
pub struct LightTrees {
    pub nodes: Vec<LightNode>,
    /// The leaf of each light, [`NO_LEAF`] for lights that are never chosen.
    pub leaves: Vec<u32>,
}

/// A light with its bounds.
#[derive(Clone, Copy)]
struct Item {
    bounds: LightBounds,
    light: u32,
}

/// A part of a tree.
struct Subtree {
    /// Its uppermost node, which the caller puts in its place.
    node: LightNode,
    bounds: LightBounds,
}

/// Place of a node: its index and its parent's, and that of the first node below it.
#[derive(Clone, Copy)]
struct Place {
    own: u32,
    parent: u32,
    below: u32,
}

impl LightTrees {
    /// Trees over the lights that have bounds. `root` says in which one each light is.
    pub(super) fn new(bounds: &[Option<LightBounds>], root: impl Fn(usize) -> u32) -> Self {
        let mut trees: Vec<Vec<Item>> = vec![Vec::new(); LIGHT_ROOTS as usize];
        for (i, bounds) in bounds.iter().enumerate() {
            if let Some(bounds) = *bounds {
                trees[root(i) as usize].push(Item { bounds, light: i as u32 });
            }
        }
        // A tree of n leaves has n − 1 pairs of children.
        let pairs: usize = trees.iter().map(|items| items.len().saturating_sub(1)).sum();
        let mut nodes = vec![LightNode::default(); LIGHT_ROOTS as usize + 2 * pairs];
        let (roots, mut below) = nodes.split_at_mut(LIGHT_ROOTS as usize);
        let mut first = LIGHT_ROOTS;
        for (own, items) in (0..LIGHT_ROOTS).zip(&mut trees) {
            if items.is_empty() {
                roots[own as usize] = LightNode { next: LEAF_BIT, ..Default::default() };
                continue;
            }
            let (these, others) = std::mem::take(&mut below).split_at_mut(2 * (items.len() - 1));
            roots[own as usize] = subtree(items, these, Place { own, parent: own, below: first }, 0).node;
            first += these.len() as u32;
            below = others;
        }
        let mut leaves = vec![NO_LEAF; bounds.len()];
        for (index, node) in (0..).zip(&nodes) {
            if node.intensity > 0.0 && node.next & LEAF_BIT != 0 {
                leaves[node.light() as usize] = index;
            }
        }
        Self { nodes, leaves }
    }
}

/// Builds the tree of `items`, the nodes below its uppermost one in `slots`. Children are pairs of
/// neighbours; those of the first child come before those of the second.
fn subtree(items: &mut [Item], slots: &mut [LightNode], place: Place, depth: u32) -> Subtree {
    if let [item] = items {
        return Subtree { node: item.bounds.node(item.light | LEAF_BIT, place.parent), bounds: item.bounds };
    }
    let count = divide(items, depth);
    let (first, second) = items.split_at_mut(count);
    let (pair, slots) = slots.split_at_mut(2);
    let (of_first, of_second) = slots.split_at_mut(2 * (count - 1));
    let [own, below] = [place.below, place.below + 2];
    let places = [(own, below), (own + 1, below + of_first.len() as u32)];
    let [one, two] = places.map(|(own, below)| Place { own, parent: place.own, below });
    let is_large = first.len() + second.len() > PARALLEL;
    let mut build_first = || subtree(first, of_first, one, depth + 1);
    let mut build_second = || subtree(second, of_second, two, depth + 1);
    let (first, second) =
        if is_large { rayon::join(build_first, build_second) } else { (build_first(), build_second()) };
    (pair[0], pair[1]) = (first.node, second.node);
    let bounds = first.bounds.union(second.bounds);
    Subtree { node: bounds.node(place.below, place.parent), bounds }
}

/// Reorders the items into two parts and returns the size of the first, at least 1 and less than
/// all: the division between buckets along an axis that costs least.
fn divide(items: &mut [Item], depth: u32) -> usize {
    let half = items.len() / 2;
    if items.len() == 2 || depth >= MAX_UNEVEN_DEPTH {
        return half;
    }
    let around = |middle: Vec3| Bounds { min: middle, max: middle };
    let middles = items.iter().map(|item| around(item.bounds.middle())).fold(Bounds::EMPTY, Bounds::union);
    let extent = middles.max - middles.min;
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|axis| extent[*axis] > 0.0) {
        // Thin parts are costly (12.6.3, `Kr`).
        let thinness = extent.max_element() / extent[axis];
        for (cost, bucket) in division_costs(items, axis, &middles) {
            if best.is_none_or(|(least, ..)| thinness * cost < least) {
                best = Some((thinness * cost, axis, bucket));
            }
        }
    }
    let Some((_, axis, bucket)) = best else { return half };
    let count = partition(items, |item| bucket_of(item, axis, &middles) <= bucket);
    if count == 0 || count == items.len() { half } else { count }
}

/// Cost of each division behind a bucket that has items on both sides.
fn division_costs(items: &[Item], axis: usize, middles: &Bounds) -> Vec<(f32, usize)> {
    let mut buckets = [None::<LightBounds>; BUCKETS];
    for item in items {
        let bucket = &mut buckets[bucket_of(item, axis, middles)];
        *bucket = Some(bucket.map_or(item.bounds, |bounds| bounds.union(item.bounds)));
    }
    let join = |sum: &mut Option<LightBounds>, bucket: &Option<LightBounds>| {
        *sum = match (*sum, *bucket) {
            (Some(sum), Some(bucket)) => Some(sum.union(bucket)),
            (sum, bucket) => sum.or(bucket),
        };
        Some(sum.map(|bounds| bounds.cost()))
    };
    let before: Vec<Option<f32>> = buckets.iter().scan(None, join).collect();
    let mut behind: Vec<Option<f32>> = buckets.iter().rev().scan(None, join).collect();
    behind.reverse();
    (0..BUCKETS - 1).filter_map(|i| Some((before[i]? + behind[i + 1]?, i))).collect()
}

fn bucket_of(item: &Item, axis: usize, middles: &Bounds) -> usize {
    let part = (item.bounds.middle()[axis] - middles.min[axis]) / (middles.max[axis] - middles.min[axis]);
    ((part * BUCKETS as f32) as usize).min(BUCKETS - 1)
}

/// Moves items that are `first` to the front, and returns their number.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut count = 0;
    for i in 0..items.len() {
        if first(&items[i]) {
            items.swap(i, count);
            count += 1;
        }
    }
    count
}
