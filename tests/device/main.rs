//! The device and the kernels on it: search, traversal, sampling, limits, faults, equal bits.

mod bsdf;
mod chi_square;
mod determinism;
mod emitter_sampling;
mod faults;
mod fresnel;
mod kd_tree;

mod light_sampling;
mod limits;
mod nearest;
mod probe;
mod sampling;
mod traversal;
