//! Fewer queries at further samples of pixels in which maps give little of the light. Kernel:
//! `thin_queries`.

use super::{cell_table::cell_hash, share_estimates::SharedPoints};
use crate::{
    error::Result,
    gpu::{Gpu, Kernel},
};

/// The kernel.
#[derive(Clone, Debug)]
pub struct QueryThinning(Kernel);

impl QueryThinning {
    /// Compiles the kernel.
    #[must_use]
    pub fn new(gpu: &Gpu) -> Self {
        Self(Kernel::new(gpu, "thin_queries", &[]))
    }

    /// Has one of so many samples of each of the tile's pixels, powers of two, get the light of
    /// `maps` maps, which `gather` adds, and it counts for all of them. Which one is drawn by the
    /// keys of the pixels, so that the mean is right.
    ///
    /// # Errors
    /// Those of `gather`.
    pub fn run(
        &self,
        gpu: &Gpu,
        tile: &SharedPoints,
        (one_in, keys): (&[u32], &[[u32; 4]]),
        maps: u32,
        gather: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        if one_in.iter().all(|&samples| samples == 1) {
            return gather();
        }
        let drawn = |[x, y, sample, seed]: [u32; 4]| cell_hash([x, y, sample].map(|c| c as i32), seed);
        let turn = |(&samples, &key): (&u32, &[u32; 4])| [samples, drawn(key) % samples];
        let turns: Vec<[u32; 2]> = one_in.iter().zip(keys).map(turn).collect();
        let turns = gpu.storage_with("turns of samples", &turns)?;
        let slots = tile.pixels * tile.samples * tile.branches;
        let thin = |last_map: u32| {
            let span = gpu.uniform("slots", &[slots, tile.branches, tile.samples, last_map]);
            let buffers = [("span", &span), ("turns", &turns), ("points", tile.points), ("radiance", tile.radiance)];
            let mut encoder = gpu.encoder();
            self.0.dispatch(&mut encoder, &self.0.bind(gpu, &buffers), slots.into());
            gpu.submit(encoder);
        };
        thin(maps);
        gather()?;
        thin(0);
        Ok(())
    }
}
