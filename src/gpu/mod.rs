//! The device: adapters and limits, buffers, kernels, copies. Knows nothing of photons.

mod adapter;
mod buffer;
mod kernel;
pub mod shaders;

use std::sync::{Arc, Mutex};

pub use adapter::{AdapterReport, NO_ADAPTER, adapters};
pub use buffer::{Buffer, MemoryCount};
pub use kernel::{Bindings, Kernel};

use crate::error::{Error, Result};

/// An open device.
#[derive(Debug)]
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub limits: wgpu::Limits,
    /// Name of the adapter.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    pub memory: Arc<MemoryCount>,
    /// What the driver reported outside of any call.
    fault: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Opens the adapter of that name or index, or the best one.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none or it cannot be opened.
    pub fn open(wanted: Option<&str>) -> Result<Self> {
        let chosen = adapter::choose(wanted)?;
        let (device, queue) = pollster::block_on(chosen.adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("caustica"),
            required_features: wgpu::Features::SUBGROUP,
            required_limits: chosen.limits.clone(),
            ..Default::default()
        }))
        .map_err(|e| Error::Device(format!("adapter {} cannot be opened: {e}", chosen.name)))?;
        let fault = Arc::new(Mutex::new(None));
        let (on_error, on_loss) = (Arc::clone(&fault), Arc::clone(&fault));
        device.on_uncaptured_error(Arc::new(move |e| note_fault(&on_error, &e.to_string())));
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                note_fault(&on_loss, &format!("the device was lost: {message}"));
            }
        });
        let (limits, name, driver) = (chosen.limits, chosen.name, chosen.driver);
        Ok(Self { device, queue, limits, name, driver, memory: Arc::default(), fault })
    }

    /// The most bytes that one storage binding can hold.
    #[must_use]
    pub fn max_binding(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// A zeroed storage buffer of `count` elements of `T` (at least one: a binding cannot be empty), which can be
    /// copied from and to and hold indirect arguments.
    ///
    /// # Errors
    /// [`Error::Limit`] if one binding cannot hold it.
    pub fn storage<T>(&self, label: &str, count: u64) -> Result<Buffer> {
        let bytes = (count.max(1) * size_of::<T>() as u64).next_multiple_of(4);
        if bytes > self.max_binding() {
            return Err(Error::Limit {
                what: label.to_string(),
                needed: bytes,
                unit: "bytes",
                limit: "maxStorageBufferRange",
                adapter: self.name.clone(),
                allowed: self.max_binding(),
                advice: "ask for less or use another --device".to_string(),
            });
        }
        use wgpu::BufferUsages as U;
        Ok(self.buffer(label, bytes, U::STORAGE | U::COPY_SRC | U::COPY_DST | U::INDIRECT))
    }

    /// A storage buffer filled with `data`.
    ///
    /// # Errors
    /// [`Error::Limit`] if one binding cannot hold it.
    pub fn storage_with<T: bytemuck::Pod>(&self, label: &str, data: &[T]) -> Result<Buffer> {
        let buffer = self.storage::<T>(label, data.len() as u64)?;
        self.write(&buffer, 0, data);
        Ok(buffer)
    }

    /// A uniform buffer that holds `value`.
    #[must_use]
    pub fn uniform<T: bytemuck::Pod>(&self, label: &str, value: &T) -> Buffer {
        let bytes = (size_of::<T>() as u64).next_multiple_of(16);
        let buffer = self.buffer(label, bytes, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        self.write(&buffer, 0, std::slice::from_ref(value));
        buffer
    }

    fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> Buffer {
        let inner = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        });
        self.memory.add(size);
        Buffer { inner, memory: Arc::clone(&self.memory) }
    }

    /// Writes `data` from byte `offset` of the buffer on, before the next submission.
    pub fn write<T: bytemuck::Pod>(&self, buffer: &Buffer, offset: u64, data: &[T]) {
        self.queue.write_buffer(buffer, offset, bytemuck::cast_slice(data));
    }

    #[must_use]
    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Hands the commands to the device without waiting for them.
    pub fn submit(&self, encoder: wgpu::CommandEncoder) {
        self.queue.submit([encoder.finish()]);
    }

    /// Waits until the device has done all that was submitted.
    ///
    /// # Errors
    /// [`Error::Gpu`] with what the driver reported.
    pub fn wait(&self) -> Result<()> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        if let Some(message) = self.fault.lock().expect("no holder of this lock panics").take() {
            return Err(Error::Gpu(format!("{} ({}): {message}", self.name, self.driver)));
        }
        polled.map(|_| ()).map_err(|e| Error::Gpu(format!("{} ({}): {e}", self.name, self.driver)))
    }

    /// Reads `count` elements from element `first` on, after all that was submitted.
    ///
    /// # Errors
    /// [`Error::Gpu`] with what the driver reported.
    pub fn read<T: bytemuck::Pod>(&self, buffer: &Buffer, first: u64, count: u64) -> Result<Vec<T>> {
        let (offset, bytes) = (first * size_of::<T>() as u64, count * size_of::<T>() as u64);
        if bytes == 0 {
            self.wait()?;
            return Ok(Vec::new());
        }
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = self.buffer("readback", bytes, usage);
        let mut encoder = self.encoder();
        encoder.copy_buffer_to_buffer(buffer, offset, &staging, 0, bytes);
        self.submit(encoder);
        staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.wait()?;
        let mapped = staging
            .slice(..)
            .get_mapped_range()
            .map_err(|e| Error::Gpu(format!("{} ({}): reading back failed: {e}", self.name, self.driver)))?;
        Ok(bytemuck::pod_collect_to_vec(&mapped))
    }
}

/// Keeps the first fault: later ones are its consequences.
fn note_fault(fault: &Mutex<Option<String>>, message: &str) {
    let mut slot = fault.lock().expect("no holder of this lock panics");
    slot.get_or_insert_with(|| message.split_whitespace().collect::<Vec<_>>().join(" "));
}
