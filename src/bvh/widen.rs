//! Collapse of a binary tree into nodes of up to [`WIDTH`] children.

use super::{BvhChild, WIDTH, convert::Binary, convert::MAX_HEIGHT};
use crate::layout::{BVH_STACK, BvhNode};
use crate::scene::Bounds;

// Two levels of the binary tree make one wide node, which defers all children but one.
const _: () = assert!(max_deferred(MAX_HEIGHT) <= BVH_STACK as u32 && WIDTH == 4);

/// Returns the nodes, parents before children, and the primitive indices in leaf order.
pub(super) fn widen(binary: &Binary) -> (Vec<BvhNode>, Vec<u32>) {
    let mut widener = Widener {
        binary,
        heights: heights(binary),
        nodes: vec![BvhNode::default()],
        order: Vec::with_capacity(binary.order.len()),
    };
    widener.node(0, 0, BVH_STACK as u32);
    (widener.nodes, widener.order)
}

/// Height of the subtree of each node: interior nodes on the longest path down.
fn heights(binary: &Binary) -> Vec<u32> {
    let mut heights = vec![1; binary.nodes.len()];
    for (i, children) in binary.nodes.iter().enumerate().rev() {
        let below = children.iter().filter(|child| child.count == 0).map(|child| heights[child.first as usize]);
        heights[i] += below.max().unwrap_or(0);
    }
    heights
}

/// Maximum number of deferred children below a binary subtree of the given height, if two of its
/// levels are always collapsed.
const fn max_deferred(height: u32) -> u32 {
    (WIDTH as u32 - 1) * height.div_ceil(2)
}

struct Widener<'a> {
    binary: &'a Binary,
    heights: Vec<u32>,
    nodes: Vec<BvhNode>,
    order: Vec<u32>,
}

impl Widener<'_> {
    /// Writes a node of the binary tree to slot `at`, and all nodes below it. `room` is the number
    /// of children that may still be deferred.
    fn node(&mut self, at: usize, index: usize, room: u32) {
        let mut children = self.opened_by_area(index);
        let fits = |child: &BvhChild| self.deferred_below(child) + children.len() as u32 - 1 <= room;
        if !children.iter().all(fits) {
            children = self.opened_by_level(index);
        }
        let room = room - (children.len() as u32 - 1);
        children.sort_by_key(|child| child.count > 0);
        let interior = children.iter().take_while(|child| child.count == 0).count();
        let boxes: Vec<Bounds> = children.iter().map(|child| child.bounds).collect();
        let leaves: Vec<u32> = children[interior..].iter().map(|leaf| leaf.count).collect();
        let first_node = self.nodes.len();
        self.nodes[at] = BvhNode::new(&boxes, &leaves, first_node as u32, self.order.len() as u32);
        for leaf in &children[interior..] {
            let range = leaf.first as usize..(leaf.first + leaf.count) as usize;
            self.order.extend_from_slice(&self.binary.order[range]);
        }
        self.nodes.resize(first_node + interior, BvhNode::default());
        for (i, child) in children[..interior].iter().enumerate() {
            self.node(first_node + i, child.first as usize, room);
        }
    }

    fn deferred_below(&self, child: &BvhChild) -> u32 {
        if child.count > 0 { 0 } else { max_deferred(self.heights[child.first as usize]) }
    }

    /// Children of a node. Replaces the child of the largest area by its own children while there
    /// is room: most rays enter it.
    fn opened_by_area(&self, index: usize) -> Vec<BvhChild> {
        let mut children = self.binary.nodes[index].to_vec();
        while children.len() < WIDTH {
            let interior = children.iter().enumerate().filter(|(_, child)| child.count == 0);
            let largest = interior.max_by(|a, b| a.1.bounds.half_area().total_cmp(&b.1.bounds.half_area()));
            let Some((largest, child)) = largest else { break };
            let opened = self.binary.nodes[child.first as usize];
            children.splice(largest..=largest, opened);
        }
        children
    }

    /// Grandchildren of a node; a leaf stays as it is.
    fn opened_by_level(&self, index: usize) -> Vec<BvhChild> {
        let open = |child: &BvhChild| {
            if child.count > 0 { vec![*child] } else { self.binary.nodes[child.first as usize].to_vec() }
        };
        self.binary.nodes[index].iter().flat_map(open).collect()
    }
}
