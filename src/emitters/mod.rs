//! All that emits light, as one list and the tables and trees that choose from it: punctual lights,
//! emissive triangles and spheres, the environment. Host only; `upload` puts it on the device.

mod cumulative;
mod direction_bins;
pub mod entries;
pub mod environment_map;
pub mod importance;
pub mod lamps_in_glass;
mod light_bounds;
pub mod light_clusters;
mod light_media;
pub mod light_table;
pub mod light_tree;
pub mod openings;
pub mod sight;
mod surface_lights;
mod target_shares;
pub mod targets;

pub(crate) use light_media::set_media;
pub use light_table::NamedLight;
