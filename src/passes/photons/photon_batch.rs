//! One batch of photon paths on the device: emit, bounce until no path is left, and store.

use super::raw_map::RawMap;
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{Counters, MAP_KINDS, PHOTON_INDEX_MASK, Photon, PhotonBatch, Store},
    map_kind::MapKind,
    passes::wavefront::{Step, Wavefront},
    settings::{MAX_BOUNCES, Sampler},
    upload::{SceneBuffers, sampler_constant},
};

/// Capacity of the staging buffer, photons per path of a batch. A batch that exceeds it is traced
/// again in smaller batches.
const STAGED_PER_PATH: u64 = 2;

const _: () = assert!(MAX_BOUNCES <= PHOTON_INDEX_MASK, "a key has room for the photons of a path");

/// Kernels of the photon pass.
#[derive(Debug)]
pub(crate) struct PhotonKernels {
    emit: Kernel,
    bounce: Kernel,
    store: Kernel,
}

/// Buffers of a batch.
pub(crate) struct BatchBuffers {
    wavefront: Wavefront,
    staged: Buffer,
    staged_keys: Buffer,
    counts: Buffer,
    offsets: Buffer,
    /// Photons stored of each named light, `u32`.
    pub light_photons: Buffer,
    pub staging_capacity: u64,
}

/// Result of one batch.
pub(crate) struct BatchResult {
    pub counters: Counters,
    /// Number of photons of each path, for each [`MapKind`].
    counts: Vec<u32>,
}

impl PhotonKernels {
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, sampler: Sampler) -> Self {
        let kernel = |stem| scene.kernel_with(gpu, stem, &[sampler_constant(sampler)]);
        Self {
            emit: kernel("emit_photons"),
            bounce: kernel("bounce_photons"),
            store: Kernel::new(gpu, "store_photons", &[]),
        }
    }

    /// Emits a batch from lights sampled by the table `choices`, and bounces it until no path is
    /// left.
    pub fn run(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        choices: &Buffer,
        buffers: &BatchBuffers,
        batch: &PhotonBatch,
    ) -> Result<BatchResult> {
        let uniform = gpu.uniform("photon batch", batch);
        let own = [
            ("choices", choices),
            ("batch", &uniform),
            ("staged", &buffers.staged),
            ("staged_keys", &buffers.staged_keys),
            ("counts", &buffers.counts),
        ];
        let paths = u64::from(batch.paths);
        let emit = Step { kernel: &self.emit, buffers: &own };
        let bounce = Step { kernel: &self.bounce, buffers: &own };
        let surfaces = (batch.max_surfaces, batch.max_surfaces);
        let counters = buffers.wavefront.run(gpu, scene, (&emit, paths), &[bounce], paths, surfaces)?;
        Ok(BatchResult { counters, counts: gpu.read(&buffers.counts, 0, paths * u64::from(MAP_KINDS))? })
    }

    /// Moves a batch's photons of one kind to their positions in the map, up to the first path that
    /// does not fit as a whole.
    pub fn store(
        &self,
        gpu: &Gpu,
        buffers: &BatchBuffers,
        (kind, map): (MapKind, &mut RawMap),
        result: &BatchResult,
        first_path: u64,
    ) -> Result<()> {
        let counts = result.counts.iter().skip(kind as usize).step_by(MAP_KINDS as usize);
        gpu.write(&buffers.offsets, 0, &map.assign_offsets(counts.copied(), first_path));
        let mut encoder = gpu.encoder();
        for (segment, first_photon, photons) in map.photons.filled(map.stored as u32) {
            let staged = result.counters.staged;
            let uniform = gpu.uniform("store", &Store { staged, first_photon, photons, kind: kind as u32 });
            let bindings = self.store.bind(
                gpu,
                &[
                    ("store", &uniform),
                    ("staged", &buffers.staged),
                    ("staged_keys", &buffers.staged_keys),
                    ("offsets", &buffers.offsets),
                    ("paths", &buffers.wavefront.paths),
                    ("light_photons", &buffers.light_photons),
                    ("photons", segment),
                ],
            );
            self.store.dispatch(&mut encoder, &bindings, u64::from(staged));
        }
        gpu.submit(encoder);
        gpu.wait()
    }
}

impl BatchBuffers {
    /// Buffers for batches of up to `paths` paths, from `named` named lights.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, paths: u64, named: usize) -> Result<Self> {
        let staging_capacity = (paths * STAGED_PER_PATH).max(2 * u64::from(MAX_BOUNCES));
        Ok(Self {
            wavefront: Wavefront::new(gpu, scene, "photon", (paths, 0), 0)?,
            staged: gpu.storage::<Photon>("staged photons", staging_capacity)?,
            staged_keys: gpu.storage::<u32>("keys of staged photons", staging_capacity)?,
            counts: gpu.storage::<u32>("photon counts", paths * u64::from(MAP_KINDS))?,
            offsets: gpu.storage::<u32>("photon places", paths)?,
            light_photons: gpu.storage::<u32>("photons of lights", named as u64)?,
            staging_capacity,
        })
    }

    /// The first staged photons with their keys, in any order.
    pub fn staged(&self, gpu: &Gpu, count: u32) -> Result<Vec<(u32, Photon)>> {
        let photons: Vec<Photon> = gpu.read(&self.staged, 0, count.into())?;
        let keys: Vec<u32> = gpu.read(&self.staged_keys, 0, count.into())?;
        Ok(keys.into_iter().zip(photons).collect())
    }
}
