//! Orders photons along a Hilbert curve. Kernels: `bound_photons`, `merge_bounds`, `key_photons`,
//! `sort_photons`.

use super::{photon_store::PhotonStore, radix_sort::RadixSort};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{BOUND_LANES, BoundStep, Cell, KeyStep, MoveStep},
};

/// Bits of each half of a Hilbert key.
pub(crate) const KEY_BITS: u32 = 30;

/// The compiled kernels.
#[derive(Debug)]
pub struct SortPhotons {
    bound: Kernel,
    merge: Kernel,
    key: Kernel,
    fetch: Kernel,
}

impl SortPhotons {
    /// Compiles them.
    #[must_use]
    pub fn new(gpu: &Gpu) -> Self {
        let kernel = |stem| Kernel::new(gpu, stem, &[]);
        Self {
            bound: kernel("bound_photons"),
            merge: kernel("merge_bounds"),
            key: kernel("key_photons"),
            fetch: kernel("sort_photons"),
        }
    }

    /// Pairs (key, index) of the first `count` photons in the order (Hilbert key, index).
    pub(crate) fn order(&self, gpu: &Gpu, radix: &RadixSort, photons: &PhotonStore, count: u32) -> Result<Buffer> {
        let bounds = self.bounds(gpu, photons, count)?;
        let mut entries = [
            gpu.storage::<[u32; 2]>("sort entries", count.into())?,
            gpu.storage::<[u32; 2]>("sort entries", count.into())?,
        ];
        // Sorts by the fine half of the key first. The sort by the coarse half is stable, so that
        // equal keys keep that order.
        for fine in [1, 0] {
            let mut encoder = gpu.encoder();
            // A buffer may not be dropped before the commands that use it are submitted.
            let mut steps = Vec::new();
            for (segment, first, size) in photons.filled(count) {
                let invocations = if fine == 1 { size } else { count };
                let key_step = KeyStep { count: invocations, segment_first: first, segment_count: size, fine };
                let step = gpu.uniform("key step", &key_step);
                let buffers = [("photons", segment), ("boxes", &bounds), ("entries", &entries[0]), ("key_step", &step)];
                self.key.dispatch(&mut encoder, &self.key.bind(gpu, &buffers), invocations.into());
                steps.push(step);
            }
            gpu.submit(encoder);
            if radix.sort(gpu, [&entries[0], &entries[1]], count, 0..KEY_BITS)? == 1 {
                entries.swap(0, 1);
            }
        }
        let [sorted, _] = entries;
        Ok(sorted)
    }

    /// Buffer of boxes, the first of which bounds all photons.
    fn bounds(&self, gpu: &Gpu, photons: &PhotonStore, count: u32) -> Result<Buffer> {
        let segments = photons.filled(count).count() as u32;
        let boxes = gpu.storage::<Cell>("photon bounds", u64::from((segments * BOUND_LANES).max(1)))?;
        let mut encoder = gpu.encoder();
        let mut steps = Vec::new();
        for ((segment, _, size), w) in photons.filled(count).zip(0..) {
            let step = gpu.uniform("bound step", &BoundStep { count: size, first_box: w * BOUND_LANES });
            let buffers = [("photons", segment), ("boxes", &boxes), ("bound_step", &step)];
            self.bound.dispatch(&mut encoder, &self.bound.bind(gpu, &buffers), BOUND_LANES.into());
            steps.push(step);
        }
        self.merge.dispatch(&mut encoder, &self.merge.bind(gpu, &[("boxes", &boxes)]), 1);
        gpu.submit(encoder);
        Ok(boxes)
    }

    /// Moves the photons to the segments of the sorted map, in the order of `entries`.
    pub(crate) fn fetch(
        &self,
        gpu: &Gpu,
        entries: &Buffer,
        photons: &PhotonStore,
        count: u32,
        (positions, fluxes, segment): (&[Buffer], &[Buffer], u32),
    ) {
        let mut encoder = gpu.encoder();
        let mut steps = Vec::new();
        for ((position, flux), first) in positions.iter().zip(fluxes).zip((0..).step_by(segment as usize)) {
            let size = segment.min(count - first);
            for (unsorted, from, part) in photons.filled(count) {
                let move_step =
                    MoveStep { sorted_first: first, sorted_count: size, segment_first: from, segment_count: part };
                let step = gpu.uniform("move step", &move_step);
                let buffers = [
                    ("entries", entries),
                    ("photons", unsorted),
                    ("positions", position),
                    ("fluxes", flux),
                    ("move_step", &step),
                ];
                self.fetch.dispatch(&mut encoder, &self.fetch.bind(gpu, &buffers), size.into());
                steps.push(step);
            }
        }
        gpu.submit(encoder);
    }
}
