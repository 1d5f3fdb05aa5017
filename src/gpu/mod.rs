//! The device: adapters and limits, buffers, kernels, copies. Knows nothing of photons.

mod adapter;
mod buffer;
mod chunks;
mod commands;
mod compiler;
mod device;
mod fault;
mod hide_uniforms;
mod kernel;
mod lanes;
mod pace;
mod program;
mod read_images;
#[doc(hidden)]
pub mod shaders;
mod specialize;
mod table;
mod timer;

pub use adapter::{AdapterReport, NO_ADAPTER, adapters};
pub use buffer::MemoryCount;
pub use device::{Gpu, SHORT_LOOPS};
pub use pace::{MAX_PER_DISPATCH, Pacing};

// For the passes, tests and benches; their types are those of the graphics library.
#[doc(hidden)]
pub use self::{
    buffer::Buffer,
    commands::Commands,
    kernel::{Bindings, Kernel},
    table::Table,
};
