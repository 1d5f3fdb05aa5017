//! How bright caustics are beside all other light where they lie: faint ones need few photons.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::photon_batch::{BatchBuffers, PhotonKernels};
use crate::{
    error::Result,
    gpu::Gpu,
    layout::{Photon, PhotonBatch, from_octahedral},
    upload::{SceneBuffers, light_buffers::ChoiceBuffer},
};

/// Paths that tell the other light.
const PATHS: u64 = 1 << 14;
/// Photons of caustics about which both are estimated, spread over all, and nearest photons of each
/// estimate.
const PLACES: usize = 256;
const NEAREST: usize = 16;
/// Fraction of the caustics' photons about which caustics are fainter than the part that decides.
const FAINTER: f64 = 0.98;
/// Cosine between normals from which on photons are of one surface.
const ALIKE: f32 = 0.5;

/// Light as photons, and the number of paths that they are divided by.
pub(super) struct Light {
    pub photons: Vec<Photon>,
    pub paths: u64,
}

/// All light but that of caustics, by a few paths. `None` if they have too many photons
/// for the buffers.
pub(super) fn other_light(
    gpu: &Gpu,
    scene: &SceneBuffers,
    kernels: &PhotonKernels,
    (buffers, most_paths): (&BatchBuffers, u64),
    (choices, batch): (&ChoiceBuffer, &PhotonBatch),
) -> Result<Option<Light>> {
    let paths = PATHS.min(most_paths);
    let batch = PhotonBatch { paths: paths as u32, staging_capacity: buffers.staging_capacity as u32, ..*batch };
    let result = kernels.run(gpu, scene, &choices.buffer, buffers, &batch)?;
    if u64::from(result.counters.staged) > buffers.staging_capacity {
        return Ok(None);
    }
    // Staged photons lie in any order.
    let mut staged = buffers.staged(gpu, result.counters.staged)?;
    staged.sort_unstable_by_key(|(key, _)| *key);
    Ok(Some(Light { photons: staged.into_iter().map(|(_, photon)| photon).collect(), paths }))
}

/// Fraction of the light that caustics are where they lie, 0 to 1: fainter for most of their
/// photons. 1 without enough of these.
pub(super) fn part_of_caustics(caustics: &Light, others: &Light) -> f64 {
    if caustics.photons.len() < NEAREST {
        return 1.0;
    }
    let [bright, rest] = [caustics, others].map(Surfaces::new);
    let count = caustics.photons.len();
    let places = PLACES.min(count);
    let part = |place: usize| {
        let at = place * count / places;
        let irradiance = bright.irradiance(bright.places[at]);
        f64::from(irradiance / (irradiance + rest.irradiance(bright.places[at])).max(f32::MIN_POSITIVE))
    };
    let mut parts: Vec<f64> = (0..places).into_par_iter().map(part).collect();
    parts.sort_by(f64::total_cmp);
    parts[(FAINTER * places as f64) as usize]
}

/// Photons as what an estimate asks.
struct Surfaces {
    /// Position and normal.
    places: Vec<(Vec3, Vec3)>,
    /// Mean of the channels over the number of paths, W.
    fluxes: Vec<f32>,
}

impl Surfaces {
    fn new(light: &Light) -> Self {
        let place = |photon: &Photon| (Vec3::from(photon.position), from_octahedral(photon.normal));
        let flux = |photon: &Photon| photon.flux.iter().sum::<f32>() / (3.0 * light.paths as f32);
        Self { places: light.photons.iter().map(place).collect(), fluxes: light.photons.iter().map(flux).collect() }
    }

    /// Estimate by the nearest photons of the same surface, W/m².
    fn irradiance(&self, (position, normal): (Vec3, Vec3)) -> f32 {
        let own = self.places.iter().zip(&self.fluxes).filter(|((_, n), _)| n.dot(normal) > ALIKE);
        let mut own: Vec<(f32, f32)> = own.map(|((p, _), flux)| (p.distance_squared(position), *flux)).collect();
        if own.len() < NEAREST {
            return 0.0;
        }
        let (nearer, last, _) = own.select_nth_unstable_by(NEAREST - 1, |a, b| a.0.total_cmp(&b.0));
        nearer.iter().map(|(_, flux)| flux).sum::<f32>() / (PI * last.0).max(f32::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::octahedral;

    /// An even grid of photons over a square of side 1, of that flux in all.
    fn sheet(side: u16, flux: f32, normal: Vec3) -> Light {
        let at = |i: u16| (f32::from(i) + 0.5) / f32::from(side);
        let each = flux / f32::from(side).powi(2);
        let photon = |i: u16| Photon {
            position: [at(i % side), at(i / side), 0.0],
            flux: [each; 3],
            normal: octahedral(normal),
            ..Default::default()
        };
        Light { photons: (0..side * side).map(photon).collect(), paths: 1 }
    }

    #[test]
    fn a_part_is_that_of_the_light_on_one_surface() {
        let close = |part: f64, right: f64| (part - right).abs() < 0.25 * right;
        for (flux, right) in [(1.0, 0.5), (0.1, 1.0 / 11.0), (9.0, 0.9)] {
            let part = part_of_caustics(&sheet(40, flux, Vec3::Z), &sheet(30, 1.0, Vec3::Z));
            assert!(close(part, right), "{part} instead of {right}");
        }
        // Light on the back of the sheet is not beside them; nor is anything without photons.
        assert_eq!(part_of_caustics(&sheet(40, 0.1, Vec3::Z), &sheet(30, 1.0, -Vec3::Z)), 1.0);
        assert_eq!(part_of_caustics(&sheet(3, 0.1, Vec3::Z), &sheet(30, 1.0, Vec3::Z)), 1.0);
    }

    #[test]
    fn a_small_bright_spot_decides() {
        // A hundredth of the other light on a thousandth of the sheet.
        let mut spot = sheet(40, 0.01, Vec3::Z);
        spot.photons.iter_mut().for_each(|photon| photon.position = photon.position.map(|x| x * 0.0316));
        let part = part_of_caustics(&spot, &sheet(100, 1.0, Vec3::Z));
        assert!(part > 0.8, "{part}");
    }
}
