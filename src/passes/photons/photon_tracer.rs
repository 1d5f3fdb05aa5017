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
    emission_plans::{EmissionPlan, LOST_UNIT, PathRanges, pilot_of_other_light, plans, steered},
    faint_caustics::{Light, other_light, part_of_caustics},
    photon_batch::{BatchBuffers, PhotonKernels},
    raw_map::RawMap,
};
use crate::{
    error::Result,
    gpu::Gpu,
    layout::{self, PhotonBatch},
    map_kind::{ByKind, MapKind},
    progress::{Progress, Stage},
    settings::{PhotonSettings, Sampler},
    upload::SceneBuffers,
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
/// The same of photons for caustics where panes that rays to lights pass are among what they are
/// aimed at: most go through these, and few of the others meet anything.
const PATHS_PER_PHOTON_AT_PANES: u64 = 8;

/// Least number of the same of photons for caustics, however faint these are.
const MIN_CAUSTIC_PATHS_PER_PHOTON: f64 = 8.0;

/// Enclosure below which what the cameras see is open. By rounding, some rays meet the very surface
/// that they leave.
const OPEN: f64 = 0.05;

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
        let steered = steered(gpu, scene, (&self.kernels, settings), (&buffers, batch_limit, max_paths))?;
        for plan in plans(scene, settings, caustics, paths, steered.as_ref()) {
            let enough =
                paths_that_matter(scene.lights.enclosure * scene.lights.diffuse, largest, MIN_PATHS_PER_PHOTON)
                    .filter(|_| plan.is_for_little_light(settings));
            let at_panes = (plan.is_for_caustics(settings) && scene.has_clear_surfaces())
                .then(|| max_paths.min(PATHS_PER_PHOTON_AT_PANES * u64::from(settings.caustic)));
            let max_paths = plan.paths.count.or(enough).or(at_panes).unwrap_or(max_paths);
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
        (buffers, mut batch_limit, mut max_paths): (&BatchBuffers, u64, u64),
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
                ..plan.batch(scene, settings, &open(traced))
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
                    let warning = traced.maps[kind].close_if_idle(kind.name(), growth_paths);
                    let is_expected = is_rightly_idle(scene, settings, kind, &traced.maps[kind]);
                    traced.warnings.extend(warning.filter(|_| !is_expected));
                }
                let is_asked = plan.is_for_caustics(settings) && traced.maps.caustic.open;
                if is_asked && first_path == growth_paths && max_paths > first_path {
                    let part =
                        self.measure_caustics(gpu, scene, settings, (buffers, batch_limit), &traced.maps.caustic)?;
                    let enough = paths_that_matter(part, traced.maps.caustic.capacity, MIN_CAUSTIC_PATHS_PER_PHOTON);
                    max_paths = max_paths.min(enough.unwrap_or(max_paths)).max(first_path);
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

    /// Fraction of the light that the caustics in a map are where they lie, times that of what is
    /// seen which is diffuse and shows them.
    fn measure_caustics(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        settings: &PhotonSettings,
        (buffers, batch_limit): (&BatchBuffers, u64),
        map: &RawMap,
    ) -> Result<f64> {
        let (choices, batch) = pilot_of_other_light(scene, settings);
        if choices.strata == 0 {
            return Ok(1.0);
        }
        let others = other_light(gpu, scene, &self.kernels, (buffers, batch_limit), (choices, &batch))?;
        let caustics = Light { photons: map.read(gpu)?, paths: map.emitted };
        let part = others.map_or(1.0, |others| part_of_caustics(&caustics, &others));
        Ok(part * scene.lights.diffuse)
    }
}

/// Whether a map that hardly grows has nothing more to take.
fn is_rightly_idle(scene: &SceneBuffers, settings: &PhotonSettings, kind: MapKind, map: &RawMap) -> bool {
    let by_kind = match kind {
        // Light of what the cameras see meets nothing else.
        MapKind::Global => map.stored == 0 && scene.lights.enclosure < OPEN && !settings.mode.stores_direct(),
        // What windows alone reflect is little, and mostly out of the house.
        MapKind::Caustic => scene.only_clear_surfaces_cast,
    };
    by_kind || !scene.has_diffuse
}

/// Maps that take photons.
fn open(traced: &TracedPhotons) -> ByKind<bool> {
    ByKind { global: traced.maps.global.open, caustic: traced.maps.caustic.open }
}

/// Number of paths of a map whose light is that fraction of the picture's where it matters, with a
/// minimum for each photon; `None` if as many as of any map. Its noise counts by that fraction: its
/// variance by the square.
fn paths_that_matter(fraction: f64, capacity: u64, least: f64) -> Option<u64> {
    let each = (PATHS_PER_PHOTON as f64 * fraction * fraction).max(least);
    (each < PATHS_PER_PHOTON as f64).then_some((each * capacity as f64) as u64)
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;
    use crate::{
        bvh::Bvh,
        progress::Silent,
        scene::{Bounds, Camera, Light, LightKind, Material, Scene, Sphere, Surface},
        settings::LightSettings,
    };

    /// Warnings of the maps of balls of those surfaces, so many metres apart, in sunlight. The
    /// camera sees the first.
    fn warnings(surfaces: &[Surface], apart: f32) -> Vec<String> {
        let gpu = Gpu::open(None).expect("tests need an adapter");
        let ball =
            |i: usize| Sphere { center: vec3(apart * i as f32, 0.0, 0.0), radius: 1.0, material: i as u32, object: 0 };
        let mut scene = Scene {
            spheres: (0..surfaces.len()).map(ball).collect(),
            objects: vec!["balls".to_owned()],
            materials: surfaces.iter().map(|surface| Material::new("", *surface)).collect(),
            ..Scene::default()
        };
        scene.lights.push(Light {
            name: "sun".to_owned(),
            group: None,
            kind: LightKind::Directional,
            position: Vec3::ZERO,
            direction: Vec3::NEG_Y,
            intensity: Vec3::ONE,
        });
        scene.cameras.push(Camera::framing(Bounds::from(&scene.spheres[0])));
        let buffers = SceneBuffers::new(&gpu, &scene, &Bvh::build(&scene), &LightSettings::default()).expect("fits");
        let settings = PhotonSettings { global: 100_000, caustic: 100_000, ..PhotonSettings::default() };
        let tracer = PhotonTracer::new(&gpu, &buffers, settings.sampler);
        let traced = tracer.trace(&gpu, &buffers, &settings, scene.has_specular(), &Silent).expect("it is traced");
        assert!(traced.maps.global.stored < 10 && traced.maps.caustic.stored < 10);
        traced.warnings
    }

    #[test]
    fn maps_that_have_nothing_to_take_are_no_fault() {
        let (mirror, diffuse) = (Surface::Mirror { tint: Vec3::ONE }, Surface::Diffuse { albedo: Vec3::ONE });
        assert_eq!(warnings(&[mirror, mirror], 3.0), [""; 0], "nothing shows photons");
        assert_eq!(warnings(&[Surface::Glass { ior: 1.5, tint: Vec3::ONE }], 3.0), [""; 0], "nothing shows photons");
        assert_eq!(warnings(&[diffuse], 3.0), [""; 0], "nothing is lit by another thing");
        // Photons would be seen, but next to none of the mirror's light meets the other ball.
        let control = warnings(&[mirror, diffuse], 2000.0);
        let said = |name: &str| control.iter().any(|line| line.starts_with(&format!("the {name} map hardly grows")));
        assert!(said("caustic") && said("global"), "{control:?}");
    }

    #[test]
    fn open_scenes_take_fewer_paths() {
        assert_eq!(paths_that_matter(1.0, 1000, 4.0), None, "as many as any map");
        assert_eq!(paths_that_matter(0.5, 1000, 4.0), Some(25_000));
        assert_eq!(paths_that_matter(0.0, 1000, 4.0), Some(4000));
    }
}
