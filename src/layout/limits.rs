//! Sizes and limits that kernels and host agree on.

/// Invocations per workgroup, in every kernel.
pub const WORKGROUP_SIZE: u32 = 64;
/// Bits of the index of a node or a primitive in words whose higher bits hold another value.
pub const BVH_INDEX_BITS: u32 = 28;
/// Workgroups per dimension that every adapter can dispatch.
pub const MAX_WORKGROUPS: u32 = 65_535;
/// Maximum number of deferred children in a BVH traversal; [`crate::bvh`] builds no tree that needs
/// more.
pub const BVH_STACK: usize = 48;
// The stacks of a workgroup's traversals fit the workgroup memory that every adapter has, 16 KiB.
const _: () = assert!((BVH_STACK + 1) * WORKGROUP_SIZE as usize * 4 <= 16 << 10);
/// Maximum of the weight by which an interpolated normal changes flux; it grows without bound
/// towards grazing angles to the geometric surface.
pub const MAX_NORMAL_WEIGHT: f32 = 8.0;
/// Rounding error of a hit point, as a fraction of the largest coordinate that it is computed from:
/// 2^-19.
pub const OFFSET_SCALE: f32 = 1.907_348_6e-6;
/// Words of a set of media, one bit for each slot of [`crate::scene::Solids`].
pub const MEDIA_WORDS: usize = 4;
