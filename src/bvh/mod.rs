//! Bounding volume hierarchy in the layout that the shaders traverse. A binary tree is built first;
//! its levels are then collapsed into nodes of up to [`WIDTH`] children with quantized bounding
//! boxes, so that a ray loads few bytes.
//!
//! Node 0 is the root and always exists: a scene with fewer than two primitives, which gives no
//! binary tree, is padded with degenerate triangles that no ray hits. A traversal defers the
//! farther children and keeps at most [`BVH_STACK`](crate::layout::BVH_STACK) of them on its stack.

mod binary;
mod build;
mod contact_search;
mod contacts;
mod convert;
mod instance;
mod instance_contacts;
mod media;
mod node;
mod overlap;
mod parallel;
mod plane_tree;
mod ray;
mod split;
#[cfg(test)]
mod tests;
mod widen;

pub use build::Bvh;
pub use contacts::{Contacts, contacts};
pub use media::{Media, MediaProbe};
pub use node::{BvhChild, FILLER, MAX_LEAF, WIDTH};
pub use ray::RayHit;
