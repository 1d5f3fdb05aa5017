//! All structs and constants shared with the GPU.
//!
//! Each struct here has a twin of the same name in `shaders/`; `tests/house/layouts.rs` reflects
//! the shaders and compares names, order, offsets and sizes. Vectors are arrays so that `repr(C)`
//! and WGSL agree on alignment: a `[f32; 3]` is followed by a 4-byte field, as WGSL places a
//! `vec3f`.

mod camera;
mod estimate;
mod irradiance;
mod lights;
mod limits;
mod maps;
mod octahedral;
mod paths;
mod scene;

pub use camera::*;
pub use estimate::*;
pub use irradiance::*;
pub use lights::*;
pub use limits::*;
pub use maps::*;
pub use octahedral::*;
pub use paths::*;
pub use scene::*;
