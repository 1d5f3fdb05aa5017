//! Paths of photons and of the camera, their queues, and the photons that they leave.

use bytemuck::{Pod, Zeroable};

use super::limits::MEDIA_WORDS;

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
    /// Primitive that the path leaves and does not meet next, with
    /// [`SPHERE_BIT`](super::SPHERE_BIT) if it is in contact with others, which it leaves as well;
    /// [`NOTHING_LEFT`](super::NOTHING_LEFT) for none.
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
    /// `1 / PhotonBatch::lost_scale` W, weight of camera paths in units of 1 /
    /// [`LOST_SCALE`](super::LOST_SCALE).
    pub lost: u32,
    /// Rays traced, low and high word.
    pub rays: u32,
    pub rays_high: u32,
    /// Times that a path met more surfaces in one place, or a ray started inside of more media,
    /// than there is room for.
    pub media_overflows: u32,
    /// Paths or points with rays that have not come to their ends within the loop budget.
    pub unfinished: u32,
    /// Infinite or NaN values that were left out, each with its path or sample.
    pub non_finite: u32,
    /// High word of `lost`.
    pub lost_high: u32,
    /// Shadow rays of one pass of direct light over a tile's points.
    pub shadow_rays: u32,
    /// Half of the queues that the current bounce reads: 0 or 1. It writes the other one.
    pub reads: u32,
    /// Rays of the last bounce beyond the first of each path.
    pub further_rays: u32,
}

impl Counters {
    /// Rays traced.
    #[must_use]
    pub fn all_rays(&self) -> u64 {
        (u64::from(self.rays) | (u64::from(self.rays_high) << 32)) + u64::from(self.further_rays)
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
    /// [`CAUSTICS_APART`].
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
    /// Least probability with which a photon is stored.
    pub least_kept: f32,
    /// Sphere that diffuse surfaces outside of it send more photons to, centre and radius; radius
    /// 0: none.
    pub aim: [f32; 4],
    /// Photons are stored with the probability importance times this, at most 1; 0: all are stored.
    pub kept_scale: f32,
    /// Targets after those that parallel light alone is aimed at.
    pub entry_count: u32,
    pub pad0: u32,
    pub pad1: u32,
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

/// Streams of random numbers: of general photon paths, of those aimed at mirrors and glass, and of
/// the paths that look where the light goes before.
pub const STREAM_PHOTON: u32 = 0;
pub const STREAM_CAUSTIC: u32 = 2;
pub const STREAM_PILOT: u32 = 4;
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

/// Bit of a node of the octree over what cameras see that has children.
pub const IMPORTANCE_CHILDREN: u32 = 0x8000_0000;

/// Bins along each side of the square of directions from which light comes through an opening.
pub const OPENINGS_SIDE: u32 = 64;

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
