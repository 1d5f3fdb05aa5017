//! Bounding volume hierarchy in the layout that the shaders traverse: a binary tree whose levels are then joined to nodes
//! of up to [`WIDTH`] children with their boxes in few bits, so that a ray loads little.
//!
//! Node 0 is the root and always there: a scene with fewer than two primitives, of which no binary tree can be made, is filled
//! up with triangles without area, which no ray hits. Following farther children later, a traversal postpones at most
//! [`BVH_STACK`](crate::layout::BVH_STACK) of them.

mod build;
mod convert;
mod media;
mod node;
#[cfg(test)]
mod tests;
mod widen;

pub use build::{Bvh, FILLER};
pub use media::{Media, MediaProbe, packed, too_deep};
pub use node::{BvhChild, MAX_LEAF, WIDTH};
