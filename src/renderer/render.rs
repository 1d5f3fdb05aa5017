//! The whole algorithm: the stages of a session, run once.

use std::time::Instant;

use super::{
    light_groups::LightGroups,
    session::{Render, Session},
    size::picture_size,
};
use crate::{error::Result, gpu::Gpu, progress::Progress, scene::Scene, settings::Settings, stats::Stats};

/// Renders the scene. The caller adds the seconds of `load` to the statistics.
///
/// # Errors
/// A setting out of its range, a scene without light or without geometry, a limit of the adapter, a
/// fault of the driver, or [`crate::Error::Stopped`].
pub fn render(gpu: &Gpu, scene: &Scene, settings: &Settings, progress: &dyn Progress) -> Result<Render> {
    let start = Instant::now();
    check(scene, settings)?;
    let groups = LightGroups::open(gpu, scene, settings, progress)?;
    let (film, mut stats) = groups.film(|_, session| {
        session.prefetch(settings);
        let maps = session.photon_maps(&settings.photons, progress)?;
        session.film(&maps, &settings.estimate, &settings.picture, progress)
    })?;
    stats.seconds.total = start.elapsed().as_secs_f64();
    Ok(Render { frame: film.finish(), stats })
}

/// Traces the photons of a picture, and no more: statistics of the first pass.
///
/// # Errors
/// As [`render`].
pub fn trace_photons(gpu: &Gpu, scene: &Scene, settings: &Settings, progress: &dyn Progress) -> Result<Stats> {
    check(scene, settings)?;
    let session = Session::open_groups(gpu, scene, settings, &[], progress)?.remove(0);
    Ok(session.photon_maps(&settings.photons, progress)?.stats().clone())
}

/// Checks the settings, the scene and the picture's size before the work begins.
pub(crate) fn check(scene: &Scene, settings: &Settings) -> Result<()> {
    settings.check()?;
    scene.check_renderable()?;
    picture_size(scene.camera(settings.picture.camera.as_deref())?, &settings.picture).map(drop)
}
