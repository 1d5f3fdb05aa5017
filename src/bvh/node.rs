//! Packing of a node: child boxes with 8 bits per coordinate, in units of a power of two from the
//! lower corner of the node (Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray Traversal on
//! GPUs Through Compressed Wide BVHs", section 3.1).

use glam::Vec3;

use crate::layout::{BVH_INDEX_BITS, BvhNode};
use crate::scene::Bounds;

/// Maximum number of children of a node.
pub const WIDTH: usize = 4;

/// [`Primitive::id`](crate::layout::Primitive::id) of a padding triangle, and of the box of an
/// instance.
pub const FILLER: u32 = u32::MAX;

/// Maximum number of primitives of a leaf.
pub const MAX_LEAF: u32 = 4;

// The primitive count of a leaf, less one, is stored in two bits.
const _: () = assert!(MAX_LEAF <= 4);

/// Largest quantized coordinate.
const MAX_UNITS: u32 = 255;
/// Biased exponent of the largest finite f32.
const MAX_EXPONENT: u32 = 254;

/// A child of a [`BvhNode`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BvhChild {
    /// Bounding box, metres. Contains the box of the contents, since quantization rounds outwards.
    pub bounds: Bounds,
    /// Interior child: index of its node. Leaf: index of its first primitive.
    pub first: u32,
    /// Number of primitives of a leaf; 0 for an interior child.
    pub count: u32,
}

impl BvhNode {
    /// Packs a node. `boxes` holds the boxes of its children, at most [`WIDTH`], interior children
    /// before leaves; `leaves` the primitive count of each leaf, 1 to [`MAX_LEAF`]; `first_node`
    /// and `first_primitive` the indices of its first child node and its first primitive.
    ///
    /// # Panics
    /// If `first_node` or `first_primitive` is 2^28 or more.
    #[must_use]
    pub fn new(boxes: &[Bounds], leaves: &[u32], first_node: u32, first_primitive: u32) -> Self {
        debug_assert!(boxes.len() <= WIDTH && leaves.len() <= boxes.len());
        assert!((first_node | first_primitive) >> BVH_INDEX_BITS == 0, "a tree of more than 2^28 nodes or primitives");
        let interior = boxes.len() - leaves.len();
        let corner = boxes.iter().fold(Bounds::EMPTY, |all, b| all.union(*b)).min;
        let [x, y, z] = corner.to_array().map(f32::to_bits);
        let mut node = Self {
            grid: [x, y, z, 0],
            low: [0, 0, 0, first_node | (interior as u32) << BVH_INDEX_BITS],
            high: [0, 0, 0, first_primitive | (boxes.len() as u32) << BVH_INDEX_BITS],
        };
        for axis in 0..3 {
            let highest = boxes.iter().map(|b| b.max[axis]).fold(corner[axis], f32::max);
            let exponent = exponent(corner[axis], highest);
            let at = |units: u32| plane(corner[axis], exponent, units);
            let guess = |position: f32| ((position - corner[axis]) / unit(exponent)) as u32;
            node.grid[3] |= exponent << (8 * axis);
            for (child, b) in boxes.iter().enumerate() {
                let below = (0..=guess(b.min[axis]).min(MAX_UNITS)).rev().find(|q| at(*q) <= b.min[axis]);
                let above = (guess(b.max[axis]).min(MAX_UNITS)..=MAX_UNITS).find(|q| at(*q) >= b.max[axis]);
                node.low[axis] |= below.unwrap_or(0) << (8 * child);
                node.high[axis] |= above.unwrap_or(MAX_UNITS) << (8 * child);
            }
        }
        for (leaf, count) in leaves.iter().enumerate() {
            node.grid[3] |= (count - 1) << (24 + 2 * (interior + leaf));
        }
        node
    }

    /// The node of a tree that is appended to others: its indices of nodes and primitives are
    /// higher by so many.
    ///
    /// # Panics
    /// If an index is then 2^28 or more.
    #[must_use]
    pub fn moved(&self, nodes: u32, primitives: u32) -> Self {
        let mask = (1 << BVH_INDEX_BITS) - 1;
        let moved = |word: u32, by: u32| {
            assert!((word & mask) + by <= mask, "trees of more than 2^28 nodes or primitives");
            word + by
        };
        let mut node = *self;
        node.low[3] = moved(self.low[3], nodes);
        node.high[3] = moved(self.high[3], primitives);
        node
    }

    /// Unpacks the children, in the order in which they were packed.
    pub fn children(&self) -> impl Iterator<Item = BvhChild> + use<> {
        let Self { grid: [x, y, z, shape], low, high } = *self;
        let corner = [x, y, z].map(f32::from_bits);
        let side = move |axis: usize, words: [u32; 4], child: u32| {
            plane(corner[axis], (shape >> (8 * axis)) & 0xff, (words[axis] >> (8 * child)) & 0xff)
        };
        let index = move |word: u32| word & ((1 << BVH_INDEX_BITS) - 1);
        let mut first_primitive = index(high[3]);
        (0..high[3] >> BVH_INDEX_BITS).map(move |child| {
            let at = |words| Vec3::from_array(std::array::from_fn(|axis| side(axis, words, child)));
            let bounds = Bounds { min: at(low), max: at(high) };
            if child < low[3] >> BVH_INDEX_BITS {
                return BvhChild { bounds, first: index(low[3]) + child, count: 0 };
            }
            let count = 1 + ((shape >> (24 + 2 * child)) & 3);
            first_primitive += count;
            BvhChild { bounds, first: first_primitive - count, count }
        })
    }
}

/// Smallest exponent with which [`MAX_UNITS`] units reach from `low` to `high`.
fn exponent(low: f32, high: f32) -> u32 {
    let too_small = ((high - low) / MAX_UNITS as f32).to_bits() >> 23;
    let reaches = |exponent: &u32| plane(low, *exponent, MAX_UNITS) >= high;
    (too_small.min(MAX_EXPONENT)..=MAX_EXPONENT).find(reaches).unwrap_or(MAX_EXPONENT)
}

/// Length of one unit: a power of two, or 0 for an exponent of 0.
fn unit(exponent: u32) -> f32 {
    f32::from_bits(exponent << 23)
}

/// Coordinate that lies `units` units from the corner of a node. Same arithmetic as the shaders,
/// bit for bit; the product is exact.
fn plane(corner: f32, exponent: u32, units: u32) -> f32 {
    corner + units as f32 * unit(exponent)
}
