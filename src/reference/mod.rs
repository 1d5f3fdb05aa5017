//! Reference implementation of the radiance estimate on the CPU, written for readability. Tests and
//! `caustica compare` hold the kernels against it.

mod above;
mod brute_force;
mod estimate;
mod kd_map;
mod kd_tree;

pub use brute_force::{Found, brute_force};
pub use estimate::{estimate, usable};
pub use kd_map::{Estimate, KdMap, TIE, are_tied, fingerprint, mix};
pub use kd_tree::KdTree;
