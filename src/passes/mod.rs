//! The passes: host code that owns kernels and runs them. One file per pass.

mod photon_tracer;
mod camera_tracer;
mod scene_buffers;

pub use camera_tracer::{CameraTracer, StepCount, Tile};
pub use photon_tracer::{BOUNCE_CEILING, PhotonTracer, RawMap, TracedPhotons};
pub use scene_buffers::SceneBuffers;
