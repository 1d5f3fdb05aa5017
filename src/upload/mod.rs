//! The scene on the device: bind group 0.

pub mod light_buffers;
mod material_buffers;
pub mod scene_buffers;
mod texels;

pub use scene_buffers::{SceneBuffers, sampler_constant};
