//! Weights of pixels of different numbers of samples, so that all have the same total.

use super::{film::Film, film_sums::Weights, layers::LAYERS};

impl Film {
    /// Has some pixels take so many samples more, see `Self::weigh`.
    #[must_use]
    pub fn with_extra_samples(mut self, extra: u32) -> Self {
        let spp = self.samples as u32;
        let divisor = (1..=spp.max(1)).rev().find(|d| spp.is_multiple_of(*d) && extra.is_multiple_of(*d)).unwrap_or(1);
        if extra > 0 {
            self.weights = Weights { plain: (spp + extra) / divisor, uneven: spp / divisor, extra };
        }
        self
    }

    /// Weighs what a pixel has so far as that number of samples that every pixel has. `is_uneven`:
    /// it has more.
    pub(crate) fn weigh(&mut self, (column, row): (u32, u32), is_uneven: bool) {
        let pixel = row as usize * self.window.width as usize + column as usize;
        let Weights { plain, uneven, extra } = self.weights;
        self.mattes.iter_mut().for_each(|matte| matte.weigh(pixel, if is_uneven { uneven } else { plain }));
        if is_uneven {
            self.extra_samples += u64::from(extra);
            let weight = uneven as f32 / plain as f32;
            let all = LAYERS.iter().map(|layer| layer.channels.len()).zip(&mut self.sums);
            let extras = self.extras.iter_mut().map(|layer| (layer.count(), &mut layer.sums));
            for (count, sums) in all.chain(extras) {
                sums[pixel * count..][..count].iter_mut().for_each(|sum| *sum *= weight);
            }
        }
    }
}
