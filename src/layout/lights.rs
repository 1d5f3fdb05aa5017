//! Lights, the trees and tables by which they are chosen, and samples of them.

use bytemuck::{Pod, Zeroable};

use super::limits::MEDIA_WORDS;

/// Kinds of [`Light`]. First the punctual lights.
pub const POINT_LIGHT: u32 = 0;
pub const SPOT_LIGHT: u32 = 1;
pub const DIRECTIONAL_LIGHT: u32 = 2;
/// Emissive surfaces.
pub const TRIANGLE_LIGHT: u32 = 3;
pub const SPHERE_LIGHT: u32 = 4;
/// The environment.
pub const ENVIRONMENT_LIGHT: u32 = 5;

/// A punctual light, an emissive triangle or a subtriangle of one, an emissive sphere, or the
/// environment. Its power is `emission · area · solid_angle`, times the mean of what varies over a
/// surface, except for directional lights and the environment.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// Point, spot: position, metres. Triangle: its first corner. Sphere: its centre.
    pub position: [f32; 3],
    /// One of [`POINT_LIGHT`] … [`ENVIRONMENT_LIGHT`].
    pub kind: u32,
    /// Spot, directional: unit direction of emission. Triangle: edge to the second corner. Sphere:
    /// (radius, 0, 0).
    pub e1: [f32; 3],
    /// Index of the named light, what a user calls one light: all surfaces of one emissive material
    /// are one.
    pub named: u32,
    /// Spot: 1 − cos of the outer angle, and width in cosines of the falloff. Triangle: edge to the
    /// third corner.
    pub e2: [f32; 3],
    /// Integral over all directions of the fraction of `emission` that goes there, sr. Point: 4π.
    /// Spot: by its falloff. Surfaces: π for the front alone, 2π for both sides.
    pub solid_angle: f32,
    /// Point, spot: radiant intensity (on the axis), W/sr. Directional: irradiance of a surface
    /// that faces it, W/m². Triangle, sphere: radiance, W/(m² sr). Environment: 1, a factor on its
    /// pixels.
    pub emission: [f32; 3],
    /// Surfaces: area, m². Others: 1.
    pub area: f32,
    /// Media in which paths start on the front, and on the back of a surface: a set of slots. See
    /// [`crate::bvh::MediaProbe`].
    pub media: [u32; MEDIA_WORDS],
    pub back_media: [u32; MEDIA_WORDS],
    /// Index of the material plus one where the emission varies over the surface, by a texture or
    /// by opacity; else 0. `emission` is then a factor.
    pub material: u32,
    /// Index of the triangle's [`Attributes`](super::Attributes) plus one; 0 for none.
    pub attributes: u32,
    /// Triangle: position of this light among the subtriangles of its triangle,
    /// [`subtriangle_word`].
    pub subtriangle: u32,
    /// Triangle: number of subtriangles along an edge of its triangle; 0 or 1 if the light is all
    /// of it. The subtriangles are consecutive lights, row by row.
    pub side: u32,
    /// Index of its leaf among the [`LightNode`]s, or [`NO_LEAF`], and of the root of its tree.
    pub leaf: u32,
    pub root: u32,
    /// Strength of the clear coat on a surface, which takes a part of its emission.
    pub clearcoat: f32,
    pub pad: u32,
}

/// Set in [`Light::subtriangle`] for one that is turned by half a turn against its triangle.
pub const TURNED_BIT: u32 = 1 << 16;

/// Word for [`Light::subtriangle`]: column and row of the corner nearest to the triangle's first
/// corner, along its edges, in units of subtriangles.
#[must_use]
pub fn subtriangle_word(column: u32, row: u32, is_turned: bool) -> u32 {
    column | (row << 8) | if is_turned { TURNED_BIT } else { 0 }
}

/// One entry of a table from which lights are sampled.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightChoice {
    /// Probability that this light or one before it is chosen; 1 for the last light that can be
    /// chosen.
    pub cdf: f32,
    /// Probability of this light: the difference to its predecessor.
    pub probability: f32,
}

/// Number of trees of lights, whose roots are the first [`LightNode`]s, and among them that of the
/// environment and that of surfaces, with points and spots where these are many; see
/// `src/emitters/light_tree.rs`.
pub const LIGHT_ROOTS: u32 = 4;
pub const ENVIRONMENT_ROOT: u32 = 0;
pub const EMITTER_ROOT: u32 = 1;
/// First root of the trees of lights that visible points sum where they are few: directional ones,
/// then points and spots.
pub const SUMMED_ROOT: u32 = 2;
/// In place of the leaf of a light that is never chosen: none.
pub const NO_LEAF: u32 = u32::MAX;
/// Bits of [`LightNode::next`]: the node is a leaf; its surfaces may shine along the opposite cone
/// as well; its lights are at infinity.
pub const LEAF_BIT: u32 = 0x8000_0000;
pub const BOTH_WAYS_BIT: u32 = 0x4000_0000;
pub const FAR_BIT: u32 = 0x2000_0000;
/// Mask there of the index.
pub const NEXT_MASK: u32 = FAR_BIT - 1;

/// Node of a tree by which direct light chooses a light: bounds of one light or several, see
/// `src/emitters/light_bounds.rs`. It consists of vectors of four words, as
/// [`BvhNode`](super::BvhNode) does.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightNode {
    /// Centre of the box around the lights, metres.
    pub center: [f32; 3],
    /// Half extents of the box: eight bits each, z lowest, in units of which the top eight bits are
    /// the exponent, biased as in a float.
    pub half: u32,
    /// Word 0: axis of the cone along which they shine, octahedral. Word 1: cosine of its half
    /// angle, a 16-bit snorm number; √(1 − d²), an 8-bit unorm number, where d is the part of the
    /// light that shines along the axis; and the cosine of the angle from the cone on beyond which
    /// nothing shines, an 8-bit snorm number. Cosines are rounded down. Word 2: bits of the sum of
    /// their intensities, four times those of points, or of the irradiance by lights at infinity,
    /// relative to that of all lights. Word 3, [`Self::next`].
    pub shine: [u32; 4],
}

impl LightNode {
    /// Leaf: index of the light. Others: of the first of two children, which are neighbours. With
    /// [`LEAF_BIT`], [`BOTH_WAYS_BIT`], [`FAR_BIT`].
    #[must_use]
    pub fn next(&self) -> u32 {
        self.shine[3]
    }

    #[must_use]
    pub fn is_leaf(&self) -> bool {
        self.next() & LEAF_BIT != 0
    }

    #[must_use]
    pub fn intensity(&self) -> f32 {
        f32::from_bits(self.shine[2])
    }
}

/// Arguments of `light_directly`: one punctual light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DirectLight {
    pub light: u32,
    pub pad0: u32,
    pub pad1: u32,
    pub pad2: u32,
}

/// Arguments of `sample_emitters`: one sample of each point.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct EmitterSample {
    /// Index of the sample, and number of samples per point.
    pub sample: u32,
    pub samples: u32,
    /// Number of trees of lights that are sampled.
    pub roots: u32,
    pub pad: u32,
}
