//! Recording and submission: dispatches are cut into chunks, and a submission is closed before it
//! takes too long.

use std::{
    mem,
    ops::{Deref, DerefMut},
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};

use super::{
    chunks::Chunks,
    pace::{Chunk, Pace, Pacing},
    timer::{Timed, Timer, Timings},
};

/// Time without an answer after which the device counts as hung. Submissions are kept far shorter
/// than that on GPUs. Software works through all of them at the speed of its processor and cannot
/// hang.
pub(super) const HUNG_AFTER: Duration = Duration::from_secs(300);

/// The queue of a device, with what is known of the time that its work takes.
#[derive(Debug)]
pub(super) struct Submissions {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pub pace: Pace,
    pub timer: Option<Timer>,
    pub chunks: Chunks,
    dispatches: AtomicU64,
}

impl Submissions {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, pacing: Pacing) -> Self {
        Self {
            device: device.clone(),
            queue: queue.clone(),
            pace: Pace::new(pacing),
            timer: Timer::new(device, queue),
            chunks: Chunks::new(device),
            dispatches: AtomicU64::new(0),
        }
    }

    /// Number of dispatches recorded so far.
    pub fn dispatches(&self) -> u64 {
        self.dispatches.load(Ordering::Relaxed)
    }

    /// Waits for all submitted work, at most [`HUNG_AFTER`] where it is cut; then reports to
    /// the pace what the device's clock has measured.
    pub fn poll(&self) -> Result<(), wgpu::PollError> {
        let timeout = (self.pace.pacing == Pacing::Measured).then_some(HUNG_AFTER);
        let polled = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout });
        if let Some(timer) = &self.timer {
            timer.collect(&self.pace);
        }
        polled.map(drop)
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }
}

/// Recorded commands. [`super::Gpu::submit`] submits them; some are submitted earlier where
/// together they would keep the device for too long. The host must not write to a buffer between
/// the recording of two commands that use it.
#[derive(Debug)]
pub struct Commands<'g> {
    pub(super) submissions: &'g Submissions,
    encoder: wgpu::CommandEncoder,
    /// Predicted duration of the submission so far.
    seconds: f64,
    timings: Timings,
}

impl<'g> Commands<'g> {
    pub(super) fn new(submissions: &'g Submissions) -> Self {
        Self { submissions, encoder: submissions.encoder(), seconds: 0.0, timings: Timings::default() }
    }

    /// Submits what was recorded; recording goes on.
    pub(super) fn flush(&mut self) {
        let Submissions { device, queue, timer, .. } = self.submissions;
        let encoder = mem::replace(&mut self.encoder, self.submissions.encoder());
        let timings = mem::take(&mut self.timings);
        self.seconds = 0.0;
        match timer {
            Some(timer) => timer.submit(device, queue, encoder, timings),
            None => drop(queue.submit([encoder.finish()])),
        }
    }

    /// Records `invocations` invocations of a kernel, chunk by chunk. `record` puts one chunk into
    /// a pass, given its first invocation and their number.
    pub(super) fn dispatch(
        &mut self,
        stem: &'static str,
        invocations: u64,
        record: impl Fn(&mut wgpu::ComputePass<'_>, u64, u64),
    ) {
        let mut first = 0;
        while first < invocations {
            let chunk = self.submissions.pace.chunk(stem, invocations - first);
            if !self.submissions.pace.fits(self.seconds, &chunk) || self.timings.is_full() {
                self.flush();
            }
            let is_last = first + chunk.invocations == invocations;
            self.record(stem, &chunk, |pass| record(pass, first, chunk.invocations));
            first += chunk.invocations;
            if !is_last && chunk.seconds.is_none() {
                // The first chunk measures how large the others may be. A fault shows in the next
                // wait.
                self.flush();
                let _ = self.submissions.poll();
            }
        }
    }

    fn record(&mut self, stem: &'static str, chunk: &Chunk, record: impl FnOnce(&mut wgpu::ComputePass<'_>)) {
        self.submissions.dispatches.fetch_add(1, Ordering::Relaxed);
        self.seconds += chunk.seconds.unwrap_or(f64::INFINITY);
        let timed = self
            .submissions
            .timer
            .as_ref()
            .map(|timer| timer.time(&mut self.timings, Timed { stem, invocations: chunk.invocations }));
        let mut pass = self
            .encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(stem), timestamp_writes: timed });
        record(&mut pass);
    }

    pub(super) fn finish(mut self) {
        self.flush();
    }
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
