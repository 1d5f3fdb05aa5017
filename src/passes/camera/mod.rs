//! Second pass: camera paths to visible points, direct light there, rays of final gathering.

pub mod bright_places;
mod camera_kernels;
pub mod camera_tracer;
mod direct_light;
pub mod final_gather;
mod ray_keys;
pub mod tile;
mod tiling;
mod view;
mod waiting_points;

pub use bright_places::{BrightPlaces, Leg, RayEnd};
pub use camera_kernels::CameraKernels;
pub use camera_tracer::CameraTracer;
pub use final_gather::{FinalGather, FinalRays};
pub use tile::{Further, StepCount, Tile, morton_number};
