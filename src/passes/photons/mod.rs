//! First pass: photon paths from the lights, and the photons that they store.

mod emission_plans;
mod faint_caustics;
mod photon_batch;
pub mod photon_tracer;
mod pilot;
pub mod raw_map;
mod steering;

pub use emission_plans::{PathRange, PathRanges};
pub use photon_tracer::{PhotonTracer, TracedPhotons};
pub use raw_map::RawMap;
