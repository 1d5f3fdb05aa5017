//! The scene on the device: bind group 0.

pub mod light_buffers;
pub mod scene_buffers;

pub use scene_buffers::{SceneBuffers, sampler_constant};
