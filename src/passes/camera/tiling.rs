//! The tiles of a picture, those of further samples in a few pixels of a tile, and their pixels.

use super::{
    camera_tracer::CameraTracer,
    tile::{Further, Listed, PIXEL_SAMPLES, Tile, morton_place, tile_sides},
};
use crate::settings::Crop;

/// Samples of a pixel in a tile of further samples at most: of a small tile's room, they take what
/// a pixel without a list may take too.
const EXTRA_SAMPLES: u32 = 64;

impl CameraTracer {
    /// The tiles of the whole picture that overlap the data window, in order. A tile is the same
    /// for every data window, to the last bit.
    #[must_use]
    pub fn tiles(&self) -> Vec<Tile> {
        let samples = self.view.spp.min(PIXEL_SAMPLES);
        let (width, height) = tile_sides(&self.view, self.room);
        let (columns, rows) = (self.view.width, self.view.height);
        let kept = |side: u32| side.div_ceil(self.view.left_out + 1);
        let mut tiles = Vec::new();
        for first_row in (0..kept(rows)).step_by(height as usize) {
            for first_column in (0..kept(columns)).step_by(width as usize) {
                if !self.window.touches((first_column, first_row), (width, height)) {
                    continue;
                }
                for first_sample in (0..self.view.spp).step_by(samples as usize) {
                    let samples = samples.min(self.view.spp - first_sample);
                    let first_sample = self.view.first_sample + first_sample;
                    let pixels = width * height;
                    tiles.push(Tile { pixels, first_column, first_row, first_sample, samples, listed: None });
                }
            }
        }
        tiles
    }

    /// Tiles of the samples that pixels of a tile have besides, in order. Their indices follow each
    /// other from one far from those of all other samples on.
    #[must_use]
    pub fn extra_tiles(&self, tile: &Tile, further: &[Further]) -> Vec<Tile> {
        let of = |pixel: &u32| further[*pixel as usize];
        let most = further.iter().map(|pixel| pixel.doublings).max().unwrap_or(0);
        let mut tiles = Vec::new();
        for doubling in 1..=most {
            let is_doubled = |pixel: &u32| of(pixel).doublings >= doubling;
            let pixels: Vec<u32> = (0..tile.pixels).filter(is_doubled).collect();
            let samples = self.view.spp << doubling;
            let had = samples / 2;
            let step = had.min(EXTRA_SAMPLES);
            let at_once = (self.room as u32 / (self.view.branches * step)).max(1);
            for first in (had..samples).step_by(step as usize) {
                for some in pixels.chunks(at_once as usize) {
                    let one_in = some.iter().map(|pixel| of(pixel).one_in).collect();
                    tiles.push(Tile {
                        pixels: some.len() as u32,
                        first_sample: self.first_extra + first - self.view.spp,
                        samples: step.min(samples - first),
                        listed: Some(Listed { pixels: some.into(), one_in, samples }),
                        ..*tile
                    });
                }
            }
        }
        tiles
    }

    /// The part of the picture that the tiles of [`Self::tiles`] have: the data window, and what
    /// else they trace.
    #[must_use]
    pub fn tiled(&self) -> Crop {
        let (width, height) = tile_sides(&self.view, self.room);
        let along = |first: u32, count: u32, side: u32, whole: u32| {
            let origin = first / side * side;
            (origin, (first + count).next_multiple_of(side).min(whole) - origin)
        };
        let Crop { column, row, .. } = self.window;
        let (column, width) = along(column, self.window.width, width, self.view.width);
        let (row, height) = along(row, self.window.height, height, self.view.height);
        Crop { column, row, width, height }
    }

    /// Column and row of the `i`-th pixel of a tile, among those that the picture has.
    pub(super) fn place(tile: &Tile, i: u32) -> (u32, u32) {
        let (column, row) = morton_place(tile.listed.as_ref().map_or(i, |listed| listed.pixels[i as usize]));
        (tile.first_column + column, tile.first_row + row)
    }

    /// Numbers that differ between a tile's pixels, its samples and seeds, for each of its pixels.
    #[must_use]
    pub fn keys_of_pixels(&self, tile: &Tile) -> Vec<[u32; 4]> {
        let key = |(column, row)| [column, row, tile.first_sample, self.view.seed];
        (0..tile.pixels).map(|i| key(Self::place(tile, i))).collect()
    }

    /// Column and row of the `i`-th pixel of a tile within the data window; `None` outside of it.
    #[must_use]
    pub fn pixel(&self, tile: &Tile, i: u32) -> Option<(u32, u32)> {
        let (x, y) = Self::place(tile, i);
        let window = &self.window;
        let (x, y) = (x.checked_sub(window.column)?, y.checked_sub(window.row)?);
        (x < window.width && y < window.height).then_some((x, y))
    }
}
