//! Weights of pixels of different numbers of samples, so that all have the same total.

use super::{film::Film, layers::LAYERS};

impl Film {
    /// Has the samples of some pixels double up to so many times, see `Self::weigh`.
    #[must_use]
    pub fn with_doublings(self, doublings: u32) -> Self {
        Self { doublings, ..self }
    }

    /// Weighs what a pixel has so far, whose samples were doubled so many times, as the number of
    /// samples that every pixel has.
    pub(crate) fn weigh(&mut self, (column, row): (u32, u32), doubled: u32) {
        let pixel = row as usize * self.window.width as usize + column as usize;
        // Mattes count samples: those of a pixel that has fewest count most.
        self.mattes.iter_mut().for_each(|matte| matte.weigh(pixel, 1 << (self.doublings - doubled)));
        if doubled > 0 {
            self.extra_samples += (self.samples << doubled) - self.samples;
            let weight = 1.0 / (1_u32 << doubled) as f32;
            let all = LAYERS.iter().map(|layer| layer.channels.len()).zip(&mut self.sums);
            let extras = self.extras.iter_mut().map(|layer| (layer.count(), &mut layer.sums));
            for (count, sums) in all.chain(extras) {
                sums[pixel * count..][..count].iter_mut().for_each(|sum| *sum *= weight);
            }
        }
    }
}
