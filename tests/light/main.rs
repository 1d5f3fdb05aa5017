//! Pictures and photon maps against closed forms, against references, and modes against each other.

mod analytic;
mod contacts;
mod extremes;
mod flat_surfaces;
mod lights;
mod modes;
mod pixels;
mod references;
mod refraction;
mod seen;
mod solids;
