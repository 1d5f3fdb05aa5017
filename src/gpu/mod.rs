//! The device: adapters and limits, buffers, kernels, copies. Knows nothing of photons.

mod adapter;
mod buffer;
mod chunks;
mod commands;
mod compiler;
mod device;
mod fault;
mod kernel;
mod pace;
mod program;
pub mod shaders;
mod table;
mod timer;

pub use adapter::{AdapterReport, NO_ADAPTER, adapters};
pub use buffer::{Buffer, MemoryCount};
pub use commands::Commands;
pub use device::Gpu;
pub use kernel::{Bindings, Kernel};
pub use pace::{MAX_PER_DISPATCH, Pacing};
pub use table::Table;
