//! Two-pass photon mapping (Jensen 1996, "Global Illumination Using Photon Maps"). The body of
//! [`render`] shows the whole algorithm.
//!
//! [`Session`] offers the single stages, for several pictures of the same photons.

mod film_layers;
mod gatherer;
mod light_groups;
mod maps;
mod obstacles;
mod power_classes;
mod preview;
mod progressive;
mod ray_start;
mod render;
mod searches;
mod seen;
mod session;
mod size;
mod tally;
mod tiles;
mod unevenness;

pub use light_groups::LightGroups;
pub use maps::PhotonMaps;
pub use progressive::Progressive;
pub use render::{render, trace_photons};
pub use session::{Render, Session};
pub use size::size_of;

#[cfg(feature = "report")]
pub(crate) use {
    gatherer::Observer,
    render::check,
    size::picture_size,
    tally::finish_stats,
    tiles::{CameraPass, Gatherer},
};
