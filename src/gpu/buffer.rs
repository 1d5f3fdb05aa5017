//! Buffers, and the count of the device memory that these and tables take.

use std::{
    ops::Deref,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

/// Bytes of all live buffers and tables, now and at most.
#[derive(Debug)]
pub struct MemoryCount {
    now: AtomicU64,
    peak: AtomicU64,
    limit: AtomicU64,
}

impl Default for MemoryCount {
    fn default() -> Self {
        Self { now: AtomicU64::new(0), peak: AtomicU64::new(0), limit: AtomicU64::new(u64::MAX) }
    }
}

impl MemoryCount {
    pub(super) fn add(&self, bytes: u64) {
        let now = self.now.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.peak.fetch_max(now, Ordering::Relaxed);
    }

    pub(super) fn subtract(&self, bytes: u64) {
        self.now.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Bytes of the buffers and tables alive now.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now.load(Ordering::Relaxed)
    }

    /// The most bytes that were alive at once since the device was opened or
    /// [`Self::restart_peak`].
    #[must_use]
    pub fn peak(&self) -> u64 {
        self.peak.load(Ordering::Relaxed)
    }

    /// Bytes that all buffers together may take: all that the driver gives, unless
    /// [`Self::set_limit`] was called.
    #[must_use]
    pub fn limit(&self) -> u64 {
        self.limit.load(Ordering::Relaxed)
    }

    /// Leaves the rest of the device's memory to others.
    pub fn set_limit(&self, bytes: u64) {
        self.limit.store(bytes, Ordering::Relaxed);
    }

    /// Measures the peak anew from here.
    pub fn restart_peak(&self) {
        self.peak.store(self.now(), Ordering::Relaxed);
    }
}

/// A buffer on the device; its memory is given back when it is dropped and no submitted work needs
/// it any more.
#[derive(Debug)]
pub struct Buffer {
    pub(super) inner: wgpu::Buffer,
    pub(super) memory: Arc<MemoryCount>,
}

impl Deref for Buffer {
    type Target = wgpu::Buffer;
    fn deref(&self) -> &wgpu::Buffer {
        &self.inner
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.memory.subtract(self.inner.size());
    }
}
