//! Order of the queries of a batch: the points that wait for the map are marked, keyed along its
//! Hilbert curve and sorted. Kernels: `mark_points`, `key_points`.

use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{self, GatherInfo},
    passes::maps::{
        photon_map::PhotonMap,
        radix_sort::{RadixSort, scan_levels},
    },
};

/// Bits of a point's key: the upper word of its Hilbert key.
const POINT_KEY_BITS: u32 = 3 * layout::KEY_BITS;
/// Maximum number of points, and number of key bits to sort by, from the highest. Few points make
/// few blocks of packets to distribute, and their pixel order already keeps near points together.
/// More points are sorted by all bits.
const SORT_BITS_BY_COUNT: [(u32, u32); 2] = [(4096, 8), (16_384, 16)];

/// The compiled kernels.
#[derive(Debug)]
pub(super) struct QueryOrder {
    mark: Kernel,
    key: Kernel,
    radix: RadixSort,
}

impl QueryOrder {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let kernel = |stem| Kernel::new(gpu, stem, &[]);
        Self { mark: kernel("mark_points"), key: kernel("key_points"), radix: RadixSort::new(gpu) }
    }

    /// Sorts the points of a batch that wait for the map. `entries`: two buffers for the sort.
    /// Returns the buffer that holds the order, and the number of points.
    pub(super) fn sort<'b>(
        &self,
        gpu: &Gpu,
        map: &PhotonMap,
        info: &GatherInfo,
        points: &Buffer,
        entries: &'b [Buffer; 2],
    ) -> Result<(&'b Buffer, u32)> {
        let uniform = gpu.uniform("gather info", info);
        let marks = scan_levels(gpu, u64::from(info.count) + 1)?;
        let mut buffers = map.bindings().to_vec();
        buffers.extend([
            ("gather_info", &uniform),
            ("points", points),
            ("values", &marks[0]),
            ("offsets", &marks[0]),
            ("keyed", &entries[0]),
        ]);
        let mut encoder = gpu.encoder();
        self.mark.dispatch(&mut encoder, &self.mark.bind(gpu, &buffers), u64::from(info.count) + 1);
        self.radix.prefix_sums(gpu, &mut encoder, &marks);
        let key = self.key.clone().with_tables(&map.tables());
        key.dispatch(&mut encoder, &key.bind(gpu, &buffers), info.count.into());
        gpu.submit(encoder);
        let waiting = gpu.read::<u32>(&marks[0], info.count.into(), 1)?[0];
        let bits =
            SORT_BITS_BY_COUNT.iter().find(|(most, _)| waiting <= *most).map_or(POINT_KEY_BITS, |(_, bits)| *bits);
        let sorted = self.radix.sort(gpu, entries.each_ref(), waiting, POINT_KEY_BITS - bits..POINT_KEY_BITS)?;
        Ok((&entries[sorted], waiting))
    }
}
