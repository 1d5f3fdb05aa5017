//! Unsorted photons on the device, and the maximum size of a map there.

use crate::{
    error::{Error, Result},
    gpu::{Buffer, Gpu},
    layout::{Photon, PhotonPosition},
};

/// Maximum number of segments of a sorted map; `shaders/bindings/photon_map.wesl` binds that many.
pub(super) const MAX_SEGMENTS: usize = 2;

/// Unsorted photons in segments that one binding can hold.
#[derive(Debug)]
pub struct PhotonStore {
    segments: Vec<Buffer>,
    segment_photons: u32,
}

impl PhotonStore {
    /// Room for `capacity` photons, zeroed.
    ///
    /// # Errors
    /// [`Error::Limit`] if the device refuses a segment.
    pub fn new(gpu: &Gpu, capacity: u32) -> Result<Self> {
        Self::segmented(gpu, capacity, segment_elements::<Photon>(gpu))
    }

    /// Variant of [`Self::new`] with segments of `segment_photons`, a power of two ≥ 64.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn segmented(gpu: &Gpu, capacity: u32, segment_photons: u32) -> Result<Self> {
        let segments = (0..capacity.div_ceil(segment_photons).max(1))
            .map(|w| {
                gpu.storage::<Photon>(
                    "unsorted photons",
                    u64::from(segment_photons.min(capacity - w * segment_photons)),
                )
            })
            .collect::<Result<_>>()?;
        Ok(Self { segments, segment_photons })
    }

    /// A store with a copy of `photons`.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with(gpu: &Gpu, photons: &[Photon]) -> Result<Self> {
        let count = u32::try_from(photons.len()).map_err(|_| too_many(gpu, photons.len() as u64))?;
        let store = Self::new(gpu, count)?;
        store.write(gpu, photons);
        Ok(store)
    }

    /// Writes `photons` from index 0 on.
    pub fn write(&self, gpu: &Gpu, photons: &[Photon]) {
        for (segment, part) in self.segments.iter().zip(photons.chunks(self.segment_photons as usize)) {
            gpu.write(segment, 0, part);
            // One submission per segment, because the staging memory of a write is freed with its
            // submission.
            gpu.submit(gpu.encoder());
        }
    }

    /// The buffers, `array<Photon>` each; photon `i` lies in segment `i / segment_photons`.
    #[must_use]
    pub fn segments(&self) -> &[Buffer] {
        &self.segments
    }

    /// Photons per segment, a power of two; the last segment may be shorter.
    #[must_use]
    pub fn segment_photons(&self) -> u32 {
        self.segment_photons
    }

    /// Segments of the first `count` photons: buffer, index of its first photon, number of its
    /// photons.
    pub(crate) fn filled(&self, count: u32) -> impl Iterator<Item = (&Buffer, u32, u32)> {
        self.segments.iter().zip(0..).filter_map(move |(buffer, w)| {
            let first = w * self.segment_photons;
            (first < count).then(|| (buffer, first, self.segment_photons.min(count - first)))
        })
    }
}

/// Elements of a segment: the largest power of two that one binding holds.
pub(super) fn segment_elements<T>(gpu: &Gpu) -> u32 {
    elements_within::<T>(gpu.max_binding())
}

/// Variant of [`segment_elements`] for bindings of that many bytes. Photons are counted in 31 bits,
/// so that a segment has at most 2^29.
fn elements_within<T>(binding: u64) -> u32 {
    let most = (binding / size_of::<T>() as u64).clamp(64, 1 << 29);
    1 << most.ilog2()
}

/// Maximum number of photons of a map, where bindings have that many bytes.
fn most_photons(binding: u64) -> u64 {
    MAX_SEGMENTS as u64 * u64::from(elements_within::<PhotonPosition>(binding))
}

/// Fails if a map of so many photons cannot be built. Called before any photon is traced.
pub(crate) fn check_capacity(gpu: &Gpu, photons: u32) -> Result<()> {
    if u64::from(photons) > most_photons(gpu.max_binding()) { Err(too_many(gpu, photons.into())) } else { Ok(()) }
}

pub(super) fn too_many(gpu: &Gpu, count: u64) -> Error {
    Error::Limit {
        what: "a photon map".to_string(),
        needed: count,
        unit: "photons",
        limit: "maxStorageBufferRange",
        adapter: gpu.name.clone(),
        allowed: most_photons(gpu.max_binding()),
        advice: "ask for fewer `photons.global` or use another `device`".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::CELL_PHOTONS;

    #[test]
    fn a_hundred_million_photons_fit_the_bindings_of_a_gpu() {
        for (binding, photons) in [
            (64, 128),
            (128 << 20, 1 << 24),
            ((1 << 31) - 4, 1 << 27),
            ((1 << 32) - 4, 1 << 28),
            (1 << 34, 1 << 30),
            (1 << 60, 1 << 30),
        ] {
            assert_eq!(most_photons(binding), photons, "bindings of {binding} bytes");
            // All other data per photon then fits as well: key and index in two buffers of the
            // sort, and its part of the digit counts, of the cells and of the data that a search
            // reads.
            assert!(photons * 8 <= binding.max(1024), "sort entries in {binding} bytes");
            assert!(photons / u64::from(CELL_PHOTONS) * 37 <= binding.max(1024), "cells in {binding} bytes");
            // Photons that do not fit get positions from 2^31 on.
            assert!(photons < 1 << 31);
        }
        assert!(most_photons((1 << 31) - 4) > 100_000_000 && most_photons(128 << 20) < 100_000_000);
    }
}
