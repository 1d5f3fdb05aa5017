//! Tiles of further samples in a few pixels of a tile.

use super::{
    camera_tracer::CameraTracer,
    tile::{Listed, Tile},
};

/// Samples of a pixel in one of these tiles at most: of a small tile's room, they take what a pixel
/// without a list may take too.
const PIXEL_SAMPLES: u32 = 64;

impl CameraTracer {
    /// Tiles of the samples that the given pixels of a tile have besides, in order. Their indices
    /// follow each other from one far from those of all other samples on.
    #[must_use]
    pub fn extra_tiles(&self, tile: &Tile, pixels: &[u32]) -> Vec<Tile> {
        let step = self.extra.clamp(1, PIXEL_SAMPLES);
        let at_once = (self.room as u32 / (self.view.branches * step)).max(1);
        let mut tiles = Vec::new();
        for first in (0..self.extra).step_by(step as usize) {
            for (before, some) in (0..).step_by(at_once as usize).zip(pixels.chunks(at_once as usize)) {
                tiles.push(Tile {
                    pixels: some.len() as u32,
                    first_sample: self.first_extra + first,
                    samples: step.min(self.extra - first),
                    listed: Some(Listed { pixels: some.into(), before }),
                    ..*tile
                });
            }
        }
        tiles
    }

    /// Columns and rows of a tile's square.
    #[must_use]
    pub fn square(tile: &Tile) -> (u32, u32) {
        let bits = tile.pixels.ilog2();
        (1 << bits.div_ceil(2), 1 << (bits / 2))
    }

    /// Number of a pixel of a tile in Morton order, by its column and row there.
    #[must_use]
    pub fn number(column: u32, row: u32) -> u32 {
        let spread = |x: u32| (0..16).fold(0, |sum, bit| sum | ((x >> bit) & 1) << (2 * bit));
        spread(column) | (spread(row) << 1)
    }
}
