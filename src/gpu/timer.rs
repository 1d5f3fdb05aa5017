//! The device's own clock: the duration of each chunk of a dispatch, known once the device has
//! finished it.

use std::{
    mem,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use super::pace::Pace;

/// Maximum number of chunks of a submission that are timed.
const ROOM: usize = 128;
/// Size of a time, bytes.
const TIME: u64 = size_of::<u64>() as u64;

/// A chunk that is timed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timed {
    pub stem: &'static str,
    pub invocations: u64,
}

/// The timed chunks of a submission, in order.
#[derive(Debug, Default)]
pub(super) struct Timings(Vec<Timed>);

impl Timings {
    pub fn is_full(&self) -> bool {
        self.0.len() >= ROOM
    }
}

/// Times when chunks of submissions began and ended.
#[derive(Debug)]
pub(super) struct Timer {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Seconds of a tick.
    tick: f64,
    /// Submissions whose times were not collected yet.
    pending: Mutex<Vec<Pending>>,
    /// Buffers of those that were, for further ones.
    spare: Mutex<Vec<wgpu::Buffer>>,
}

#[derive(Debug)]
struct Pending {
    times: wgpu::Buffer,
    is_mapped: Arc<AtomicBool>,
    timings: Timings,
}

impl Timer {
    /// `None` where the device has no clock.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Self {
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * ROOM as u32,
            }),
            resolved: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times"),
                size: 2 * ROOM as u64 * TIME,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            tick: f64::from(queue.get_timestamp_period()) * 1e-9,
            pending: Mutex::default(),
            spare: Mutex::default(),
        })
    }

    /// The queries that a pass writes when it begins and ends.
    pub fn time<'t>(&'t self, timings: &mut Timings, chunk: Timed) -> wgpu::ComputePassTimestampWrites<'t> {
        let query = 2 * timings.0.len() as u32;
        timings.0.push(chunk);
        wgpu::ComputePassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(query),
            end_of_pass_write_index: Some(query + 1),
        }
    }

    /// Submits the commands and has the times of their chunks read back.
    pub fn submit(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mut encoder: wgpu::CommandEncoder,
        timings: Timings,
    ) {
        let bytes = 2 * timings.0.len() as u64 * TIME;
        if bytes == 0 {
            queue.submit([encoder.finish()]);
            return;
        }
        let spare = locked(&self.spare).pop();
        let times = spare.unwrap_or_else(|| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("times read back"),
                size: 2 * ROOM as u64 * TIME,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        encoder.resolve_query_set(&self.set, 0..2 * timings.0.len() as u32, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &times, 0, bytes);
        queue.submit([encoder.finish()]);
        let is_mapped = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&is_mapped);
        times
            .slice(..bytes)
            .map_async(wgpu::MapMode::Read, move |result| flag.store(result.is_ok(), Ordering::Release));
        locked(&self.pending).push(Pending { times, is_mapped, timings });
    }

    /// Tells the pace the times read back so far. To be called when the device has finished all
    /// submitted work.
    pub fn collect(&self, pace: &Pace) {
        for Pending { times, is_mapped, timings } in mem::take(&mut *locked(&self.pending)) {
            let bytes = 2 * timings.0.len() as u64 * TIME;
            // Times of a lost device never arrive.
            let Some(mapped) =
                is_mapped.load(Ordering::Acquire).then(|| times.slice(..bytes).get_mapped_range().ok()).flatten()
            else {
                continue;
            };
            let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&mapped);
            drop(mapped);
            times.unmap();
            locked(&self.spare).push(times);
            for (Timed { stem, invocations }, span) in timings.0.into_iter().zip(ticks.chunks_exact(2)) {
                pace.measured(stem, invocations, span[1].saturating_sub(span[0]) as f64 * self.tick);
            }
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use crate::gpu::{
        Gpu, Kernel, Pacing,
        pace::{MIN_CHUNK, MIN_TIMED},
    };

    #[test]
    fn the_clock_of_the_device_is_read() {
        let gpu = Gpu::open_paced(None, Some(Pacing::Measured)).expect("tests need an adapter");
        assert!(gpu.submissions.timer.is_some(), "{} has no clock", gpu.name);
        let kernel = Kernel::new(&gpu, "sum_spans", &[]);
        let span = u64::from(crate::layout::SCAN_SPAN);
        let values = gpu.storage::<u32>("values", MIN_CHUNK * span).expect("fits");
        let sums = gpu.storage::<u32>("sums", MIN_CHUNK).expect("fits");
        let bindings = kernel.bind(&gpu, &[("values", &values), ("sums", &sums)]);
        let cost = |invocations| {
            let mut commands = gpu.encoder();
            kernel.dispatch(&mut commands, &bindings, invocations);
            gpu.submit(commands);
            gpu.wait().expect("it runs");
            gpu.submissions.pace.cost("sum_spans")
        };
        assert_eq!(cost(MIN_TIMED - 64), None, "control: too few to tell");
        let seconds = cost(MIN_CHUNK).expect("it was timed") * MIN_CHUNK as f64;
        assert!((1e-7..600.0).contains(&seconds), "{seconds} s");
    }
}
