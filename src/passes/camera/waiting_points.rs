//! Points that still wait for light, of those in a buffer: most have it from elsewhere. Kernels:
//! `list_waiting`, `collect_points`.

use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::VisiblePoint,
};

/// The kernels, and room for as many points.
#[derive(Debug)]
pub struct WaitingPoints {
    list: Kernel,
    collect: Kernel,
    /// Number of points listed, then their indices.
    waiting: Buffer,
    /// Collected points, [`VisiblePoint`].
    pub collected: Buffer,
}

impl WaitingPoints {
    /// Room for `room` points listed at once, and for as many collected ones.
    ///
    /// # Errors
    /// Limits of the adapter.
    pub fn new(gpu: &Gpu, room: u64) -> Result<Self> {
        let kernel = |stem| Kernel::new(gpu, stem, &[]);
        Ok(Self {
            list: kernel("list_waiting"),
            collect: kernel("collect_points"),
            waiting: gpu.storage::<u32>("points that wait", room + 1)?,
            collected: gpu.storage::<VisiblePoint>("collected points", room)?,
        })
    }

    /// Indices of those of the first `count` points that wait for light, in order.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn list(&self, gpu: &Gpu, points: &Buffer, count: u32) -> Result<Vec<u32>> {
        let span = gpu.uniform("points to list", &[count, 0, 0, 0]);
        let buffers = [("span", &span), ("points", points), ("waiting", &self.waiting)];
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&self.waiting, 0, Some(4));
        self.list.dispatch(&mut encoder, &self.list.bind(gpu, &buffers), count.into());
        gpu.submit(encoder);
        let listed = gpu.read::<u32>(&self.waiting, 0, 1)?[0];
        let mut indices = if listed > 0 { gpu.read(&self.waiting, 1, listed.into())? } else { Vec::new() };
        // The device lists them in the order in which its invocations happen to run.
        indices.sort_unstable();
        Ok(indices)
    }

    /// Copies the points of those indices to [`Self::collected`], from `first` on.
    pub fn collect(&self, gpu: &Gpu, points: &Buffer, indices: &[u32], first: u32) {
        let count = indices.len() as u32;
        if count == 0 {
            return;
        }
        gpu.write(&self.waiting, 4, indices);
        let span = gpu.uniform("points to collect", &[count, first, 0, 0]);
        let buffers = [("span", &span), ("points", points), ("indices", &self.waiting), ("collected", &self.collected)];
        let mut encoder = gpu.encoder();
        self.collect.dispatch(&mut encoder, &self.collect.bind(gpu, &buffers), count.into());
        gpu.submit(encoder);
    }
}
