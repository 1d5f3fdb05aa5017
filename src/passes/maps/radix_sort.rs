//! Stable radix sort of (key, index) pairs, and prefix sums. Kernels: `count_digits`, `sum_spans`,
//! `scan_spans`, `scatter_entries`.

use std::ops::Range;

use crate::{
    error::Result,
    gpu::{Buffer, Commands, Gpu, Kernel},
    layout::{RADIX_CHUNK, RADIX_DIGITS, SCAN_SPAN, SortStep},
};

const CHUNK: u32 = RADIX_CHUNK;
const DIGITS: u32 = RADIX_DIGITS;
const DIGIT_BITS: u32 = DIGITS.ilog2();
const SPAN: u64 = SCAN_SPAN as u64;

/// The compiled kernels of the sort.
#[derive(Debug)]
pub struct RadixSort {
    count: Kernel,
    sum: Kernel,
    scan: Kernel,
    scatter: Kernel,
}

impl RadixSort {
    /// Compiles the kernels.
    #[must_use]
    pub fn new(gpu: &Gpu) -> Self {
        let kernel = |stem| Kernel::new(gpu, stem, &[]);
        Self {
            count: kernel("count_digits"),
            sum: kernel("sum_spans"),
            scan: kernel("scan_spans"),
            scatter: kernel("scatter_entries"),
        }
    }

    /// Sorts the first `count` pairs of `entries[0]` by those bits of their keys; bit 0 is the
    /// lowest. Pairs with equal bits keep their order. Returns which of the two buffers holds the
    /// result; the other one is overwritten.
    ///
    /// # Errors
    /// [`crate::Error::Limit`] if the digit counts exceed a binding.
    pub fn sort(&self, gpu: &Gpu, entries: [&Buffer; 2], count: u32, bits: Range<u32>) -> Result<usize> {
        if count < 2 {
            return Ok(0);
        }
        let chunks = count.div_ceil(CHUNK);
        // An odd number of cache lines between digits spreads them over all sets of a CPU's cache.
        let stride = (chunks.div_ceil(16) | 1) * 16;
        let levels = scan_levels(gpu, u64::from(stride) * u64::from(DIGITS))?;
        let mut encoder = gpu.encoder();
        let mut from = 0;
        for shift in bits.step_by(DIGIT_BITS as usize) {
            let step = gpu.uniform("sort step", &SortStep { count, shift, stride, pad: 0 });
            let buffers = [
                ("entries_in", entries[from]),
                ("entries_out", entries[1 - from]),
                ("counts", &levels[0]),
                ("sort_step", &step),
            ];
            encoder.clear_buffer(&levels[0], 0, None);
            self.count.dispatch(&mut encoder, &self.count.bind(gpu, &buffers), chunks.into());
            self.prefix_sums(gpu, &mut encoder, &levels);
            self.scatter.dispatch(&mut encoder, &self.scatter.bind(gpu, &buffers), chunks.into());
            gpu.submit(std::mem::replace(&mut encoder, gpu.encoder()));
            from = 1 - from;
        }
        Ok(from)
    }

    /// Turns the values of the first of [`scan_levels`] into their exclusive prefix sums.
    pub(crate) fn prefix_sums(&self, gpu: &Gpu, encoder: &mut Commands, levels: &[Buffer]) {
        let buffers = |l: usize| [("values", &levels[l]), ("sums", &levels[l + 1])];
        let spans = |l: usize| levels[l + 1].size() / 4;
        for l in 0..levels.len() - 1 {
            self.sum.dispatch(encoder, &self.sum.bind(gpu, &buffers(l)), spans(l));
        }
        // The prefix sum of the only span of the last level is 0.
        encoder.clear_buffer(&levels[levels.len() - 1], 0, None);
        for l in (0..levels.len() - 1).rev() {
            self.scan.dispatch(encoder, &self.scan.bind(gpu, &buffers(l)), spans(l));
        }
    }
}

/// Buffers for the levels of a prefix sum: `count` values, the sums of their spans, the sums of
/// spans of these, down to a single sum.
pub(crate) fn scan_levels(gpu: &Gpu, mut count: u64) -> Result<Vec<Buffer>> {
    let mut levels = vec![gpu.storage::<u32>("values to sum", count)?];
    while count > 1 {
        count = count.div_ceil(SPAN);
        levels.push(gpu.storage::<u32>("sums of spans", count)?);
    }
    Ok(levels)
}
