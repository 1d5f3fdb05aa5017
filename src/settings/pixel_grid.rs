//! A grid of few pixels of a picture, at which something is measured that is too slow for all.

use super::Crop;

/// Pixels of a grid at most, about.
const PIXELS: u64 = 700;
/// Pixels from one to the next at least.
const EVERY: u32 = 5;

/// Each n-th pixel of each n-th row of a picture, from the middle of the first n x n pixels on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelGrid {
    every: u32,
}

impl PixelGrid {
    /// The grid of a picture of that size. Its distance is odd, so that it does not follow textures
    /// and tiles.
    #[must_use]
    pub fn of(size: (u32, u32)) -> Self {
        let pixels = u64::from(size.0) * u64::from(size.1);
        Self { every: ((pixels / PIXELS).isqrt() as u32 | 1).max(EVERY) }
    }

    /// Columns and rows from one pixel to the next.
    #[must_use]
    pub fn every(&self) -> u32 {
        self.every
    }

    /// The first column and row that has pixels.
    #[must_use]
    pub fn first(&self) -> u32 {
        self.every / 2
    }

    /// The pixels of the grid in a part of the picture, as columns and rows of the grid. It may
    /// have none.
    #[must_use]
    pub fn window(&self, part: Crop) -> Crop {
        let along = |first: u32, count: u32| {
            let kept = |end: u32| end.saturating_sub(self.first()).div_ceil(self.every);
            (kept(first), kept(first + count) - kept(first))
        };
        let ((column, width), (row, height)) = (along(part.column, part.width), along(part.row, part.height));
        Crop { column, row, width, height }
    }

    /// Places of the grid's pixels in a part of the picture, in order, as indices of the part's
    /// pixels.
    pub fn places(&self, part: Crop) -> impl Iterator<Item = usize> + use<> {
        let (window, every, first) = (self.window(part), self.every, self.first());
        let along = move |kept: u32, origin: u32| (kept * every + first - origin) as usize;
        (0..window.height).flat_map(move |row| {
            let before = along(window.row + row, part.row) * part.width as usize;
            (0..window.width).map(move |column| before + along(window.column + column, part.column))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_coarse_in_large_pictures() {
        let every = |size| PixelGrid::of(size).every();
        assert_eq!([every((8, 8)), every((128, 128)), every((256, 256)), every((1024, 1024))], [5, 5, 9, 39]);
        assert_eq!(every((16_384, 16_384)) % 2, 1);
    }

    #[test]
    fn places_are_those_of_the_whole_picture_in_every_part() {
        let grid = PixelGrid::of((8, 7));
        let whole = Crop { column: 0, row: 0, width: 8, height: 7 };
        let all: Vec<usize> = grid.places(whole).collect();
        assert_eq!(all, [18, 23]);
        let parts = [(0, 0, 5, 7), (5, 0, 1, 7), (6, 0, 2, 7)];
        let mut found = Vec::new();
        for (column, row, width, height) in parts {
            let part = Crop { column, row, width, height };
            let of_whole = |i: usize| (i / width as usize) * 8 + i % width as usize + column as usize;
            assert_eq!(grid.places(part).count() as u32, grid.window(part).width * grid.window(part).height);
            found.extend(grid.places(part).map(of_whole));
        }
        found.sort_unstable();
        assert_eq!(found, all);
        assert_eq!(grid.places(Crop { column: 3, row: 3, width: 2, height: 2 }).count(), 0, "between them");
    }
}
