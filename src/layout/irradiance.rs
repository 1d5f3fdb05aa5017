//! Irradiance kept in cells and in records.

use bytemuck::{Pod, Zeroable};

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
    /// Points with this [`VisiblePoint::next_map`](super::VisiblePoint::next_map) are lit.
    pub next_map: u32,
    pub pad0: u32,
    pub pad1: u32,
    pub pad2: u32,
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
    /// Fraction of the filter's radius up to which the record is taken.
    pub reach: f32,
    /// Radiance that the coat reflects to the viewer, over its albedo, W/(m² sr). Negative: it has
    /// none of which rays of final gathering bring the light.
    pub coat: [f32; 3],
    /// As `reach`, of the coat: narrow lobes show details of what is near.
    pub coat_reach: f32,
}

/// The directions from which the light of an [`IrradianceRecord`] comes, of each colour four
/// numbers of eight bits, signed and normalised. The first three are v/(1 + |v|), where v is the
/// vector ∫ L ω dω along the surface, over the irradiance E; the last one is E/∫ L dω, the mean
/// cosine. And what is asked of the nearest record alone.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightDirections {
    pub red: u32,
    pub green: u32,
    pub blue: u32,
    /// As [`IrradianceRecord::reach`], whatever walls are near.
    pub open_reach: f32,
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
    /// Whether the disc of its estimate is narrow: 0 or 1.
    pub narrow: u32,
    /// Irradiance at the point, W/m².
    pub irradiance: [f32; 3],
    pub pad: u32,
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
/// The same cosine, where the disc of the entry's estimate is narrow, and no entry is on the
/// point's surface.
pub const NARROW_COSINE: f32 = 0.25;
/// Number of entries of a cell, one for each surface, from which on further surfaces have entries
/// in narrower cells alone.
pub const CELL_SURFACES: u32 = 8;
