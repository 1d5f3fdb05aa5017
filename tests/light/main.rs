//! Pictures and photon maps against closed forms, against references, and modes against each other.

mod aimed_lobes;
mod analytic;
mod clear_panes;
mod contacts;
mod covers;
mod crops;
mod extremes;
mod few_photons;
mod flat_surfaces;
mod instances;
mod lights;
mod material_references;
mod modes;
mod narrow_things;
mod pixels;
mod references;
mod refraction;
mod seen;
mod sessions;
mod smooth_shading;
mod solids;
mod spaced_gathering;
mod transport;
mod uneven_pixels;
mod veils;
mod wide_grounds;
