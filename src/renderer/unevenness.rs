//! Pixels that need more samples than others.
//!
//! A pixel is chosen by its neighbours, not by its own samples: where these decide, samples that
//! miss a small bright thing end the search for it, and the picture gets darker (Kirk and Arvo
//! 1991, "Unbiased Sampling Techniques for Image Synthesis"). What runs through a pixel, an edge or
//! a penumbra, runs through two neighbours on opposite sides of it as well.

use crate::layout::{LAYER_ROWS, PixelSums};

/// Squared relative error of a pixel from which on it has more samples.
const THRESHOLD: f32 = 0.002;
/// Radiance below which errors count less, as a fraction of that of the tile.
const DARK: f32 = 0.1;

/// Neighbours of a pixel, in turn around it.
const AROUND: [(i32, i32); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// Samples of the pixels of a square: columns, rows, and for each pixel the sums over so many
/// samples, or `None` outside of the picture.
pub struct Square<'a> {
    pub columns: u32,
    pub rows: u32,
    pub samples: u32,
    pub sums: &'a dyn Fn(u32, u32) -> Option<&'a PixelSums>,
}

impl Square<'_> {
    /// Columns and rows of the pixels that need more samples, row by row.
    pub fn uneven(&self) -> Vec<(u32, u32)> {
        let places = || (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (column, row)));
        let sums = || places().filter_map(|(column, row)| (self.sums)(column, row));
        // The mean of roots hardly follows a small bright lamp.
        let root = |sums: &PixelSums| (f64::from(sums[0][0] + sums[0][1] + sums[0][2]).max(0.0)).sqrt();
        let count = sums().count().max(1) as f64;
        let scale = (sums().map(root).filter(|root| root.is_finite()).sum::<f64>() / count).powi(2);
        let dark = DARK * scale as f32 / (3.0 * self.samples as f32);
        let error = |(column, row)| (self.sums)(column, row).map(|sums| error(sums, self.samples, dark));
        let errors: Vec<Option<f32>> = places().map(error).collect();
        let at = |column: i32, row: i32| {
            let (column, row) = (u32::try_from(column).ok()?, u32::try_from(row).ok()?);
            (column < self.columns && row < self.rows).then(|| errors[(row * self.columns + column) as usize])?
        };
        let threshold = std::env::var("AD_T").ok().and_then(|t| t.parse().ok()).unwrap_or(THRESHOLD);
        let rule = std::env::var("AD_R").unwrap_or_default();
        let is_uneven = |&(column, row): &(u32, u32)| {
            let around = AROUND.map(|(x, y)| at(column as i32 + x, row as i32 + y));
            let own = at(column as i32, row as i32);
            let e = match rule.as_str() {
                "max" => around.iter().flatten().fold(0.0_f32, |a, b| a.max(*b)),
                "mean" => { let v: Vec<f32> = around.iter().flatten().copied().collect(); v.iter().sum::<f32>() / v.len().max(1) as f32 }
                "own3" => around.iter().flatten().chain(&own).fold(0.0_f32, |a, b| a.max(*b)),
                "own" => own.unwrap_or(0.0),
                "through" => through(&around),
                _ => {
                    let far = AROUND.map(|(x, y)| at(column as i32 + 2 * x, row as i32 + 2 * y));
                    let both = |i: usize| around[i].map(|near| near.max(far[i].unwrap_or(0.0)));
                    through(&std::array::from_fn(both))
                }
            };
            own.is_some() && e > threshold
        };
        places().filter(is_uneven).collect()
    }
}

/// Squared relative error of the mean of a pixel's samples, mean of the channels.
fn error(sums: &PixelSums, samples: u32, dark: f32) -> f32 {
    let n = samples as f32;
    let of = |c: usize| {
        let mean = sums[0][c] / n;
        let variance = (sums[LAYER_ROWS + 1][c] / n - mean * mean).max(0.0) / (n - 1.0);
        variance / (mean * mean + dark * dark).max(f32::MIN_POSITIVE)
    };
    let all = [0, 1, 2].map(of);
    let mean = all.iter().sum::<f32>() / 3.0;
    if mean.is_finite() { mean } else { 0.0 }
}

/// Error of what runs through a pixel, by those of its neighbours: the largest that two have on
/// opposite sides. Where one of both lies outside, the other has to do.
fn through(around: &[Option<f32>; 8]) -> f32 {
    let opposite = |i: usize| [3, 4, 5].map(|turn| around[(i + turn) % 8]);
    let pair = |a: f32, b: Option<f32>| b.map_or(a, |b| a.min(b));
    let pairs = (0..8).filter_map(|i| Some((around[i]?, opposite(i))));
    pairs.flat_map(|(a, others)| others.map(|b| pair(a, b))).fold(0.0, f32::max)
}
