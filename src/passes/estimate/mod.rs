//! The radiance estimate: the search for the nearest photons, their sum, and estimates that visible
//! points share.

pub mod gather;
mod gather_kernels;
mod query_order;
pub mod share_estimates;

pub use gather::{Gather, GatherOptions, GatherSettings};
pub use share_estimates::{EstimateRequest, EstimateSharing, SharedPoints};
