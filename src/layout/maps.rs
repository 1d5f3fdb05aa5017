//! Photon maps: positions and fluxes, the grid over them, and the steps that sort them.

use bytemuck::{Pod, Zeroable};

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
