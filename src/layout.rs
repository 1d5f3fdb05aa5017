//! All structs shared with the GPU, in one file.
//!
//! Each struct here has a twin of the same name in `shaders/`; `tests/house/layouts.rs` reflects
//! the shaders and compares names, order, offsets and sizes. Vectors are arrays so that `repr(C)`
//! and WGSL agree on alignment: a `[f32; 3]` is followed by a 4-byte field, as WGSL places a
//! `vec3f`.

use bytemuck::{Pod, Zeroable};

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

/// One interior node of the BVH: boxes and kinds of its children. It consists of vectors of four
/// words, which software Vulkan reads fastest. Interior children come before leaves and are
/// consecutive, as are the primitives of all its leaves. Made by `BvhNode::new` in
/// `src/bvh/node.rs`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct BvhNode {
    /// Words 0 to 2: lower corner of the box around all children, metres, as bits of floats. Word
    /// 3: the shape. Eight bits for each axis are the exponent of its unit, biased as in a float.
    /// From bit 24 on, two bits for each child are the number of primitives of a leaf, less one.
    pub grid: [u32; 4],
    /// Words 0 to 2: for each axis the lower bounds of the children's boxes, eight bits each, in
    /// units from the corner. Word 3: index of the first interior child in 28 bits, above it the
    /// number of interior children.
    pub low: [u32; 4],
    /// Words 0 to 2: the upper bounds. Word 3: index of the leaves' first primitive in 28 bits,
    /// above it the number of all children.
    pub high: [u32; 4],
}

/// Set in [`Primitive::material`] when the primitive is a sphere.
pub const SPHERE_BIT: u32 = 0x8000_0000;

/// Set there when light passes through the primitive's surface, a pane or glass: where surfaces
/// coincide, the others are met first.
pub const TRANSMITS_BIT: u32 = 0x4000_0000;
/// Set there when another surface lies in the same plane: hits within rounding are one interface.
pub const CONTACT_BIT: u32 = 0x2000_0000;
/// Position in [`Primitive::id`] of the rank of a surface among those in contact with it, and the
/// largest one; the mask of the index below it.
pub const RANK_SHIFT: u32 = 28;
pub const MAX_RANK: u32 = 15;
pub const ID_MASK: u32 = (1 << RANK_SHIFT) - 1;
/// Position in the material of the slot of the solid that the primitive bounds, and its mask.
pub const SLOT_SHIFT: u32 = 22;
pub const SLOT_MASK: u32 = 127;
/// Number of slots, and the slot of surfaces that bound no solid.
pub const NO_SLOT: u32 = 127;
/// Set there when parts of the surface are not there: rays ask for its opacity.
pub const ALPHA_BIT: u32 = 1 << 21;
/// Mask there of the index into the materials.
pub const MATERIAL_MASK: u32 = ALPHA_BIT - 1;
/// In place of the primitive that a path has left: none.
pub const NOTHING_LEFT: u32 = (1 << BVH_INDEX_BITS) - 1;
/// Surfaces that a path of light through mirrors and glass may meet beyond its diffuse bounces.
pub const CHAIN_LIMIT: u32 = 512;
/// Roughness below which a lobe is perfectly specular: narrower than a pixel.
pub const SHARP_ROUGHNESS: f32 = 0.03;
/// Fraction of metal from which on a surface casts caustics.
pub const METAL: f32 = 0.5;
/// Units of lost light in a camera path of weight 1, see [`Counters::lost`].
pub const LOST_SCALE: u32 = 4096;

/// A triangle `v0, v0 + e1, v0 + e2`, or a sphere with centre `v0` and radius `e1.x`, in the order
/// of the BVH's leaves.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Primitive {
    pub v0: [f32; 3],
    /// Index into the materials, with [`SPHERE_BIT`] for a sphere; on the device also
    /// [`TRANSMITS_BIT`], [`CONTACT_BIT`] and the slot at [`SLOT_SHIFT`].
    pub material: u32,
    pub e1: [f32; 3],
    /// Index of the primitive in the scene before the BVH reordered it; on the device with its rank
    /// among those in contact with it at [`RANK_SHIFT`].
    pub id: u32,
    pub e2: [f32; 3],
    /// Index of the primitive's first [`Light`], plus one; 0 if it does not emit light.
    pub emitter: u32,
}

/// Interpolated normals of a triangle's corners, octahedral (see [`octahedral`]); unused for
/// spheres.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Normals {
    pub n0: u32,
    pub n1: u32,
    pub n2: u32,
    /// Lowest bit: the corners' normals all equal the geometric one, so that the surface is flat
    /// and the rest need not be read. Other bits: index of the triangle's [`Attributes`] plus one,
    /// 0 for none.
    pub attributes: u32,
}

/// Texels in a row of a table (`gpu::Table`): the maximum width of a texture that every device
/// supports.
pub const TABLE_COLUMNS: u32 = 2048;

/// Kinds of [`MaterialRecord`].
pub const DIFFUSE: u32 = 0;
pub const MIRROR: u32 = 1;
/// Closed solid with an index of refraction.
pub const GLASS: u32 = 2;
/// Thin pane: light goes straight through.
pub const PANE: u32 = 3;

/// Diffuse base under a dielectric coat, or metal.
pub const LAYERED: u32 = 4;

/// Texels of a [`MaterialRecord`].
pub const MATERIAL_TEXELS: u32 = 14;

/// Bits of [`MaterialRecord::flags`]: the back emits as much as the front; the surface is there
/// where its opacity reaches the cutoff; its opacity is its coverage.
pub const DOUBLE_SIDED_BIT: u32 = 1;
pub const MASK_BIT: u32 = 2;
pub const BLEND_BIT: u32 = 4;
/// The surface is seen in its base colour, whatever lights it.
pub const UNLIT_BIT: u32 = 8;

/// Factors of a material, and where its textures are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MaterialRecord {
    /// Base colour: albedo of the diffuse lobe, reflectance of metal, tint of glass. Each 0..1.
    pub color: [f32; 3],
    /// One of [`DIFFUSE`] … [`LAYERED`].
    pub kind: u32,
    /// Radiance that the front side emits, W/(m² sr).
    pub emission: [f32; 3],
    /// Index of refraction of glass and panes.
    pub ior: f32,
    /// 0: perfectly specular lobes.
    pub roughness: f32,
    pub metallic: f32,
    /// Fraction of the light within glass that is transmitted.
    pub transmission: f32,
    /// [`DOUBLE_SIDED_BIT`], [`MASK_BIT`], [`BLEND_BIT`], [`UNLIT_BIT`].
    pub flags: u32,
    /// Reflectance of the coat along the normal, without its strength.
    pub f0: [f32; 3],
    /// Strength of the coat.
    pub specular: f32,
    pub normal_scale: f32,
    pub opacity: f32,
    /// Opacity from which on a masked surface is there.
    pub cutoff: f32,
    /// Fraction of the diffuse light that leaves on the other side, and its colour.
    pub diffuse_transmission: f32,
    pub diffuse_transmission_color: [f32; 3],
    pub clearcoat: f32,
    pub clearcoat_roughness: f32,
    pub clearcoat_normal_scale: f32,
    pub anisotropy: f32,
    /// Radians.
    pub anisotropy_rotation: f32,
    pub sheen_color: [f32; 3],
    pub sheen_roughness: f32,
    pub iridescence: f32,
    pub iridescence_ior: f32,
    /// Thickness of the film where its texture is 0 and where it is 1, nanometres.
    pub iridescence_thickness: [f32; 2],
    /// Texels of the table of materials where the [`TextureRecord`]s begin, 0 for none: base
    /// colour, metallic and roughness, normal, emission; specular, specular colour, transmission,
    /// diffuse transmission; its colour, clear coat, its roughness, its normal; sheen, its
    /// roughness, anisotropy, iridescence; thickness of the film.
    pub textures: [[u32; 4]; 5],
}

/// A texture of a material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TextureRecord {
    /// First texel of the image.
    pub first: u32,
    /// Width, and height shifted by 16 bits.
    pub size: u32,
    /// Two bits each for what lies beyond the borders of u and v ([`WRAP_REPEAT`] …), then
    /// [`LINEAR_BIT`], [`SRGB_BIT`], [`SECOND_UV_BIT`].
    pub flags: u32,
    /// The image, and smaller versions of it that follow.
    pub levels: u32,
    /// Rows of the transform of texture coordinates.
    pub transform: [[f32; 4]; 2],
}

/// Texels beyond the border of an image: the image again, mirrored, or the border's texels.
pub const WRAP_REPEAT: u32 = 0;
pub const WRAP_MIRROR: u32 = 1;
pub const WRAP_CLAMP: u32 = 2;
/// Texels are interpolated.
pub const LINEAR_BIT: u32 = 16;
/// Colours are stored by the sRGB curve.
pub const SRGB_BIT: u32 = 32;
/// The second set of texture coordinates is read.
pub const SECOND_UV_BIT: u32 = 64;

/// Values at the corners of a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Attributes {
    /// Texture coordinates, both sets of each corner.
    pub uvs: [[f32; 4]; 3],
    /// Factors on base colour and opacity.
    pub colors: [[f32; 4]; 3],
    /// Tangents, octahedral; the lowest bit is set where the bitangent is turned.
    pub tangents: [u32; 3],
    pub pad: u32,
}

/// Texels of [`Attributes`].
pub const ATTRIBUTE_TEXELS: u32 = 7;

/// The medium inside a solid.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Medium {
    /// Factor on light that passes the surface of the solid, each 0..1.
    pub tint: [f32; 3],
    /// Index of refraction.
    pub ior: f32,
    /// Absorption coefficient, 1/m.
    pub absorption: [f32; 3],
    /// 20 over the Abbe number; 0 for an index that does not depend on the wavelength.
    pub dispersion: f32,
}

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
    /// Index of the triangle's [`Attributes`] plus one; 0 for none.
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
    pub pad0: u32,
    pub pad1: u32,
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

/// Number of trees of lights, whose roots are the first [`LightNode`]s, and that of the environment
/// among them; see `src/emitters/light_tree.rs`.
pub const LIGHT_ROOTS: u32 = 4;
pub const ENVIRONMENT_ROOT: u32 = 0;
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
/// `src/emitters/light_bounds.rs`. It consists of vectors of four words, as [`BvhNode`] does.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightNode {
    /// Centre of the box around the lights, metres.
    pub center: [f32; 3],
    /// Half extents of the box: eight bits each, z lowest, in units of which the top eight bits are
    /// the exponent, biased as in a float.
    pub half: u32,
    /// Word 0: axis of the cone along which they shine, octahedral. Word 1: cosines of its half
    /// angle, and of the angle from there on beyond which nothing shines; each a 16-bit snorm
    /// number, rounded down. Word 2: bits of the sum of their greatest radiant intensities, or of
    /// the irradiance by lights at infinity, relative to that of all lights. Word 3,
    /// [`Self::next`].
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

/// Sphere around all geometry.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SceneSphere {
    /// Metres.
    pub center: [f32; 3],
    pub radius: f32,
}

/// Size and rotation of the environment map.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct EnvironmentInfo {
    /// Pixels of the environment map; 0 and 0 without one.
    pub columns: u32,
    pub rows: u32,
    /// Cosine and sine of its rotation about +Y.
    pub rotation_cos: f32,
    pub rotation_sin: f32,
}

/// State of a photon path or a camera path. Each bounce overwrites it in place.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Path {
    pub origin: [f32; 3],
    /// History of the path. Each kind of path has its accessors in
    /// `shaders/lib/transport/path.wesl`.
    pub history: u32,
    pub direction: [f32; 3],
    /// Surfaces met so far in the low 12 bits, diffuse ones in the next 12, surfaces passed that
    /// have one medium on both sides in the high 8.
    pub bounces: u32,
    /// Flux in W of a photon (before the division by the number of paths), or weight of a camera
    /// path.
    pub beta: [f32; 3],
    /// Primitive that the path leaves and does not meet next, with [`SPHERE_BIT`] if it is in
    /// contact with others, which it leaves as well; [`NOTHING_LEFT`] for none.
    pub left: u32,
    /// Media around the path, a set of slots.
    pub media: [u32; MEDIA_WORDS],
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
    /// Normal of its surface on the side from which it came, octahedral.
    pub normal: u32,
}

/// [`VisiblePoint::next_map`] of a point for which irradiance kept in cells will do.
pub const BY_CELL: u32 = 1 << 16;

/// A visible point: where a camera path hit a diffuse surface, and the outgoing light is sought.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VisiblePoint {
    /// Metres.
    pub position: [f32; 3],
    /// 0: no point. Otherwise the first map, from 1, that is not gathered here yet, or [`BY_CELL`].
    pub next_map: u32,
    /// Weight of the camera path times the BRDF, albedo/π: multiplies irradiance.
    pub weight: [f32; 3],
    /// Distance along `ng` by which the origin of a ray must be moved off the surface, metres.
    pub offset: f32,
    /// Geometric normal, unit, on the viewer's side.
    pub ng: [f32; 3],
    /// Media around the point: up to eight slots plus one, 8 bits each; 0 and 0 for none. All bits
    /// are set where there are more.
    pub media_low: u32,
    /// Interpolated normal, unit, on the viewer's side of the geometric one.
    pub ns: [f32; 3],
    pub media_high: u32,
    /// Unit, to the viewer.
    pub view: [f32; 3],
    /// Layers above the diffuse lobe, eight bits each: roots of the reflectances of a coat along
    /// the normal and at grazing angles, strongest colour of the sheen and its roughness. 0 for
    /// nothing.
    pub above: u32,
}

/// Vertex of a camera path at which rough lobes are lit. Unit vectors are octahedral, see
/// [`octahedral`]; `ng` and `ns` as in [`VisiblePoint`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LobePoint {
    /// Metres.
    pub position: [f32; 3],
    /// Same as in [`VisiblePoint`].
    pub offset: f32,
    /// Weight of the path before the lobe.
    pub beta: [f32; 3],
    /// n_b/n_a of rough glass, negative for a sheet of it; 0 for lobes that only reflect.
    pub eta: f32,
    pub ng: u32,
    pub ns: u32,
    /// Direction to the viewer.
    pub view: u32,
    pub tangent: u32,
    /// Halves, as all that follow: reflectance along the normal; of rough glass the tint of what is
    /// transmitted.
    pub f0: [u32; 2],
    /// Reflectance at grazing angles.
    pub f90: [u32; 2],
    /// Factor of light that is reflected more than once.
    pub compensation: [u32; 2],
    /// Colour and roughness of the sheen.
    pub sheen: [u32; 2],
    /// Widths of GGX along the tangent and across it.
    pub alpha: u32,
    /// Strength of the clear coat and its width.
    pub clearcoat: u32,
    /// Octahedral, as the others.
    pub clearcoat_normal: u32,
    pub pad: u32,
}

/// Counters of a batch of paths; see `shaders/lib/core/queue.wesl`. A batch has at most 2^18 paths
/// of at most 4095 bounces, so that a counter that grows by one per bounce stays below 2^30. The
/// host adds batches up in 64 bits.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Counters {
    /// Paths in the queue that the current bounce reads.
    pub current: u32,
    /// Paths put into the next queue.
    pub next: u32,
    /// Photons staged, including those that did not fit.
    pub staged: u32,
    /// Light that the limits of bounces took, low word: flux of photons in units of
    /// `1 / PhotonBatch::lost_scale` W, weight of camera paths in units of 1 / [`LOST_SCALE`].
    pub lost: u32,
    /// Rays traced, low and high word.
    pub rays: u32,
    pub rays_high: u32,
    /// Times that a path met more surfaces in one place, or a ray started inside of more media,
    /// than there is room for.
    pub media_overflows: u32,
    /// Rays abandoned when the loop budget was spent.
    pub unfinished: u32,
    /// Infinite or NaN values that were left out, each with its path or sample.
    pub non_finite: u32,
    /// High word of `lost`.
    pub lost_high: u32,
    /// Shadow rays of one pass of direct light over a tile's points.
    pub shadow_rays: u32,
    /// Half of the queues that the current bounce reads: 0 or 1. It writes the other one.
    pub reads: u32,
}

impl Counters {
    /// Rays traced.
    #[must_use]
    pub fn all_rays(&self) -> u64 {
        u64::from(self.rays) | (u64::from(self.rays_high) << 32)
    }

    /// Flux lost to the bounce limit, in the unit of [`Self::lost`].
    #[must_use]
    pub fn all_lost(&self) -> u64 {
        u64::from(self.lost) | (u64::from(self.lost_high) << 32)
    }
}

/// Settings of one batch of photon paths; see `shaders/lib/transport/photon_batch.wesl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PhotonBatch {
    pub seed: u32,
    /// Round of the first path, low and high word: number of paths before it, divided by `strata`.
    pub first_round: u32,
    pub first_round_high: u32,
    pub paths: u32,
    /// Entries of the table of lights.
    pub light_count: u32,
    /// Number of strata of the random number that chooses a light, which are assigned to the paths
    /// in turn; and the stratum of the first path.
    pub strata: u32,
    pub first_stratum: u32,
    /// Diffuse surfaces that a path meets at most.
    pub max_bounces: u32,
    /// [`STORE_GLOBAL`], [`STORE_DIRECT`], [`STORE_CAUSTIC`], [`FOLLOW_DIFFUSE`], [`AIM`],
    /// [`CAUSTICS_APART`], [`EVENLY`].
    pub rules: u32,
    pub staging_capacity: u32,
    pub lost_scale: f32,
    /// Stream of random numbers.
    pub stream: u32,
    /// Targets at which paths are aimed: the first, and how many.
    pub first_target: u32,
    pub target_count: u32,
    /// Surfaces that a path meets at most.
    pub max_surfaces: u32,
    pub pad1: u32,
    /// Sphere that diffuse surfaces outside of it send more photons to, centre and radius; radius
    /// 0: none.
    pub aim: [f32; 4],
}

impl PhotonBatch {
    /// The same batch, starting with the path of that index among all paths of its kind. The
    /// `strata` are assigned to these in turn.
    #[must_use]
    pub fn starting_at(self, path: u64) -> Self {
        let (round, stratum) = (path / u64::from(self.strata), path % u64::from(self.strata));
        Self {
            first_round: round as u32,
            first_round_high: (round >> 32) as u32,
            first_stratum: stratum as u32,
            ..self
        }
    }
}

/// Streams of random numbers: of general photon paths, and of those aimed at mirrors and glass.
pub const STREAM_PHOTON: u32 = 0;
pub const STREAM_CAUSTIC: u32 = 2;
/// The global map still takes photons.
pub const STORE_GLOBAL: u32 = 1;
/// The global map takes photons that come directly from a light.
pub const STORE_DIRECT: u32 = 2;
/// The caustic map still takes photons.
pub const STORE_CAUSTIC: u32 = 4;
/// Paths go on after a diffuse surface.
pub const FOLLOW_DIFFUSE: u32 = 8;
/// Lights outside of the targets send paths towards them only.
pub const AIM: u32 = 16;
/// Caustic photons are those that come from a light through specular surfaces only. Photons that a
/// diffuse surface scattered before belong to the global map.
pub const CAUSTICS_APART: u32 = 32;
/// All targets are chosen as often, whatever their size.
pub const EVENLY: u32 = 64;

/// Maximum number of targets that caustic paths are aimed at.
pub const MAX_TARGETS: u32 = 32;

/// Kinds of photon maps, as the shaders know [`MapKind`](crate::map_kind::MapKind), and how many
/// there are.
pub const GLOBAL_MAP: u32 = 0;
pub const CAUSTIC_MAP: u32 = 1;
pub const MAP_KINDS: u32 = 2;

/// Key of a staged photon. The lowest bits ([`PATH_MASK`]) are the index of the path in its batch.
/// From bit [`PHOTON_INDEX_SHIFT`] on, the bits of [`PHOTON_INDEX_MASK`] are the photon's index
/// among those of its path in that map. From bit [`KIND_SHIFT`] on comes the kind of the map.
pub const PATH_MASK: u32 = 0x3_ffff;
pub const PHOTON_INDEX_SHIFT: u32 = 18;
pub const PHOTON_INDEX_MASK: u32 = 0xfff;
pub const KIND_SHIFT: u32 = 30;

/// Arguments of `store_photons`; see there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Store {
    pub staged: u32,
    pub first_photon: u32,
    pub photons: u32,
    /// The map, [`GLOBAL_MAP`] or [`CAUSTIC_MAP`].
    pub kind: u32,
}

/// Samplers, the sources of sample numbers; see `shaders/lib/core/sampler.wesl`.
pub const SAMPLER_RANDOM: u32 = 0;
pub const SAMPLER_SOBOL: u32 = 1;

/// A camera, and the samples of one tile; see `shaders/lib/camera/camera_tile.wesl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CameraTile {
    pub position: [f32; 3],
    pub seed: u32,
    /// Vector from the centre of the picture, at distance 1, to its right edge.
    pub right: [f32; 3],
    pub width: u32,
    /// Vector from the centre of the picture, at distance 1, to its upper edge.
    pub up: [f32; 3],
    pub height: u32,
    /// Unit direction of view.
    pub forward: [f32; 3],
    /// Samples per pixel of the whole picture.
    pub spp: u32,
    /// Pixel of the tile's upper left corner.
    pub first_column: u32,
    pub first_row: u32,
    /// First sample of each pixel, and samples of each pixel, in this tile.
    pub first_sample: u32,
    pub samples: u32,
    pub pad0: u32,
    /// Path slots per sample: reflection and refraction are both followed at its first
    /// log2(branches) dielectric interfaces.
    pub branches: u32,
    /// Pixels of the tile, in Morton order.
    pub pixels: u32,
    /// 1: rays are parallel and `right`, `up` are in metres; 0: they start from `position`.
    pub parallel: u32,
    /// Radius of the lens, metres; 0 for a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane of focus along the camera's axis, metres.
    pub focus: f32,
    /// Entries of the pixel filter's table, less 1.
    pub filter_steps: u32,
    /// Samples in the tile's margin. They follow those of its pixels.
    pub margin: u32,
    /// Media around the start of the rays, as in [`Light::media`].
    pub media: [u32; MEDIA_WORDS],
    /// Depths along the axis between which the camera sees, metres.
    pub near_depth: f32,
    pub far_depth: f32,
    /// Depth at which parallel rays start, metres, at most 0.
    pub start_depth: f32,
    /// Width of what a sample sees by rough lobes, metres, from which on irradiance kept in cells
    /// will do; 0: nowhere.
    pub cells_from: f32,
}

/// First hit of a camera sample.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FirstHit {
    /// Interpolated normal towards the viewer; 0 if nothing was hit.
    pub normal: [f32; 3],
    /// Distance along the camera's axis, metres.
    pub depth: f32,
    pub albedo: [f32; 3],
    /// 1 if something was hit.
    pub alpha: f32,
    /// Relative to the scene's centre, metres.
    pub position: [f32; 3],
    /// Index of the primitive in the scene; no number to add up.
    pub id: u32,
    /// First set of texture coordinates; 0 without textures.
    pub uv: [f32; 2],
    pub pad0: u32,
    pub pad1: u32,
}

/// Rows of four numbers that a camera sample writes for the output layers: those of [`FirstHit`].
pub const LAYER_ROWS: usize = 4;

/// Sums over a tile's samples of one pixel, by rows. The first row is the radiance, and the number
/// of samples left out of it because the sum would not be finite with them. The others are the rows
/// of the samples.
pub type PixelSums = [[f32; 4]; LAYER_ROWS + 1];

/// Arguments of `light_directly`: one punctual light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DirectLight {
    pub light: u32,
    pub points: u32,
    pub pad0: u32,
    pub pad1: u32,
}

/// Arguments of `sample_emitters`: one sample of each point.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct EmitterSample {
    pub points: u32,
    /// Index of the sample, and number of samples per point.
    pub sample: u32,
    pub samples: u32,
    /// Number of trees of lights that are sampled.
    pub roots: u32,
}

/// Arguments of `start_final_gather` and `sum_final_gather`: some rays of the chosen points.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FinalStep {
    /// Index of the first ray of each point, how many follow each other in this step, and how many
    /// each point has in all.
    pub first_ray: u32,
    pub rays_now: u32,
    pub rays: u32,
    /// Chosen points.
    pub chosen: u32,
    /// 1: the rays of all points of the picture are one set of numbers, those of neighbours follow
    /// each other. 0: the rays of a pixel are a set.
    pub joint: u32,
    pub pad0: u32,
    pub pad1: u32,
    pub pad2: u32,
}

/// Arguments of `reuse_irradiance`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CellGrid {
    /// Cells of level 0 per metre.
    pub per_metre: f32,
    pub levels: u32,
    /// Number of entries less 1; the number is a power of 2.
    pub mask: u32,
    pub points: u32,
    /// Points with this [`VisiblePoint::next_map`] are lit.
    pub next_map: u32,
    pub pad0: u32,
    pub pad1: u32,
    pub pad2: u32,
}

/// Sums over the rays of final gathering of a point, by the directions from which light arrives.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ArrivingLight {
    /// Directions weighted by radiance, and 1 by irradiance.
    pub direction: [f32; 3],
    pub light: f32,
    /// Inverse distances to what was hit, 1/m.
    pub nearness: f32,
    pub pad0: f32,
    pub pad1: f32,
    pub pad2: f32,
}

/// Irradiance at a visible point of one of the pixels of a record grid.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct IrradianceRecord {
    /// Metres.
    pub position: [f32; 3],
    /// Geometric normal, octahedral.
    pub ng: u32,
    /// By that normal, W/m²; negative: no point.
    pub irradiance: [f32; 3],
    /// Eight bits each, signed and normalised: the vector ∫ L ω dω along the surface, over twice
    /// the irradiance; and the fraction of the filter's radius up to which the record is taken.
    pub direction_and_reach: u32,
}

/// Arguments of `filter_irradiance`: records by rows of a grid that is coarser than the picture,
/// each pixel of it with as many slots as a camera sample has branches.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct RecordGrid {
    /// The part of the grid that has records: its first pixel, and pixels along its sides.
    pub first_column: u32,
    pub first_row: u32,
    pub columns: u32,
    pub rows: u32,
    /// Pixels of the grid per pixel of the picture, along both sides.
    pub columns_per_pixel: f32,
    pub rows_per_pixel: f32,
    /// Radius of the filter per metre between camera and point; metres if rays are parallel.
    pub reach: f32,
    /// Pixels of the grid on each side of a point among which the filter looks for records.
    pub footprint: u32,
}

/// Irradiance kept for the points of a cell that lie on one surface.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct IrradianceCell {
    /// Coordinates of the cell, in cells of its level.
    pub coordinates: [i32; 3],
    /// Level + 1; 0: no entry.
    pub level: u32,
    /// The point that speaks for the cell, metres, and its geometric normal.
    pub position: [f32; 3],
    /// Whether the cells of the next level are looked up first: [`WHOLE_CELL`], [`SPLIT_CELL`] or
    /// [`WIDE_CELL`].
    pub split: u32,
    pub normal: [f32; 3],
    pub pad0: u32,
    /// Irradiance at the point, W/m².
    pub irradiance: [f32; 3],
    pub pad1: u32,
}

/// The cell is not split; it is, and speaks for cells in it without an entry; it is, and is too
/// wide to speak for them.
pub const WHOLE_CELL: u32 = 0;
pub const SPLIT_CELL: u32 = 1;
pub const WIDE_CELL: u32 = 2;

/// Distance from the plane of an entry's point, in cells, and cosine to its normal, up to which a
/// point takes its irradiance.
pub const CELL_FLATNESS: f32 = 0.25;
pub const CELL_COSINE: f32 = 0.9;

/// Photons of a cell of the finest level of the photon grid; cells of a coarser cell.
pub const CELL_PHOTONS: u32 = 16;
pub const CELL_FAN: u32 = 8;
/// Bits per axis in one word of a Hilbert key.
pub const KEY_BITS: u32 = 10;
/// Packets of a block, which are searched together.
pub const PACKET_BLOCK: u32 = 8;
/// Queries of a block.
pub const QUERY_BLOCK: u32 = 32;
/// One block in this many is a pilot, which is searched before the others.
pub const PILOT_STRIDE: u32 = 8;
/// One block in this many is searched before the other pilots.
pub const FIRST_PILOT_STRIDE: u32 = 64;
/// Maximum number of rays that survey one disc.
pub const MAX_RAYS: u32 = 180;

/// One cell of the photon grid: [`CELL_PHOTONS`] consecutive photons along a Hilbert curve, or
/// [`CELL_FAN`] cells of the next finer level. Cells are stored level by level, from the coarsest,
/// which is one cell, to the finest.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Cell {
    /// Smallest box around the photons, metres.
    pub lo: [f32; 3],
    /// Box around the directions to where the photons came from: x, y, z in 8 bits each, signed
    /// normalised.
    pub wi_lo: u32,
    pub hi: [f32; 3],
    pub wi_hi: u32,
}

/// Position and incident direction of a sorted photon: all that a search reads.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PhotonPosition {
    /// Metres.
    pub position: [f32; 3],
    /// Direction to where the photon came from, octahedral.
    pub wi: u32,
}

/// Flux and surface normal of a sorted photon.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PhotonFlux {
    /// Flux in W, before the division by the number of emitted paths.
    pub flux: [f32; 3],
    /// Normal of its surface on the side from which it came, octahedral.
    pub normal: u32,
}

/// Sizes of a photon map.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MapInfo {
    /// Photons.
    pub count: u32,
    /// Levels of cells.
    pub levels: u32,
    /// Index of the first photon of the second segment.
    pub split: u32,
    pub pad: u32,
}

/// Settings of one batch of a gather.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GatherInfo {
    /// Queries of the batch, including those without a point.
    pub count: u32,
    /// Index of the batch's first point.
    pub first: u32,
    /// k: number of nearest photons of an estimate.
    pub neighbors: u32,
    /// 1: the radius is the maximum radius, whatever the number of photons.
    pub fixed_radius: u32,
    /// Square of the maximum radius, m²; negative if there is none.
    pub max_radius_squared: f32,
    /// 1 / number of emitted paths.
    pub per_path: f32,
    /// One block of queries in this many is searched.
    pub stride: u32,
    /// Mean of the kernel over the disc.
    pub kernel_mean: f32,
    /// Coefficients of the kernel's polynomial from the rim, see [`crate::density`]: the first
    /// four, and the fifth.
    pub kernel: [f32; 4],
    pub kernel_fifth: f32,
    /// Number of the map gathered, from 1. Points take part whose [`VisiblePoint::next_map`] is not
    /// 0 and at most this.
    pub map_number: u32,
    pub pad0: u32,
    pub pad1: u32,
}

/// Result of a query.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Gathered {
    /// Square of the radius of the estimate, m²: the distance of the nearest photon that is not
    /// summed, or the maximum radius.
    pub radius_squared: f32,
    /// Photons summed.
    pub count: u32,
    /// Hash of the set of photons, see `GatherOptions::fingerprint`.
    pub fingerprint: u32,
}

/// Pixels along the side of a cell of a tile's margin; see `shaders/lib/camera/margin.wesl`.
pub const MARGIN_CELL: u32 = 8;
/// Camera samples of such a cell.
pub const MARGIN_SAMPLES: u32 = 16;

/// One round in which points of a tile share estimates; see `shaders/lib/camera/share.wesl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ShareRound {
    /// Cells of the tile.
    pub cells: u32,
    /// Pixels of a cell: a power of 4, consecutive in the tile, hence a square.
    pub cell_pixels: u32,
    /// Samples of each pixel in the tile.
    pub samples: u32,
    /// Samples of a pixel that are candidates for the query, and the stride of the pixels of a cell
    /// that have candidates.
    pub candidates: u32,
    pub step: u32,
    /// Cells of the tile's margin that take part.
    pub margin: u32,
    pub branches: u32,
    /// Maximum distance at which a point takes a query's estimate, relative to the radius of the
    /// estimate; squared.
    pub reach_squared: f32,
    /// Visible points of the tile, without its margin.
    pub points: u32,
    /// Same as in [`GatherInfo`].
    pub map_number: u32,
}

/// Consecutive entries that one invocation of the radix sort processes.
pub const RADIX_CHUNK: u32 = 256;
/// Values of one digit of the radix sort.
pub const RADIX_DIGITS: u32 = 256;
/// Values that one invocation of a prefix sum adds up.
pub const SCAN_SPAN: u32 = 256;

/// One digit of the radix sort; see `shaders/lib/core/radix.wesl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SortStep {
    /// Entries to sort.
    pub count: u32,
    /// Lowest bit of the digit.
    pub shift: u32,
    /// Distance of the counts of neighbouring digits.
    pub stride: u32,
    pub pad: u32,
}

/// Boxes per segment of the first reduction of the photons' bounds.
pub const BOUND_LANES: u32 = 1024;

/// Arguments of `bound_photons` for one segment.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BoundStep {
    /// Photons of the segment.
    pub count: u32,
    /// Index of its first box.
    pub first_box: u32,
}

/// Arguments of `key_photons`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct KeyStep {
    /// Invocations.
    pub count: u32,
    /// Photons of the segment that is bound: the first, and how many.
    pub segment_first: u32,
    pub segment_count: u32,
    /// 1 for the fine half of the Hilbert key, 0 for the coarse one.
    pub fine: u32,
}

/// Arguments of `sort_photons`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MoveStep {
    /// Sorted photons of the segment that is written: the first, and how many.
    pub sorted_first: u32,
    pub sorted_count: u32,
    /// Unsorted photons of the segment that is read: the first, and how many.
    pub segment_first: u32,
    pub segment_count: u32,
}

/// Arguments of `build_grid`: the cells to make.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GridStep {
    /// Photons of the map.
    pub photons: u32,
    /// Level of the cells, 0 for the finest.
    pub level: u32,
    /// Indices of the first cell of the level and of the next finer one.
    pub base: u32,
    pub finer_base: u32,
    /// Cells of the next finer level.
    pub finer_count: u32,
    /// The cells of this dispatch: the first in its level, and how many.
    pub first_cell: u32,
    pub cell_count: u32,
    pub pad: u32,
}

/// Bytes of `SearchState` in the shaders: the state of a query between dispatches.
pub const SEARCH_STATE_BYTES: usize = 128;
/// Bytes of `GatherState` in the shaders: the sums of a packet between dispatches.
pub const GATHER_STATE_BYTES: usize = 1072;

/// Octahedral encoding of a unit vector in two 16-bit signed normalised numbers (Cigolle et al.
/// 2014, "A Survey of Efficient Representations for Independent Unit Vectors"); x in the low half.
/// Twin of `encode_octahedral` in `shaders/lib/core/octahedral.wesl`.
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
