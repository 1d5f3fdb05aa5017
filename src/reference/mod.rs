//! The same estimate in plain Rust, written to be read: what the device's kernels are measured against.

mod brute_force;
mod estimate;

pub use brute_force::{Found, brute_force};
pub use estimate::{ConeFilter, MAX_NORMAL_WEIGHT, estimate, usable};
