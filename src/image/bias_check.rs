//! Estimates of less bias at some of a picture's pixels, summed over passes: how far the picture is
//! from their mean.

use super::film_sums::{add_all, finite};
use crate::settings::{Crop, PixelGrid};

/// Sums over passes of the radiance of closer estimates, at the pixels of a grid. Each pass has
/// photons, samples and rays for them that no other has, nor the picture: their mean is independent
/// of it, and they tell their own noise.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BiasCheck {
    pub passes: u32,
    /// Sums of the estimates, three numbers for each pixel.
    pub sums: Vec<f32>,
    /// Sums of the squares of their deviations from their mean.
    pub deviations: Vec<f32>,
}

impl BiasCheck {
    /// The estimates of one pass.
    pub fn of_pass(radiance: Vec<f32>) -> Self {
        Self { passes: 1, deviations: vec![0.0; radiance.len()], sums: radiance }
    }

    /// Adds another one by `add`; what is not known of both is not known of the sum.
    pub fn join(into: &mut Option<Self>, other: Option<&Self>, add: fn(&mut Self, &Self)) {
        match (&mut *into, other) {
            (Some(sum), Some(other)) => add(sum, other),
            _ => *into = None,
        }
    }

    /// Adds the passes of another one at the same pixels, as [`super::Film::merge`] does.
    pub fn merge(&mut self, other: &Self) {
        let (n, m) = (f64::from(self.passes), f64::from(other.passes));
        for i in 0..self.sums.len() {
            let apart = f64::from(other.sums[i]) / m - f64::from(self.sums[i]) / n;
            let both = f64::from(self.deviations[i]) + f64::from(other.deviations[i]);
            self.deviations[i] = finite(both + apart * apart * (n * m / (n + m)));
        }
        add_all(&mut self.sums, &other.sums);
        self.passes += other.passes;
    }

    /// Adds light that is summed with that of the same pass.
    pub fn add_light(&mut self, other: &Self) {
        debug_assert!((self.passes, other.passes) == (1, 1), "of one pass");
        add_all(&mut self.sums, &other.sums);
    }

    /// Of each checked pixel of a picture of the same passes, its index and its numbers, given the
    /// picture's radiance. `None` for one pass.
    pub fn numbers<'a>(
        &'a self,
        radiance: &'a [f32],
        whole: (u32, u32),
        window: Crop,
    ) -> Option<impl Iterator<Item = (usize, [Checked; 3])> + 'a> {
        let passes = f64::from(self.passes);
        let number = move |i: usize, place: usize, c: usize| {
            let closer = f64::from(self.sums[3 * i + c]) / passes;
            let apart = f64::from(radiance[3 * place + c]) - closer;
            let variance = f64::from(self.deviations[3 * i + c]) / (passes - 1.0) / passes;
            Checked { closer, error: variance.sqrt(), square: apart * apart - variance }
        };
        let of_pixel = move |(i, place)| (place, [0, 1, 2].map(|c| number(i, place, c)));
        (self.passes > 1).then(|| PixelGrid::of(whole).places(window).enumerate().map(of_pixel))
    }
}

/// A number of a picture that is checked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Checked {
    /// Mean of the closer estimates.
    pub closer: f64,
    /// Standard error of that mean.
    pub error: f64,
    /// Estimate of the squared error: the squared distance to that mean, less the variance of that.
    pub square: f64,
}
