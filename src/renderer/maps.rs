//! First pass: traces photons from the lights and stores them in maps, with the settings of the
//! tracing.

use super::{power_classes::power_classes, seen::Viewer, tally};
use crate::{
    error::Result,
    gpu::Gpu,
    map_kind::MapKind,
    passes::{MapKernels, PathRanges, PhotonMap, PhotonStore, PhotonTracer},
    progress::{Progress, Stage},
    settings::PhotonSettings,
    stats::{Stats, timed},
    upload::SceneBuffers,
};

/// Photon maps of a first pass, on the device: one of each kind that holds a photon, or several by
/// the powers of their photons.
#[derive(Debug)]
pub struct PhotonMaps {
    maps: Vec<PhotonMap>,
    kinds: Vec<MapKind>,
    /// Settings of the tracing.
    pub(super) settings: PhotonSettings,
    /// Index of the first camera sample of pictures, if the photons are those of one of several
    /// passes.
    pub(super) first_sample: Option<u32>,
    /// Number of the session that traced them.
    pub(super) session: u64,
    pub(super) stats: Stats,
}

impl PhotonMaps {
    /// The maps, in the order of [`MapKind::ALL`]; none if no photon was traced or stored.
    #[must_use]
    pub fn maps(&self) -> &[PhotonMap] {
        &self.maps
    }

    /// The maps with their kinds.
    pub fn by_kind(&self) -> impl Iterator<Item = (MapKind, &PhotonMap)> {
        self.kinds.iter().copied().zip(&self.maps)
    }

    /// Keeps the map of one kind only, for pictures of its part of the light.
    #[doc(hidden)]
    #[must_use]
    pub fn only(mut self, kind: MapKind) -> Self {
        let pairs = self.kinds.into_iter().zip(self.maps).filter(|(k, _)| *k == kind);
        (self.kinds, self.maps) = pairs.unzip();
        self
    }

    /// Settings of the tracing. Pictures made from the maps use the same mode, bounces, sampler,
    /// seed and rays of final gathering.
    #[must_use]
    pub fn settings(&self) -> &PhotonSettings {
        &self.settings
    }

    /// Statistics of the session's stages and of the first pass.
    #[must_use]
    pub fn stats(&self) -> &Stats {
        &self.stats
    }
}

/// Traces the photons of a scene and sorts them into maps. `caustics`: the scene has a specular
/// surface. `paths`: indices of the photons' paths. `viewer`: counts the photons that it sees.
pub(super) fn trace_maps(
    gpu: &Gpu,
    (scene, session): (&SceneBuffers, u64),
    settings: &PhotonSettings,
    (caustics, paths, viewer): (bool, &PathRanges, Option<Viewer<'_>>),
    mut stats: Stats,
    progress: &dyn Progress,
) -> Result<PhotonMaps> {
    let settings = settings.clone();
    if !settings.mode.traces_photons() {
        return Ok(PhotonMaps { maps: Vec::new(), kinds: Vec::new(), settings, first_sample: None, session, stats });
    }
    let traced = timed(&mut stats.seconds.photons, || {
        PhotonTracer::new(gpu, scene, settings.sampler).trace_range(gpu, scene, &settings, (caustics, paths), progress)
    })?;
    stats.rays += traced.rays;
    stats.photons.global = tally::map_stats(&traced.maps.global);
    stats.photons.caustic = tally::map_stats(&traced.maps.caustic);
    if let Some(viewer) = viewer {
        stats.photons.global.seen = Some(viewer.count(gpu, &traced.maps.global)?);
        stats.photons.caustic.seen = Some(viewer.count(gpu, &traced.maps.caustic)?);
    }
    stats.photons.lost_to_bounce_limit = traced.lost;
    stats.photons.lights = tally::light_stats(scene, &traced.of_lights);
    tally::count_faults(&mut stats, traced.media_overflows, traced.unfinished);
    stats.non_finite.photons += traced.non_finite;
    stats.warnings.extend(traced.warnings);
    let lost = traced.lost / scene.lights.table.power();
    stats.warnings.extend(tally::lost_between_surfaces(lost, settings.bounce_limit()));
    progress.report(Stage::Grid, 0, 1);
    let (mut maps, mut kinds) = (Vec::new(), Vec::new());
    timed(&mut stats.seconds.grid, || {
        let kernels = MapKernels::new(gpu);
        for (kind, map) in traced.maps.into_pairs().into_iter().filter(|(_, map)| map.stored > 0) {
            if kind == MapKind::Caustic && scene.lights.mixes_powers {
                for class in power_classes(map.read(gpu)?) {
                    let photons = PhotonStore::with(gpu, &class)?;
                    maps.push(PhotonMap::build(gpu, &kernels, photons, class.len() as u32, map.emitted)?);
                    kinds.push(kind);
                }
                continue;
            }
            maps.push(PhotonMap::build(gpu, &kernels, map.photons, map.stored as u32, map.emitted)?);
            kinds.push(kind);
        }
        Result::Ok(())
    })?;
    Ok(PhotonMaps { maps, kinds, settings, first_sample: None, session, stats })
}
