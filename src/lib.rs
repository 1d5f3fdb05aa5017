//! Caustica: headless photon mapping on the GPU.
#![deny(unsafe_code)]
#![warn(missing_debug_implementations)]

pub mod bvh;
pub mod error;
pub mod gpu;
pub mod image;
pub mod layout;
pub mod passes;
pub mod progress;
pub mod reference;
pub mod renderer;
pub mod scene;
pub mod settings;
pub mod stats;

pub use error::{Error, Result};
