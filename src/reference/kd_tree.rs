//! Search for the k nearest neighbours in a left-balanced kd-tree (Jensen 2001, "Realistic Image
//! Synthesis Using Photon Mapping", sections 6.1 to 6.3).
//!
//! The tree is an implicit heap: the children of node `i` are `2 i + 1` and `2 i + 2`. All levels
//! but the last are full, so it needs no pointers and has depth O(log N). Each node holds the
//! median photon of its subtree along the axis in which that subtree is longest. Photons on the
//! left have a coordinate at most that of the node, those on the right at least that.

use std::collections::BinaryHeap;

use glam::Vec3;

use super::{Found, brute_force::squared_distance};

/// Subtrees of fewer photons are balanced without a task of their own.
const MIN_TASK: usize = 4096;

/// A balanced kd-tree of photons.
#[derive(Clone, Debug)]
pub struct KdTree {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Node {
    position: Vec3,
    /// Index of the photon in the list from which the tree was built.
    photon: u32,
    /// Split axis: 0, 1 or 2.
    axis: u8,
}

impl KdTree {
    /// Builds the tree in O(N log N) on all threads of the rayon pool. Equal lists give equal
    /// trees.
    ///
    /// # Panics
    /// If there are more than 2³² positions.
    #[must_use]
    pub fn new(positions: &[Vec3]) -> Self {
        let index = |i: usize| u32::try_from(i).expect("a photon's index has 32 bits");
        let node = |(i, &position): (usize, &Vec3)| Node { position, photon: index(i), axis: 0 };
        let mut sorted: Vec<Node> = positions.iter().enumerate().map(node).collect();
        balance(&mut sorted);
        let mut nodes = vec![Node::default(); sorted.len()];
        fill(&mut nodes, 0, &sorted);
        Self { nodes }
    }

    /// Number of photons.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether the tree has no photon.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Memory of the tree, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        size_of_val(self.nodes.as_slice()) as u64
    }

    /// Finds in O(k log N) what [`super::brute_force`] finds: the same photons in the same order,
    /// and the same radius.
    #[must_use]
    pub fn nearest(&self, query: Vec3, k: u32, max_radius: Option<f32>, usable: impl Fn(usize) -> bool) -> Found {
        let limit = max_radius.map_or(f32::INFINITY, |radius| radius * radius);
        // Searches for one more photon than is summed: its distance is the radius.
        Found::of(&self.search(query, k.saturating_add(1), limit, usable), k, max_radius)
    }

    /// Finds the `count` nearest photons that `usable` accepts and whose squared distance is below
    /// `limit`, m². Returns squared distances and indices: nearest first, equal distances in
    /// ascending order of index.
    #[must_use]
    pub fn search(&self, query: Vec3, count: u32, limit: f32, usable: impl Fn(usize) -> bool) -> Vec<(f32, u32)> {
        let room = count as usize;
        if room == 0 {
            return Vec::new();
        }
        let nearest = BinaryHeap::with_capacity(room.min(self.len()));
        let mut search = Search { query, limit, room, nearest, usable };
        self.visit(0, &mut search);
        let sorted = search.nearest.into_sorted_vec().into_iter();
        sorted.map(|(bits, photon)| (f32::from_bits(bits), photon)).collect()
    }

    /// Searches a subtree: first the side on which the query lies, then the node itself, then the
    /// other side if it can hold a photon that is near enough.
    fn visit(&self, i: usize, search: &mut Search<impl Fn(usize) -> bool>) {
        let Some(node) = self.nodes.get(i) else { return };
        let axis = usize::from(node.axis);
        let beyond = search.query[axis] - node.position[axis];
        let (left, right) = (2 * i + 1, 2 * i + 2);
        let (near, far) = if beyond < 0.0 { (left, right) } else { (right, left) };
        self.visit(near, search);
        search.offer(node);
        // Includes equality: at equal distance the lower index is nearer.
        if beyond * beyond <= search.bound() {
            self.visit(far, search);
        }
    }
}

/// State of a search.
struct Search<Usable> {
    query: Vec3,
    /// Square of the maximum radius, exclusive, m².
    limit: f32,
    /// Maximum number of photons to keep, ≥ 1.
    room: usize,
    /// The nearest photons so far, farthest on top: bits of the squared distance and index. For
    /// numbers ≥ 0 the bit patterns sort as the numbers do.
    nearest: BinaryHeap<(u32, u32)>,
    usable: Usable,
}

impl<Usable: Fn(usize) -> bool> Search<Usable> {
    /// Squared distance beyond which no photon can be among the nearest.
    fn bound(&self) -> f32 {
        match self.nearest.peek() {
            Some((bits, _)) if self.nearest.len() == self.room => f32::from_bits(*bits),
            _ => self.limit,
        }
    }

    /// Inserts the photon if it is among the nearest so far.
    fn offer(&mut self, node: &Node) {
        let distance = squared_distance(self.query, node.position);
        if distance >= self.limit || distance > self.bound() || !(self.usable)(node.photon as usize) {
            return;
        }
        let candidate = (distance.to_bits(), node.photon);
        if self.nearest.len() < self.room {
            self.nearest.push(candidate);
        } else if let Some(mut farthest) = self.nearest.peek_mut().filter(|farthest| candidate < **farthest) {
            *farthest = candidate;
        }
    }
}

/// Orders the nodes so that the root of a left-balanced tree lies between its left and right
/// subtree, recursively.
fn balance(nodes: &mut [Node]) {
    if nodes.len() < 2 {
        return;
    }
    let axis = longest_axis(nodes);
    let order = |a: &Node, b: &Node| a.position[axis].total_cmp(&b.position[axis]).then(a.photon.cmp(&b.photon));
    let (left, root, right) = nodes.select_nth_unstable_by(left_size(nodes.len()), order);
    root.axis = axis as u8;
    if left.len() < MIN_TASK {
        balance(left);
        balance(right);
    } else {
        rayon::join(|| balance(left), || balance(right));
    }
}

/// Copies balanced nodes into heap order, their root at index `i`.
fn fill(heap: &mut [Node], i: usize, nodes: &[Node]) {
    if nodes.is_empty() {
        return;
    }
    let (left, rest) = nodes.split_at(left_size(nodes.len()));
    heap[i] = rest[0];
    fill(heap, 2 * i + 1, left);
    fill(heap, 2 * i + 2, &rest[1..]);
}

/// Number of nodes left of the root in a tree of `count` ≥ 1 nodes whose last level is filled from
/// the left.
fn left_size(count: usize) -> usize {
    // The levels above the last hold 2^d - 1 nodes. The last holds up to 2^d, the left half of them
    // under the left child.
    let last = 1 << count.ilog2();
    let above = (last - 1) / 2;
    let in_last = count - (last - 1);
    above + in_last.min(last / 2)
}

/// Axis in which the bounds of the nodes are longest; the first of equals.
fn longest_axis(nodes: &[Node]) -> usize {
    let bounds = |(low, high): (Vec3, Vec3), node: &Node| (low.min(node.position), high.max(node.position));
    let (low, high) = nodes.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), bounds);
    let size = high - low;
    (0..3).rev().max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_level_is_filled_from_the_left() {
        let sizes: Vec<_> = (1..=15).map(left_size).collect();
        assert_eq!(sizes, [0, 1, 1, 2, 3, 3, 3, 4, 5, 6, 7, 7, 7, 7, 7]);
    }

    #[test]
    fn every_node_splits_its_subtree() {
        for count in [0, 1, 2, 3, 31, 32, 33, 1000] {
            let tree = KdTree::new(&positions(count));
            assert_eq!(tree.len(), count);
            assert_eq!(misplaced(&tree), 0, "{count} photons");
        }
        // Control: exchanges two photons that lie far apart.
        let mut tree = KdTree::new(&positions(1000));
        let (a, b) = (tree.nodes[500].position, tree.nodes[999].position);
        (tree.nodes[500].position, tree.nodes[999].position) = (b, a);
        assert!(misplaced(&tree) > 0);
    }

    fn positions(count: usize) -> Vec<Vec3> {
        // Fractions of multiples of irrational numbers: evenly distributed, without repetition.
        let at = |i: usize, step: f32| (i as f32 * step).fract();
        (0..count).map(|i| Vec3::new(at(i, 0.618_034), at(i, 0.414_214), at(i, 0.732_051))).collect()
    }

    /// Number of nodes on the wrong side of an ancestor.
    fn misplaced(tree: &KdTree) -> usize {
        let wrong = |i: usize| {
            let mut child = i;
            while child > 0 {
                let parent = (child - 1) / 2;
                let axis = usize::from(tree.nodes[parent].axis);
                let (own, split) = (tree.nodes[i].position[axis], tree.nodes[parent].position[axis]);
                if if child % 2 == 1 { own > split } else { own < split } {
                    return true;
                }
                child = parent;
            }
            false
        };
        (0..tree.len()).filter(|&i| wrong(i)).count()
    }
}
