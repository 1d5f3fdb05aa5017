//! Commands under way to the device: dispatches that are cut into parts, and submissions that end
//! in time.

use std::{
    mem,
    ops::{Deref, DerefMut},
};

use super::{
    Gpu,
    pace::{LEAST_TIMED, Part},
    timer::{Timed, Timings},
};

/// Commands that are recorded, and handed over by [`Gpu::submit`] or, where they would keep the
/// device for too long, before. A buffer must not be written by the host between the recording of
/// two commands that use it.
#[derive(Debug)]
pub struct Commands<'g> {
    pub(super) gpu: &'g Gpu,
    encoder: wgpu::CommandEncoder,
    /// That the submission is likely to take so far.
    seconds: f64,
    timings: Timings,
}

impl<'g> Commands<'g> {
    pub(super) fn new(gpu: &'g Gpu) -> Self {
        Self { gpu, encoder: new_encoder(gpu), seconds: 0.0, timings: Timings::default() }
    }

    /// Hands over what was recorded; the recording goes on.
    pub(super) fn flush(&mut self) {
        let encoder = mem::replace(&mut self.encoder, new_encoder(self.gpu));
        let timings = mem::take(&mut self.timings);
        self.seconds = 0.0;
        match &self.gpu.timer {
            Some(timer) => timer.submit(self.gpu, encoder, timings),
            None => drop(self.gpu.queue.submit([encoder.finish()])),
        }
    }

    /// Records `invocations` invocations of a kernel, part by part; `record` puts one part, of
    /// which it is told the first invocation and the number of them, into a pass.
    pub(super) fn dispatch(
        &mut self,
        stem: &'static str,
        invocations: u64,
        record: impl Fn(&mut wgpu::ComputePass<'_>, u64, u64),
    ) {
        let mut first = 0;
        while first < invocations {
            let part = self.gpu.pace.part(stem, invocations - first);
            if !self.gpu.pace.fits(self.seconds, &part) || self.timings.is_full() {
                self.flush();
            }
            let is_last = first + part.invocations == invocations;
            self.record(stem, &part, |pass| record(pass, first, part.invocations));
            first += part.invocations;
            if !is_last && part.seconds.is_none() {
                // The first part tells how large the others may be. A fault shows in the next wait.
                self.flush();
                let _ = self.gpu.poll();
            }
        }
    }

    fn record(&mut self, stem: &'static str, part: &Part, record: impl FnOnce(&mut wgpu::ComputePass<'_>)) {
        self.gpu.dispatches.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        self.seconds += part.seconds.unwrap_or(f64::INFINITY);
        let timer = self.gpu.timer.as_ref().filter(|_| part.invocations >= LEAST_TIMED);
        let timed = timer.map(|timer| timer.time(&mut self.timings, Timed { stem, invocations: part.invocations }));
        let mut pass = self
            .encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(stem), timestamp_writes: timed });
        record(&mut pass);
    }

    pub(super) fn finish(mut self) {
        self.flush();
    }
}

fn new_encoder(gpu: &Gpu) -> wgpu::CommandEncoder {
    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

impl Deref for Commands<'_> {
    type Target = wgpu::CommandEncoder;
    fn deref(&self) -> &wgpu::CommandEncoder {
        &self.encoder
    }
}

impl DerefMut for Commands<'_> {
    fn deref_mut(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.encoder
    }
}
