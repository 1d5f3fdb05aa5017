//! Trees of lights, by which direct light chooses one for each point that it lights, in proportion
//! to what it may give there (Pharr et al. 2023, "Physically Based Rendering", section 12.6.3,
//! after Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting"). `shaders/lib/transport/light_tree.wesl` descends them.

use glam::Vec3;

use super::light_bounds::LightBounds;
use crate::{
    layout::{LEAF_BIT, LIGHT_ROOTS, LightNode, NEXT_MASK, NO_LEAF, SUMMED_ROOT},
    scene::Bounds,
};

/// Roots of directional lights, and of few points and spots.
pub const DIRECTIONAL_ROOT: u32 = SUMMED_ROOT;
pub const PUNCTUAL_ROOT: u32 = SUMMED_ROOT + 1;
/// Number of trees from which visible points always choose, the first ones.
pub const EMITTER_ROOTS: u32 = SUMMED_ROOT;
/// Intervals along an axis between which lights are divided.
const BUCKETS: usize = 12;
/// Depth from which on lights are divided in halves, so that no descent is longer than this and the
/// binary logarithm of their number.
const MAX_UNEVEN_DEPTH: u32 = 32;
/// Number of lights from which on both halves are built at once.
const PARALLEL: usize = 1 << 12;

/// The trees of a scene. Their roots are the first [`LIGHT_ROOTS`] nodes; a root of intensity 0 has
/// no lights.
#[derive(Clone, Debug, Default)]
pub struct LightTrees {
    pub nodes: Vec<LightNode>,
    /// The leaf of each light, [`NO_LEAF`] for lights that are never chosen.
    pub leaves: Vec<u32>,
    /// The root of each light's tree.
    pub roots: Vec<u32>,
}

/// A light with its bounds.
#[derive(Clone, Copy)]
struct Item {
    bounds: LightBounds,
    light: u32,
}

/// A subtree.
struct Subtree {
    /// Its uppermost node, which the caller stores.
    node: LightNode,
    bounds: LightBounds,
}

impl LightTrees {
    /// Trees over the lights that have bounds; `roots` says which tree each light belongs to.
    pub(super) fn new(bounds: &[Option<LightBounds>], roots: Vec<u32>) -> Self {
        let mut trees: Vec<Vec<Item>> = vec![Vec::new(); LIGHT_ROOTS as usize];
        for (light, (bounds, root)) in (0..).zip(bounds.iter().zip(&roots)) {
            trees[*root as usize].extend(bounds.map(|bounds| Item { bounds, light }));
        }
        // A tree of n leaves has n − 1 pairs of children.
        let pairs: usize = trees.iter().map(|items| items.len().saturating_sub(1)).sum();
        let mut nodes = vec![LightNode::default(); LIGHT_ROOTS as usize + 2 * pairs];
        let (tops, mut below) = nodes.split_at_mut(LIGHT_ROOTS as usize);
        let mut first = LIGHT_ROOTS;
        for (top, items) in tops.iter_mut().zip(&mut trees) {
            if items.is_empty() {
                *top = LightNode { shine: [0, 0, 0, LEAF_BIT], ..Default::default() };
                continue;
            }
            let (own, others) = std::mem::take(&mut below).split_at_mut(2 * (items.len() - 1));
            let count = own.len() as u32;
            *top = subtree(items, own, first, 0).node;
            first += count;
            below = others;
        }
        let mut leaves = vec![NO_LEAF; bounds.len()];
        let is_light = |node: &LightNode| node.is_leaf() && node.intensity() > 0.0;
        for (index, node) in (0..).zip(&nodes).filter(|(_, node)| is_light(node)) {
            leaves[(node.next() & NEXT_MASK) as usize] = index;
        }
        Self { nodes, leaves, roots }
    }
}

/// Builds the tree of `items`, the nodes below its uppermost one in `slots`, the first of which has
/// the index `first`. Children are pairs of neighbours. What is below the first child comes before
/// what is below the second, by which kernels find the way to a leaf.
fn subtree(items: &mut [Item], slots: &mut [LightNode], first: u32, depth: u32) -> Subtree {
    if let [item] = items {
        return Subtree { node: item.bounds.node(item.light | LEAF_BIT), bounds: item.bounds };
    }
    let is_large = items.len() > PARALLEL;
    let count = divide(items, depth);
    let (nearer, others) = items.split_at_mut(count);
    let (pair, slots) = slots.split_at_mut(2);
    let (own, rest) = slots.split_at_mut(2 * (count - 1));
    let second = first + 2 + own.len() as u32;
    let mut left = || subtree(nearer, own, first + 2, depth + 1);
    let mut right = || subtree(others, rest, second, depth + 1);
    let (left, right) = if is_large { rayon::join(left, right) } else { (left(), right()) };
    (pair[0], pair[1]) = (left.node, right.node);
    let bounds = left.bounds.union(right.bounds).about_mean(items.iter().map(|item| &item.bounds));
    Subtree { node: bounds.node(first), bounds }
}

/// Reorders the items into two groups and returns the size of the first, at least 1 and less than
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
        // Thin groups are costly (12.6.3, `Kr`).
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
    let fraction = (item.bounds.middle()[axis] - middles.min[axis]) / (middles.max[axis] - middles.min[axis]);
    ((fraction * BUCKETS as f32) as usize).min(BUCKETS - 1)
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

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;
    use crate::layout::{EMITTER_ROOT, Light, POINT_LIGHT, TRIANGLE_LIGHT};

    fn light(position: Vec3, kind: u32) -> Light {
        let edges = [[0.01, 0.0, 0.02], [0.0, 0.03, 0.0]];
        Light { position: position.to_array(), kind, e1: edges[0], e2: edges[1], ..Default::default() }
    }

    fn trees(lights: &[Light], intensity: impl Fn(usize) -> f64) -> LightTrees {
        let bounds = |(i, light): (usize, &Light)| LightBounds::new(light, intensity(i));
        let bounds: Vec<_> = lights.iter().enumerate().map(bounds).collect();
        LightTrees::new(&bounds, vec![EMITTER_ROOT; lights.len()])
    }

    fn half_of(node: &LightNode) -> Vec3 {
        let steps = [16, 8, 0].map(|shift| ((node.half >> shift) & 255) as f32);
        f32::from_bits((node.half >> 24) << 23) * Vec3::from_array(steps)
    }

    /// The greatest depth of a tree, whose nodes must be within their parents.
    fn depth_of(trees: &LightTrees) -> u32 {
        let mut open = vec![(EMITTER_ROOT as usize, 0)];
        let (mut deepest, mut seen) = (0, 0);
        while let Some((at, depth)) = open.pop() {
            let node = trees.nodes[at];
            seen += 1;
            deepest = deepest.max(depth);
            if node.is_leaf() {
                continue;
            }
            let first = (node.next() & NEXT_MASK) as usize;
            let center = Vec3::from_array(node.center);
            for child in &trees.nodes[first..first + 2] {
                let apart = (Vec3::from_array(child.center) - center).abs();
                // Extents are rounded up to 1/128 of the largest.
                let (inner, outer) = (half_of(child), half_of(&node));
                let slack = outer.max_element() / 60.0 + 1e-5;
                assert!((apart + inner).cmple(outer + slack).all(), "{child:?} in {node:?}");
            }
            let sum: f32 = trees.nodes[first..first + 2].iter().map(LightNode::intensity).sum();
            assert!((sum - node.intensity()).abs() <= 1e-5 * sum);
            open.extend([(first, depth + 1), (first + 1, depth + 1)]);
        }
        assert_eq!(seen + LIGHT_ROOTS as usize - 1, trees.nodes.len(), "every node is in the tree");
        deepest
    }

    #[test]
    fn every_light_that_shines_has_one_leaf() {
        let position = |i: usize| vec3((i as f32 * 0.7).sin(), (i as f32 * 1.3).cos(), i as f32 * 0.01);
        let kind = |i: usize| if i.is_multiple_of(2) { TRIANGLE_LIGHT } else { POINT_LIGHT };
        let lights: Vec<Light> = (0..20_000).map(|i| light(position(i), kind(i))).collect();
        let all = trees(&lights, |i| if i % 5 == 0 { 0.0 } else { 1.0 + i as f64 });
        assert!(depth_of(&all) < MAX_UNEVEN_DEPTH);
        for (i, leaf) in all.leaves.iter().enumerate() {
            assert_eq!(*leaf == NO_LEAF, i % 5 == 0, "light {i}");
            assert!(*leaf == NO_LEAF || all.nodes[*leaf as usize].next() & NEXT_MASK == i as u32);
        }
        let again = trees(&lights, |i| if i % 5 == 0 { 0.0 } else { 1.0 + i as f64 });
        assert_eq!(all.nodes, again.nodes, "threads leave no trace");
        let other = trees(&lights, |i| 1.0 + i as f64);
        assert_ne!(all.nodes, other.nodes, "control");
    }

    #[test]
    fn no_arrangement_of_lights_makes_a_deep_tree() {
        let halving: Vec<Light> = (0..120).map(|i| light(Vec3::X * 0.5_f32.powi(i), POINT_LIGHT)).collect();
        let alike = vec![light(Vec3::ONE, POINT_LIGHT); 100_000];
        let line: Vec<Light> = (0..5000).map(|i| light(Vec3::X * i as f32, POINT_LIGHT)).collect();
        for lights in [halving, alike, line] {
            let depth = depth_of(&trees(&lights, |_| 1.0));
            assert!(depth <= MAX_UNEVEN_DEPTH + lights.len().ilog2() + 1, "{depth} for {}", lights.len());
        }
    }

    #[test]
    fn dark_lights_and_none_have_no_tree() {
        for lights in [vec![], vec![light(Vec3::ZERO, POINT_LIGHT); 1000]] {
            let none = trees(&lights, |_| 0.0);
            assert!(none.nodes.len() == LIGHT_ROOTS as usize && none.nodes.iter().all(|node| node.intensity() == 0.0));
        }
    }
}
