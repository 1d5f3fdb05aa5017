//! Caustica renders glTF scenes by photon mapping on the GPU, without a screen: glTF in, OpenEXR
//! out.
//!
//! # A first picture
//!
//! ```no_run
//! use std::path::Path;
//!
//! use caustica::{Gpu, Scene, Settings, Silent, image::write_exr, render};
//!
//! fn main() -> caustica::Result<()> {
//!     let scene = Scene::load(Path::new("scene.glb"))?;
//!     let settings = Settings::default().with(|s| s.photons.global = 1_000_000);
//!     let picture = render(&Gpu::open(None)?, &scene, &settings, &Silent)?;
//!     write_exr(Path::new("out.exr"), &picture.frame, &scene.origin(&settings, &picture.stats))
//! }
//! ```
//!
//! A [`Scene`] holds the contents of a file: triangles and exact spheres, materials, lights and
//! cameras, and the [`scene::Environment`] around it. A [`Gpu`] is an open device, real or
//! software; [`Gpu::open`] takes the name of an adapter. [`Settings`] give the numbers of photons
//! and samples, the [`settings::Mode`] of illumination and the seed. The result is a [`Frame`] of
//! scene-linear radiance, depth, normal and albedo, which [`image`] writes as OpenEXR or PNG, and
//! the [`Stats`] of the render.
//!
//! Units are metres, watts and steradians; colours are linear Rec.709.
//!
//! # Stages
//!
//! [`render`] runs the stages of a [`Session`] once:
//!
//! 1. [`Session::open`] builds the hierarchy of the scene and copies the scene to the device.
//! 2. [`Session::photon_maps`] traces photons from the lights into two maps, a global one and one
//!    for caustics.
//! 3. [`Session::picture`] follows camera rays through mirrors and glass to the first diffuse
//!    surface and estimates the light there from the nearest photons and from shadow rays.
//!
//! Any number of pictures can be made from the same maps, with other cameras, sizes, kernels or
//! numbers of neighbours; see the example `many_cameras`. Anything that a file cannot hold can be
//! added to the [`Scene`] before the session is opened.
//!
//! # Progress and stopping
//!
//! A [`Progress`] receives the stage and the completed units, and is asked often whether the work
//! should stop. After a stop request the call returns [`Error::Stopped`], and the device can be
//! used again. [`Silent`] ignores reports and never requests a stop. Reports come from the calling
//! thread. To stop the work from another thread, let that thread set a flag, and read the flag in
//! [`Progress::stop_requested`].
//!
//! # Errors
//!
//! Every failure that a file, a setting, the device or the disk can cause is an [`Error`],
//! displayed as one line. A setting out of range gives [`Error::Setting`] with the setting's path
//! in [`Settings`], such as `picture.spp`, and its range. The ranges are constants beside the
//! settings, such as [`settings::EstimateSettings::NEIGHBORS`]. A panic is a bug.
//! [`Scene::warnings`] lists features of a scene that were ignored or changed, [`Stats::warnings`]
//! problems that did not prevent the render.
//!
//! # Reproducibility
//!
//! Equal scenes, settings, adapters and drivers give equal frames, bit for bit: the seed determines
//! all random numbers, and no sum depends on the order in which the device works. Other adapters or
//! drivers round differently. [`Scene::origin`] collects the provenance of a picture;
//! [`image::write_exr`] stores it in the file.
//!
//! # Features
//!
//! | feature | what it adds |
//! |---|---|
//! | `cli` (default) | the command `caustica`; implies `report` |
//! | `report` | the modules `compare` and `study`: measurements with tables, charts and pages |
//!
//! With `default-features = false`, both features are off, and the dependencies that only they need
//! are not built.

#[doc(hidden)]
pub mod bvh;
#[cfg(feature = "report")]
pub mod compare;
pub mod density;
#[doc(hidden)]
pub mod emitters;
pub mod error;
pub mod gpu;
#[cfg(feature = "report")]
mod html;
pub mod image;
#[doc(hidden)]
pub mod layout;
pub mod map_kind;
mod memory;
#[doc(hidden)]
pub mod passes;
pub mod pixel_filter;
pub mod progress;
#[doc(hidden)]
pub mod reference;
pub mod renderer;
pub mod scene;
pub mod settings;
pub mod stats;
#[cfg(feature = "report")]
pub mod study;
#[doc(hidden)]
pub mod upload;

pub use error::{Error, Result};
pub use gpu::Gpu;
pub use image::Frame;
pub use progress::{Progress, Silent, Stage};
pub use renderer::{PhotonMaps, Progressive, Render, Session, render};
pub use scene::Scene;
pub use settings::Settings;
pub use stats::Stats;
