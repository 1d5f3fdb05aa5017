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
/// The same through a scene's tree and those of the meshes in it that instances share.
pub const INSTANCED_STACK: usize = 63;
/// Levels of such two binary trees together, of the scene and of a mesh: two levels defer three
/// children, a leaf of the scene up to four instances, and the way back takes one entry.
pub const TREE_HEIGHTS: u32 = 38;
const _: () = assert!(3 * (TREE_HEIGHTS as usize / 2) + 4 < INSTANCED_STACK);

/// Levels of an evenly split tree over so many primitives, four in a leaf; 0 for a single leaf.
#[must_use]
pub fn even_height(primitives: usize) -> u32 {
    primitives.div_ceil(4).next_power_of_two().trailing_zeros()
}

// The stacks of a workgroup's traversals fit the workgroup memory that every adapter has, 16 KiB.
const _: () = assert!((INSTANCED_STACK + 1) * WORKGROUP_SIZE as usize * 4 <= 16 << 10 && BVH_STACK < INSTANCED_STACK);
/// Maximum of the weight by which an interpolated normal changes flux; it grows without bound
/// towards grazing angles to the geometric surface.
pub const MAX_NORMAL_WEIGHT: f32 = 8.0;
/// Rounding error of a hit point, as a fraction of the largest coordinate that it is computed from:
/// 2^-19.
pub const OFFSET_SCALE: f32 = 1.907_348_6e-6;
/// Words of a set of media, one bit for each slot of [`crate::scene::Solids`].
pub const MEDIA_WORDS: usize = 4;

/// Words before the list of paths or points with late rays, the first two of which are the first
/// entry of the slice that goes on, and its number of entries.
pub const LATE_HEADER: u32 = 4;
/// Entries of a slice at most.
pub const LATE_SLICE: u32 = 768;
/// Words that are kept of a late ray: where it stopped, and its stack.
pub const LATE_RAY: u32 = 87;
/// Words that are kept of an entry: whether it is done, and three rays.
pub const LATE_WORDS: u32 = 1 + 3 * LATE_RAY;
const _: () = assert!(INSTANCED_STACK + 23 <= LATE_RAY as usize);
