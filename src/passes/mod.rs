//! The passes: host code that owns kernels and runs them. One file per pass.

pub mod build_grid;
pub mod camera_tracer;
pub mod gather;
pub mod photon_map;
pub mod photon_tracer;
pub mod radix_sort;
pub mod scene_buffers;
pub mod share_estimates;
pub mod sort_photons;

pub use camera_tracer::{CameraTracer, StepCount, Tile};
pub use gather::{Gather, GatherOptions, GatherSettings};
pub use photon_map::{MapKernels, PhotonMap, PhotonStore};
pub use photon_tracer::{BOUNCE_CEILING, PhotonTracer, RawMap, TracedPhotons};
pub use scene_buffers::SceneBuffers;
pub use share_estimates::{EstimateSharing, SharedPoints};
