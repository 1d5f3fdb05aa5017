//! Complete binary trees: items are halved until few are left, and node i has the children 2 i + 1
//! and 2 i + 2.

use rayon::prelude::*;

use super::Bounds;

/// Items of a leaf at most.
const LEAF: usize = 8;

/// A tree with a value for each node.
#[derive(Debug)]
pub(crate) struct CompleteTree<N> {
    pub nodes: Vec<N>,
    /// Indices of items in the order of the leaves.
    order: Vec<u32>,
    levels: u32,
}

/// What a visit comes to, and is told about.
pub(crate) enum Visit<'a, N> {
    /// A node by its index: whether to go below it.
    Node(usize, &'a N),
    /// The items of a leaf: whether to go on.
    Leaf(&'a [u32]),
}

impl<N: Send> CompleteTree<N> {
    /// The tree over items. `node` gives the value of a node by its items, `divide` orders items so
    /// that the lower half of them come first, `index` gives that of an item.
    pub fn new<T: Send>(
        mut items: Vec<T>,
        node: impl Fn(&[T]) -> N + Sync,
        divide: impl Fn(&mut [T], &N) + Sync,
        index: impl Fn(&T) -> u32,
    ) -> Self {
        let levels = items.len().div_ceil(LEAF).max(1).next_power_of_two().ilog2();
        let mut nodes = Vec::new();
        let mut parts = if items.is_empty() { Vec::new() } else { vec![items.as_mut_slice()] };
        for level in 0..=levels {
            let divided = parts.par_iter_mut().map(|part| {
                let value = node(part);
                if level < levels {
                    divide(part, &value);
                }
                value
            });
            nodes.par_extend(divided);
            let halves = |part| {
                let part: &mut [T] = part;
                let (low, high) = part.split_at_mut(part.len() / 2);
                [low, high]
            };
            parts = if level < levels { parts.into_iter().flat_map(halves).collect() } else { Vec::new() };
        }
        Self { nodes, order: items.iter().map(index).collect(), levels }
    }

    /// The items of a node that is a leaf.
    fn leaf(&self, node: usize) -> Option<&[u32]> {
        let number = (node + 1).checked_sub(1 << self.levels)?;
        let (mut from, mut to) = (0, self.order.len());
        for level in (0..self.levels).rev() {
            let middle = from + (to - from) / 2;
            if number >> level & 1 == 0 { to = middle } else { from = middle }
        }
        Some(&self.order[from..to])
    }

    /// Goes through the tree as `visit` says.
    pub fn visit(&self, mut visit: impl FnMut(Visit<'_, N>) -> bool) {
        let mut waiting = vec![0];
        while let Some(index) = waiting.pop() {
            let Some(node) = self.nodes.get(index) else { continue };
            if !visit(Visit::Node(index, node)) {
                continue;
            }
            match self.leaf(index) {
                Some(items) if !visit(Visit::Leaf(items)) => return,
                Some(_) => {}
                None => waiting.extend([2 * index + 2, 2 * index + 1]),
            }
        }
    }

    /// The leaf of each of `count` items.
    pub fn leaves(&self, count: usize) -> Vec<usize> {
        let mut of = vec![usize::MAX; count];
        for node in (1 << self.levels) - 1..self.nodes.len() {
            self.leaf(node).unwrap_or_default().iter().for_each(|item| of[*item as usize] = node);
        }
        of
    }
}

impl CompleteTree<Bounds> {
    /// The tree over boxes.
    pub fn of_boxes(boxes: &[Bounds]) -> Self {
        // Boxes may have no end.
        let middle = |b: &Bounds| (0.5 * b.min + 0.5 * b.max).map(|x| if x.is_finite() { x } else { 0.0 });
        let all = |items: &[(u32, Bounds)]| items.iter().map(|(_, b)| *b).fold(Bounds::EMPTY, Bounds::union);
        let divide = |items: &mut [(u32, Bounds)], _: &Bounds| {
            let middles = items.iter().map(|(_, b)| middle(b));
            let around = Bounds::around(middles);
            let size = around.max - around.min;
            let axis = size.max_position();
            let key = |item: &(u32, Bounds)| middle(&item.1)[axis];
            items.select_nth_unstable_by(items.len() / 2, |a, b| key(a).total_cmp(&key(b)).then(a.0.cmp(&b.0)));
        };
        Self::new(boxes.iter().copied().zip(0..).map(|(b, i)| (i, b)).collect(), all, divide, |item| item.0)
    }

    /// Calls `found` for each item in a leaf whose box meets another one, until it says no.
    pub fn near(&self, bounds: &Bounds, mut found: impl FnMut(usize) -> bool) {
        self.visit(|visit| match visit {
            Visit::Node(_, node) => node.touches(bounds),
            Visit::Leaf(items) => items.iter().all(|item| found(*item as usize)),
        });
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;

    #[test]
    fn all_that_meets_a_box_is_found() {
        let boxes: Vec<Bounds> = (0..1000_u32)
            .map(|i| {
                let min = vec3((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32);
                Bounds { min, max: min + 0.5 }
            })
            .chain([Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY }])
            .collect();
        for count in [0, 1, 8, 9, 63, 64, 65, 1001] {
            let boxes = &boxes[1001 - count..];
            let tree = CompleteTree::of_boxes(boxes);
            let asked = Bounds { min: vec3(2.4, 3.4, 7.4), max: vec3(5.1, 3.6, 9.9) };
            let (mut found, mut looked_at) = (Vec::new(), 0);
            tree.near(&asked, |i| {
                looked_at += 1;
                if boxes[i].touches(&asked) {
                    found.push(i);
                }
                true
            });
            found.sort_unstable();
            let right: Vec<usize> = (0..count).filter(|i| boxes[*i].touches(&asked)).collect();
            assert_eq!(found, right);
            assert!(count < 1000 || looked_at < count / 4, "{looked_at} of {count}");
            let leaves = tree.leaves(count);
            assert!(leaves.iter().all(|leaf| *leaf < tree.nodes.len()));
        }
    }
}
