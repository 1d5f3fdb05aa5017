//! Tiles: parts of a picture's samples, their sizes, and counts of one step over a tile.

use std::sync::Arc;

use crate::{
    layout::{CameraTile, Counters, LOST_SCALE, MARGIN_CELL},
    settings::PictureSettings,
};

/// Rays of final gathering of each visible point of a small picture for which a tile has room.
const RAYS_AT_ONCE: u64 = 16;
/// Visible points for which a tile has room at least, without its margin; fewer for a picture of
/// few pixels, if the smallest tile fits.
const MIN_ROOM: u64 = 1 << 16;
const MIN_ROOM_PER_PIXEL: u64 = 128;
/// Maximum number of samples of one pixel in a tile.
pub(super) const PIXEL_SAMPLES: u32 = PictureSettings::MOST_EVEN;
/// Minimum number of pixels of a tile.
const MIN_TILE_PIXELS: u32 = 64;

/// A part of the picture's samples.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Pixels, a power of 2, in Morton order; some of them may lie outside the picture. Of a list,
    /// as many as it has.
    pub pixels: u32,
    /// Pixel of the upper left corner.
    pub first_column: u32,
    pub first_row: u32,
    pub first_sample: u32,
    /// Samples of each pixel.
    pub samples: u32,
    /// Some pixels of the square; `None`: all.
    pub listed: Option<Listed>,
}

impl Tile {
    /// Columns and rows of a tile without a list.
    #[must_use]
    pub fn sides(&self) -> (u32, u32) {
        sides_of(self.pixels)
    }
}

/// Some pixels of a square.
#[derive(Clone, Debug)]
pub struct Listed {
    /// Their numbers in Morton order.
    pub pixels: Arc<[u32]>,
    /// [`Further::one_in`] of each.
    pub one_in: Arc<[u32]>,
    /// Samples of each of these pixels when this tile is done.
    pub samples: u32,
}

/// What a pixel has besides the samples of every pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Further {
    /// Number of times that its samples double.
    pub doublings: u32,
    /// One of that many further samples, a power of two, has the light of the caustic map, for all
    /// of them.
    pub one_in: u32,
}

/// Counts of one step, for the statistics.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepCount {
    pub rays: u64,
    pub media_overflows: u64,
    pub unfinished: u64,
    pub non_finite: u64,
    /// Weight of the camera paths that the chain limit ended, in paths.
    pub lost: f64,
}

impl std::ops::AddAssign for StepCount {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.media_overflows += other.media_overflows;
        self.unfinished += other.unfinished;
        self.non_finite += other.non_finite;
        self.lost += other.lost;
    }
}

impl From<Counters> for StepCount {
    fn from(counters: Counters) -> Self {
        Self {
            rays: counters.all_rays(),
            media_overflows: u64::from(counters.media_overflows),
            unfinished: u64::from(counters.unfinished),
            non_finite: u64::from(counters.non_finite),
            lost: counters.all_lost() as f64 / f64::from(LOST_SCALE),
        }
    }
}

/// Visible points for which a tile has room: those of a batch of the device, with final gathering
/// twice as many since each step of its rays waits for the device; or those of the whole picture
/// and some of their rays; and at least those of the smallest tile.
pub(super) fn room_for(view: &CameraTile, batch: u64, final_rays: u32) -> u64 {
    let pixels = u64::from(view.width) * u64::from(view.height);
    let points = pixels * u64::from(view.branches) * u64::from(view.spp);
    let rays = u64::from(final_rays).clamp(1, RAYS_AT_ONCE);
    let most = if final_rays > 0 { 2 * batch } else { batch };
    let smallest = u64::from(MIN_TILE_PIXELS * view.branches * view.spp.min(PIXEL_SAMPLES));
    let least = MIN_ROOM.min((MIN_ROOM_PER_PIXEL * pixels).max(smallest).next_power_of_two());
    (points * rays).next_power_of_two().clamp(least.min(most), most).max(smallest)
}

/// Pixels along the sides of each tile, powers of 2.
pub(super) fn tile_sides(view: &CameraTile, room: u64) -> (u32, u32) {
    let pixels = (room as u32 / (view.branches * view.spp.min(PIXEL_SAMPLES))).max(MIN_TILE_PIXELS);
    let side_bits = |side: u32| side.next_power_of_two().ilog2();
    let needed = 2 * side_bits(view.width.max(view.height)).max(MIN_TILE_PIXELS.ilog2() / 2);
    let bits = pixels.ilog2().min(needed);
    sides_of(1 << bits)
}

/// Sides of a square, or half of one, of so many pixels, a power of 2.
fn sides_of(pixels: u32) -> (u32, u32) {
    let bits = pixels.ilog2();
    (1 << bits.div_ceil(2), 1 << (bits / 2))
}

/// Number of a pixel in Morton order, by its column and row in a tile or in the picture, below
/// 65,536.
#[must_use]
pub fn morton_number(column: u32, row: u32) -> u32 {
    let spread = |x: u32| (0..16).fold(0, |sum, bit| sum | ((x >> bit) & 1) << (2 * bit));
    spread(column) | (spread(row) << 1)
}

/// Column and row of the pixel of that number.
pub(super) fn morton_place(number: u32) -> (u32, u32) {
    let even_bits = |i: u32| (0..16).fold(0, |sum, bit| sum | ((i >> bit) & (1 << bit)));
    (even_bits(number), even_bits(number >> 1))
}

/// Number of cells in the margin of a tile of that size.
pub(super) fn margin_cells((width, height): (u32, u32)) -> u32 {
    2 * (width / MARGIN_CELL + 2) + 2 * (height / MARGIN_CELL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_has_room_for_its_points() {
        for (side, branches, spp) in [1, 16, 33, 4096]
            .into_iter()
            .flat_map(|side| [1, 4, 8, 16].map(|branches| (side, branches)))
            .flat_map(|(side, branches)| [1, 4, 128, 160, 256, 5000].map(|spp| (side, branches, spp)))
        {
            let view = CameraTile { width: side, height: side, branches, spp, ..Default::default() };
            for (batch, final_rays) in [(1 << 16, 0), (1 << 16, 16), (1 << 20, 0)] {
                let room = room_for(&view, batch, final_rays);
                let (width, height) = tile_sides(&view, room);
                let points = u64::from(width * height) * u64::from(branches * spp.min(PIXEL_SAMPLES));
                assert!(points <= room, "{points} points, room for {room}: {side} {branches} {spp} {final_rays}");
            }
        }
    }

    #[test]
    fn numbers_and_places_are_inverse() {
        for place in [(0, 0), (1, 0), (0, 1), (5, 3), (300, 255)] {
            assert_eq!(morton_place(morton_number(place.0, place.1)), place);
        }
        assert_eq!([(0, 0), (1, 0), (0, 1), (1, 1), (2, 0)].map(|(x, y)| morton_number(x, y)), [0, 1, 2, 3, 4]);
    }
}
