//! The photon pass: emit, bounce until no path is left, and store, batch by batch until the maps are full.
//!
//! Which photons a map holds, and in which order, depends on the indices of the paths alone: never on the size of the
//! batches or on the order in which the device runs them.

use std::f64::consts::PI;

use super::{SceneBuffers, photon_map::PhotonStore};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{self, Counters, Path, Photon, PhotonBatch, Store},
    progress::{Progress, Stage},
    settings::{LightSampling, Settings},
};

/// Paths of one batch at least and at most: the device must be busy, and a staged photon knows its path by 19 bits.
const MIN_BATCH: u64 = 1 << 16;
const MAX_BATCH: u64 = 1 << 19;
/// Photons that the staging buffer holds per path of a batch; a batch that has more is traced again in smaller parts.
const STAGED_PER_PATH: u64 = 2;
/// Bounces handed to the device at once.
const BOUNCES_PER_SUBMISSION: u32 = 32;
/// Bound of the bounces where roulette alone ends paths: a scene that absorbs nothing would keep them for ever.
pub const BOUNCE_CEILING: u32 = 4095;
/// A map that gains less than this fraction of its capacity while [`GROWTH_WINDOW`] paths are traced stops there.
const LEAST_GROWTH: f64 = 1e-4;
/// Paths over which growth is watched, at least; a map's capacity if that is more.
const GROWTH_WINDOW: u64 = 1 << 17;
/// Fixed-point unit of lost flux, as a fraction of a path's mean flux.
const LOST_UNIT: f64 = 1.0 / 4096.0;

/// Photons in the order of their paths.
#[derive(Debug)]
pub struct RawMap {
    pub photons: PhotonStore,
    pub capacity: u64,
    /// Photons in it.
    pub stored: u64,
    /// Paths that they stem from: what their flux must be divided by.
    pub emitted: u64,
    open: bool,
}

/// What the photon pass leaves.
#[derive(Debug)]
pub struct TracedPhotons {
    pub global: RawMap,
    pub caustic: RawMap,
    /// Flux that the bounce limit took, W, mean of the channels.
    pub lost: f64,
    pub rays: u64,
    pub media_overflows: u64,
    /// Rays given up after the loop budget.
    pub unfinished: u64,
    pub warnings: Vec<String>,
}

/// Kernels of the photon pass.
#[derive(Debug)]
pub struct PhotonTracer {
    emit: Kernel,
    advance: Kernel,
    bounce: Kernel,
    store: Kernel,
}

/// Buffers of a batch.
struct BatchBuffers {
    paths: Buffer,
    queues: [Buffer; 2],
    counters: Buffer,
    dispatch_arguments: Buffer,
    staged: Buffer,
    staged_keys: Buffer,
    counts: Buffer,
    places: Buffer,
    staging_capacity: u64,
}

/// What one batch did.
struct BatchResult {
    counters: Counters,
    /// Photons per path: for the global map in the low half, for the caustic map in the high half.
    counts: Vec<u32>,
}

impl PhotonTracer {
    #[must_use]
    pub fn new(gpu: &Gpu, scene: &SceneBuffers) -> Self {
        Self {
            emit: scene.kernel(gpu, "emit_photons"),
            advance: Kernel::new(gpu, "advance_queue", &[]),
            bounce: scene.kernel(gpu, "bounce_photons"),
            store: Kernel::new(gpu, "store_photons", &[]),
        }
    }

    /// Traces photons until both maps are full, hardly grow, or all paths have been emitted. `caustics`: the scene has
    /// a delta surface.
    ///
    /// # Errors
    /// Limits of the adapter, faults of the driver, and [`crate::Error::Stopped`].
    pub fn trace(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        settings: &Settings,
        caustics: bool,
        progress: &dyn Progress,
    ) -> Result<TracedPhotons> {
        let wants_global = settings.mode.stores_direct() || settings.mode.follows_diffuse();
        let mut traced = TracedPhotons {
            global: RawMap::new(gpu, settings.global_photons, wants_global)?,
            caustic: RawMap::new(gpu, settings.caustic_photons, caustics)?,
            lost: 0.0,
            rays: 0,
            media_overflows: 0,
            unfinished: 0,
            warnings: Vec::new(),
        };
        let largest = u64::from(settings.global_photons.max(settings.caustic_photons));
        let max_paths = settings.max_paths.unwrap_or(100 * largest);
        let mut batch_limit = (largest / 4).clamp(MIN_BATCH, MAX_BATCH).min(max_paths.max(1));
        let buffers = BatchBuffers::new(gpu, batch_limit)?;
        let growth_window = GROWTH_WINDOW.max(largest);
        let (mut first_path, mut lost_units) = (0, 0);
        let mut stored_before = [0, 0];
        while first_path < max_paths && (traced.global.open || traced.caustic.open) {
            progress.check()?;
            let until_check = growth_window - first_path % growth_window;
            let paths = traced.paths_wanted(first_path).min(batch_limit).min(max_paths - first_path).min(until_check);
            let batch = photon_batch(scene, settings, &traced, first_path, paths, buffers.staging_capacity);
            let result = self.run_batch(gpu, scene, &buffers, &batch)?;
            let staged = u64::from(result.counters.staged);
            if staged > buffers.staging_capacity {
                batch_limit = (paths * buffers.staging_capacity * 9 / (staged * 10)).max(1);
                continue;
            }
            self.store(gpu, &buffers, &mut traced, &result, first_path)?;
            first_path += paths;
            traced.rays += u64::from(result.counters.rays) | (u64::from(result.counters.rays_high) << 32);
            traced.media_overflows += u64::from(result.counters.media_overflows);
            traced.unfinished += u64::from(result.counters.unfinished);
            lost_units += u64::from(result.counters.lost);
            if first_path.is_multiple_of(growth_window) {
                traced.close_idle_maps(&mut stored_before, growth_window);
            }
            progress.report(Stage::Photons, traced.stored(), traced.expected());
        }
        traced.lost = lost_units as f64 * LOST_UNIT * mean_flux(scene) / first_path.max(1) as f64;
        Ok(traced)
    }

    /// Emits a batch and bounces it until no path is left.
    fn run_batch(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        buffers: &BatchBuffers,
        batch: &PhotonBatch,
    ) -> Result<BatchResult> {
        let uniform = gpu.uniform("photon batch", batch);
        let named = |input: usize| {
            scene.with(&[
                ("batch", &uniform),
                ("paths", &buffers.paths),
                ("queue_in", &buffers.queues[input]),
                ("queue_out", &buffers.queues[1 - input]),
                ("counters", &buffers.counters),
                ("dispatch_arguments", &buffers.dispatch_arguments),
                ("staged", &buffers.staged),
                ("staged_keys", &buffers.staged_keys),
                ("counts", &buffers.counts),
            ])
        };
        let emit = self.emit.bind(gpu, &named(1));
        let advance = self.advance.bind(gpu, &named(0));
        let bounce = [0, 1].map(|input| self.bounce.bind(gpu, &named(input)));
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&buffers.counters, 0, None);
        self.emit.dispatch(&mut encoder, &emit, u64::from(batch.paths));
        let mut bounces = 0;
        loop {
            for _ in 0..BOUNCES_PER_SUBMISSION.min(batch.max_bounces - bounces) {
                self.advance.dispatch(&mut encoder, &advance, 1);
                let bindings = &bounce[(bounces % 2) as usize];
                self.bounce.dispatch_indirect(&mut encoder, bindings, &buffers.dispatch_arguments, 0);
                bounces += 1;
            }
            gpu.submit(encoder);
            let counters: Counters = gpu.read(&buffers.counters, 0, 1)?[0];
            if counters.next == 0 || bounces >= batch.max_bounces {
                return Ok(BatchResult { counters, counts: gpu.read(&buffers.counts, 0, u64::from(batch.paths))? });
            }
            encoder = gpu.encoder();
        }
    }

    /// Moves a batch's photons to their places in the maps, up to the first path that does not fit as a whole.
    fn store(
        &self,
        gpu: &Gpu,
        buffers: &BatchBuffers,
        traced: &mut TracedPhotons,
        result: &BatchResult,
        first_path: u64,
    ) -> Result<()> {
        let mut places = traced.global.place(result.counts.iter().map(|c| c & 0xffff), first_path);
        places.extend(traced.caustic.place(result.counts.iter().map(|c| c >> 16), first_path));
        gpu.write(&buffers.places, 0, &places);
        let mut encoder = gpu.encoder();
        for (map, map_bit, first_place) in
            [(&traced.global, 0, 0), (&traced.caustic, layout::CAUSTIC_BIT, result.counts.len() as u32)]
        {
            for (window, first_photon, photons) in map.photons.parts(map.stored as u32) {
                let staged = result.counters.staged;
                let store = Store { staged, first_place, first_photon, photons, map_bit, ..Default::default() };
                let uniform = gpu.uniform("store", &store);
                let bindings = self.store.bind(
                    gpu,
                    &[
                        ("store", &uniform),
                        ("staged", &buffers.staged),
                        ("staged_keys", &buffers.staged_keys),
                        ("places", &buffers.places),
                        ("photons", window),
                    ],
                );
                self.store.dispatch(&mut encoder, &bindings, u64::from(staged));
            }
        }
        gpu.submit(encoder);
        gpu.wait()
    }
}

impl BatchBuffers {
    fn new(gpu: &Gpu, paths: u64) -> Result<Self> {
        let staging_capacity = (paths * STAGED_PER_PATH).max(2 * u64::from(BOUNCE_CEILING));
        Ok(Self {
            paths: gpu.storage::<Path>("photon paths", paths)?,
            queues: [gpu.storage::<u32>("photon queue", paths)?, gpu.storage::<u32>("photon queue", paths)?],
            counters: gpu.storage::<Counters>("photon counters", 1)?,
            dispatch_arguments: gpu.storage::<[u32; 3]>("photon dispatch arguments", 1)?,
            staged: gpu.storage::<Photon>("staged photons", staging_capacity)?,
            staged_keys: gpu.storage::<u32>("keys of staged photons", staging_capacity)?,
            counts: gpu.storage::<u32>("photon counts", paths)?,
            places: gpu.storage::<u32>("photon places", 2 * paths)?,
            staging_capacity,
        })
    }
}

impl RawMap {
    /// An empty map; without room if it is not `wanted`.
    fn new(gpu: &Gpu, capacity: u32, wanted: bool) -> Result<Self> {
        let capacity = if wanted { capacity } else { 0 };
        Ok(Self {
            photons: PhotonStore::new(gpu, capacity)?,
            capacity: u64::from(capacity),
            stored: 0,
            emitted: 0,
            open: wanted,
        })
    }

    /// Place of the first photon of each path of a batch. The first path that does not fit closes the map, which is
    /// then normalised by the paths before it.
    fn place(&mut self, counts: impl Iterator<Item = u32>, first_path: u64) -> Vec<u32> {
        // Beyond the end of any map, also when a path's photons are counted from there.
        const DROPPED: u32 = 1 << 31;
        counts
            .zip(first_path..)
            .map(|(count, path)| {
                if self.open && self.stored + u64::from(count) > self.capacity {
                    self.open = false;
                }
                if !self.open {
                    return DROPPED;
                }
                let place = self.stored as u32;
                self.stored += u64::from(count);
                self.emitted = path + 1;
                place
            })
            .collect()
    }

    /// The photons, read back in the order of their paths.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<Photon>> {
        let parts = self.photons.parts(self.stored as u32);
        parts
            .map(|(window, _, count)| gpu.read(window, 0, u64::from(count)))
            .collect::<Result<Vec<_>>>()
            .map(|p| p.concat())
    }

    /// Paths that are likely to fill the map from here on.
    fn paths_wanted(&self, first_path: u64) -> u64 {
        if !self.open {
            return 0;
        }
        if self.stored == 0 {
            return if first_path == 0 { self.capacity.max(1024) } else { u64::MAX };
        }
        let per_photon = first_path as f64 / self.stored as f64;
        ((self.capacity - self.stored) as f64 * per_photon * 1.02) as u64 + 1024
    }
}

impl TracedPhotons {
    fn paths_wanted(&self, first_path: u64) -> u64 {
        self.global.paths_wanted(first_path).max(self.caustic.paths_wanted(first_path))
    }

    fn stored(&self) -> u64 {
        self.global.stored + self.caustic.stored
    }

    /// Photons that the maps hold in the end, as far as is known.
    fn expected(&self) -> u64 {
        let end = |map: &RawMap| if map.open { map.capacity } else { map.stored };
        end(&self.global) + end(&self.caustic)
    }

    /// Closes maps that hardly grew since the last call.
    fn close_idle_maps(&mut self, stored_before: &mut [u64; 2], window: u64) {
        let maps = [("global", &mut self.global), ("caustic", &mut self.caustic)];
        for ((name, map), before) in maps.into_iter().zip(stored_before) {
            let gained = map.stored - *before;
            *before = map.stored;
            if map.open && (gained as f64) < LEAST_GROWTH * map.capacity as f64 {
                map.open = false;
                self.warnings.push(format!(
                    "the {name} map hardly grows: {gained} photons from the last {window} paths; \
                     it stays at {} of {} photons",
                    map.stored, map.capacity
                ));
            }
        }
    }
}

/// Mean over all paths of the flux that a path starts with, W, mean of the channels.
fn mean_flux(scene: &SceneBuffers) -> f64 {
    let mean = |l: &layout::Light| l.intensity.iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0;
    4.0 * PI * scene.light_table.iter().map(mean).sum::<f64>()
}

fn photon_batch(
    scene: &SceneBuffers,
    settings: &Settings,
    traced: &TracedPhotons,
    first_path: u64,
    paths: u64,
    staging_capacity: u64,
) -> PhotonBatch {
    let light_count = scene.light_table.len() as u64;
    let rule = |holds: bool, bit: u32| if holds { bit } else { 0 };
    PhotonBatch {
        seed: settings.seed,
        first_path: first_path as u32,
        first_path_high: (first_path >> 32) as u32,
        paths: paths as u32,
        light_count: light_count as u32,
        first_light: match settings.light_sampling {
            LightSampling::Power => layout::NO_TURN,
            LightSampling::Uniform => (first_path % light_count) as u32,
        },
        max_bounces: if settings.max_bounces == 0 { BOUNCE_CEILING } else { settings.max_bounces.min(BOUNCE_CEILING) },
        rules: rule(traced.global.open, layout::STORE_GLOBAL)
            | rule(settings.mode.stores_direct(), layout::STORE_DIRECT)
            | rule(traced.caustic.open, layout::STORE_CAUSTIC)
            | rule(settings.mode.follows_diffuse(), layout::FOLLOW_DIFFUSE),
        staging_capacity: staging_capacity as u32,
        lost_scale: (1.0 / (LOST_UNIT * mean_flux(scene))) as f32,
        ..Default::default()
    }
}
