//! The binary tree over boxes: PLOC with reinsertion (Meister and Bittner 2018, 2021).

use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, leaf_collapser::collapse, node::Bvh2Node, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, SortPrecision},
};

use crate::scene::Bounds;

/// Neighbours along the curve among which PLOC looks for the nearest; only for the next ones at
/// the first levels.
const SEARCH_DISTANCE: usize = 14;
const NEAR_LEVELS: usize = 3;
const SORT_PRECISION: SortPrecision = SortPrecision::U64;
/// Fraction of the nodes that are inserted again where they cost less; twice that once leaves have
/// several primitives.
const REINSERTED: f32 = 0.05;
/// Cost of one level of the binary tree, in primitive tests.
const LEVEL_COST: f32 = 1.5;

/// Builds the tree before conversion, with leaves of at most `max_leaf` boxes; they are sorted
/// along a curve through the box `within`. Runs on one thread: the parallel sorts do not promise an
/// order of equal keys.
pub(super) fn build_binary(bounds: &[Bounds], within: Bounds, max_leaf: u32) -> Bvh2 {
    let corners = |b: &Bounds| Aabb::new(b.min.into(), b.max.into());
    let build = || {
        let count = bounds.len();
        let mut builder = PlocBuilder::with_capacity(count);
        let leaf = |(i, b): (usize, &Bounds)| Bvh2Node::new(corners(b), 1, i as u32);
        builder.current_nodes = bounds.iter().enumerate().map(leaf).collect();
        let mut tree = Bvh2::zeroed(count);
        tree.reset_for_reuse(count, Some((0..count as u32).collect()));
        builder.build_ploc_from_leaves::<SEARCH_DISTANCE, false>(
            &mut tree,
            corners(&within),
            SORT_PRECISION,
            NEAR_LEVELS,
        );
        let mut reinsertion = ReinsertionOptimizer::default();
        reinsertion.run(&mut tree, REINSERTED, None);
        collapse(&mut tree, max_leaf, LEVEL_COST);
        reinsertion.run(&mut tree, 2.0 * REINSERTED, None);
        tree
    };
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(build),
        // Falls back to the pool of this thread if no thread can be started.
        Err(_) => build(),
    }
}
