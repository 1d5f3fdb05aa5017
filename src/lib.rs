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
//! A [`Scene`] is what a file holds: triangles and exact spheres, materials, lights, cameras; and
//! the [`scene::Environment`] around it. A [`Gpu`] is an open device, real or software;
//! [`Gpu::open`] takes the name of an adapter. [`Settings`] say how many photons and samples, which
//! [`settings::Mode`] of illumination, and the seed. Out comes a [`Frame`] of scene-linear
//! radiance, depth, normal and albedo, which [`image`] writes as OpenEXR or PNG, and [`Stats`] of
//! what happened.
//!
//! Units are metres, watts and steradians; colours are linear Rec.709.
//!
//! # Stages
//!
//! [`render`] is a [`Session`] used once. Its stages, one by one:
//!
//! 1. [`Session::open`] builds the hierarchy of the scene and copies the scene to the device.
//! 2. [`Session::photon_maps`] traces photons from the lights into two maps, a global one and one
//!    for caustics.
//! 3. [`Session::picture`] follows camera rays through mirrors and glass to the first diffuse
//!    surface and estimates the light there from the nearest photons and from shadow rays.
//!
//! Any number of pictures can be made of the same maps: other cameras, sizes, kernels, numbers of
//! neighbours. The example `many_cameras` does so. What a file cannot hold can be added to the
//! [`Scene`] before the session is opened.
//!
//! # Progress and stopping
//!
//! A [`Progress`] is told the stage and how far it is, and is asked often whether the work should
//! end. If it says so, the call returns [`Error::Stopped`], and the device can be used again.
//! [`Silent`] says nothing and never stops. Reports come from the calling thread; a flag that
//! another thread sets, read in [`Progress::stop_requested`], is enough to stop.
//!
//! # Errors
//!
//! Every failure that a file, a setting, the device or the disk can cause is an [`Error`],
//! displayed as one line. A wrong setting is [`Error::Setting`] with the setting's path in
//! [`Settings`], such as `picture.spp`, and its range; the ranges are constants beside the
//! settings, such as [`settings::EstimateSettings::NEIGHBORS`]. A panic is a bug. What was ignored
//! or changed in a scene is in [`Scene::warnings`], what went wrong in a picture without spoiling
//! it in [`Stats::warnings`].
//!
//! # Reproducibility
//!
//! Equal scenes, settings, adapters and drivers give equal frames, bit for bit: the seed decides
//! all randomness, and no sum depends on the order in which the device works. [`Scene::origin`]
//! collects what a picture was made by; [`image::write_exr`] keeps it in the file. Other adapters
//! or drivers round otherwise.
//!
//! # Features
//!
//! | feature | what it adds |
//! |---|---|
//! | `cli` (default) | the command `caustica`; implies `report` |
//! | `report` | the modules `compare` and `study`: measurements with tables, charts and pages |
//!
//! With `default-features = false` neither is there, nor the dependencies that they alone need.

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
pub use renderer::{PhotonMaps, Render, Session, render};
pub use scene::Scene;
pub use settings::Settings;
pub use stats::Stats;
