//! The passes: one small file each, of the same stem as its kernel.

pub mod build_grid;
pub mod gather;
pub mod photon_map;
pub mod radix_sort;
pub mod sort_photons;
