//! The device: adapters and limits, buffers, kernels, copies. Knows nothing of photons.

mod adapter;
mod buffer;
mod commands;
mod compiler;
mod fault;
mod kernel;
mod pace;
pub mod shaders;
mod table;
mod timer;

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
        mpsc,
    },
    time::Duration,
};

pub use adapter::{AdapterReport, NO_ADAPTER, adapters};
pub use buffer::{Buffer, MemoryCount};
pub use commands::Commands;
pub use kernel::{Bindings, Kernel};
pub use pace::{MOST_PER_DISPATCH, Pacing};
pub use table::Table;

use crate::{
    error::{Error, Result},
    memory::available,
};
use compiler::Compiler;
use fault::Faults;
use kernel::Parts;
use pace::Pace;
use timer::Timer;

/// An open device.
#[derive(Debug)]
pub struct Gpu {
    #[doc(hidden)]
    pub device: wgpu::Device,
    #[doc(hidden)]
    pub queue: wgpu::Queue,
    #[doc(hidden)]
    pub limits: wgpu::Limits,
    /// Name of the adapter.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Device memory that buffers and tables take, bytes.
    pub memory: Arc<MemoryCount>,
    faults: Faults,
    pace: Pace,
    timer: Option<Timer>,
    parts: Parts,
    compiler: Compiler,
    dispatches: AtomicU64,
    /// The kernels' override `LANES`.
    lanes: u32,
}

/// How long the device may work on what was submitted before it counts as hung. Submissions are
/// kept far shorter than that on GPUs; software works through all of them at the pace of its
/// processor, and cannot hang.
const HUNG_AFTER: Duration = Duration::from_secs(300);

/// Lanes of a subgroup that share the parts of a cell at most, one each: as many as a cell has
/// parts.
const MOST_LANES: u32 = crate::layout::CELL_FAN;

impl Gpu {
    /// Opens the adapter of that name or index, or the best one.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none or it cannot be opened.
    pub fn open(wanted: Option<&str>) -> Result<Self> {
        Self::open_paced(wanted, None)
    }

    /// As [`Self::open`], with dispatches cut that way; `None`: by measured time, but for software
    /// not at all.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_paced(wanted: Option<&str>, pacing: Option<Pacing>) -> Result<Self> {
        let chosen = adapter::choose(wanted)?;
        let usual = if chosen.kind == "software" { Pacing::Whole } else { Pacing::Measured };
        let pacing = pacing.unwrap_or(usual);
        let clock = match pacing {
            Pacing::Measured => chosen.adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            Pacing::Whole | Pacing::Parts(_) => wgpu::Features::empty(),
        };
        let (device, queue) = pollster::block_on(chosen.adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("caustica"),
            required_features: wgpu::Features::SUBGROUP | clock,
            required_limits: chosen.limits.clone(),
            ..Default::default()
        }))
        .map_err(|e| Error::Device(format!("adapter {} cannot be opened: {e}", chosen.name)))?;
        let faults = Faults::of(&device);
        let (timer, parts) = (Timer::new(&device, &queue), Parts::new(&device));
        let lanes = chosen.subgroup.0.min(MOST_LANES);
        let (limits, name, driver) = (chosen.limits, chosen.name, chosen.driver);
        let (memory, dispatches) = (Arc::<MemoryCount>::default(), AtomicU64::new(0));
        // Memory of software is the host's, which gives more than it has and then ends the process.
        if let Some(bytes) = available().filter(|_| chosen.kind == "software") {
            memory.set_limit(bytes);
        }
        Ok(Self {
            device,
            queue,
            limits,
            name,
            driver,
            memory,
            faults,
            pace: Pace::new(pacing),
            timer,
            parts,
            compiler: Compiler::new(),
            dispatches,
            lanes,
        })
    }

    /// Dispatches recorded so far: parts count one by one.
    #[must_use]
    pub fn dispatches(&self) -> u64 {
        self.dispatches.load(Ordering::Relaxed)
    }

    /// The most bytes that one storage binding can hold.
    #[must_use]
    pub fn max_binding(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// The most bytes that one [`Table`] of 16-byte texels can hold.
    #[must_use]
    pub fn max_table(&self) -> u64 {
        16 * table::most_texels(&self.limits)
    }

    /// A zeroed storage buffer of `count` elements of `T` (at least one: a binding cannot be
    /// empty), which can be copied from and to and hold indirect arguments.
    ///
    /// # Errors
    /// [`Error::Limit`] if one binding cannot hold it, [`Error::Memory`] if none is left.
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
                advice: "ask for less or use another `device`".to_string(),
            });
        }
        use wgpu::BufferUsages as U;
        self.buffer(label, bytes, U::STORAGE | U::COPY_SRC | U::COPY_DST | U::INDIRECT)
    }

    /// A storage buffer filled with `data`.
    ///
    /// # Errors
    /// As [`Self::storage`].
    pub fn storage_with<T: bytemuck::Pod>(&self, label: &str, data: &[T]) -> Result<Buffer> {
        let buffer = self.storage::<T>(label, data.len() as u64)?;
        self.write(&buffer, 0, data);
        Ok(buffer)
    }

    /// A uniform buffer that holds `value`. One that finds no memory left shows in the next
    /// [`Self::wait`].
    #[must_use]
    pub fn uniform<T: bytemuck::Pod>(&self, label: &str, value: &T) -> Buffer {
        let bytes = (size_of::<T>() as u64).next_multiple_of(16);
        let buffer = self.create(label, bytes, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        self.write(&buffer, 0, std::slice::from_ref(value));
        buffer
    }

    /// A buffer, or what hinders it.
    fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> Result<Buffer> {
        let inner = self.allot(label, size, || self.create_uncounted(label, size, usage))?;
        Ok(Buffer { inner, memory: Arc::clone(&self.memory) })
    }

    /// Makes something that takes `size` bytes of the device's memory and counts them, or says that
    /// they are not there.
    fn allot<T>(&self, label: &str, size: u64, create: impl FnOnce() -> T) -> Result<T> {
        let used = self.memory.now();
        let missing =
            || Error::Memory { what: label.to_string(), needed: Some(size), adapter: self.name.clone(), used };
        if size > self.memory.limit().saturating_sub(used) {
            return Err(missing());
        }
        let created = create();
        if self.faults.take_missing_memory() {
            return Err(missing());
        }
        self.memory.add(size);
        Ok(created)
    }

    fn create(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> Buffer {
        let inner = self.create_uncounted(label, size, usage);
        self.memory.add(size);
        Buffer { inner, memory: Arc::clone(&self.memory) }
    }

    fn create_uncounted(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let label = Some(label);
        self.device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
    }

    /// Writes `data` from byte `offset` of the buffer on, before the next submission.
    pub fn write<T: bytemuck::Pod>(&self, buffer: &Buffer, offset: u64, data: &[T]) {
        self.queue.write_buffer(buffer, offset, bytemuck::cast_slice(data));
    }

    /// Records commands, to be handed over with [`Self::submit`].
    #[must_use]
    pub fn encoder(&self) -> Commands<'_> {
        Commands::new(self)
    }

    /// Hands the commands to the device without waiting for them.
    pub fn submit(&self, commands: Commands) {
        commands.finish();
    }

    /// Waits until the device has done all that was submitted.
    ///
    /// # Errors
    /// [`Error::Lost`], [`Error::Memory`] or [`Error::Gpu`]: what went wrong since the last wait.
    pub fn wait(&self) -> Result<()> {
        let polled = self.poll();
        if let Some(fault) = self.faults.take() {
            return Err(fault.into_error(&self.name, &self.driver, self.memory.now()));
        }
        polled.map_err(|e| match e {
            wgpu::PollError::Timeout => Error::Lost {
                adapter: format!("{} ({})", self.name, self.driver),
                why: format!("it has not answered for {} minutes", HUNG_AFTER.as_secs() / 60),
            },
            other => Error::Gpu(format!("{} ({}): {other}", self.name, self.driver)),
        })
    }

    /// Waits as [`Self::wait`] does, and leaves faults for that.
    fn poll(&self) -> std::result::Result<(), wgpu::PollError> {
        let timeout = (self.pace.pacing == Pacing::Measured).then_some(HUNG_AFTER);
        let polled = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout });
        if let Some(timer) = &self.timer {
            timer.collect(&self.pace);
        }
        polled.map(drop)
    }

    /// Reads `count` elements from element `first` on, after all that was submitted.
    ///
    /// # Errors
    /// As [`Self::wait`], and [`Error::Memory`] if no room is left for the copy.
    pub fn read<T: bytemuck::Pod>(&self, buffer: &Buffer, first: u64, count: u64) -> Result<Vec<T>> {
        let (offset, bytes) = (first * size_of::<T>() as u64, count * size_of::<T>() as u64);
        if bytes == 0 {
            self.wait()?;
            return Ok(Vec::new());
        }
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = self.buffer("data to read back", bytes, usage)?;
        let mut encoder = self.encoder();
        encoder.copy_buffer_to_buffer(buffer, offset, &staging, 0, bytes);
        self.submit(encoder);
        let (tell, told) = mpsc::channel();
        staging.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // Nobody listens any more where the wait below failed.
            let _ = tell.send(result.is_ok());
        });
        self.wait()?;
        // Another thread's wait may be the one that tells, a moment after this one's is over.
        let is_there = told.recv_timeout(HUNG_AFTER).unwrap_or(false);
        let mapped = is_there.then(|| staging.slice(..).get_mapped_range().ok()).flatten();
        // Without a fault there is one reason left.
        let lost = || Error::Lost {
            adapter: format!("{} ({})", self.name, self.driver),
            why: "it gave nothing back".to_string(),
        };
        mapped.map(|bytes| bytemuck::pod_collect_to_vec(&bytes)).ok_or_else(lost)
    }
}
