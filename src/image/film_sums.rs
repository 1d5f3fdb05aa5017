//! Sums that a film holds: of layers that were asked for, and of passes.

use super::layers::{LAYERS, Rule, Source};

/// Number of a film's layers.
pub(super) const LAYER_COUNT: usize = LAYERS.len();

/// Sums of a layer that was asked for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ExtraSums {
    pub channels: Vec<String>,
    pub rule: Rule,
    /// Source of the numbers in the table.
    pub source: Option<Source>,
    /// Sums pixel by pixel; with [`Rule::PerCount`], of one number more than there are channels.
    pub sums: Vec<f32>,
}

impl ExtraSums {
    /// Numbers of a pixel.
    pub fn count(&self) -> usize {
        self.channels.len() + usize::from(self.rule == Rule::PerCount)
    }
}

/// Squared radius of the estimates of passes, relative to that of pass 0: its mean over the passes,
/// the sum of its squared deviations from the mean, and the mean of its inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bandwidth {
    pub mean: f64,
    pub deviations: f64,
    pub inverse: f64,
}

impl Bandwidth {
    pub fn of_pass(factor: f64) -> Self {
        Self { mean: factor, deviations: 0.0, inverse: 1.0 / factor }
    }
}

/// Second moments of the means of passes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Moments {
    /// Sums of squared deviations of the layers' means, in the order of [`LAYERS`].
    pub deviations: [Vec<f32>; LAYER_COUNT],
    /// Sums of the products of the deviations of radiance and bandwidth.
    pub with_bandwidth: Vec<f32>,
}

/// The number, or the largest one of its sign.
pub(super) fn finite(number: f64) -> f32 {
    number.clamp(f32::MIN.into(), f32::MAX.into()) as f32
}

/// Adds numbers one by one. A sum beyond the range is the largest number.
pub(super) fn add_all(into: &mut [f32], from: &[f32]) {
    into.iter_mut().zip(from).for_each(|(a, b)| *a = (*a + *b).clamp(f32::MIN, f32::MAX));
}
