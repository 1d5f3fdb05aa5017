//! The device and the kernels on it: search, traversal, limits, faults, equal bits.

mod determinism;
mod faults;
mod kd_tree;
mod limits;
mod nearest;
mod traversal;
