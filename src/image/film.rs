//! The film: sums over camera samples, from which a frame is made, and the second moments of merged
//! passes.

use std::array;

use serde::{Deserialize, Serialize};

use super::{
    bias_check::BiasCheck,
    cryptomatte::Matte,
    frame::{DataWindow, Frame},
    layers::{EXTRA_LAYERS, LAYERS, Rule, Source, layer_index},
};
use crate::{
    error::{Error, Result},
    layout::PixelSums,
    settings::{Crop, ExtraLayers, PixelGrid},
};

/// Number of a film's layers.
const LAYER_COUNT: usize = LAYERS.len();

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
    /// Differences from estimates of less bias, if there are such for all passes.
    pub(super) check: Option<BiasCheck>,
    /// Number of samples that were left out, since a sum would not be finite with them.
    pub(super) non_finite: u64,
    /// How samples of pixels that have more of them count.
    pub(super) weights: Weights,
    /// Number of samples beyond those that every pixel has.
    pub(super) extra_samples: u64,
}

/// How the samples of a pass count in pixels of different numbers of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Weights {
    /// Factors on counts of samples where a pixel has those that every pixel has, and where it has
    /// more: both give a pixel the same total. The first is also that of the number of samples.
    pub plain: u32,
    pub uneven: u32,
    /// Samples that a pixel has more.
    pub extra: u32,
}

/// Every pixel has the same number.
impl Default for Weights {
    fn default() -> Self {
        Self { plain: 1, uneven: 1, extra: 0 }
    }
}

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
    fn of_pass(factor: f64) -> Self {
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
            weights: Weights::default(),
            extra_samples: 0,
        }
    }

    /// Has some pixels take so many samples more, see `Self::weigh`.
    #[must_use]
    pub fn with_extra_samples(mut self, extra: u32) -> Self {
        let spp = self.samples as u32;
        let divisor = (1..=spp.max(1)).rev().find(|d| spp.is_multiple_of(*d) && extra.is_multiple_of(*d)).unwrap_or(1);
        if extra > 0 {
            self.weights = Weights { plain: (spp + extra) / divisor, uneven: spp / divisor, extra };
        }
        self
    }

    /// Weighs what a pixel has so far as that number of samples that every pixel has. `is_uneven`:
    /// it has more.
    pub(crate) fn weigh(&mut self, (column, row): (u32, u32), is_uneven: bool) {
        let pixel = row as usize * self.window.width as usize + column as usize;
        let Weights { plain, uneven, extra } = self.weights;
        self.mattes.iter_mut().for_each(|matte| matte.weigh(pixel, if is_uneven { uneven } else { plain }));
        if is_uneven {
            self.extra_samples += u64::from(extra);
            let weight = uneven as f32 / plain as f32;
            let all = LAYERS.iter().map(|layer| layer.channels.len()).zip(&mut self.sums);
            let extras = self.extras.iter_mut().map(|layer| (layer.count(), &mut layer.sums));
            for (count, sums) in all.chain(extras) {
                sums[pixel * count..][..count].iter_mut().for_each(|sum| *sum *= weight);
            }
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
            let add = |into: &mut [f32], from: &[f32]| into.iter_mut().zip(from).for_each(|(a, b)| *a += b);
            add(&mut total.sums[radiance], &film.sums[radiance]);
            for (layer, other) in total.extras.iter_mut().zip(&film.extras) {
                if matches!(layer.source, Some(Source::Component(_))) {
                    add(&mut layer.sums, &other.sums);
                }
            }
            total.non_finite += film.non_finite;
            total.extra_samples += film.extra_samples;
            total.check = match (total.check.take(), &film.check) {
                (Some(mut sum), Some(of_group)) => {
                    sum.add_light(of_group);
                    Some(sum)
                }
                _ => None,
            };
        }
        let mut total = total.expect("a group of lights");
        total.extras.extend(lights);
        total
    }

    /// Notes the squared radius of the pass's estimates, relative to that of pass 0.
    #[must_use]
    pub fn with_bandwidth(self, factor: f64) -> Self {
        Self { bandwidth: Bandwidth::of_pass(factor), ..self }
    }

    /// Notes how far the radiance of pass `index` is from that of `closer`, a film of estimates of
    /// less bias at the pixels of the picture's [`PixelGrid`] alone. `ratio` is that of the bias to
    /// this difference.
    #[must_use]
    pub(crate) fn checked_by(self, index: u32, closer: &Self, ratio: f32) -> Self {
        let radiance = layer_index("radiance");
        let (here, there) = (self.means(), closer.means());
        let places = PixelGrid::of(self.whole).places(self.window);
        let numbers = places.flat_map(|place| &here[radiance][3 * place..][..3]);
        let differences = numbers.zip(&there[radiance]).map(|(a, b)| ratio * (a - b)).collect();
        Self { check: Some(BiasCheck::of_pass(index, differences)), ..self }
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

    /// Adds the passes of another film of the same part of the same picture. Second moments are
    /// merged without cancellation (Chan, Golub and LeVeque 1983, "Algorithms for Computing the
    /// Sample Variance", equation 2.1). Sums round, so that the order of merges decides the last
    /// bits: [`super::PassSum`] fixes it.
    ///
    /// # Errors
    /// [`Error::Differs`] if size or window differ.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        let layers = |film: &Self| film.extras.iter().flat_map(|layer| layer.channels.clone()).collect::<Vec<_>>();
        let mattes = |film: &Self| film.mattes.iter().map(|matte| matte.of).collect::<Vec<_>>();
        if (layers(self), mattes(self)) != (layers(other), mattes(other)) {
            return Err(Error::Differs("films of different layers cannot be merged".to_owned()));
        }
        if self.weights != other.weights {
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
        let (n, m) = (f64::from(self.passes), f64::from(other.passes));
        // Weight of the product of the distances between both means.
        let weight = n * m / (n + m);
        let (here, there) = (self.means(), other.means());
        let shift = other.bandwidth.mean - self.bandwidth.mean;
        let mut moments = self.moments.take().unwrap_or_else(|| self.no_moments());
        for i in 0..LAYER_COUNT {
            let theirs = other.moments.as_ref().map(|moments| moments.deviations[i].as_slice());
            let distances = here[i].iter().zip(&there[i]).map(|(a, b)| f64::from(*b) - f64::from(*a));
            let products = distances.map(|d| d * d * weight);
            add(&mut moments.deviations[i], theirs, products);
        }
        let radiance = layer_index("radiance");
        let theirs = other.moments.as_ref().map(|moments| moments.with_bandwidth.as_slice());
        let distances = here[radiance].iter().zip(&there[radiance]).map(|(a, b)| f64::from(*b) - f64::from(*a));
        add(&mut moments.with_bandwidth, theirs, distances.map(|d| d * shift * weight));
        self.moments = Some(moments);
        self.bandwidth = Bandwidth {
            mean: self.bandwidth.mean + shift * m / (n + m),
            deviations: self.bandwidth.deviations + other.bandwidth.deviations + shift * shift * weight,
            inverse: (n * self.bandwidth.inverse + m * other.bandwidth.inverse) / (n + m),
        };
        for (a, b) in self.sums.iter_mut().zip(&other.sums) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        }
        for (layer, theirs) in self.extras.iter_mut().zip(&other.extras) {
            layer.sums.iter_mut().zip(&theirs.sums).for_each(|(a, b)| *a += b);
        }
        self.mattes.iter_mut().zip(&other.mattes).for_each(|(matte, theirs)| matte.merge(theirs));
        self.check = match (self.check.take(), &other.check) {
            (Some(mut sum), Some(theirs)) => {
                sum.merge(theirs);
                Some(sum)
            }
            _ => None,
        };
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
                .channels(self.samples * u64::from(self.weights.plain))
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

    /// Standard error over the passes of each of a layer's means; `None` for one pass.
    ///
    /// # Panics
    /// If [`LAYERS`] has no layer of that name.
    #[must_use]
    pub fn standard_error(&self, layer: &str) -> Option<Vec<f32>> {
        let (i, passes) = (layer_index(layer), f64::from(self.passes));
        let deviations = &self.moments.as_ref()?.deviations[i];
        let error = |deviations: &f32| (f64::from(*deviations) / (passes - 1.0) / passes).sqrt() as f32;
        Some(deviations.iter().map(error).collect())
    }

    /// Estimate of the bias of each of the means of radiance, by linear regression of the passes'
    /// means on their squared radii, to which the bias is proportional at first order (Silverman
    /// 1986, "Density Estimation", section 3.3); `None` unless passes differ in radius. It has a
    /// noise of its own, [`Self::bias_noise`] times the standard error.
    #[must_use]
    pub fn bias(&self) -> Option<Vec<f32>> {
        let moments = self.moments.as_ref().filter(|_| self.bandwidth.deviations > 0.0)?;
        let scale = self.bandwidth.mean / self.bandwidth.deviations;
        Some(moments.with_bandwidth.iter().map(|product| (f64::from(*product) * scale) as f32).collect())
    }

    /// Standard error of [`Self::bias`] relative to [`Self::standard_error`], if the variance of a
    /// pass is inverse to its squared radius, as that of a number of photons relative to it is.
    #[must_use]
    pub fn bias_noise(&self) -> Option<f64> {
        let Bandwidth { mean, deviations, inverse } = self.bandwidth;
        let passes = f64::from(self.passes);
        // The variance v/f of a pass of squared radius f gives the mean the variance v Σ 1/f / n²,
        // and the slope v Σ (f − mean)²/f / deviations². The latter sum is n mean (mean inverse −
        // 1).
        let ratio = mean * (mean * inverse - 1.0).max(0.0) / inverse;
        (deviations > 0.0).then(|| mean * passes / deviations * ratio.sqrt())
    }

    /// The mean of each number, by its layer's rule.
    fn means(&self) -> [Vec<f32>; LAYER_COUNT] {
        array::from_fn(|i| {
            let count = LAYERS[i].channels.len();
            let scale = self.scale_of(LAYERS[i].rule);
            self.sums[i].iter().enumerate().map(|(at, sum)| sum * scale(at / count)).collect()
        })
    }

    /// The moments of one pass.
    fn no_moments(&self) -> Moments {
        Moments {
            deviations: array::from_fn(|i| vec![0.0; self.sums[i].len()]),
            with_bandwidth: vec![0.0; self.sums[layer_index("radiance")].len()],
        }
    }
}

/// Adds the moments of another film, and the products of the distances between both means.
fn add(moments: &mut [f32], theirs: Option<&[f32]>, products: impl Iterator<Item = f64>) {
    for (i, (moment, product)) in moments.iter_mut().zip(products).enumerate() {
        let theirs = theirs.map_or(0.0, |moments| f64::from(moments[i]));
        *moment = (f64::from(*moment) + theirs + product) as f32;
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
        let rows = [[v * s, 2.0 * v * s, 3.0 * v * s, 0.0], [0.0, 0.0, hits, 5.0 * hits], [v * hits, 0.0, 0.0, hits]];
        let [radiance, normal, albedo] = rows;
        [radiance, normal, albedo, [7.0 * hits, 8.0 * hits, 9.0 * hits, 0.0], [0.0; 4], [0.0; 4]]
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
    fn passes_of_smaller_radii_tell_the_bias() {
        // Means 3 + 2 f of squared radii f: a bias of 2 times the mean of f.
        let bandwidths = [1.0, 0.5, 0.25, 0.125];
        let merged = |value: &dyn Fn(f64) -> f32| {
            let pass = |f: f64| film(&[value(f); 6], 4).with_bandwidth(f);
            let mut merged = pass(bandwidths[0]);
            bandwidths[1..].iter().for_each(|f| merged.merge(&pass(*f)).expect("they are of one picture"));
            merged
        };
        let biased = merged(&|f| (3.0 + 2.0 * f) as f32);
        let bias = biased.bias().expect("radii differ")[0];
        assert!((bias - 2.0 * 1.875 / 4.0).abs() < 1e-6, "{bias}");
        assert!((biased.finish().radiance()[0][0] - bias - 3.0).abs() < 1e-6, "without it, the truth is left");
        assert_eq!(merged(&|_| 3.0).bias().expect("radii differ")[0], 0.0, "control: no bias");
        assert!(film(&[1.0; 6], 4).bias().is_none(), "one pass tells nothing");
        // The slope of two passes is the difference: mean/(f₀ − f₁) times √(v/f₀ + v/f₁), and the
        // standard error half of that root.
        let mut two = film(&[1.0; 6], 4);
        two.merge(&film(&[2.0; 6], 4).with_bandwidth(0.5)).expect("they are of one picture");
        assert!((two.bias_noise().expect("radii differ") - 2.0 * 0.75 / 0.5).abs() < 1e-12);
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
