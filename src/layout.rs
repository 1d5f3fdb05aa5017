//! Every struct that crosses to the GPU, in one file.
//!
//! Each struct here has a twin of the same name in `shaders/`; `tests/house/layouts.rs` reflects
//! the shaders and compares names, order, offsets and sizes. Vectors are arrays so that `repr(C)`
//! and WGSL agree on alignment: a `[f32; 3]` is followed by a 4-byte field, as WGSL places a
//! `vec3f`.

use bytemuck::{Pod, Zeroable};

/// Invocations per workgroup, in every kernel.
pub const WORKGROUP_SIZE: u32 = 64;
/// Bits of the index of a node or a primitive where more stands above it.
pub const BVH_INDEX_BITS: u32 = 28;
/// Workgroups per dimension that every adapter can dispatch.
pub const MAX_WORKGROUPS: u32 = 65_535;
/// Children that a BVH traversal can postpone; [`crate::bvh`] builds no tree that needs more.
pub const BVH_STACK: usize = 48;
/// Bound of the weight by which an interpolated normal changes flux that grazes the geometric
/// surface.
pub const MAX_NORMAL_WEIGHT: f32 = 8.0;
/// Rounding of a hit point, as a fraction of the largest coordinate that it is computed from:
/// 2^-19.
pub const OFFSET_SCALE: f32 = 1.907_348_6e-6;
/// Media that a path can be inside of at once.
pub const MEDIA_DEPTH: usize = 4;

/// One interior node of the BVH: its children's boxes and what they are, four words at a time as
/// software Vulkan reads them fastest. Interior children come before leaves and lie side by side,
/// as do the primitives of all its leaves. Made by `BvhNode::new` in `src/bvh/node.rs`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct BvhNode {
    /// Bits of the lower corner of the box around all children, metres; then the shape: for each
    /// axis eight bits, the exponent of a unit as in a float's bits, and from bit 24 two bits for
    /// each child, the primitives of a leaf less one.
    pub grid: [u32; 4],
    /// For each axis the lower bounds of the children's boxes, eight bits each, in units from the
    /// corner; then the first interior child in 28 bits and how many there are.
    pub low: [u32; 4],
    /// The upper bounds; then the leaves' first primitive in 28 bits and the number of all
    /// children.
    pub high: [u32; 4],
}

/// Set in [`Primitive::material`] when the primitive is a sphere.
pub const SPHERE_BIT: u32 = 0x8000_0000;

/// Set there when the primitive's material is a mirror or glass: where surfaces coincide, the
/// others are met first.
pub const DELTA_BIT: u32 = 0x4000_0000;

/// A triangle `v0, v0 + e1, v0 + e2`, or a sphere with centre `v0` and radius `e1.x`, in the order
/// of the BVH's leaves.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Primitive {
    pub v0: [f32; 3],
    /// Index into the materials, with [`SPHERE_BIT`] for a sphere, and on the device [`DELTA_BIT`]
    /// for a delta surface.
    pub material: u32,
    pub e1: [f32; 3],
    /// Index of the primitive in the scene before the BVH reordered it.
    pub id: u32,
    pub e2: [f32; 3],
    /// Index of the primitive as a [`Light`], plus one; 0 if it does not shine.
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
    /// 1 if the corners' normals all equal the geometric one: the surface is flat and the rest need
    /// not be read.
    pub flat_shaded: u32,
}

/// Texels in a row of a table (`gpu::Table`): the least width of a texture that every device has.
pub const TABLE_COLUMNS: u32 = 2048;

/// Kinds of [`Material`].
pub const DIFFUSE: u32 = 0;
pub const MIRROR: u32 = 1;
/// Closed solid with an index of refraction.
pub const GLASS: u32 = 2;
/// Thin pane: light goes straight through.
pub const PANE: u32 = 3;

/// How a surface scatters and shines.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Diffuse: albedo. Mirror: tint of the reflection. Glass, pane: tint of what is transmitted.
    /// Each 0..1.
    pub color: [f32; 3],
    /// One of [`DIFFUSE`], [`MIRROR`], [`GLASS`], [`PANE`].
    pub kind: u32,
    /// Radiance that its front side sends out, W/(m² sr).
    pub emission: [f32; 3],
    /// Index of refraction of panes.
    pub ior: f32,
    /// 1 if its back sends out as much.
    pub double_sided: u32,
    /// Index of the [`Medium`] in the solid, of glass.
    pub medium: u32,
    pub pad0: u32,
    pub pad1: u32,
}

/// What fills a solid.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Medium {
    /// Index of refraction.
    pub ior: f32,
}

/// Kinds of [`Light`]: punctual ones,
pub const POINT_LIGHT: u32 = 0;
pub const SPOT_LIGHT: u32 = 1;
pub const DIRECTIONAL_LIGHT: u32 = 2;
/// surfaces,
pub const TRIANGLE_LIGHT: u32 = 3;
pub const SPHERE_LIGHT: u32 = 4;
/// and what comes from all around.
pub const ENVIRONMENT_LIGHT: u32 = 5;

/// Anything that shines: a punctual light, an emissive triangle or sphere, or the environment. Its
/// power is `emission · area · solid_angle`, but for directional lights and the environment.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// Point, spot: place, metres. Triangle: its first corner. Sphere: its centre.
    pub position: [f32; 3],
    /// One of [`POINT_LIGHT`] … [`ENVIRONMENT_LIGHT`].
    pub kind: u32,
    /// Spot, directional: unit direction in which it shines. Triangle: edge to the second corner.
    /// Sphere: (radius, 0, 0).
    pub e1: [f32; 3],
    /// What a user calls one light: all that shines by one material is a group.
    pub group: u32,
    /// Spot: 1 − cos of the outer angle, and width in cosines of the falloff. Triangle: edge to the
    /// third corner.
    pub e2: [f32; 3],
    /// Integral over all directions of the share of `emission` that goes there, sr: point 4π, spot
    /// as its falloff says, surfaces π for the front alone and 2π for both sides.
    pub solid_angle: f32,
    /// Point, spot: radiant intensity (on the axis), W/sr. Directional: irradiance of a surface
    /// that faces it, W/m². Triangle, sphere: radiance, W/(m² sr). Environment: 1, a factor on its
    /// pixels.
    pub emission: [f32; 3],
    /// Area of a surface, m²; 1 without one.
    pub area: f32,
    /// Media in which paths start on the front, and on the back of a surface: their indices, each
    /// plus one, outermost first; 0 for none. See [`crate::bvh::MediaProbe`].
    pub media: [u32; MEDIA_DEPTH],
    pub back_media: [u32; MEDIA_DEPTH],
}

/// One entry of a table by which lights are chosen.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightChoice {
    /// Probability that this light or one before it is chosen; 1 for the last that can be.
    pub cdf: f32,
    /// Probability of this light: the difference to its predecessor.
    pub probability: f32,
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

/// A path on its way: a photon, or a camera ray. Rewritten in place by each bounce.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Path {
    pub origin: [f32; 3],
    /// What is remembered of the path, by accessors of its kind in
    /// `shaders/lib/transport/path.wesl`.
    pub history: u32,
    pub direction: [f32; 3],
    /// Surfaces met so far.
    pub bounces: u32,
    /// Flux in W of a photon (before the division by the number of paths), or weight of a camera
    /// path.
    pub beta: [f32; 3],
    /// Depth of the stack of media.
    pub media_count: u32,
    /// Indices of the media around the path, outermost first.
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
    /// Normal of its surface on the side from which it came, octahedral.
    pub normal: u32,
}

/// Where a camera path met a diffuse surface; asks for the light that leaves there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct VisiblePoint {
    /// Metres.
    pub position: [f32; 3],
    /// 0: no point. Otherwise the first map, from 1, that is not gathered here yet.
    pub next_map: u32,
    /// Weight of the camera path times the BRDF, albedo/π: multiplies irradiance.
    pub weight: [f32; 3],
    /// Distance by which a ray that leaves must be moved along `ng` off the surface, metres.
    pub offset: f32,
    /// Geometric normal, unit, on the viewer's side.
    pub ng: [f32; 3],
    /// Media around the point as in [`Light::media`], 16 bits each: the two outermost, and below
    /// the others. 0 and 0 for none, and where one of them is not among the first 65,535.
    pub media_outer: u32,
    /// Interpolated normal, unit, on the viewer's side of the geometric one.
    pub ns: [f32; 3],
    pub media_inner: u32,
}

/// What happens to a batch of paths; see `shaders/lib/core/queue.wesl`. A batch has at most 2^18
/// paths of at most 4095 bounces, so that what is counted once a bounce stays below 2^30; the host
/// adds batches up in 64 bits.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Counters {
    /// Paths in the list that the running bounce reads.
    pub current: u32,
    /// Paths put into the next list.
    pub next: u32,
    /// Photons staged, also those that did not fit.
    pub staged: u32,
    /// Flux that the bounce limit took, in units of `1 / PhotonBatch::lost_scale` W: low word.
    pub lost: u32,
    /// Rays traced, low and high word.
    pub rays: u32,
    pub rays_high: u32,
    /// Times that a path entered more media than the stack holds.
    pub media_overflows: u32,
    /// Rays given up after the loop budget.
    pub unfinished: u32,
    /// Infinite or undefined numbers that were left out, each with the path or sample that it
    /// belonged to.
    pub non_finite: u32,
    /// High word of `lost`.
    pub lost_high: u32,
    /// Shadow rays of one pass of direct light over a tile's points.
    pub shadow_rays: u32,
}

impl Counters {
    /// Rays traced.
    #[must_use]
    pub fn all_rays(&self) -> u64 {
        u64::from(self.rays) | (u64::from(self.rays_high) << 32)
    }

    /// Flux that the bounce limit took, in its unit.
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
    /// Round of the first path, low and high word: paths before it over `turns`.
    pub first_round: u32,
    pub first_round_high: u32,
    pub paths: u32,
    /// Entries of the table of lights.
    pub light_count: u32,
    /// The range of random numbers that choose lights is cut into this many parts, dealt to the
    /// paths in turn; and the part of the first path.
    pub turns: u32,
    pub first_turn: u32,
    pub max_bounces: u32,
    /// [`STORE_GLOBAL`], [`STORE_DIRECT`], [`STORE_CAUSTIC`], [`FOLLOW_DIFFUSE`], [`AIM`],
    /// [`CAUSTICS_APART`].
    pub rules: u32,
    pub staging_capacity: u32,
    pub lost_scale: f32,
    /// Stream of random numbers.
    pub stream: u32,
    /// Targets at which paths are aimed: the first, and how many.
    pub first_target: u32,
    pub target_count: u32,
    pub pad0: u32,
    pub pad1: u32,
}

impl PhotonBatch {
    /// The same batch with its first path at that place among all paths of its kind, which are
    /// dealt to `turns` in turn.
    #[must_use]
    pub fn starting_at(self, path: u64) -> Self {
        let (round, turn) = (path / u64::from(self.turns), path % u64::from(self.turns));
        Self { first_round: round as u32, first_round_high: (round >> 32) as u32, first_turn: turn as u32, ..self }
    }
}

/// Streams of random numbers: of general photon paths, and of those aimed at mirrors and glass.
pub const STREAM_PHOTON: u32 = 0;
pub const STREAM_CAUSTIC: u32 = 2;
/// The global map still takes photons.
pub const STORE_GLOBAL: u32 = 1;
/// The global map takes photons that come straight from a light.
pub const STORE_DIRECT: u32 = 2;
/// The caustic map still takes photons.
pub const STORE_CAUSTIC: u32 = 4;
/// Paths go on after a diffuse surface.
pub const FOLLOW_DIFFUSE: u32 = 8;
/// Lights outside of the targets send paths towards them only.
pub const AIM: u32 = 16;
/// Caustic photons are those that come from a light through delta surfaces only; what a diffuse
/// surface scattered before belongs to the global map.
pub const CAUSTICS_APART: u32 = 32;

/// Targets that caustic paths are aimed at, at most.
pub const MAX_TARGETS: u32 = 32;

/// Kinds of photon maps, as the shaders know [`MapKind`](crate::map_kind::MapKind), and how many
/// there are.
pub const GLOBAL_MAP: u32 = 0;
pub const CAUSTIC_MAP: u32 = 1;
pub const MAP_KINDS: u32 = 2;

/// Key of a staged photon: the low bits are the path within its batch; from the shift on the
/// photon's number on its path, as many bits as the mask has; then the kind of the map.
pub const PATH_MASK: u32 = 0x3_ffff;
pub const PLACE_SHIFT: u32 = 18;
pub const PLACE_MASK: u32 = 0xfff;
pub const KIND_SHIFT: u32 = 30;

/// What `store_photons` needs to know; see there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Store {
    pub staged: u32,
    pub first_photon: u32,
    pub photons: u32,
    /// The map, [`GLOBAL_MAP`] or [`CAUSTIC_MAP`].
    pub kind: u32,
}

/// Where the numbers for sampling come from; see `shaders/lib/core/sampler.wesl`.
pub const SAMPLER_RANDOM: u32 = 0;
pub const SAMPLER_SOBOL: u32 = 1;

/// A camera and the part of its samples that one tile holds; see
/// `shaders/lib/camera/camera_tile.wesl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CameraTile {
    pub position: [f32; 3],
    pub seed: u32,
    /// From the centre of the picture, at distance 1, to its right edge.
    pub right: [f32; 3],
    pub width: u32,
    /// From the centre of the picture, at distance 1, to its upper edge.
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
    pub max_bounces: u32,
    /// Places for paths of a sample: both ways are followed at its first log2(branches) dielectric
    /// interfaces.
    pub branches: u32,
    /// Pixels of the tile, in Morton order.
    pub pixels: u32,
    /// 1: rays are parallel and `right`, `up` are in metres; 0: they start from `position`.
    pub parallel: u32,
    /// Radius of the lens, metres; 0 for a pinhole.
    pub lens_radius: f32,
    /// Distance of the sharp plane along the camera's axis, metres.
    pub focus: f32,
    /// Entries of the pixel filter's table, less 1.
    pub filter_steps: u32,
    /// Samples in the tile's margin: they follow those of its pixels.
    pub margin: u32,
    /// Media around the start of the rays, as in [`Light::media`].
    pub media: [u32; MEDIA_DEPTH],
    /// Depths along the axis between which the camera sees, metres.
    pub near_depth: f32,
    pub far_depth: f32,
    /// Depth at which parallel rays start, metres, at most 0.
    pub start_depth: f32,
    pub pad: u32,
}

/// What the first ray of a camera sample hit.
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
}

/// Rows of four numbers that a camera sample writes for the output layers: those of [`FirstHit`].
pub const LAYER_ROWS: usize = 2;

/// Sums over a tile's samples of one pixel, by rows: radiance with the number of samples that are
/// not in its sum, as it would not be finite with them; then the rows of the samples.
pub type PixelSums = [[f32; 4]; LAYER_ROWS + 1];

/// Which punctual light `light_directly` takes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DirectLight {
    pub light: u32,
    pub points: u32,
    pub pad0: u32,
    pub pad1: u32,
}

/// Which of the samples `sample_emitters` takes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct EmitterSample {
    pub points: u32,
    /// The sample, and how many a point has.
    pub sample: u32,
    pub samples: u32,
    /// Entries of the table of lights.
    pub light_count: u32,
}

/// Which rays of final gathering `start_final_gather` starts.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FinalStep {
    /// Which of the rays of a visible point, and how many it has.
    pub ray: u32,
    pub rays: u32,
    /// Visible points.
    pub points: u32,
    pub pad: u32,
}

/// Photons of a finest cell of the photon grid; cells of a coarser one.
pub const CELL_PHOTONS: u32 = 16;
pub const CELL_FAN: u32 = 8;
/// Bits per axis in one word of a Hilbert key.
pub const KEY_BITS: u32 = 10;
/// Packets that are searched together: a block.
pub const PACKET_BLOCK: u32 = 8;
/// Queries of a block.
pub const QUERY_BLOCK: u32 = 32;
/// One block of so many is a pilot, which is searched before the others,
pub const PILOT_STRIDE: u32 = 8;
/// and one of so many before these.
pub const FIRST_PILOT_STRIDE: u32 = 64;
/// Rays that survey one disc at most.
pub const MOST_RAYS: u32 = 150;

/// One cell of the photon grid: [`CELL_PHOTONS`] photons that follow each other along a Hilbert
/// curve, or [`CELL_FAN`] cells of the next finer level. Cells lie level by level, the coarsest,
/// which is one cell, first.
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
    /// Index of the first photon of the second window.
    pub split: u32,
    pub pad: u32,
}

/// Settings of one batch of a gather.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GatherInfo {
    /// Queries of the batch, also those without a point.
    pub count: u32,
    /// Index of the batch's first point.
    pub first: u32,
    /// k.
    pub neighbors: u32,
    /// 1: the radius is the maximum radius, whatever the number of photons.
    pub fixed_radius: u32,
    /// Square of the largest radius, m²; negative if there is none.
    pub max_radius_squared: f32,
    /// 1 / number of emitted paths.
    pub per_path: f32,
    /// Of how many blocks of queries one is searched.
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

/// What a query found.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Gathered {
    /// Square of the radius of the estimate, m²: of the nearest photon that is not summed, or the
    /// largest radius.
    pub radius_squared: f32,
    /// Photons summed.
    pub count: u32,
    /// Tells the set of photons from others, see `GatherOptions::fingerprint`.
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
    /// Pixels of a cell, a power of 4, that follow each other in the tile: a square.
    pub cell_pixels: u32,
    /// Samples of each pixel in the tile.
    pub samples: u32,
    /// The samples of a pixel of which a query is chosen, and in which of the cell's pixels: every
    /// step-th.
    pub candidates: u32,
    pub step: u32,
    /// Cells of the tile's margin that take part.
    pub margin: u32,
    pub branches: u32,
    /// Square of the distance within which a point takes a query's estimate, over that of the
    /// estimate's radius.
    pub reach_squared: f32,
    /// Visible points of the tile, without its margin.
    pub points: u32,
    /// As in [`GatherInfo`].
    pub map_number: u32,
}

/// Consecutive entries that one invocation of the radix sort walks.
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

/// Boxes per window of the first reduction of the photons' bounds.
pub const BOUND_LANES: u32 = 1024;

/// What `bound_photons` needs to know of its window.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BoundStep {
    /// Photons of the window.
    pub count: u32,
    /// Index of its first box.
    pub first_box: u32,
}

/// What `key_photons` needs to know.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct KeyStep {
    /// Invocations.
    pub count: u32,
    /// Photons of the window that is bound: the first, and how many.
    pub window_first: u32,
    pub window_count: u32,
    /// 1 for the fine half of the Hilbert key, 0 for the coarse one.
    pub fine: u32,
}

/// What `sort_photons` needs to know.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MoveStep {
    /// Sorted photons of the window that is written: the first, and how many.
    pub sorted_first: u32,
    pub sorted_count: u32,
    /// Unsorted photons of the window that is read: the first, and how many.
    pub window_first: u32,
    pub window_count: u32,
}

/// What `build_grid` needs to know of the cells that it makes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct GridStep {
    /// Photons of the map.
    pub photons: u32,
    /// Level of the cells, 0 for the finest.
    pub level: u32,
    /// Places of the first cell of the level and of the next finer one.
    pub base: u32,
    pub finer_base: u32,
    /// Cells of the next finer level.
    pub finer_count: u32,
    /// The cells of this dispatch: the first in its level, and how many.
    pub first_cell: u32,
    pub cell_count: u32,
    pub pad: u32,
}

/// Bytes of `SearchState` in the shaders, in which a query waits for its next dispatch.
pub const SEARCH_STATE_BYTES: usize = 112;
/// Bytes of `GatherState` in the shaders, in which the sums of a packet wait.
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
