//! Radiance estimates: searches, their results, and points that share them.

use bytemuck::{Pod, Zeroable};

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
    /// Number of the map gathered, from 1. Points take part whose
    /// [`VisiblePoint::next_map`](super::VisiblePoint::next_map) is not 0 and at most this.
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
    /// Whether its disc is narrow: 0 or 1.
    pub narrow: u32,
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
    /// 1: cells that follow each other are no neighbours, and share nothing with each other.
    pub is_listed: u32,
}

/// Bytes of `SearchState` in the shaders: the state of a query between dispatches.
pub const SEARCH_STATE_BYTES: usize = 128;
/// Bytes of `GatherState` in the shaders: the sums of a packet between dispatches.
pub const GATHER_STATE_BYTES: usize = 1072;
