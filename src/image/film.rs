//! The film: sums over camera samples, from which a frame is made, and the second moments of merged
//! passes.

use std::array;

use super::{
    frame::{DataWindow, Frame},
    layers::{LAYERS, Rule, layer_index},
};
use crate::{
    error::{Error, Result},
    layout::PixelSums,
    settings::Crop,
};

/// Sums of every layer over the samples of one pass, or of several that were merged.
///
/// A pass is one run over all samples of a picture with photons of its own. Passes are independent,
/// so the second moments of their means give the standard error of the merged picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    whole: (u32, u32),
    window: Crop,
    passes: u32,
    /// Number of samples of each pixel in all passes.
    samples: u64,
    /// Sums of the layers' numbers, pixel by pixel, in the order of [`LAYERS`].
    sums: [Vec<f32>; LAYERS.len()],
    /// Sums over the passes of the squares of their means; `None` for one pass, whose means follow
    /// from the sums.
    squares: Option<[Vec<f64>; LAYERS.len()]>,
    /// Number of samples that were left out, since a sum would not be finite with them.
    non_finite: u64,
}

impl Film {
    /// Creates an empty film of one pass of `spp` samples a pixel, for a part of a picture.
    #[must_use]
    pub fn new(whole: (u32, u32), window: Crop, spp: u32) -> Self {
        let pixels = window.width as usize * window.height as usize;
        let zeros = |i: usize| vec![0.0; pixels * LAYERS[i].channels.len()];
        let sums = array::from_fn(zeros);
        Self { whole, window, passes: 1, samples: spp.into(), sums, squares: None, non_finite: 0 }
    }

    /// Number of passes.
    #[must_use]
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// Number of samples of each pixel in all passes.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Number of samples that were left out, since a sum would not be finite with them.
    #[must_use]
    pub fn non_finite(&self) -> u64 {
        self.non_finite
    }

    /// Adds the device's sums over `samples` samples of a pixel, given by its column and row in the
    /// data window.
    pub(crate) fn add(&mut self, (column, row): (u32, u32), sums: &PixelSums, samples: u32) {
        let pixel = row as usize * self.window.width as usize + column as usize;
        self.non_finite += sums[0][3] as u64;
        for (layer, of_layer) in LAYERS.iter().zip(&mut self.sums) {
            let (row, first) = layer.source;
            let count = layer.channels.len();
            let into = &mut of_layer[pixel * count..][..count];
            let added = || into.iter().zip(&sums[row][first..]).map(|(a, b)| a + b);
            if added().all(f32::is_finite) {
                let added: [f32; 4] = array::from_fn(|c| added().nth(c).unwrap_or(0.0));
                into.copy_from_slice(&added[..count]);
            } else {
                self.non_finite += u64::from(samples);
            }
        }
    }

    /// Adds the passes of another film of the same part of the same picture.
    ///
    /// # Errors
    /// [`Error::Differs`] if size or window differ.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        if (self.whole, self.window) != (other.whole, other.window) {
            let part = |film: &Self| {
                let (Crop { column, row, width, height }, (w, h)) = (film.window, film.whole);
                format!("{width}x{height} pixels at {column},{row} of {w}x{h}")
            };
            return Err(Error::Differs(format!(
                "films of different pictures cannot be merged: {} and {}",
                part(self),
                part(other)
            )));
        }
        let mut squares = self.squares();
        let add = |a: &mut [Vec<f64>; LAYERS.len()], b: [Vec<f64>; LAYERS.len()]| {
            a.iter_mut().zip(b).for_each(|(a, b)| a.iter_mut().zip(b).for_each(|(a, b)| *a += b));
        };
        add(&mut squares, other.squares());
        self.squares = Some(squares);
        for (a, b) in self.sums.iter_mut().zip(&other.sums) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        }
        self.passes += other.passes;
        self.samples += other.samples;
        self.non_finite += other.non_finite;
        Ok(())
    }

    /// Returns the means as a frame.
    #[must_use]
    pub fn finish(&self) -> Frame {
        let size = (self.window.width, self.window.height);
        Frame::of_layers(size, DataWindow::of(self.whole, self.window), self.means())
    }

    /// Standard error over the passes of each of a layer's means; `None` for one pass.
    ///
    /// # Panics
    /// If [`LAYERS`] has no layer of that name.
    #[must_use]
    pub fn standard_error(&self, layer: &str) -> Option<Vec<f32>> {
        let (i, passes) = (layer_index(layer), f64::from(self.passes));
        let squares = &self.squares.as_ref()?[i];
        let error = |(mean, squares): (&f32, &f64)| {
            let variance = (squares / passes - f64::from(*mean).powi(2)).max(0.0) / (passes - 1.0);
            variance.sqrt() as f32
        };
        Some(self.means()[i].iter().zip(squares).map(error).collect())
    }

    /// The mean of each number, by its layer's rule.
    fn means(&self) -> [Vec<f32>; LAYERS.len()] {
        let per_sample = 1.0 / self.samples as f32;
        let hits = &self.sums[layer_index("alpha")];
        array::from_fn(|i| {
            let count = LAYERS[i].channels.len();
            let scale = |pixel: usize| match LAYERS[i].rule {
                Rule::PerSample => per_sample,
                Rule::PerHit if hits[pixel] > 0.0 => 1.0 / hits[pixel],
                Rule::PerHit => 0.0,
            };
            self.sums[i].iter().enumerate().map(|(at, sum)| sum * scale(at / count)).collect()
        })
    }

    /// Sums over the passes of the squares of their means.
    fn squares(&self) -> [Vec<f64>; LAYERS.len()] {
        let of_one = || self.means().map(|means| means.into_iter().map(|mean| f64::from(mean).powi(2)).collect());
        self.squares.clone().unwrap_or_else(of_one)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: (u32, u32) = (3, 2);
    const ALL: Crop = Crop { column: 0, row: 0, width: 3, height: 2 };

    /// Sums over `samples` samples, each of the value `v`, half of which hit something.
    fn sums(v: f32, samples: u32) -> PixelSums {
        let (s, hits) = (samples as f32, samples as f32 / 2.0);
        [[v * s, 2.0 * v * s, 3.0 * v * s, 0.0], [0.0, 0.0, hits, 5.0 * hits], [v * hits, 0.0, 0.0, hits]]
    }

    fn film(values: &[f32], spp: u32) -> Film {
        let mut film = Film::new(WHOLE, ALL, spp);
        for (i, v) in (0..).zip(values) {
            film.add((i % 3, i / 3), &sums(*v, spp), spp);
        }
        film
    }

    #[test]
    fn means_follow_the_rules_of_the_layers() {
        let frame = film(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 8).finish();
        assert_eq!((frame.radiance()[4], frame.alpha()[4]), ([5.0, 10.0, 15.0], 0.5));
        assert_eq!((frame.depth()[4], frame.normal()[4], frame.albedo()[4]), (5.0, [0.0, 0.0, 1.0], [5.0, 0.0, 0.0]));
        let empty = Film::new(WHOLE, ALL, 8).finish();
        assert_eq!((empty.depth()[0], empty.radiance()[0]), (0.0, [0.0; 3]), "nothing hit is no division by 0");
    }

    #[test]
    fn halves_merge_to_what_one_film_holds() {
        let mut whole = film(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 4);
        (0..6).for_each(|i| whole.add((i % 3, i / 3), &sums(7.0, 4), 4));
        let (mut merged, second) = (film(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 4), film(&[7.0; 6], 4));
        merged.merge(&second).expect("they are of one picture");
        assert_eq!(merged.sums, whole.sums);
        assert_eq!((merged.passes(), merged.samples()), (2, 8));
        let [mean, ..] = merged.finish().radiance()[0];
        assert_eq!(mean, 4.0);
        // Control: a third pass changes the mean.
        merged.merge(&second).expect("they are of one picture");
        assert_ne!(merged.finish().radiance()[0][0], mean);
    }

    #[test]
    fn passes_tell_their_standard_error() {
        let mut merged = film(&[1.0; 6], 4);
        assert_eq!(merged.standard_error("radiance"), None);
        for value in [2.0, 3.0, 6.0] {
            merged.merge(&film(&[value; 6], 4)).expect("they are of one picture");
        }
        // The values 1, 2, 3, 6 of four passes have the mean 3 and the variance 14/3.
        let error = merged.standard_error("radiance").expect("four passes")[0];
        assert!((error - (14.0_f32 / 3.0 / 4.0).sqrt()).abs() < 1e-6, "{error}");
        let mut equal = film(&[1.0; 6], 4);
        equal.merge(&film(&[1.0; 6], 4)).expect("they are of one picture");
        assert_eq!(equal.standard_error("radiance").expect("two passes")[0], 0.0, "control: equal passes");
    }

    #[test]
    fn films_of_other_pictures_are_refused() {
        let mut a = film(&[1.0; 6], 4);
        let cropped = Film::new((6, 2), ALL, 4);
        let message = a.merge(&cropped).expect_err("another picture").to_string();
        assert!(message.contains("3x2 pixels at 0,0 of 6x2") && !message.contains('\n'), "{message}");
        assert_eq!(a, film(&[1.0; 6], 4), "nothing was added");
    }

    #[test]
    fn what_is_not_finite_is_left_out_and_counted() {
        let mut film = film(&[f32::MAX / 4.0; 6], 1);
        film.add((0, 0), &sums(f32::MAX / 4.0, 1), 1);
        film.add((0, 0), &sums(f32::MAX / 2.0, 1), 1);
        assert_eq!(film.non_finite(), 2, "twice the blue channel exceeds the largest number");
        assert!(film.finish().radiance()[0].iter().all(|x| x.is_finite()));
        let mut counted = Film::new(WHOLE, ALL, 1);
        counted.add((1, 1), &[[0.0, 0.0, 0.0, 3.0], [0.0; 4], [0.0; 4]], 1);
        assert_eq!(counted.non_finite(), 3);
    }
}
