//! Differences between a picture and estimates of less bias at some of its pixels, summed over
//! passes.

use crate::settings::{Crop, PixelGrid};

/// Sums over passes of the difference between the mean radiance of a pixel and that of an estimate
/// of less bias, at the pixels of a grid. Even and odd passes are apart: their noise is
/// independent, so that the product of their means is the square of the bias on average.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BiasCheck {
    /// Number of even and of odd passes.
    pub passes: [u32; 2],
    /// Sums of the differences, three numbers for each pixel.
    pub sums: [Vec<f32>; 2],
}

impl BiasCheck {
    /// The differences of one pass.
    pub fn of_pass(index: u32, differences: Vec<f32>) -> Self {
        let mut check = Self { passes: [0, 0], sums: [vec![0.0; differences.len()], vec![0.0; differences.len()]] };
        let half = index as usize % 2;
        check.passes[half] = 1;
        check.sums[half] = differences;
        check
    }

    /// Adds another one by `add`; what is not known of both is not known of the sum.
    pub fn join(into: &mut Option<Self>, other: Option<&Self>, add: fn(&mut Self, &Self)) {
        match (&mut *into, other) {
            (Some(sum), Some(other)) => add(sum, other),
            _ => *into = None,
        }
    }

    /// Adds the passes of another one at the same pixels.
    pub fn merge(&mut self, other: &Self) {
        for half in 0..2 {
            self.passes[half] += other.passes[half];
            self.sums[half].iter_mut().zip(&other.sums[half]).for_each(|(a, b)| *a += b);
        }
    }

    /// Adds light that is summed with that of the same passes.
    pub fn add_light(&mut self, other: &Self) {
        let passes = self.passes;
        self.merge(other);
        self.passes = passes;
    }

    /// Estimates of the squared bias of each number, with the index of its pixel in a part of a
    /// picture of that size; `None` unless there are passes of both kinds.
    pub fn squares(&self, whole: (u32, u32), window: Crop) -> Option<impl Iterator<Item = (usize, [f64; 3])> + '_> {
        let [even, odd] = self.passes.map(f64::from);
        let product = move |i: usize| f64::from(self.sums[0][i]) / even * (f64::from(self.sums[1][i]) / odd);
        let of_pixel = move |(i, place): (usize, usize)| (place, [0, 1, 2].map(|c| product(3 * i + c)));
        (even > 0.0 && odd > 0.0).then(|| PixelGrid::of(whole).places(window).enumerate().map(of_pixel))
    }
}
