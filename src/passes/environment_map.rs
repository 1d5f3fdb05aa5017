//! The environment as the device reads it: pixels, and tables by which directions are drawn.
//!
//! A pixel is chosen in proportion to the luminance around it and its solid angle; within it directions are uniform. The
//! luminance is blurred by a 3 x 3 tent first, so that the density is above 0 wherever the interpolated radiance is.

use std::f64::consts::{PI, TAU};

use super::cumulative::cumulative;
use crate::scene::Environment;

/// An environment map ready to be uploaded.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    pub columns: u32,
    pub rows: u32,
    /// Radiance, W/(m² sr), and the cumulative probability of the pixel in its row.
    pub pixels: Vec<[f32; 4]>,
    /// Cumulative probability of the rows.
    pub marginal: Vec<f32>,
    /// Integral of the radiance over all directions, W/m² in each channel.
    pub integral: [f64; 3],
    /// Turn about +Y, radians.
    pub rotation: f32,
}

impl EnvironmentMap {
    /// The map, averaged down by 2 x 2 until its pixels take at most `bytes`.
    #[must_use]
    pub fn new(environment: &Environment, bytes: u64) -> Self {
        let mut size = (environment.width as usize, environment.height as usize);
        let mut pixels: Vec<[f32; 3]> =
            environment.pixels.iter().map(|p| p.map(|x| x * environment.strength)).collect();
        while size.0 > 1 && (size.0 * size.1 * size_of::<[f32; 4]>()) as u64 > bytes {
            (pixels, size) = halved(&pixels, size);
        }
        let (columns, rows) = size;
        let weights = blurred_luminance(&pixels, size);
        let (mut table, mut row_weights, mut integral) = (Vec::with_capacity(pixels.len()), Vec::new(), [0.0; 3]);
        for (row, (colors, weights)) in pixels.chunks(columns).zip(weights.chunks(columns)).enumerate() {
            let solid_angle = row_solid_angle(row, rows) / columns as f64;
            row_weights.push(weights.iter().sum::<f64>() * solid_angle);
            for (color, in_row) in colors.iter().zip(cumulative(weights)) {
                (0..3).for_each(|c| integral[c] += f64::from(color[c]) * solid_angle);
                table.push([color[0], color[1], color[2], in_row]);
            }
        }
        Self {
            columns: columns as u32,
            rows: rows as u32,
            pixels: table,
            marginal: cumulative(&row_weights),
            integral,
            rotation: environment.rotation,
        }
    }
}

/// Steradians of a row of pixels.
fn row_solid_angle(row: usize, rows: usize) -> f64 {
    let edge = |row: usize| (PI * row as f64 / rows as f64).cos();
    TAU * (edge(row) - edge(row + 1))
}

/// Half as many columns and rows, rounded up; pixels at an odd edge stand for themselves.
fn halved(pixels: &[[f32; 3]], (columns, rows): (usize, usize)) -> (Vec<[f32; 3]>, (usize, usize)) {
    let half = (columns.div_ceil(2), rows.div_ceil(2));
    let mean = |i: usize| {
        let (x, y) = (2 * (i % half.0), 2 * (i / half.0));
        let at = |x: usize, y: usize| glam::Vec3::from(pixels[y.min(rows - 1) * columns + x.min(columns - 1)]);
        (0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))).to_array()
    };
    ((0..half.0 * half.1).map(mean).collect(), half)
}

/// Mean of the channels under the weights 1 2 1 along columns and rows; columns go round, rows end at the poles.
fn blurred_luminance(pixels: &[[f32; 3]], (columns, rows): (usize, usize)) -> Vec<f64> {
    let luminance = |i: usize| pixels[i].iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0;
    let tent = |before: f64, here: f64, after: f64| 0.25 * before + 0.5 * here + 0.25 * after;
    let along: Vec<f64> = (0..pixels.len())
        .map(|i| {
            let (x, first) = (i % columns, i - i % columns);
            let (before, after) = (first + (x + columns - 1) % columns, first + (x + 1) % columns);
            tent(luminance(before), luminance(i), luminance(after))
        })
        .collect();
    (0..pixels.len())
        .map(|i| {
            let above = if i < columns { i } else { i - columns };
            let below = if i + columns < columns * rows { i + columns } else { i };
            tent(along[above], along[i], along[below])
        })
        .collect()
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
        assert_eq!((map.columns, map.rows, map.pixels.len(), map.marginal.len()), (5, 3, 15, 3));
        // The bright pixel 5 of row 0 is one of the four of pixel 2.
        assert_eq!(map.pixels[2][..3], [0.0, 1.5, 2.0]);
        assert_eq!(map.pixels[1][..3], [0.0, 0.0, 2.0]);
    }

    #[test]
    fn neighbours_of_a_lonely_pixel_can_be_drawn() {
        let pixels = (0..8 * 4).map(|i| [if i == 16 { 1.0 } else { 0.0 }; 3]).collect();
        let environment = Environment { width: 8, height: 4, pixels, ..Environment::uniform(glam::Vec3::ZERO) };
        let map = EnvironmentMap::new(&environment, u64::MAX);
        let in_row: Vec<f32> = map.pixels[16..24].iter().map(|p| p[3]).collect();
        assert!(in_row[0] > 0.4 && in_row[1] > 0.7 && in_row[6] == in_row[1] && in_row[7] == 1.0, "{in_row:?}");
        assert!(map.marginal[0] == 0.0 && map.marginal[1] > 0.1 && map.marginal[2] < 1.0 && map.marginal[3] == 1.0);
    }
}
