//! Lists of a pass: late rays, pixels of a tile, and keys of rays.
//!
//! Late rays need more than the loop budget of an invocation, and go on in further dispatches: a
//! kernel lists the paths or points with such rays. It then runs again for a slice of the list at a
//! time, as often as its rays take: each is kept where it stopped. What a ray finds does not depend
//! on where it stopped, nor on the order of the list.

use std::mem::offset_of;

use crate::{
    error::Result,
    gpu::{Bindings, Buffer, Gpu, Kernel},
    layout::{Counters, LATE_HEADER, LATE_SLICE, LATE_WORDS},
    upload::SceneBuffers,
};

/// Dispatches of one slice at most. A ray moves on by thousands of nodes in each.
const MOST_DISPATCHES: u32 = 1 << 16;
/// Words that are kept for all entries of a slice.
const KEPT_WORDS: u64 = (LATE_SLICE * LATE_WORDS) as u64;
const WORD: u64 = size_of::<u32>() as u64;

/// Paths or points with late rays, pixels, keys, and what is kept of the rays of a slice.
#[derive(Debug)]
pub struct Lists {
    buffer: Buffer,
    /// Number of paths or points that there is room for.
    room: u64,
    pixels: u64,
    keys: u64,
}

impl Lists {
    /// Room for as many paths or points, if rays of the scene can be late, and for as many pixels
    /// and keys.
    ///
    /// # Errors
    /// Limits of the adapter.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, room: u64, (pixels, keys): (u64, u64)) -> Result<Self> {
        let (room, kept) = if scene.has_late_rays(gpu) { (room, KEPT_WORDS) } else { (0, 0) };
        let buffer = gpu.storage::<u32>("lists", u64::from(LATE_HEADER) + room + pixels + 2 * keys + kept)?;
        Ok(Self { buffer, room, pixels, keys })
    }

    /// The binding of kernels that use them.
    #[must_use]
    pub fn binding(&self) -> (&str, &Buffer) {
        ("lists", &self.buffer)
    }

    /// Word at which the pixels begin.
    #[must_use]
    pub fn pixels_at(&self) -> u32 {
        LATE_HEADER + self.room as u32
    }

    /// Lists pixels.
    pub fn write_pixels(&self, gpu: &Gpu, pixels: &[u32]) {
        gpu.write(&self.buffer, u64::from(self.pixels_at()) * WORD, pixels);
    }

    /// Word at which the keys begin.
    #[must_use]
    pub fn keys_at(&self) -> u32 {
        self.pixels_at() + self.pixels as u32
    }

    /// Lists keys.
    pub fn write_keys(&self, gpu: &Gpu, keys: &[[u32; 2]]) {
        gpu.write(&self.buffer, u64::from(self.keys_at()) * WORD, keys);
    }

    /// Traces the rays of the first `listed` entries to their ends: of each slice of the list,
    /// those of one kernel after the other, as [`Self::kernel`] gives them. Leaves
    /// [`Counters::unfinished`] 0, and returns how many rays are given up.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn finish(&self, gpu: &Gpu, counters: &Buffer, listed: u32, kernels: &[(Kernel, Bindings)]) -> Result<u32> {
        let entries = u64::from(listed).min(self.room) as u32;
        let mut given_up = listed - entries;
        let unfinished = offset_of!(Counters, unfinished) as u64;
        for first in (0..entries).step_by(LATE_SLICE as usize) {
            let count = LATE_SLICE.min(entries - first);
            gpu.write(&self.buffer, 0, &[first, count]);
            for (kernel, bindings) in kernels {
                let mut pending = count;
                for dispatch in 0..MOST_DISPATCHES {
                    let mut encoder = gpu.encoder();
                    if dispatch == 0 {
                        encoder.clear_buffer(&self.buffer, (u64::from(self.keys_at()) + 2 * self.keys) * WORD, None);
                    }
                    encoder.clear_buffer(counters, unfinished, Some(WORD));
                    kernel.dispatch(&mut encoder, bindings, count.into());
                    gpu.submit(encoder);
                    pending = gpu.read::<u32>(counters, unfinished / WORD, 1)?[0];
                    if pending == 0 {
                        break;
                    }
                }
                given_up += pending;
            }
        }
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(counters, unfinished, Some(WORD));
        gpu.submit(encoder);
        Ok(given_up)
    }

    /// The variant of a kernel that goes on with late rays, with its buffers.
    #[must_use]
    pub fn kernel(gpu: &Gpu, kernel: &Kernel, buffers: &[(&str, &Buffer)]) -> (Kernel, Bindings) {
        let variant = kernel.with_constant(gpu, "GOES_ON", 1.0);
        let bindings = variant.bind(gpu, buffers);
        (variant, bindings)
    }
}
