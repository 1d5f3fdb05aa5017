//! An open device: memory, submissions, and what goes wrong with them.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError, mpsc},
};

use super::{
    adapter,
    buffer::{Buffer, MemoryCount},
    commands::{Commands, HUNG_AFTER, Submissions},
    compiler::Compiler,
    fault::Faults,
    lanes::Lanes,
    pace::Pacing,
    program::Rewrites,
    shaders::needs,
};
use crate::{
    error::{Error, Result},
    layout::TABLE_COLUMNS,
    memory::available,
};

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
    /// Points and paths that are handed to the device at once, a power of 2: enough to keep it
    /// busy.
    pub batch: u64,
    pub(super) submissions: Submissions,
    pub(super) compiler: Compiler,
    /// How lanes share the work of a search.
    pub(crate) lanes: Lanes,
    /// Whether the device is software.
    pub(crate) is_software: bool,
    /// Whether tables are images that are read faster than storage buffers: then they hold what is
    /// not written.
    pub(crate) reads_images: bool,
    /// Maximum number of nodes and primitives that a ray visits, at least [`SHORT_LOOPS`].
    pub(crate) trace_budget: u32,
    /// Memory for what is read back, kept for the next time: to get some takes a GPU's driver
    /// longer than most reads.
    spare_reader: Mutex<Option<Buffer>>,
    faults: Faults,
}

/// Bytes that are read back at once: a power of 2.
const READ_AT_ONCE: u64 = 1 << 23;

/// Maximum number of nodes and primitives that a ray visits on software: Lavapipe ends loops
/// silently after 65,535 iterations of the 8 invocations of a subgroup.
pub const SHORT_LOOPS: u32 = 8000;
/// That of others: a third of a second, where each visit waits for memory.
const LONG_LOOPS: u32 = 1 << 20;

/// [`Gpu::batch`] of an adapter of that kind. A tile takes about half a kilobyte a point, and a
/// search as much. Software is busy with few points, but each wait for it leaves cores idle.
fn batch_of(kind: &str) -> u64 {
    match kind {
        "discrete" => 1 << 19,
        "software" => 1 << 16,
        _ => 1 << 17,
    }
}

impl Gpu {
    /// Opens the adapter of that name or index, or the best one, with the pacing that suits it:
    /// none for software, measured otherwise.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none or it cannot be opened.
    pub fn open(wanted: Option<&str>) -> Result<Self> {
        Self::open_paced(wanted, None)
    }

    /// Opens the device as [`Self::open`] does, with dispatches cut that way.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_paced(wanted: Option<&str>, pacing: Option<Pacing>) -> Result<Self> {
        let chosen = adapter::choose(wanted)?;
        let usual = if chosen.kind == "software" { Pacing::Whole } else { Pacing::Measured };
        let pacing = pacing.unwrap_or(usual);
        let clock = match pacing {
            Pacing::Measured => chosen.adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            Pacing::Whole | Pacing::Chunks(_) => wgpu::Features::empty(),
        };
        let (device, queue) = pollster::block_on(chosen.adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("caustica"),
            required_features: wgpu::Features::SUBGROUP | clock,
            required_limits: chosen.limits.clone(),
            ..Default::default()
        }))
        .map_err(|e| Error::Device(format!("adapter {} cannot be opened: {e}", chosen.name)))?;
        let faults = Faults::of(&device);
        let submissions = Submissions::new(&device, &queue, pacing);
        let is_software = chosen.kind == "software";
        let lanes = Lanes::new(chosen.subgroup, is_software);
        let batch = batch_of(chosen.kind);
        let trace_budget = if is_software { SHORT_LOOPS } else { LONG_LOOPS };
        let (limits, name, driver) = (chosen.limits, chosen.name, chosen.driver);
        let memory = Arc::<MemoryCount>::default();
        // Memory of software is the host's, which gives more than it has and then ends the process.
        if let Some(bytes) = available().filter(|_| chosen.kind == "software") {
            memory.set_limit(bytes);
        }
        let tables = limits.max_storage_textures_per_shader_stage;
        let reads_images = is_software && tables >= needs().max_sampled_textures_per_shader_stage;
        let compiler = Compiler::new(Rewrites { hides_uniforms: is_software, reads_images });
        Ok(Self {
            device,
            queue,
            limits,
            name,
            driver,
            memory,
            batch,
            submissions,
            compiler,
            lanes,
            is_software,
            reads_images,
            trace_budget,
            spare_reader: Mutex::default(),
            faults,
        })
    }

    /// Has rays stop after that many nodes and primitives, to go on in later dispatches: for tests.
    #[doc(hidden)]
    #[must_use]
    pub fn with_trace_budget(self, visits: u32) -> Self {
        Self { trace_budget: visits, ..self }
    }

    /// Spreads packets of queries over lanes as on a GPU: for tests.
    #[doc(hidden)]
    #[must_use]
    pub fn with_spread_packets(self) -> Self {
        Self { lanes: self.lanes.spread(), ..self }
    }

    /// Whether what kernels read lies in tables rather than in storage buffers: for tests.
    #[doc(hidden)]
    #[must_use]
    pub fn keeps_tables(&self) -> bool {
        self.reads_images
    }

    /// Keeps what kernels read in storage buffers as far as these hold it, as on a GPU: for tests.
    #[doc(hidden)]
    #[must_use]
    pub fn with_storage_buffers(self) -> Self {
        let compiler = Compiler::new(Rewrites { hides_uniforms: self.is_software, reads_images: false });
        Self { compiler, reads_images: false, ..self }
    }

    /// Whether several lanes answer a packet of queries together: for tests.
    #[doc(hidden)]
    #[must_use]
    pub fn spreads_packets(&self) -> bool {
        self.lanes.of_packet > 1
    }

    /// Number of dispatches recorded so far; each chunk of a cut one counts.
    #[must_use]
    pub fn dispatches(&self) -> u64 {
        self.submissions.dispatches()
    }

    /// Seconds that the device itself took for each kernel since this was last asked. None where it
    /// is software or has no clock.
    #[must_use]
    pub fn take_kernel_seconds(&self) -> BTreeMap<String, f64> {
        self.submissions.pace.take_seconds()
    }

    /// Maximum size of a storage binding, bytes.
    #[must_use]
    pub fn max_binding(&self) -> u64 {
        self.limits.max_storage_buffer_binding_size.min(self.limits.max_buffer_size)
    }

    /// Maximum number of texels of a [`super::Table`].
    #[must_use]
    pub fn max_table_texels(&self) -> u64 {
        let side = self.limits.max_texture_dimension_2d;
        u64::from(TABLE_COLUMNS.min(side)) * u64::from(side)
    }

    /// Maximum number of texels of a [`super::Table`] with layers.
    #[must_use]
    pub fn max_layered_texels(&self) -> u64 {
        u64::from(TABLE_COLUMNS).pow(2) * u64::from(self.limits.max_texture_array_layers)
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

    /// A buffer whose memory is checked at once.
    fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> Result<Buffer> {
        let inner = self.allot(label, size, || self.create_uncounted(label, size, usage))?;
        Ok(Buffer { inner, memory: Arc::clone(&self.memory) })
    }

    /// Creates something that takes `size` bytes of the device's memory and counts them.
    ///
    /// # Errors
    /// [`Error::Memory`] if they are not left.
    pub(super) fn allot<T>(&self, label: &str, size: u64, create: impl FnOnce() -> T) -> Result<T> {
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

    /// Begins to record commands, which [`Self::submit`] submits.
    #[must_use]
    pub fn encoder(&self) -> Commands<'_> {
        Commands::new(&self.submissions)
    }

    /// Submits the commands without waiting for them.
    pub fn submit(&self, commands: Commands) {
        commands.finish();
    }

    /// Waits until the device has finished all submitted work.
    ///
    /// # Errors
    /// [`Error::Lost`], [`Error::Memory`] or [`Error::Gpu`]: what went wrong since the last wait.
    pub fn wait(&self) -> Result<()> {
        let polled = self.submissions.poll();
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

    /// Reads `count` elements from element `first` on, after all submitted work.
    ///
    /// # Errors
    /// As [`Self::wait`], and [`Error::Memory`] if no room is left for the copy.
    pub fn read<T: bytemuck::Pod>(&self, buffer: &Buffer, first: u64, count: u64) -> Result<Vec<T>> {
        let (offset, bytes) = (first * size_of::<T>() as u64, count * size_of::<T>() as u64);
        if bytes == 0 {
            self.wait()?;
            return Ok(Vec::new());
        }
        let mut data: Vec<T> = bytemuck::zeroed_vec(count as usize);
        let mut from = offset;
        for piece in bytemuck::cast_slice_mut::<T, u8>(&mut data).chunks_mut(READ_AT_ONCE as usize) {
            self.read_piece(buffer, from, piece)?;
            from += piece.len() as u64;
        }
        Ok(data)
    }

    /// Reads bytes from byte `offset` on, at most [`READ_AT_ONCE`].
    fn read_piece(&self, buffer: &Buffer, offset: u64, into: &mut [u8]) -> Result<()> {
        let bytes = into.len() as u64;
        let spare = || self.spare_reader.lock().unwrap_or_else(PoisonError::into_inner);
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let kept = spare().take().filter(|kept| kept.size() >= bytes);
        let reader = match kept {
            Some(kept) => kept,
            None => self.buffer("data to read back", bytes.next_power_of_two(), usage)?,
        };
        let mut encoder = self.encoder();
        encoder.copy_buffer_to_buffer(buffer, offset, &reader, 0, bytes);
        self.submit(encoder);
        let (sender, receiver) = mpsc::channel();
        reader.slice(..bytes).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver is gone where the wait below failed.
            let _ = sender.send(result.is_ok());
        });
        self.wait()?;
        // Another thread's wait may run the callback, a moment after this wait has ended.
        let is_mapped = receiver.recv_timeout(HUNG_AFTER).unwrap_or(false);
        let mapped = is_mapped.then(|| reader.slice(..bytes).get_mapped_range().ok()).flatten();
        // Without a fault only the loss of the device is left.
        let lost = || Error::Lost {
            adapter: format!("{} ({})", self.name, self.driver),
            why: "it gave nothing back".to_string(),
        };
        into.copy_from_slice(&mapped.ok_or_else(lost)?);
        reader.unmap();
        *spare() = Some(reader);
        Ok(())
    }
}
