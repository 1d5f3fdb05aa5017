//! The device and its kernels: search, traversal, sampling, limits, faults, determinism.

mod bsdf;
mod chi_square;
mod determinism;
mod emitter_sampling;
mod faults;
mod fresnel;
mod gloss;
mod kd_tree;
mod late_rays;
mod layers;
mod light_sampling;
mod light_tree;
mod limits;
mod lobe_mixture;
mod losses;
mod microfacets;
mod nearest;
mod openings;
mod probe;
mod rough_dielectric;
mod sampling;
mod thinning;
mod traversal;
