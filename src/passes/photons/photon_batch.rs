//! One batch of photon paths on the device: emit, bounce until no path is left, and store.

use super::raw_map::RawMap;
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{Counters, MAP_KINDS, MapKind, PLACE_MASK, Path, Photon, PhotonBatch, Store},
    settings::MAX_BOUNCES,
    upload::SceneBuffers,
};

/// Photons that the staging buffer holds per path of a batch; a batch that has more is traced again in smaller parts.
const STAGED_PER_PATH: u64 = 2;
/// Bounces handed to the device at once.
const BOUNCES_PER_SUBMISSION: u32 = 32;

const _: () = assert!(MAX_BOUNCES <= PLACE_MASK, "a key has room for the photons of a path");

/// Kernels of the photon pass.
#[derive(Debug)]
pub(crate) struct PhotonKernels {
    emit: Kernel,
    advance: Kernel,
    bounce: Kernel,
    store: Kernel,
}

/// Buffers of a batch.
pub(crate) struct BatchBuffers {
    paths: Buffer,
    queues: [Buffer; 2],
    counters: Buffer,
    dispatch_arguments: Buffer,
    staged: Buffer,
    staged_keys: Buffer,
    counts: Buffer,
    places: Buffer,
    /// Photons stored of each group of lights, `u32`.
    pub light_photons: Buffer,
    pub staging_capacity: u64,
}

/// What one batch did.
pub(crate) struct BatchResult {
    pub counters: Counters,
    /// Photons of each path, for each [`MapKind`].
    counts: Vec<u32>,
}

impl PhotonKernels {
    pub fn new(gpu: &Gpu, scene: &SceneBuffers) -> Self {
        Self {
            emit: scene.kernel(gpu, "emit_photons"),
            advance: Kernel::new(gpu, "advance_queue", &[]),
            bounce: scene.kernel(gpu, "bounce_photons"),
            store: Kernel::new(gpu, "store_photons", &[]),
        }
    }

    /// Emits a batch from lights by the table `choices` and bounces it until no path is left.
    pub fn run(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        choices: &Buffer,
        buffers: &BatchBuffers,
        batch: &PhotonBatch,
    ) -> Result<BatchResult> {
        let uniform = gpu.uniform("photon batch", batch);
        let named = |input: usize| {
            scene.with(&[
                ("choices", choices),
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
                self.bounce.dispatch_indirect(&mut encoder, bindings, &buffers.dispatch_arguments, batch.paths.into());
                bounces += 1;
            }
            gpu.submit(encoder);
            let counters: Counters = gpu.read(&buffers.counters, 0, 1)?[0];
            if counters.next == 0 || bounces >= batch.max_bounces {
                return Ok(BatchResult {
                    counters,
                    counts: gpu.read(&buffers.counts, 0, u64::from(batch.paths * MAP_KINDS))?,
                });
            }
            encoder = gpu.encoder();
        }
    }

    /// Moves a batch's photons to their places in the maps, up to the first path that does not fit as a whole. `maps` are the
    /// global and the caustic one, where the batch was for them.
    pub fn store(
        &self,
        gpu: &Gpu,
        buffers: &BatchBuffers,
        maps: [Option<&mut RawMap>; 2],
        result: &BatchResult,
        first_path: u64,
    ) -> Result<()> {
        for (map, kind) in maps.into_iter().zip([MapKind::Global, MapKind::Caustic]) {
            let Some(map) = map else { continue };
            let counts = result.counts.iter().skip(kind as usize).step_by(MAP_KINDS as usize);
            let (places, map) = (map.place(counts.copied(), first_path), &*map);
            gpu.write(&buffers.places, 0, &places);
            let mut encoder = gpu.encoder();
            for (window, first_photon, photons) in map.photons.parts(map.stored as u32) {
                let staged = result.counters.staged;
                let store = Store { staged, first_photon, photons, kind: kind as u32 };
                let uniform = gpu.uniform("store", &store);
                let bindings = self.store.bind(
                    gpu,
                    &[
                        ("store", &uniform),
                        ("staged", &buffers.staged),
                        ("staged_keys", &buffers.staged_keys),
                        ("places", &buffers.places),
                        ("paths", &buffers.paths),
                        ("light_photons", &buffers.light_photons),
                        ("photons", window),
                    ],
                );
                self.store.dispatch(&mut encoder, &bindings, u64::from(staged));
            }
            gpu.submit(encoder);
        }
        gpu.wait()
    }
}

impl BatchBuffers {
    /// For batches of that many paths from that many groups of lights.
    pub fn new(gpu: &Gpu, paths: u64, groups: usize) -> Result<Self> {
        let staging_capacity = (paths * STAGED_PER_PATH).max(2 * u64::from(MAX_BOUNCES));
        Ok(Self {
            paths: gpu.storage::<Path>("photon paths", paths)?,
            queues: [gpu.storage::<u32>("photon queue", paths)?, gpu.storage::<u32>("photon queue", paths)?],
            counters: gpu.storage::<Counters>("photon counters", 1)?,
            dispatch_arguments: gpu.storage::<[u32; 3]>("photon dispatch arguments", 1)?,
            staged: gpu.storage::<Photon>("staged photons", staging_capacity)?,
            staged_keys: gpu.storage::<u32>("keys of staged photons", staging_capacity)?,
            counts: gpu.storage::<u32>("photon counts", paths * u64::from(MAP_KINDS))?,
            places: gpu.storage::<u32>("photon places", paths)?,
            light_photons: gpu.storage::<u32>("photons of lights", groups as u64)?,
            staging_capacity,
        })
    }
}
