//! The passes: host code that owns kernels and runs them. One file per pass.

pub mod build_grid;
pub mod camera_tracer;
mod cumulative;
mod direct_light;
pub mod environment_map;
pub mod final_gather;
pub mod gather;
pub mod light_buffers;
mod light_media;
pub mod light_table;
mod photon_batch;
pub mod photon_map;
pub mod photon_tracer;
pub mod radix_sort;
pub mod raw_map;
pub mod scene_buffers;
pub mod share_estimates;
pub mod sort_photons;
pub mod targets;

pub use camera_tracer::{CameraKernels, CameraTracer, StepCount, Tile};
pub use final_gather::FinalGather;
pub use gather::{Gather, GatherOptions, GatherSettings};
pub use light_table::LightGroup;
pub use photon_batch::BOUNCE_CEILING;
pub use photon_map::{MapKernels, PhotonMap, PhotonStore};
pub use photon_tracer::{PhotonTracer, TracedPhotons};
pub use raw_map::RawMap;
pub use scene_buffers::SceneBuffers;
pub use share_estimates::{Asked, EstimateSharing, SharedPoints};
