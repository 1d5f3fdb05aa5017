//! Pixels that need more samples than others.
//!
//! A pixel is chosen by its neighbours, and its own samples have no say: where they decide, those
//! that miss a small bright thing end the search for it, those that find it go on, and the picture
//! gets darker (Kirk and Arvo 1991, "Unbiased Sampling Techniques for Image Synthesis"). What runs
//! through a pixel, an edge or a penumbra, runs through neighbours on opposite sides of it as well.

use std::array::from_fn;

use rayon::prelude::*;

use crate::layout::{LAYER_ROWS, PixelSums};

/// Squared relative error of the mean of its samples above which a pixel is uneven.
const UNEVEN: f32 = 0.005;
/// Radiance below which errors count less, as a fraction of that around.
const DARK: f32 = 0.1;

/// One of that many samples has the light of maps at least.
const LEAST_ONE_IN: u32 = 32;

/// Steps to the neighbours of a pixel, in turn around it.
const AROUND: [(i32, i32); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// Samples of the pixels of a square.
pub struct Square<'a> {
    pub columns: u32,
    pub rows: u32,
    /// Samples of each pixel, two at least.
    pub samples: u32,
    /// Their sums in the pixel of a column and a row; `None` outside of the picture.
    pub sums: &'a (dyn Fn(u32, u32) -> Option<&'a PixelSums> + Sync),
}

impl Square<'_> {
    /// Columns and rows of the pixels between uneven ones, row by row, with the error that these
    /// have.
    pub fn uneven(&self) -> Vec<((u32, u32), f32)> {
        let in_row = |row| (0..self.columns).map(move |column| (column, row));
        let places = || (0..self.rows).into_par_iter().flat_map_iter(in_row);
        let spread = |(column, row)| (self.sums)(column, row).map(|sums| Spread::of(sums, self.samples));
        let spreads: Vec<Option<Spread>> = places().map(spread).collect();
        let at = |column: i32, row: i32| {
            let (column, row) = (u32::try_from(column).ok()?, u32::try_from(row).ok()?);
            (column < self.columns && row < self.rows).then(|| spreads[(row * self.columns + column) as usize])?
        };
        let error_through = |(column, row): (u32, u32)| {
            let (x, y) = (column as i32, row as i32);
            let near = AROUND.map(|(dx, dy)| at(x + dx, y + dy));
            let far = AROUND.map(|(dx, dy)| at(x + 2 * dx, y + 2 * dy));
            let all = || near.iter().chain(&far).flatten();
            let dark = DARK * all().map(|one| one.light()).sum::<f32>() / all().count().max(1) as f32;
            let error = |one: &Spread| one.error(dark);
            // Few samples may miss what runs along the rim of the next pixel, but show it in the
            // one after that.
            let toward = |i: usize| Some(error(near[i].as_ref()?).max(far[i].as_ref().map_or(0.0, error)));
            at(x, y).map(|_| ((column, row), through(&from_fn(toward))))
        };
        places().filter_map(error_through).filter(|(_, error)| *error > UNEVEN).collect()
    }

    /// One of how many samples of a pixel with that error needs the light of maps, a power of two:
    /// where it stands for n of them, the variance of a sample grows by n - 1 squares of that
    /// light, which is a sixteenth of it at most. `of_maps` is the mean of that light of each
    /// pixel: the brightest of those around decides. The pixel's own samples may have a say in
    /// this, for it does not change the mean.
    pub fn one_in(&self, (column, row): (u32, u32), error: f32, of_maps: &dyn Fn(u32, u32) -> Option<f32>) -> u32 {
        let light = (self.sums)(column, row).map_or(0.0, |sums| Spread::of(sums, self.samples).light());
        let around = |at: u32, end: u32| at.saturating_sub(2)..(at + 3).min(end);
        let places =
            around(row, self.rows).flat_map(|row| around(column, self.columns).map(move |column| (column, row)));
        let brightest = places.map(|(column, row)| of_maps(column, row).unwrap_or(f32::INFINITY)).fold(0.0, f32::max);
        let deviation = (error * self.samples as f32).sqrt() * light;
        let most = (0.5 * deviation / brightest.max(f32::MIN_POSITIVE)).clamp(1.0, LEAST_ONE_IN as f32) as u32;
        1 << most.ilog2()
    }
}

/// Number of times that the samples of a pixel double by an error above [`UNEVEN`]: once, and again
/// for each fourfold of it. Samples in proportion to the root of the squared error give the least
/// sum of errors for their number.
pub fn doublings(error: f32) -> u32 {
    1 + (0.5 * (error / UNEVEN).log2()) as u32
}

/// Mean of a pixel's samples, and the variance of that mean.
#[derive(Clone, Copy)]
struct Spread {
    mean: [f32; 3],
    variance: [f32; 3],
}

impl Spread {
    fn of(sums: &PixelSums, samples: u32) -> Self {
        let n = samples as f32;
        let mean = from_fn(|c| sums[0][c] / n);
        let variance = |c: usize| (sums[LAYER_ROWS + 1][c] / n - mean[c] * mean[c]).max(0.0) / (n - 1.0);
        Self { mean, variance: from_fn(variance) }
    }

    /// Mean of the channels.
    fn light(&self) -> f32 {
        self.mean.iter().sum::<f32>() / 3.0
    }

    /// Squared relative error of the mean, mean of the channels.
    fn error(&self, dark: f32) -> f32 {
        let of = |c: usize| self.variance[c] / (self.mean[c] * self.mean[c] + dark * dark).max(f32::MIN_POSITIVE);
        let error = [0, 1, 2].map(of).iter().sum::<f32>() / 3.0;
        // Of radiance whose square is beyond what numbers hold.
        if error.is_nan() { 0.0 } else { error }
    }
}

/// Error of what runs through a pixel: the largest that neighbours on opposite sides have both. Of
/// two sides one of which is outside, the other has to do.
fn through(around: &[Option<f32>; 8]) -> f32 {
    let opposite = |i: usize| [3, 4, 5].map(|turn| around[(i + turn) % 8]);
    let sides = (0..8).filter_map(|i| Some((around[i]?, opposite(i))));
    sides.flat_map(|(a, others)| others.map(|b| b.map_or(a, |b| a.min(b)))).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = 16;

    /// Sums of four samples of a pixel, `lit` of which are 1 and the others 0.1.
    fn pixel(lit: u32) -> PixelSums {
        let sum = |of: fn(f32) -> f32| lit as f32 * of(1.0) + (4 - lit) as f32 * of(0.1);
        let mut sums = [[0.0; 4]; LAYER_ROWS + 2];
        sums[0] = [sum(|x| x); 4];
        sums[LAYER_ROWS + 1] = [sum(|x| x * x); 4];
        sums
    }

    fn uneven(lit: impl Fn(u32, u32) -> u32) -> Vec<(u32, u32)> {
        let pixels: Vec<_> = (0..SIDE * SIDE).map(|i| pixel(lit(i % SIDE, i / SIDE))).collect();
        let sums = |column: u32, row: u32| Some(&pixels[(row * SIDE + column) as usize]);
        let found = Square { columns: SIDE, rows: SIDE, samples: 4, sums: &sums }.uneven();
        found.into_iter().map(|(place, _)| place).collect()
    }

    #[test]
    fn samples_double_with_each_fourfold_error() {
        let of = |times: f32| doublings(times * UNEVEN);
        assert_eq!([1.01, 3.9, 4.1, 15.9, 16.1, 1e6].map(of), [1, 1, 2, 2, 3, 10]);
    }

    #[test]
    fn edges_are_found_along_their_whole_length() {
        for slope in [0.0, 0.3, 1.0] {
            let edge = |column: u32, row: u32| (f64::from(row) - 2.3 - slope * f64::from(column)).abs() < 0.7;
            let found = uneven(|column, row| if edge(column, row) { 2 } else { 4 });
            let on_edge = (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)).filter(|&(x, y)| edge(x, y));
            assert!(on_edge.clone().all(|place| found.contains(&place)), "slope {slope}: {found:?}");
            assert!(found.len() < 3 * on_edge.count(), "slope {slope}: {found:?}");
        }
        assert!(uneven(|_, _| 4).is_empty() && uneven(|_, _| 0).is_empty(), "nothing where all samples are alike");
    }

    #[test]
    fn faint_light_of_maps_is_for_few_samples() {
        let pixels = [pixel(4)];
        let sums = |column: u32, row: u32| (column < 8 && row < 8).then_some(&pixels[0]);
        let square = Square { columns: 8, rows: 8, samples: 4, sums: &sums };
        let one_in = |of_maps: f32, error| square.one_in((4, 4), error, &|_, _| Some(of_maps));
        // The deviation of a sample is 0.2 at a light of 1.
        let error = 0.01;
        assert_eq!([1.0, 0.2, 0.06, 0.045, 0.02, 0.003, 0.0].map(|of| one_in(of, error)), [1, 1, 1, 2, 4, 32, 32]);
        for of in [0.04, 0.02, 0.01] {
            let n = one_in(of, error) as f32;
            assert!((n - 1.0) * of * of <= 0.04 / 16.0, "a sixteenth of the variance at most: {n} for {of}");
        }
        assert_eq!(one_in(0.02, 16.0 * error), 16, "among others that differ more");
        let bright_at = |place| square.one_in((4, 4), error, &|x, y| Some(if (x, y) == place { 1.0 } else { 0.0 }));
        assert_eq!([(4, 4), (6, 2), (6, 6), (7, 4)].map(bright_at), [1, 1, 1, 32], "a bright place is two pixels away");
        assert_eq!(square.one_in((4, 4), error, &|_, _| None), 1, "nothing is known");
    }

    #[test]
    fn pixels_have_no_say_in_their_own_samples() {
        let noise = |column: u32, row: u32| (column * 7 + row * 13 + column * row) % 5;
        let (before, one) = (uneven(noise), (5, 9));
        for lit in 0..=4 {
            let after = uneven(|column, row| if (column, row) == one { lit } else { noise(column, row) });
            assert_eq!(after.contains(&one), before.contains(&one), "{lit} lit samples");
        }
        // Control: of its neighbours, two on opposite sides do.
        let alone = |lit: u32| uneven(move |column, row| if row == 9 && [4, 6].contains(&column) { lit } else { 4 });
        assert!(alone(2).contains(&one) && !alone(4).contains(&one));
    }

    #[test]
    fn a_row_at_the_rim_has_one_side_only() {
        let found = uneven(|column, _| if column == 3 { 1 } else { 4 });
        assert!((0..SIDE).all(|row| found.contains(&(3, row))), "{found:?}");
        assert!(found.iter().all(|(column, row)| *column == 3 || [0, SIDE - 1].contains(row)), "{found:?}");
    }
}
