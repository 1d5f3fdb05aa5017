//! Every struct that crosses to the GPU, in one file.
//!
//! Each struct here has a twin of the same name in `shaders/`; `tests/layouts.rs` reflects the shaders and compares
//! names, order, offsets and sizes. Vectors are arrays so that `repr(C)` and WGSL agree on alignment: a `[f32; 3]`
//! is followed by a 4-byte field, as WGSL places a `vec3f`.

use bytemuck::{Pod, Zeroable};

/// Invocations per workgroup, in every kernel.
pub const WORKGROUP_SIZE: u32 = 64;
/// Levels that a BVH traversal can postpone; [`crate::bvh`] builds no deeper tree.
pub const BVH_STACK: usize = 32;
/// Media that a path can be inside of at once.
pub const MEDIA_DEPTH: usize = 4;

/// One interior node of the binary BVH: both children's boxes and what they are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhNode {
    /// Box of the left child, metres.
    pub left_min: [f32; 3],
    /// Interior child: index of its node. Leaf: index of its first primitive.
    pub left_first: u32,
    pub left_max: [f32; 3],
    /// Primitives of the left child; 0 for an interior node.
    pub left_count: u32,
    pub right_min: [f32; 3],
    pub right_first: u32,
    pub right_max: [f32; 3],
    pub right_count: u32,
}

/// Set in [`Primitive::material`] when the primitive is a sphere; the other bits are the material's index.
pub const SPHERE_BIT: u32 = 0x8000_0000;

/// A triangle `v0, v0 + e1, v0 + e2`, or a sphere with centre `v0` and radius `e1.x`, in the order of the BVH's leaves.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Primitive {
    pub v0: [f32; 3],
    /// Index into the materials, with [`SPHERE_BIT`] for a sphere.
    pub material: u32,
    pub e1: [f32; 3],
    /// Index of the primitive in the scene before the BVH reordered it.
    pub id: u32,
    pub e2: [f32; 3],
    pub pad: u32,
}

/// Interpolated normals of a triangle's corners, octahedral (see [`octahedral`]); unused for spheres.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Normals {
    pub n0: u32,
    pub n1: u32,
    pub n2: u32,
    /// 1 if the corners' normals all equal the geometric one: the surface is flat and the rest need not be read.
    pub flat_shaded: u32,
}

/// Kinds of [`Material`].
pub const DIFFUSE: u32 = 0;
pub const MIRROR: u32 = 1;
/// Closed solid with an index of refraction.
pub const GLASS: u32 = 2;
/// Thin pane: light goes straight through.
pub const PANE: u32 = 3;

/// How a surface scatters.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Diffuse: albedo. Mirror: tint of the reflection. Glass, pane: tint of what is transmitted. Each 0..1.
    pub color: [f32; 3],
    /// One of [`DIFFUSE`], [`MIRROR`], [`GLASS`], [`PANE`].
    pub kind: u32,
    /// Index of refraction, of glass and panes.
    pub ior: f32,
    pub pad: [u32; 3],
}

/// A point light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// Metres.
    pub position: [f32; 3],
    /// Probability that all lights up to and including this one are chosen; 1 for the last.
    pub cdf: f32,
    /// Radiant intensity, W/sr.
    pub intensity: [f32; 3],
    /// Probability that a path starts at this light.
    pub probability: f32,
}

/// A path on its way: a photon, or a camera ray. Rewritten in place by each bounce.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Path {
    pub origin: [f32; 3],
    /// Photons: diffuse bounces so far in the low 16 bits, photons stored in each map, see `bounce_photons`.
    pub flags: u32,
    pub direction: [f32; 3],
    /// Surfaces met so far.
    pub bounces: u32,
    /// Flux in W of a photon (before the division by the number of paths), or weight of a camera path.
    pub beta: [f32; 3],
    /// Depth of the stack of media.
    pub media_count: u32,
    /// Materials of the media around the path, outermost first.
    pub media: [u32; MEDIA_DEPTH],
}

/// A stored photon.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Photon {
    /// Metres.
    pub position: [f32; 3],
    /// Direction to where the photon came from, octahedral.
    pub wi: u32,
    /// Flux in W, before the division by the number of emitted paths.
    pub flux: [f32; 3],
    /// Before sorting: place in its path. After: Hilbert key of its cell.
    pub key: u32,
}

/// Where a camera path met a diffuse surface; asks for the light that leaves there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VisiblePoint {
    /// Metres.
    pub position: [f32; 3],
    /// 1 if there is a point here, 0 if the camera path ended without one.
    pub valid: u32,
    /// Weight of the camera path times the BRDF, albedo/π: multiplies irradiance.
    pub weight: [f32; 3],
    pub pad0: u32,
    /// Geometric normal, unit, on the viewer's side.
    pub ng: [f32; 3],
    pub pad1: u32,
    /// Interpolated normal, unit, on the viewer's side of the geometric one.
    pub ns: [f32; 3],
    pub pad2: u32,
}

/// Photons of a finest cell of the photon grid; cells of a coarser one.
pub const CELL_PHOTONS: u32 = 32;
pub const CELL_FAN: u32 = 4;

/// One cell of the photon grid: [`CELL_PHOTONS`] photons that follow each other along a Hilbert curve, or
/// [`CELL_FAN`] cells of the next finer level. Cells lie in depth-first order: the first finer cell follows its owner.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Cell {
    /// Smallest box around the photons, metres.
    pub lo: [f32; 3],
    /// Index of the next cell that is not part of this one.
    pub skip: u32,
    pub hi: [f32; 3],
    /// Finest cell: index of its first photon, with the highest bit set. Else: number of its photons.
    pub content: u32,
}

/// Position of a sorted photon and where it came from: all that a search needs.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PhotonPlace {
    /// Metres.
    pub position: [f32; 3],
    /// Direction to where the photon came from, octahedral.
    pub wi: u32,
}

/// What a sorted photon carries.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PhotonFlux {
    /// Flux in W, before the division by the number of emitted paths.
    pub flux: [f32; 3],
    /// Index of the photon before sorting.
    pub index: u32,
}

/// Sizes of a photon map.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MapInfo {
    /// Photons.
    pub count: u32,
    /// Cells of all levels.
    pub cells: u32,
    /// Index of the first photon of the second window.
    pub split: u32,
    pub pad: u32,
}

/// Settings of one batch of a gather.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GatherInfo {
    /// Queries of the batch, valid or not.
    pub count: u32,
    /// Index of the batch's first point.
    pub first: u32,
    /// k.
    pub neighbors: u32,
    /// C of the cone filter.
    pub cone_constant: f32,
    /// Square of the largest radius, m²; negative if there is none.
    pub max_radius_squared: f32,
    /// 1 / number of emitted paths.
    pub per_path: f32,
    /// Of how many packets of queries one is searched.
    pub stride: u32,
    pub pad: u32,
}

/// What a query found.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Gathered {
    /// Square of the radius of the estimate, m²: of the nearest photon that is not summed, or the largest radius.
    pub radius_squared: f32,
    /// Photons summed.
    pub count: u32,
}

/// Octahedral encoding of a unit vector in two 16-bit signed normalised numbers (Cigolle et al. 2014, "A Survey of
/// Efficient Representations for Independent Unit Vectors"); x in the low half. Twin of `encode_octahedral` in
/// `shaders/lib/octahedral.wesl`.
#[must_use]
pub fn octahedral(v: glam::Vec3) -> u32 {
    let p = v / (v.x.abs() + v.y.abs() + v.z.abs());
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let (x, y) = if p.z < 0.0 { ((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)) } else { (p.x, p.y) };
    let pack = |x: f32| u32::from(((x.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16);
    pack(x) | (pack(y) << 16)
}

/// Inverse of [`octahedral`]: a unit vector.
#[must_use]
pub fn from_octahedral(packed: u32) -> glam::Vec3 {
    let unpack = |u: u32| f32::max(f32::from(u as u16 as i16) / 32767.0, -1.0);
    let (x, y) = (unpack(packed & 0xffff), unpack(packed >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    let push = |x: f32| if x >= 0.0 { x - t } else { x + t };
    glam::Vec3::new(push(x), push(y), z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octahedral_keeps_directions() {
        for i in 0..1000 {
            let (a, z) = (i as f32 * 2.399_963, (i as f32 + 0.5) / 500.0 - 1.0);
            let r = (1.0 - z * z).sqrt();
            let v = glam::Vec3::new(r * a.cos(), r * a.sin(), z);
            assert!((from_octahedral(octahedral(v)) - v).length() < 1e-4, "{v}");
        }
    }
}
