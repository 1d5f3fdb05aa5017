//! Conversion of a binary tree of any depth to one of a limited number of levels, whose nodes store
//! the boxes of both children.

use obvhs::bvh2::Bvh2;

use super::{BvhChild, MAX_LEAF};
use crate::layout::even_height;
use crate::scene::Bounds;

/// Maximum height of the tree of a whole scene: interior nodes on the longest path from the root.
pub(super) const MAX_HEIGHT: u32 = 32;

/// A binary tree. [`BvhChild::first`] of a leaf is an index into `order`.
pub(super) struct Binary {
    /// Nodes, parents before children. Node 0 is the root.
    pub nodes: Vec<[BvhChild; 2]>,
    /// Primitive indices in leaf order.
    pub order: Vec<u32>,
}

/// Converts `tree`, which holds at least two primitives with the given bounds, to one of at most
/// `limit` levels.
pub(super) fn convert(tree: &Bvh2, bounds: &[Bounds], limit: u32) -> Binary {
    let made = Binary { nodes: Vec::new(), order: Vec::with_capacity(bounds.len()) };
    let mut converter = Converter { tree, bounds, limit, subtrees: measure(tree), made };
    let root = converter.tree_node(0, 0);
    if root.count > 0 {
        // All primitives fit in one leaf, but the root needs two children.
        let mut all = std::mem::take(&mut converter.made.order);
        converter.even_halves(&mut all, 0);
    }
    converter.made
}

/// Size of a subtree.
#[derive(Clone, Copy, Default)]
struct Subtree {
    primitives: u32,
    /// Interior nodes on the longest path from the root of the subtree.
    height: u32,
}

/// Computes the size of the subtree below each node.
fn measure(tree: &Bvh2) -> Vec<Subtree> {
    let mut subtrees = vec![Subtree::default(); tree.nodes.len()];
    let mut parents_first = vec![0_u32];
    let mut next = 0;
    while next < parents_first.len() {
        let node = &tree.nodes[parents_first[next] as usize];
        if !node.is_leaf() {
            parents_first.extend([node.first_index, node.first_index + 1]);
        }
        next += 1;
    }
    for &i in parents_first.iter().rev() {
        let node = &tree.nodes[i as usize];
        subtrees[i as usize] = if node.is_leaf() {
            Subtree { primitives: node.prim_count, height: 0 }
        } else {
            let [l, r] = [0, 1].map(|side| subtrees[node.first_index as usize + side]);
            Subtree { primitives: l.primitives + r.primitives, height: 1 + l.height.max(r.height) }
        };
    }
    subtrees
}

struct Converter<'a> {
    tree: &'a Bvh2,
    bounds: &'a [Bounds],
    limit: u32,
    subtrees: Vec<Subtree>,
    made: Binary,
}

impl Converter<'_> {
    /// Converts the subtree of a node that lies below `depth` interior nodes. A subtree that is too
    /// deep keeps its upper nodes as long as an even split of the children still fits into the
    /// limit.
    fn tree_node(&mut self, index: u32, depth: u32) -> BvhChild {
        let node = &self.tree.nodes[index as usize];
        if node.is_leaf() {
            let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            let leaf = self.tree.primitive_indices[range].to_vec();
            return self.leaf(&leaf);
        }
        let children = [node.first_index, node.first_index + 1];
        let fits = depth + self.subtrees[index as usize].height <= self.limit;
        let least = |child: u32| even_height(self.subtrees[child as usize].primitives as usize);
        let fits_later = |child: u32| depth + 1 + least(child) <= self.limit;
        if !fits && !children.into_iter().all(fits_later) {
            let mut below = self.primitives_below(index);
            return self.even_node(&mut below, depth);
        }
        self.interior(|this| children.map(|child| this.tree_node(child, depth + 1)))
    }

    /// Appends a node whose children `convert` creates.
    fn interior(&mut self, convert: impl FnOnce(&mut Self) -> [BvhChild; 2]) -> BvhChild {
        let index = self.made.nodes.len();
        self.made.nodes.push([BvhChild { bounds: Bounds::EMPTY, first: 0, count: 0 }; 2]);
        let children = convert(self);
        self.made.nodes[index] = children;
        let [left, right] = children.map(|child| child.bounds);
        BvhChild { bounds: left.union(right), first: index as u32, count: 0 }
    }

    fn leaf(&mut self, primitives: &[u32]) -> BvhChild {
        let first = self.made.order.len() as u32;
        self.made.order.extend_from_slice(primitives);
        let bounds = primitives.iter().map(|i| self.bounds[*i as usize]).fold(Bounds::EMPTY, Bounds::union);
        BvhChild { bounds, first, count: primitives.len() as u32 }
    }

    /// Collects all primitives below a node of the source tree.
    fn primitives_below(&self, index: u32) -> Vec<u32> {
        let (mut open, mut below) = (vec![index], Vec::new());
        while let Some(index) = open.pop() {
            let node = &self.tree.nodes[index as usize];
            if node.is_leaf() {
                let first = node.first_index as usize;
                below.extend_from_slice(&self.tree.primitive_indices[first..first + node.prim_count as usize]);
            } else {
                open.extend([node.first_index + 1, node.first_index]);
            }
        }
        below
    }

    /// Creates a leaf, or a node that splits the primitives evenly.
    fn even_node(&mut self, primitives: &mut [u32], depth: u32) -> BvhChild {
        if primitives.len() <= MAX_LEAF as usize {
            return self.leaf(primitives);
        }
        self.even_halves(primitives, depth)
    }

    /// Creates a node that splits the primitives at the median of the longest axis of their
    /// centres.
    fn even_halves(&mut self, primitives: &mut [u32], depth: u32) -> BvhChild {
        let middle = |i: u32| self.bounds[i as usize].min + self.bounds[i as usize].max;
        let centers = Bounds::around(primitives.iter().map(|i| middle(*i)));
        let axis = (centers.max - centers.min).max_position();
        // Fills whole leaves on the left, so that neither half is higher than `even_height`
        // predicts.
        let leaves = primitives.len().div_ceil(MAX_LEAF as usize);
        let half = if leaves > 1 { (leaves / 2 + leaves % 2) * MAX_LEAF as usize } else { primitives.len() / 2 };
        primitives.select_nth_unstable_by(half, |a, b| middle(*a)[axis].total_cmp(&middle(*b)[axis]).then(a.cmp(b)));
        let (left, right) = primitives.split_at_mut(half);
        self.interior(|this| [this.even_node(left, depth + 1), this.even_node(right, depth + 1)])
    }
}

/// Height of the whole tree: interior nodes on the longest path from the root.
pub(super) fn height(tree: &Bvh2) -> usize {
    measure(tree)[0].height as usize
}
