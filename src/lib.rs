//! Caustica renders glTF scenes by photon mapping on the GPU, without a screen.
//!
//! A [`scene::Scene`] is what a file holds: triangles and exact spheres, materials, lights, cameras; and the
//! [`scene::Environment`] around it. A [`gpu::Gpu`] is an open device, real or software. [`renderer::render`] traces photons from the lights into two maps, a
//! global one and one for caustics, then follows camera rays through mirrors and glass to the first diffuse surface
//! and estimates the light there from the nearest photons and from shadow rays. [`settings::Settings`] say how many
//! photons and samples, which [`settings::Mode`] of illumination, and the seed that decides all randomness. Out comes
//! an [`image::Frame`] of scene-linear radiance, depth, normal and albedo, which [`image`] writes as OpenEXR or PNG, and
//! [`stats::Stats`] of what happened. [`renderer::Session`] makes several pictures of the same photons, and
//! [`compare::compare`] holds the search on the device against a kd-tree on the CPU. [`fn@study::run`] renders and measures
//! many combinations of settings. A [`progress::Progress`] listens meanwhile and can stop the work.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use caustica::{
//!     gpu::Gpu,
//!     image::write_exr,
//!     progress::Silent,
//!     renderer,
//!     scene::Scene,
//!     settings::Settings,
//! };
//!
//! fn main() -> caustica::Result<()> {
//!     let scene = Scene::load(Path::new("scene.glb"))?;
//!     let settings = Settings::default().with(|s| s.photons.global = 1_000_000);
//!     let render = renderer::render(&Gpu::open(None)?, &scene, &settings, &Silent)?;
//!     write_exr(Path::new("out.exr"), &render.frame, &scene.origin(&settings, &render.stats))
//! }
//! ```
//!
//! Units are metres, watts and steradians; colours are linear Rec.709. Every failure that input or machine can cause is
//! an [`Error`] of one line. Equal scenes, settings, adapters and drivers give equal frames, bit for bit.
#![deny(unsafe_code)]
#![warn(missing_debug_implementations)]

pub mod bvh;
pub mod compare;
pub mod density;
pub mod emitters;
pub mod error;
pub mod gpu;
mod html;
pub mod image;
pub mod layout;
pub mod map_kind;
mod memory;
pub mod passes;
pub mod pixel_filter;
pub mod progress;
pub mod reference;
pub mod renderer;
pub mod scene;
pub mod settings;
pub mod stats;
pub mod study;
pub mod upload;

pub use error::{Error, Result};
