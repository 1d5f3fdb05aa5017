//! The film: sums over camera samples, from which a frame is made.

use std::array;

use super::{
    bias_check::BiasCheck,
    cryptomatte::Matte,
    film_sums::{Bandwidth, ExtraSums, LAYER_COUNT, Moments, add_all},
    frame::{DataWindow, Frame},
    layers::{EXTRA_LAYERS, LAYERS, Rule, Source, layer_index},
};
use crate::{
    error::{Error, Result},
    layout::PixelSums,
    settings::{Crop, ExtraLayers, PixelGrid},
};

/// Sums of every layer over the samples of one pass, or of several that were merged.
///
/// A pass is one run over all samples of a picture with photons of its own. Passes are independent,
/// so the second moments of their means give the standard error of the merged picture. Passes with
/// smaller radii are less biased, so the regression of their means on the squared radius gives an
/// estimate of the bias.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    pub(super) whole: (u32, u32),
    pub(super) window: Crop,
    pub(super) passes: u32,
    /// Number of samples of each pixel in all passes.
    pub(super) samples: u64,
    /// Sums of the layers' numbers, pixel by pixel, in the order of [`LAYERS`].
    pub(super) sums: [Vec<f32>; LAYER_COUNT],
    /// Squared radii of the passes.
    pub(super) bandwidth: Bandwidth,
    /// Second moments over the passes; `None` for one pass, where they are 0.
    pub(super) moments: Option<Moments>,
    /// Layers that were asked for.
    pub(super) extras: Vec<ExtraSums>,
    pub(super) mattes: Vec<Matte>,
    /// Estimates of less bias, if there are such for all passes.
    pub(super) check: Option<BiasCheck>,
    /// Number of samples that were left out, since a sum would not be finite with them.
    pub(super) non_finite: u64,
    /// Number of times that the samples of a pixel double at most.
    pub(super) doublings: u32,
    /// Number of samples beyond those that every pixel has.
    pub(super) extra_samples: u64,
}

impl Film {
    /// Creates an empty film of one pass of `spp` samples a pixel, for a part of a picture.
    #[must_use]
    pub fn new(whole: (u32, u32), window: Crop, spp: u32) -> Self {
        let pixels = window.width as usize * window.height as usize;
        let zeros = |i: usize| vec![0.0; pixels * LAYERS[i].channels.len()];
        Self {
            whole,
            window,
            passes: 1,
            samples: spp.into(),
            sums: array::from_fn(zeros),
            bandwidth: Bandwidth::of_pass(1.0),
            moments: None,
            extras: Vec::new(),
            mattes: Vec::new(),
            check: None,
            non_finite: 0,
            doublings: 0,
            extra_samples: 0,
        }
    }

    /// Adds the layers of [`EXTRA_LAYERS`] that are asked for, and mattes.
    #[must_use]
    pub fn with_layers(mut self, asked: &[ExtraLayers]) -> Self {
        let pixels = self.window.width as usize * self.window.height as usize;
        for row in EXTRA_LAYERS.iter().filter(|row| asked.contains(&row.of)) {
            let channels = row.channels.iter().map(|name| (*name).to_owned()).collect();
            let mut layer = ExtraSums { channels, rule: row.rule, source: Some(row.source), sums: Vec::new() };
            layer.sums = vec![0.0; pixels * layer.count()];
            self.extras.push(layer);
        }
        self.mattes.extend(Matte::asked_for(asked, pixels));
        self
    }

    /// Adds to the numbers of a pixel in the layer of that source, if the film has it.
    pub(crate) fn add_to(&mut self, source: Source, (column, row): (u32, u32), numbers: &[f32]) {
        let pixel = row as usize * self.window.width as usize + column as usize;
        for layer in self.extras.iter_mut().filter(|layer| layer.source == Some(source)) {
            let count = layer.count();
            let into = &mut layer.sums[pixel * count..][..count];
            into.iter_mut().zip(numbers).filter(|(a, b)| (**a + **b).is_finite()).for_each(|(a, b)| *a += b);
        }
    }

    /// Whether the film has mattes.
    pub(crate) fn has_mattes(&self) -> bool {
        !self.mattes.is_empty()
    }

    /// Adds samples of a pixel to the matte of that request.
    pub(crate) fn add_to_matte(
        &mut self,
        of: ExtraLayers,
        (column, row): (u32, u32),
        hashes: impl Iterator<Item = u32>,
    ) {
        let pixel = row as usize * self.window.width as usize + column as usize;
        if let Some(matte) = self.mattes.iter_mut().find(|matte| matte.of == of) {
            hashes.for_each(|hash| matte.add(pixel, hash, 1));
        }
    }

    /// The sum of the light of groups of lights, with a layer for each. All else is that of the
    /// first.
    ///
    /// # Panics
    /// If there is no group.
    #[must_use]
    pub(crate) fn of_light_groups(groups: Vec<(String, Self)>) -> Self {
        let mut lights = Vec::new();
        let mut total: Option<Self> = None;
        for (name, film) in groups {
            let radiance = layer_index("radiance");
            lights.push(ExtraSums {
                channels: ["R", "G", "B"].map(|channel| format!("light.{name}.{channel}")).to_vec(),
                rule: Rule::PerSample,
                source: None,
                sums: film.sums[radiance].clone(),
            });
            let Some(total) = &mut total else {
                total = Some(film);
                continue;
            };
            add_all(&mut total.sums[radiance], &film.sums[radiance]);
            for (layer, other) in total.extras.iter_mut().zip(&film.extras) {
                if matches!(layer.source, Some(Source::Component(_))) {
                    add_all(&mut layer.sums, &other.sums);
                }
            }
            total.non_finite += film.non_finite;
            total.extra_samples += film.extra_samples;
            BiasCheck::join(&mut total.check, film.check.as_ref(), BiasCheck::add_light);
        }
        let mut total = total.expect("a group of lights");
        total.extras.extend(lights);
        total
    }

    /// Notes the radiance of `closer`, a film of estimates of less bias of one pass, at the pixels
    /// of the picture's [`PixelGrid`] alone.
    #[must_use]
    pub(crate) fn checked_by(self, closer: &Self) -> Self {
        let [radiance, ..] = closer.means();
        let cells = PixelGrid::of(self.whole).pixels(self.window);
        let numbers = cells.flat_map(|(cell, _)| radiance[3 * cell..][..3].to_vec()).collect();
        Self { check: Some(BiasCheck::of_pass(numbers)), ..self }
    }

    /// Width and height of the whole picture, pixels.
    #[must_use]
    pub fn whole(&self) -> (u32, u32) {
        self.whole
    }

    /// The part of the picture that the film holds.
    #[must_use]
    pub fn window(&self) -> Crop {
        self.window
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

    /// Number of samples beyond those that every pixel has.
    #[must_use]
    pub fn extra_samples(&self) -> u64 {
        self.extra_samples
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
        for layer in &mut self.extras {
            let Some(Source::Rows((row, first))) = layer.source else { continue };
            let count = layer.channels.len();
            let into = &mut layer.sums[pixel * count..][..count];
            into.iter_mut().zip(&sums[row][first..]).filter(|(_, b)| b.is_finite()).for_each(|(a, b)| *a += b);
        }
    }

    /// Adds the passes of another film of the same part of the same picture. Sums round, so that
    /// the order of merges decides the last bits: [`super::PassSum`] fixes it.
    ///
    /// # Errors
    /// [`Error::Differs`] if size or window differ.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        let layers = |film: &Self| film.extras.iter().flat_map(|layer| layer.channels.clone()).collect::<Vec<_>>();
        let mattes = |film: &Self| film.mattes.iter().map(|matte| matte.of).collect::<Vec<_>>();
        if (layers(self), mattes(self)) != (layers(other), mattes(other)) {
            return Err(Error::Differs("films of different layers cannot be merged".to_owned()));
        }
        if self.doublings != other.doublings {
            return Err(Error::Differs("films of different numbers of samples cannot be merged".to_owned()));
        }
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
        self.merge_moments(other);
        for (a, b) in self.sums.iter_mut().zip(&other.sums) {
            add_all(a, b);
        }
        for (layer, theirs) in self.extras.iter_mut().zip(&other.extras) {
            add_all(&mut layer.sums, &theirs.sums);
        }
        self.mattes.iter_mut().zip(&other.mattes).for_each(|(matte, theirs)| matte.merge(theirs));
        BiasCheck::join(&mut self.check, other.check.as_ref(), BiasCheck::merge);
        self.passes += other.passes;
        self.samples += other.samples;
        self.non_finite += other.non_finite;
        self.extra_samples += other.extra_samples;
        Ok(())
    }

    /// Returns the means as a frame.
    #[must_use]
    pub fn finish(&self) -> Frame {
        let size = (self.window.width, self.window.height);
        let mut frame = Frame::of_layers(size, DataWindow::of(self.whole, self.window), self.means());
        for layer in &self.extras {
            let scale = self.scale_of(layer.rule);
            for (c, name) in layer.channels.iter().enumerate() {
                let mean = |(pixel, numbers): (usize, &[f32])| match layer.rule {
                    Rule::PerCount if numbers[layer.channels.len()] > 0.0 => numbers[c] / numbers[layer.channels.len()],
                    Rule::PerCount => 0.0,
                    _ => numbers[c] * scale(pixel),
                };
                frame.add_extra(name, layer.sums.chunks(layer.count()).enumerate().map(mean).collect());
            }
        }
        for matte in &self.mattes {
            matte
                .channels(self.samples << self.doublings)
                .into_iter()
                .for_each(|(name, numbers)| frame.add_extra(&name, numbers));
        }
        frame
    }

    /// Factor on the sums of each pixel that gives their mean by a rule.
    fn scale_of(&self, rule: Rule) -> impl Fn(usize) -> f32 + '_ {
        let per_sample = 1.0 / self.samples as f32;
        let hits = &self.sums[layer_index("alpha")];
        move |pixel| match rule {
            Rule::PerSample => per_sample,
            Rule::PerHit if hits[pixel] > 0.0 => 1.0 / hits[pixel],
            Rule::PerHit | Rule::PerCount => 0.0,
        }
    }

    /// The mean of each number, by its layer's rule.
    pub(super) fn means(&self) -> [Vec<f32>; LAYER_COUNT] {
        array::from_fn(|i| {
            let count = LAYERS[i].channels.len();
            let scale = self.scale_of(LAYERS[i].rule);
            self.sums[i].iter().enumerate().map(|(at, sum)| sum * scale(at / count)).collect()
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    const WHOLE: (u32, u32) = (3, 2);
    const ALL: Crop = Crop { column: 0, row: 0, width: 3, height: 2 };

    /// Sums over `samples` samples, each of the value `v`, half of which hit something.
    fn sums(v: f32, samples: u32) -> PixelSums {
        let (s, hits) = (samples as f32, samples as f32 / 2.0);
        let rows = [[v * s, 2.0 * v * s, 3.0 * v * s, 0.0], [0.0, 0.0, hits, 5.0 * hits], [v * hits, 0.0, 0.0, hits]];
        let [radiance, normal, albedo] = rows;
        [radiance, normal, albedo, [7.0 * hits, 8.0 * hits, 9.0 * hits, 0.0], [0.0; 4], [0.0; 4]]
    }

    pub fn film(values: &[f32], spp: u32) -> Film {
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
        counted.add((1, 1), &[[0.0, 0.0, 0.0, 3.0], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]], 1);
        assert_eq!(counted.non_finite(), 3);
    }
}
