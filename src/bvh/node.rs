//! Packing a node's children.

use crate::layout::BvhNode;

/// A child of a [`BvhNode`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BvhChild {
    /// Corners of its box, metres.
    pub min: [f32; 3],
    pub max: [f32; 3],
    /// Interior child: index of its node. Leaf: index of its first primitive.
    pub first: u32,
    /// Primitives of a leaf; 0 for an interior node.
    pub count: u32,
}

impl BvhNode {
    #[must_use]
    pub fn new([left, right]: [BvhChild; 2]) -> Self {
        let pack = |[x, y, z]: [f32; 3], w: u32| [x.to_bits(), y.to_bits(), z.to_bits(), w];
        Self {
            left_low: pack(left.min, left.first),
            left_high: pack(left.max, left.count),
            right_low: pack(right.min, right.first),
            right_high: pack(right.max, right.count),
        }
    }

    /// Left and right child.
    #[must_use]
    pub fn children(&self) -> [BvhChild; 2] {
        let corner = |[x, y, z, _]: [u32; 4]| [x, y, z].map(f32::from_bits);
        [(self.left_low, self.left_high), (self.right_low, self.right_high)].map(|(low, high)| BvhChild {
            min: corner(low),
            max: corner(high),
            first: low[3],
            count: high[3],
        })
    }
}
