//! First pass: photon paths from the lights, and the photons that they store.

mod photon_batch;
pub mod photon_tracer;
pub mod raw_map;

pub use photon_tracer::{PathRange, PathRanges, PhotonTracer, TracedPhotons};
pub use raw_map::RawMap;
