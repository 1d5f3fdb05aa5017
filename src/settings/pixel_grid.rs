//! A grid of some pixels of a picture, at which something is measured that is too slow for all.

use super::Crop;

/// Pixels of a grid, about.
const PIXELS: f64 = (1 << 12) as f64;
/// Cells by which the pixel of the next one is shifted, as a fraction of a cell: 1 less the golden
/// ratio, so that few cells in a row cover all places.
const SHIFT: f64 = 0.381_966;

/// One pixel of each cell of n x n pixels. Cells beside each other have theirs in different rows,
/// and those below each other in different columns, so that the grid meets what runs along a row or
/// a column as often as anything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelGrid {
    every: u32,
    shift: u32,
}

impl PixelGrid {
    /// The grid of a picture of that size: all pixels, if there are few.
    #[must_use]
    pub fn of(size: (u32, u32)) -> Self {
        let pixels = f64::from(size.0) * f64::from(size.1);
        let every = ((pixels / PIXELS).sqrt().round() as u32).max(1);
        let likely = (SHIFT * f64::from(every)).round() as u32;
        let shift = (likely..).find(|shift| are_coprime(*shift, every)).unwrap_or(1);
        Self { every, shift }
    }

    /// Columns and rows of a cell.
    #[must_use]
    pub fn every(&self) -> u32 {
        self.every
    }

    /// Rows by which the pixel of the next cell lies lower, and columns by which that of the cell
    /// below lies farther right, modulo the side of a cell.
    #[must_use]
    pub fn shift(&self) -> u32 {
        self.shift
    }

    /// The cells that a part of the picture overlaps, as columns and rows of cells.
    #[must_use]
    pub fn window(&self, part: Crop) -> Crop {
        let along = |first: u32, count: u32| {
            let before = first / self.every;
            (before, (first + count).div_ceil(self.every) - before)
        };
        let ((column, width), (row, height)) = (along(part.column, part.width), along(part.row, part.height));
        Crop { column, row, width, height }
    }

    /// The grid's pixels in a part of the picture, in the order of their cells: indices of the cell
    /// in [`Self::window`] and of the pixel in the part.
    pub fn pixels(self, part: Crop) -> impl Iterator<Item = (usize, usize)> {
        let window = self.window(part);
        let cells = (0..window.height).flat_map(move |row| (0..window.width).map(move |column| (column, row)));
        cells.enumerate().filter_map(move |(index, (column, row))| {
            let (column, row) = (window.column + column, window.row + row);
            let along = |cell: u32, other: u32| cell * self.every + other * self.shift % self.every;
            let (x, y) = (along(column, row).checked_sub(part.column)?, along(row, column).checked_sub(part.row)?);
            let is_in = x < part.width && y < part.height;
            is_in.then_some((index, y as usize * part.width as usize + x as usize))
        })
    }

    /// Places of the grid's pixels in a part of the picture, as indices of the part's pixels, in
    /// the order of [`Self::pixels`]. It may have none.
    pub fn places(self, part: Crop) -> impl Iterator<Item = usize> {
        self.pixels(part).map(|(_, place)| place)
    }
}

fn are_coprime(mut a: u32, mut b: u32) -> bool {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_coarse_in_large_pictures() {
        let grid = |side| (PixelGrid::of((side, side)).every(), PixelGrid::of((side, side)).shift());
        assert_eq!([grid(8), grid(64), grid(128), grid(512)], [(1, 0), (1, 0), (2, 1), (8, 3)]);
        assert_eq!(PixelGrid::of((65_535, 65_535)).every(), 1024);
    }

    #[test]
    fn each_row_and_column_has_as_many_pixels() {
        let whole = Crop { column: 0, row: 0, width: 512, height: 512 };
        let counts = |grid: PixelGrid, of: fn(usize) -> usize| {
            let mut counts = [0; 512];
            grid.places(whole).for_each(|place| counts[of(place)] += 1);
            counts
        };
        let grid = PixelGrid::of((512, 512));
        assert_eq!(counts(grid, |place| place / 512), [8; 512]);
        assert_eq!(counts(grid, |place| place % 512), [8; 512]);
        let even = counts(PixelGrid { shift: 0, ..grid }, |place| place / 512);
        assert_eq!(even[..9], [64, 0, 0, 0, 0, 0, 0, 0, 64], "control: cells without a shift");
    }

    #[test]
    fn places_are_those_of_the_whole_picture_in_every_part() {
        let (width, height) = (700, 301);
        let grid = PixelGrid::of((width, height));
        let whole = Crop { column: 0, row: 0, width, height };
        let mut all: Vec<usize> = grid.places(whole).collect();
        all.sort_unstable();
        let mut found = Vec::new();
        for (column, row, width, height) in [(0, 0, 5, 301), (5, 0, 211, 301), (216, 0, 484, 77), (216, 77, 484, 224)] {
            let part = Crop { column, row, width, height };
            let of_whole = |i: usize| (i / width as usize + row as usize) * 700 + i % width as usize + column as usize;
            let window = grid.window(part);
            assert!(grid.pixels(part).all(|(cell, _)| cell < (window.width * window.height) as usize));
            found.extend(grid.places(part).map(of_whole));
        }
        found.sort_unstable();
        assert_eq!(found, all);
        assert!(grid.every() > 1 && grid.places(Crop { column: 1, row: 0, width: 1, height: 1 }).count() == 0);
    }
}
