//! Unsorted photons of the photon pass: a map that fills up, and the number of paths that it is
//! normalised by.

use crate::{
    error::Result,
    gpu::Gpu,
    layout::Photon,
    passes::maps::photon_store::{PhotonStore, check_capacity},
};

/// Minimum growth of a map over a number of paths, as a fraction of its capacity. A map that gains
/// less is idle.
const MIN_GROWTH: f64 = 1e-4;

/// Photons in the order of their paths.
#[derive(Debug)]
pub struct RawMap {
    pub photons: PhotonStore,
    pub capacity: u64,
    /// Photons in it.
    pub stored: u64,
    /// Number of emitted paths: the divisor of their flux.
    pub emitted: u64,
    /// The map takes photons.
    pub(crate) open: bool,
    /// Photons in it at the last check of its growth.
    stored_before: u64,
}

impl RawMap {
    /// An empty map; with capacity 0 if it is not `wanted`.
    pub(crate) fn new(gpu: &Gpu, capacity: u32, wanted: bool) -> Result<Self> {
        let capacity = if wanted { capacity } else { 0 };
        check_capacity(gpu, capacity)?;
        Ok(Self {
            photons: PhotonStore::new(gpu, capacity)?,
            capacity: u64::from(capacity),
            stored: 0,
            emitted: 0,
            open: wanted,
            stored_before: 0,
        })
    }

    /// Assigns each path of a batch the index of its first photon in the map. The first path
    /// that does not fit closes the map, which is then normalised by the paths before it.
    pub(crate) fn assign_offsets(&mut self, counts: impl Iterator<Item = u32>, first_path: u64) -> Vec<u32> {
        // An index beyond the end of any map. So are those of the path's further photons.
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
                let offset = self.stored as u32;
                self.stored += u64::from(count);
                self.emitted = path + 1;
                offset
            })
            .collect()
    }

    /// The photons, read back in the order of their paths.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<Photon>> {
        let segments = self.photons.filled(self.stored as u32);
        segments
            .map(|(segment, _, count)| gpu.read(segment, 0, u64::from(count)))
            .collect::<Result<Vec<_>>>()
            .map(|p| p.concat())
    }

    /// Number of further paths that are likely to fill the map.
    pub(crate) fn paths_wanted(&self, first_path: u64) -> u64 {
        if !self.open {
            return 0;
        }
        if self.stored == 0 {
            return if first_path == 0 { self.capacity.max(1024) } else { u64::MAX };
        }
        let per_photon = first_path as f64 / self.stored as f64;
        ((self.capacity - self.stored) as f64 * per_photon * 1.02) as u64 + 1024
    }

    /// Expected number of photons when the pass ends.
    pub(crate) fn expected(&self) -> u64 {
        if self.open { self.capacity } else { self.stored }
    }

    /// Closes the map if it hardly grew since the last call, and then returns a warning.
    pub(crate) fn close_if_idle(&mut self, name: &str, paths: u64) -> Option<String> {
        let gained = self.stored - self.stored_before;
        self.stored_before = self.stored;
        if !self.open || gained as f64 >= MIN_GROWTH * self.capacity as f64 {
            return None;
        }
        self.open = false;
        let photons = if gained == 1 { "photon" } else { "photons" };
        Some(format!(
            "the {name} map hardly grows: {gained} {photons} from the last {paths} paths; it stays at {} of {} photons",
            self.stored, self.capacity
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_counted_beyond_32_bits() {
        let gpu = Gpu::open(None).expect("tests need an adapter");
        let mut map = RawMap::new(&gpu, 10, true).expect("fits");
        let first = (1_u64 << 32) - 2;
        assert_eq!(map.assign_offsets([1, 2, 3].into_iter(), first), [0, 1, 3]);
        assert_eq!((map.stored, map.emitted), (6, first + 3));
        // There is room for 4 more photons, but not for the second path as a whole.
        let offsets = map.assign_offsets([3, 2, 1].into_iter(), first + 3);
        assert_eq!((offsets[0], map.stored, map.emitted, map.open), (6, 9, first + 4, false));
        assert!(offsets[1..].iter().all(|&offset| offset >= 1 << 31));
    }
}
