//! Two-pass photon mapping (Jensen 1996, "Global Illumination Using Photon Maps"), in one screen:
//! [`render`].
//!
//! [`Session`] holds its stages one by one, for those who make several pictures of the same photons.

mod gatherer;
mod maps;
mod session;
mod size;
mod tally;
mod tiles;

use std::time::Instant;

pub use maps::PhotonMaps;
pub use session::Session;

pub(crate) use gatherer::Observer;
pub(crate) use size::picture_size;
pub(crate) use tally::finish_stats;
pub(crate) use tiles::{CameraPass, Gatherer};

use crate::{
    error::Result, gpu::Gpu, image::Frame, progress::Progress, scene::Scene, settings::Settings, stats::Stats,
};

/// A finished render.
#[derive(Clone, Debug)]
pub struct Render {
    /// The picture.
    pub frame: Frame,
    /// What happened.
    pub stats: Stats,
}

/// Renders the scene. The seconds of `load` are the caller's to add.
///
/// # Errors
/// A setting out of its range, a scene without light or without anything to draw, a limit of the
/// adapter, a fault of the driver, or [`crate::Error::Stopped`].
pub fn render(gpu: &Gpu, scene: &Scene, settings: &Settings, progress: &dyn Progress) -> Result<Render> {
    let start = Instant::now();
    check(scene, settings)?;
    let session = Session::open(gpu, scene, &settings.lights, progress)?;
    session.prefetch(settings);
    let maps = session.photon_maps(&settings.photons, progress)?;
    let mut render = session.picture(&maps, &settings.estimate, &settings.picture, progress)?;
    render.stats.seconds.total = start.elapsed().as_secs_f64();
    Ok(render)
}

/// Finds what is wrong with the settings before the work begins.
pub(crate) fn check(scene: &Scene, settings: &Settings) -> Result<()> {
    settings.check()?;
    scene.check_renderable()?;
    picture_size(scene.camera(settings.picture.camera.as_deref())?, &settings.picture).map(drop)
}
