//! Photon maps: photons sorted along a Hilbert curve, and the grid of cells over them.

pub mod build_grid;
pub mod photon_map;
pub mod photon_store;
pub mod radix_sort;
pub mod sort_photons;

pub use photon_map::{MapKernels, PhotonMap};
pub use photon_store::PhotonStore;
