//! The photon pass: emission by emission, batch by batch, until the maps are full.
//!
//! With aimed emission there are two emissions: general paths fill the global map, and paths aimed
//! at mirrors and glass fill the caustic map, which then holds L S+ D only. Without it, the same
//! paths fill both maps. The photons of a map and their order depend only on the indices of the
//! paths: never on the size of the batches or on the order in which the device runs them.
//!
//! The first of several passes is traced like a single one. Later passes emit a given number of
//! paths, whose indices follow those of the passes before them ([`PathRanges`]).

use super::{
    photon_batch::{BatchBuffers, PhotonKernels},
    raw_map::RawMap,
};
use crate::{
    error::Result,
    gpu::Gpu,
    layout::{self, PhotonBatch},
    map_kind::{ByKind, MapKind},
    progress::{Progress, Stage},
    settings::{Emission, MAX_BOUNCES, PhotonSettings, Sampler},
    upload::{SceneBuffers, light_buffers::ChoiceBuffer},
};

/// Minimum and maximum number of paths of one batch: the device must be busy, and the key of a
/// staged photon holds its path.
const MIN_BATCH: u64 = 1 << 16;
/// Paths for each photon of a small map that a batch has room for at least: buffers for more would
/// take longer to clear than to fill.
const BATCH_PER_PHOTON: u64 = 4;
const MAX_BATCH: u64 = layout::PATH_MASK as u64 + 1;
/// Minimum number of paths over which the growth of a map is measured. The capacity of the map is
/// used if it is larger.
const GROWTH_PATHS: u64 = 1 << 17;
/// Paths for each photon that a map has room for, at most and at least.
const PATHS_PER_PHOTON: u64 = 100;
const MIN_PATHS_PER_PHOTON: f64 = 4.0;
/// Fixed-point unit of lost flux, as a fraction of a path's mean flux.
const LOST_UNIT: f64 = 1.0 / 4096.0;

/// Indices of the paths of one emission: `count` of them from `first` on; `None`: until the maps
/// are full, hardly grow, or the setting's maximum of paths is emitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathRange {
    pub first: u64,
    pub count: Option<u64>,
}

/// Indices of the paths of both emissions, by the map that they are for.
pub type PathRanges = ByKind<PathRange>;

/// Result of the photon pass.
#[derive(Debug)]
pub struct TracedPhotons {
    pub maps: ByKind<RawMap>,
    /// Photons stored of each named light.
    pub of_lights: Vec<u32>,
    /// Flux that the general paths lost to the bounce limit, W, mean of the channels.
    pub lost: f64,
    pub rays: u64,
    pub media_overflows: u64,
    /// Rays abandoned when the loop budget was spent.
    pub unfinished: u64,
    /// Paths that ended because one of their values was not finite.
    pub non_finite: u64,
    pub warnings: Vec<String>,
}

/// Kernels of the photon pass.
#[derive(Debug)]
pub struct PhotonTracer {
    kernels: PhotonKernels,
}

/// One emission: paths of one kind, numbered from 0.
struct EmissionPlan<'a> {
    choices: &'a ChoiceBuffer,
    stream: u32,
    first_target: u32,
    target_count: u32,
    /// Rules of all batches: [`layout::AIM`], [`layout::CAUSTICS_APART`], and the rules of the mode
    /// that apply to these paths.
    rules: u32,
    fills: &'static [MapKind],
    /// Sphere that diffuse surfaces send more photons to.
    aim: [f32; 4],
    paths: PathRange,
}

impl PhotonTracer {
    #[must_use]
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, sampler: Sampler) -> Self {
        Self { kernels: PhotonKernels::new(gpu, scene, sampler) }
    }

    /// Has the kernels compiled ahead of their use.
    pub fn prefetch(gpu: &Gpu, scene: &SceneBuffers, sampler: Sampler) {
        let _ = Self::new(gpu, scene, sampler);
    }

    /// Traces photons until both maps are full, hardly grow, or all paths have been emitted.
    /// `caustics`: the scene has a specular surface.
    ///
    /// # Errors
    /// Limits of the adapter, faults of the driver, and [`crate::Error::Stopped`].
    pub fn trace(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        settings: &PhotonSettings,
        caustics: bool,
        progress: &dyn Progress,
    ) -> Result<TracedPhotons> {
        self.trace_range(gpu, scene, settings, (caustics, &PathRanges::default()), progress)
    }

    /// Variant of [`Self::trace`] with the paths of the given indices.
    ///
    /// # Errors
    /// As [`Self::trace`].
    pub fn trace_range(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        settings: &PhotonSettings,
        (caustics, paths): (bool, &PathRanges),
        progress: &dyn Progress,
    ) -> Result<TracedPhotons> {
        let wants_global = settings.mode.stores_direct() || settings.mode.follows_diffuse();
        let mut traced = TracedPhotons {
            maps: ByKind {
                global: RawMap::new(gpu, settings.global, wants_global)?,
                caustic: RawMap::new(gpu, settings.caustic, caustics)?,
            },
            of_lights: Vec::new(),
            lost: 0.0,
            rays: 0,
            media_overflows: 0,
            unfinished: 0,
            non_finite: 0,
            warnings: Vec::new(),
        };
        let largest = u64::from(settings.global.max(settings.caustic));
        let max_paths = settings.max_paths.unwrap_or(PATHS_PER_PHOTON * largest);
        let busy = MIN_BATCH.min((BATCH_PER_PHOTON * largest).next_power_of_two());
        let batch_limit = (largest / 4).clamp(busy, MAX_BATCH).min(max_paths.max(1));
        let named = scene.lights.table.named.len();
        let buffers = BatchBuffers::new(gpu, scene, batch_limit, named)?;
        for plan in plans(scene, settings, caustics, paths) {
            let enough =
                paths_that_matter(scene.lights.enclosure, largest).filter(|_| plan.is_for_little_light(settings));
            let max_paths = plan.paths.count.or(enough).unwrap_or(max_paths);
            self.run(gpu, scene, &plan, settings, (&buffers, batch_limit, max_paths), &mut traced, progress)?;
        }
        traced.of_lights = gpu.read(&buffers.light_photons, 0, named as u64)?;
        Ok(traced)
    }

    /// Traces the paths of one emission.
    #[allow(clippy::too_many_arguments, reason = "what stays the same for all emissions, and what does not")]
    fn run(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        plan: &EmissionPlan,
        settings: &PhotonSettings,
        (buffers, mut batch_limit, max_paths): (&BatchBuffers, u64, u64),
        traced: &mut TracedPhotons,
        progress: &dyn Progress,
    ) -> Result<()> {
        let capacities = plan.fills.iter().map(|kind| traced.maps[*kind].capacity);
        let growth_paths = GROWTH_PATHS.max(capacities.max().unwrap_or(0));
        let (mut first_path, mut lost_units) = (0, 0);
        while first_path < max_paths && plan.fills.iter().any(|kind| traced.maps[*kind].open) {
            progress.check()?;
            let until_check = growth_paths - first_path % growth_paths;
            let wanted = match plan.paths.count {
                Some(count) => count,
                None => plan.fills.iter().map(|kind| traced.maps[*kind].paths_wanted(first_path)).max().unwrap_or(0),
            };
            let paths = wanted.min(batch_limit).min(max_paths - first_path).min(until_check);
            let batch = PhotonBatch {
                paths: paths as u32,
                staging_capacity: buffers.staging_capacity as u32,
                ..plan.batch(scene, settings, traced)
            }
            .starting_at(plan.paths.first + first_path);
            let result = self.kernels.run(gpu, scene, &plan.choices.buffer, buffers, &batch)?;
            let staged = u64::from(result.counters.staged);
            if staged > buffers.staging_capacity {
                batch_limit = (paths * buffers.staging_capacity * 9 / (staged * 10)).max(1);
                continue;
            }
            for &kind in plan.fills {
                self.kernels.store(gpu, buffers, (kind, &mut traced.maps[kind]), &result, first_path)?;
            }
            first_path += paths;
            traced.rays += result.counters.all_rays();
            traced.media_overflows += u64::from(result.counters.media_overflows);
            traced.unfinished += u64::from(result.counters.unfinished);
            traced.non_finite += u64::from(result.counters.non_finite);
            lost_units += result.counters.all_lost();
            if plan.paths.count.is_none() && first_path.is_multiple_of(growth_paths) {
                for &kind in plan.fills {
                    traced.warnings.extend(traced.maps[kind].close_if_idle(kind.name(), growth_paths));
                }
            }
            let ByKind { global, caustic } = &traced.maps;
            progress.report(Stage::Photons, global.stored + caustic.stored, global.expected() + caustic.expected());
        }
        if plan.fills.contains(&MapKind::Global) {
            let flux = LOST_UNIT * scene.lights.table.power();
            traced.lost = lost_units as f64 * flux / first_path.max(1) as f64;
        }
        Ok(())
    }
}

/// Number of paths of a map of light that other surfaces send, in a scene where a fraction
/// `enclosure` of it meets anything. Its noise counts by that fraction of the light of the picture:
/// its variance by the square.
fn paths_that_matter(enclosure: f64, capacity: u64) -> Option<u64> {
    let each = (PATHS_PER_PHOTON as f64 * enclosure * enclosure).max(MIN_PATHS_PER_PHOTON);
    (each < PATHS_PER_PHOTON as f64).then_some((each * capacity as f64) as u64)
}

/// The emissions that fill the maps, without those that have no light to choose.
fn plans<'a>(
    scene: &'a SceneBuffers,
    settings: &PhotonSettings,
    caustics: bool,
    paths: &PathRanges,
) -> Vec<EmissionPlan<'a>> {
    let lights = &scene.lights;
    let rule = |holds: bool, bit: u32| if holds { bit } else { 0 };
    let aimed = settings.emission == Emission::Aimed;
    let general = EmissionPlan {
        choices: &lights.photons,
        stream: layout::STREAM_PHOTON,
        first_target: if aimed { 0 } else { lights.seen_targets },
        target_count: if aimed { lights.seen_targets + 1 } else { 1 },
        // Rays of final gathering see light that was scattered diffusely before it came through
        // glass.
        rules: rule(aimed, layout::AIM)
            | rule(aimed && lights.seen_targets > 0, layout::EVENLY)
            | rule(aimed || settings.final_gather > 0, layout::CAUSTICS_APART)
            | rule(settings.mode.stores_direct(), layout::STORE_DIRECT)
            | rule(settings.mode.follows_diffuse(), layout::FOLLOW_DIFFUSE),
        fills: if aimed { &[MapKind::Global] } else { &MapKind::ALL },
        aim: if aimed { lights.seen } else { [0.0; 4] },
        paths: paths.global,
    };
    let caustic = EmissionPlan {
        choices: &lights.aimed,
        stream: layout::STREAM_CAUSTIC,
        first_target: lights.seen_targets + 1,
        target_count: lights.specular_targets,
        rules: layout::AIM | layout::CAUSTICS_APART,
        fills: &[MapKind::Caustic],
        aim: [0.0; 4],
        paths: paths.caustic,
    };
    let wanted = [Some(general), (aimed && caustics).then_some(caustic)];
    wanted.into_iter().flatten().filter(|plan| plan.choices.strata > 0).collect()
}

impl EmissionPlan<'_> {
    /// Whether the map has only light over other surfaces, and nobody asks for a number of paths.
    fn is_for_little_light(&self, settings: &PhotonSettings) -> bool {
        settings.max_paths.is_none() && self.fills == [MapKind::Global] && !settings.mode.stores_direct()
    }

    /// Settings that all batches of the emission share, and the rules for the maps that are still
    /// open.
    fn batch(&self, scene: &SceneBuffers, settings: &PhotonSettings, traced: &TracedPhotons) -> PhotonBatch {
        let open = |kind: MapKind, bit: u32| {
            if self.fills.contains(&kind) && traced.maps[kind].open { bit } else { 0 }
        };
        PhotonBatch {
            seed: settings.seed,
            light_count: scene.lights.table.lights.len() as u32,
            strata: self.choices.strata,
            max_bounces: settings.bounce_limit(),
            max_surfaces: match scene.has_lobes {
                true => MAX_BOUNCES.min(settings.bounce_limit() + layout::CHAIN_LIMIT),
                false => settings.bounce_limit(),
            },
            rules: self.rules
                | open(MapKind::Global, layout::STORE_GLOBAL)
                | open(MapKind::Caustic, layout::STORE_CAUSTIC),
            lost_scale: (1.0 / (LOST_UNIT * scene.lights.table.power())) as f32,
            stream: self.stream,
            first_target: self.first_target,
            target_count: self.target_count,
            aim: self.aim,
            ..Default::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::paths_that_matter;

    #[test]
    fn open_scenes_take_fewer_paths() {
        assert_eq!(paths_that_matter(1.0, 1000), None, "as many as any map");
        assert_eq!(paths_that_matter(0.5, 1000), Some(25_000));
        assert_eq!(paths_that_matter(0.0, 1000), Some(4000));
    }
}
