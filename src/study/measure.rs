//! Measurements of a combination's renders.

use serde::Serialize;

use super::{
    Combination, Plan, Radii,
    cells::Measured,
    corners::corner_region,
    numbers::short,
    plan::Look,
    spread::{bias, noise},
};
use crate::{
    image::{
        Frame, Rgb8,
        difference::{mean, rel_mse, rmse},
        flip::flip,
        srgb_encode,
    },
    settings::{Mode, Settings},
    stats::{MapStats, Seconds},
};

/// Row of the table: one combination. Numbers are means over its repeats unless stated otherwise;
/// all are zero or missing if it failed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// File name of the scene.
    pub scene: String,
    /// Mode of illumination.
    pub mode: Mode,
    /// Capacity of each map, photons. Like `neighbors`, it has no meaning where the mode traces no
    /// photons.
    pub photons: u32,
    /// Photons per radiance estimate, k.
    pub neighbors: u32,
    /// Rays of final gathering at each point; 0: estimates at the points themselves.
    pub final_gather: u32,
    /// Seed of the first repeat.
    pub seed: u32,
    /// Number of repeats, each with its own seed.
    pub repeats: u32,
    /// Width of the picture, pixels.
    pub width: u32,
    /// Height of the picture, pixels.
    pub height: u32,
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds by stage. Those of `bvh`, `photons` and `grid` are common to all combinations of the
    /// same photons.
    pub seconds: Seconds,
    /// Global photon map.
    pub global: MapRow,
    /// Caustic photon map.
    pub caustic: MapRow,
    /// Mean radiance of each channel over all pixels, W/(m² sr).
    pub mean_radiance: [f64; 3],
    /// Standard deviation between the repeats, root of the mean over pixels and channels, W/(m²
    /// sr); from two repeats.
    pub noise: Option<f64>,
    /// Relative mean square error against the reference, over all pixels and channels.
    pub rel_mse: Option<f64>,
    /// Root mean square error against the reference, W/(m² sr).
    pub rmse: Option<f64>,
    /// Mean FLIP error of the tone-mapped pictures, 0 to 1.
    pub flip: Option<f64>,
    /// Bias: the error common to all repeats, root mean square over pixels and channels, W/(m² sr);
    /// needs two repeats.
    pub bias: Option<f64>,
    /// Detection limit of the bias, W/(m² sr): a smaller bias is indistinguishable from noise.
    pub bias_limit: Option<f64>,
    /// Mean radiance near concave corners relative to the reference's there; 1 is correct.
    pub corner_ratio: Option<f64>,
    /// Error message of a failed combination.
    pub error: Option<String>,
    /// Picture of the first repeat.
    #[serde(skip)]
    pub(super) thumbnail: Thumbnail,
}

/// Statistics of one photon map of a combination, in the first repeat.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MapRow {
    /// Number of emitted paths, which normalises the map.
    pub emitted: u64,
    /// Number of photons in the map.
    pub stored: u64,
    /// Radii of the estimates at all visible points.
    pub radius: Option<Radii>,
}

impl Row {
    /// Mean over the channels of [`Self::mean_radiance`], W/(m² sr).
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.mean_radiance.iter().sum::<f64>() / 3.0
    }

    /// Description of the combination.
    #[must_use]
    pub fn name(&self) -> String {
        let mode = self.mode.name();
        if self.mode.traces_photons() {
            let rays = rays(self.final_gather);
            format!("{}, {mode}, n = {}, k = {}{rays}", self.scene, short(self.photons), self.neighbors)
        } else {
            format!("{}, {mode}", self.scene)
        }
    }
}

fn rays(count: u32) -> String {
    if count > 0 { format!(", {count} rays") } else { String::new() }
}

/// Description of a render.
pub(super) fn name(scene: &str, s: &Settings) -> String {
    format!(
        "{scene}, {}, n = {}, k = {}{}, seed {}",
        s.photons.mode.name(),
        short(s.photons.global),
        s.estimate.neighbors,
        rays(s.photons.final_gather),
        s.photons.seed
    )
}

/// Measures the renders, one per repeat; there are none if the combination failed.
pub(super) fn measure(
    plan: &Plan,
    combination: &Combination,
    renders: &[(Frame, Measured)],
    reference: Option<&Frame>,
    error: Option<String>,
) -> Row {
    let settings = &combination.settings;
    let scene = &plan.subjects[combination.subject].scene;
    let mut row = Row {
        scene: scene.file_name.clone(),
        mode: settings.photons.mode,
        photons: settings.photons.global,
        neighbors: settings.estimate.neighbors,
        final_gather: settings.photons.final_gather,
        seed: settings.photons.seed,
        repeats: combination.repeats,
        width: 0,
        height: 0,
        spp: settings.picture.spp,
        seconds: Seconds::default(),
        global: MapRow::default(),
        caustic: MapRow::default(),
        mean_radiance: [0.0; 3],
        noise: None,
        rel_mse: None,
        rmse: None,
        flip: None,
        bias: None,
        bias_limit: None,
        corner_ratio: None,
        error,
        thumbnail: Thumbnail::default(),
    };
    let Some((first, measured)) = renders.first() else { return row };
    (row.width, row.height) = (first.width, first.height);
    row.seconds = mean_seconds(renders);
    row.global = map_row(measured.stats.photons.global, measured.radii[0]);
    row.caustic = map_row(measured.stats.photons.caustic, measured.radii[1]);
    row.mean_radiance = std::array::from_fn(|c| average(renders, |frame| mean(frame.radiance())[c]));
    row.noise = noise(&frames(renders));
    row.thumbnail = Thumbnail::new(first, plan.look);
    if let Some(reference) = reference.filter(|r| (r.width, r.height) == (first.width, first.height)) {
        compare(&mut row, renders, reference, plan.look);
        row.corner_ratio = scene.camera(settings.picture.camera.as_deref()).ok().and_then(|camera| {
            let region = corner_region(first, camera);
            let right = mean_in(reference, &region)?;
            let found = average(renders, |frame| mean_in(frame, &region).unwrap_or(0.0));
            (right > 0.0).then_some(found / right)
        });
    }
    row
}

fn compare(row: &mut Row, renders: &[(Frame, Measured)], reference: &Frame, look: Look) {
    let right = &reference.radiance();
    row.rel_mse = Some(average(renders, |frame| rel_mse(frame.radiance(), right, None)));
    row.rmse = Some(average(renders, |frame| rmse(frame.radiance(), right, None).powi(2)).sqrt());
    row.flip = Some(average(renders, |frame| flip(frame.radiance(), right, frame.width, look.exposure, look.tonemap)));
    let bias = bias(&frames(renders), reference);
    (row.bias, row.bias_limit) = (bias.map(|b| b.value), bias.map(|b| b.limit));
}

fn frames(renders: &[(Frame, Measured)]) -> Vec<&Frame> {
    renders.iter().map(|(frame, _)| frame).collect()
}

fn average(renders: &[(Frame, Measured)], value: impl Fn(&Frame) -> f64) -> f64 {
    renders.iter().map(|(frame, _)| value(frame)).sum::<f64>() / renders.len() as f64
}

fn mean_seconds(renders: &[(Frame, Measured)]) -> Seconds {
    let of = |stage: fn(&Seconds) -> f64| {
        renders.iter().map(|(_, m)| stage(&m.stats.seconds)).sum::<f64>() / renders.len() as f64
    };
    Seconds {
        load: of(|s| s.load),
        bvh: of(|s| s.bvh),
        photons: of(|s| s.photons),
        grid: of(|s| s.grid),
        camera: of(|s| s.camera),
        direct: of(|s| s.direct),
        gather: of(|s| s.gather),
        total: of(|s| s.total),
    }
}

fn map_row(map: MapStats, radius: Option<Radii>) -> MapRow {
    MapRow { emitted: map.emitted, stored: map.stored, radius }
}

/// Mean over the channels and the pixels of the region.
fn mean_in(frame: &Frame, region: &[bool]) -> Option<f64> {
    let inside = || frame.radiance().iter().zip(region).filter(|(_, inside)| **inside).map(|(pixel, _)| pixel);
    let count = inside().count();
    (count > 0).then(|| inside().flatten().map(|&x| f64::from(x)).sum::<f64>() / (3 * count) as f64)
}

/// Thumbnail for the contact sheet, in sRGB.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Thumbnail {
    pub width: u32,
    /// Height of the picture, pixels.
    pub height: u32,
    pub pixels: Vec<Rgb8>,
}

impl Thumbnail {
    /// Maximum side length, pixels.
    const SIDE: u32 = 192;

    /// Reduces the picture by an integer factor, which preserves the look of its noise.
    pub fn new(frame: &Frame, look: Look) -> Self {
        let factor = frame.width.max(frame.height).div_ceil(Self::SIDE).max(1);
        let (width, height) = ((frame.width / factor).max(1), (frame.height / factor).max(1));
        let scale = look.exposure.exp2();
        let pixel = |x: u32, y: u32| {
            let (mut sum, mut count) = ([0.0_f32; 3], 0.0);
            for row in (y * factor)..((y + 1) * factor).min(frame.height) {
                for column in (x * factor)..((x + 1) * factor).min(frame.width) {
                    let radiance = frame.radiance()[(row * frame.width + column) as usize];
                    let shown = look.tonemap.apply(radiance.map(|v| v * scale));
                    (0..3).for_each(|c| sum[c] += shown[c]);
                    count += 1.0;
                }
            }
            sum.map(|s| (srgb_encode(s / count) * 255.0).round() as u8)
        };
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        Self { width, height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{image::Tonemap, stats::Stats};

    fn render(values: &[f32]) -> (Frame, Measured) {
        let radiance: Vec<_> = values.iter().map(|&v| [v; 3]).collect();
        let frame = Frame::new(values.len() as u32, 1, &radiance);
        (frame, Measured { stats: Stats::default(), radii: [None; 2] })
    }

    #[test]
    fn a_region_has_its_own_mean() {
        let (frame, _) = render(&[1.0, 3.0, 100.0]);
        assert_eq!(mean_in(&frame, &[true, true, false]), Some(2.0));
        assert_eq!(mean_in(&frame, &[false; 3]), None);
    }

    #[test]
    fn a_thumbnail_is_no_larger_than_its_side() {
        let frame = Frame::new(400, 100, &[[1.0; 3]; 40_000]);
        let look = Look { exposure: 0.0, tonemap: Tonemap::None };
        let small = Thumbnail::new(&frame, look);
        assert_eq!((small.width, small.height, small.pixels.len()), (133, 33, 133 * 33));
        assert!(small.pixels.iter().all(|p| *p == [255; 3]));
        let darker = Thumbnail::new(&frame, Look { exposure: -1.0, ..look });
        assert_eq!(darker.pixels[0], [188; 3]);
    }
}
