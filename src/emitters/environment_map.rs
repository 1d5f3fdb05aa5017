//! The environment on the device: pixels, and tables from which directions are sampled.
//!
//! The corners of a cell are the centres of four adjacent pixels. Cells of the first and the last
//! row reach from a pole to the centres of the outermost pixels. A cell is sampled in proportion to
//! the mean luminance of its corners times its solid angle. Within a cell the density follows the
//! interpolated luminance (`shaders/lib/transport/environment.wesl`), so that it is above 0
//! wherever the radiance is.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::cumulative::cumulative;
use crate::scene::Environment;

/// An environment map ready to be uploaded.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    pub columns: u32,
    pub rows: u32,
    /// Radiance, W/(m² sr), and its mean over the channels.
    pub pixels: Vec<[f32; 4]>,
    /// CDF of the cells within their row; `rows + 1` rows of `columns`.
    pub cells: Vec<f32>,
    /// CDF of the rows of cells.
    pub marginal: Vec<f32>,
    /// Integral of the radiance over all directions, W/m² in each channel.
    pub integral: [f64; 3],
    /// Rotation about +Y, radians.
    pub rotation: f32,
}

impl EnvironmentMap {
    /// The map, with pixels averaged 2 x 2 repeatedly until they take at most `bytes`.
    #[must_use]
    pub fn new(environment: &Environment, bytes: u64) -> Self {
        let mut size = (environment.width as usize, environment.height as usize);
        let mut pixels: Vec<[f32; 3]> =
            environment.pixels.iter().map(|p| p.map(|x| x * environment.strength)).collect();
        while size.0 > 1 && (size.0 * size.1 * size_of::<[f32; 4]>()) as u64 > bytes {
            (pixels, size) = halved(&pixels, size);
        }
        let (columns, rows) = size;
        let at = |x: usize, y: usize| pixels[y * columns + x % columns];
        let mean = |p: [f32; 3]| p.iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0;
        let (mut cells, mut row_weights, mut integral) = (Vec::with_capacity(pixels.len()), Vec::new(), [0.0; 3]);
        for row in 0..=rows {
            let (above, below) = (row.max(1) - 1, row.min(rows - 1));
            let solid_angle = cell_solid_angle(row, rows) / columns as f64;
            let mut weights = Vec::with_capacity(columns);
            for x in 0..columns {
                let corners = [at(x, above), at(x + 1, above), at(x, below), at(x + 1, below)];
                let channel = |c: usize| corners.iter().map(|p| f64::from(p[c])).sum::<f64>() / 4.0;
                (0..3).for_each(|c| integral[c] += channel(c) * solid_angle);
                weights.push(corners.map(mean).iter().sum::<f64>() / 4.0);
            }
            row_weights.push(weights.iter().sum::<f64>() * solid_angle);
            cells.extend(cumulative(&weights));
        }
        Self {
            columns: columns as u32,
            rows: rows as u32,
            cells,
            marginal: cumulative(&row_weights),
            integral,
            rotation: environment.rotation,
            pixels: pixels.iter().map(|&p| [p[0], p[1], p[2], mean(p) as f32]).collect(),
        }
    }

    /// Direction by luminance, uniform within each cell: about as kernels sample them.
    #[must_use]
    pub fn direction(&self, u: [f32; 4]) -> Vec3 {
        let (columns, rows) = (self.columns as usize, self.rows as usize);
        let row = self.marginal.partition_point(|up_to| *up_to <= u[0]).min(rows);
        let cells = &self.cells[row * columns..(row + 1) * columns];
        let column = cells.partition_point(|up_to| *up_to <= u[1]).min(columns - 1);
        let edge = |row: usize| (PI * (row as f64 - 0.5).clamp(0.0, rows as f64) / rows as f64).cos();
        let y = edge(row) + f64::from(u[2]) * (edge(row + 1) - edge(row));
        let (sine, cosine) = (TAU * ((column as f64 + 0.5 + f64::from(u[3])) / columns as f64 - 0.5)
            - f64::from(self.rotation))
        .sin_cos();
        let across = (1.0 - y * y).max(0.0).sqrt();
        DVec3::new(across * cosine, y, across * sine).as_vec3().normalize()
    }
}

/// Solid angle of a row of cells, sr.
fn cell_solid_angle(row: usize, rows: usize) -> f64 {
    let edge = |row: usize| (PI * (row as f64 - 0.5).clamp(0.0, rows as f64) / rows as f64).cos();
    TAU * (edge(row) - edge(row + 1))
}

/// Averages 2 x 2 pixels: half as many columns and rows, rounded up. Pixels at an odd edge are
/// repeated.
fn halved(pixels: &[[f32; 3]], (columns, rows): (usize, usize)) -> (Vec<[f32; 3]>, (usize, usize)) {
    let half = (columns.div_ceil(2), rows.div_ceil(2));
    let mean = |i: usize| {
        let (x, y) = (2 * (i % half.0), 2 * (i / half.0));
        let at = |x: usize, y: usize| glam::Vec3::from(pixels[y.min(rows - 1) * columns + x.min(columns - 1)]);
        (0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))).to_array()
    };
    ((0..half.0 * half.1).map(mean).collect(), half)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: u32, height: u32, bytes: u64) -> EnvironmentMap {
        let pixels = (0..width * height).map(|i| [0.0, if i == 5 { 3.0 } else { 0.0 }, 1.0]).collect();
        let environment =
            Environment { width, height, pixels, strength: 2.0, ..Environment::uniform(glam::Vec3::ZERO) };
        EnvironmentMap::new(&environment, bytes)
    }

    #[test]
    fn the_integral_of_a_constant_is_four_pi() {
        for (width, height) in [(1, 1), (7, 3), (64, 32)] {
            let map = map(width, height, u64::MAX);
            assert!((map.integral[2] - 8.0 * PI).abs() < 1e-9, "{width} x {height}: {}", map.integral[2]);
        }
    }

    #[test]
    fn a_map_that_is_too_large_is_averaged_down() {
        let map = map(9, 5, 16 * 15);
        assert_eq!((map.columns, map.rows, map.cells.len(), map.marginal.len()), (5, 3, 20, 4));
        // Pixel 5 of row 0, the bright one, is one of the four averaged into pixel 2.
        assert_eq!(map.pixels[2][..3], [0.0, 1.5, 2.0]);
        assert_eq!(map.pixels[1][..3], [0.0, 0.0, 2.0]);
    }

    #[test]
    fn the_cells_around_a_lonely_pixel_can_be_drawn_and_no_others() {
        let pixels = (0..8 * 4).map(|i| [if i == 16 { 1.0 } else { 0.0 }; 3]).collect();
        let environment = Environment { width: 8, height: 4, pixels, ..Environment::uniform(glam::Vec3::ZERO) };
        let map = EnvironmentMap::new(&environment, u64::MAX);
        // Pixel 0 of row 2 is a corner of the last and the first cells of rows 2 and 3.
        for row in [2, 3] {
            let cells = &map.cells[8 * row..8 * row + 8];
            assert!((cells[0] - 0.5).abs() < 1e-6 && cells[6] == cells[0] && cells[7] == 1.0, "{cells:?}");
        }
        let marginal = &map.marginal;
        assert!(marginal[1] == 0.0 && marginal[2] > 0.4 && marginal[2] < 0.6 && marginal[3] == 1.0, "{marginal:?}");
    }
}
