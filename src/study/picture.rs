//! One picture with the radii of its estimates, and the mean of several.

use super::{cells::Measured, radii::Counts};
use crate::{
    error::{Error, Result},
    gpu::Gpu,
    image::Frame,
    layout::Gathered,
    progress::{Progress, Stage},
    renderer::{CameraPass, PhotonMaps, Session},
    settings::Settings,
    stats::timed,
};

/// One picture of the maps, as [`Session::picture`] makes it where no estimates are shared, and the radii of its estimates.
pub(super) fn picture(
    gpu: &Gpu,
    session: &Session,
    maps: &PhotonMaps,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Frame, Measured)> {
    if settings.photons.final_gather > 0 {
        let (name, value) = ("final-gather", settings.photons.final_gather.to_string());
        return Err(Error::Setting { name, value, problem: "is not studied".to_string() });
    }
    let mut stats = maps.stats().clone();
    let pass = CameraPass::new(session, settings)?;
    let mut gather = session.gather(settings);
    let mut film = pass.film();
    let tiles = pass.tracer.tiles();
    // Maps without a photon are not there; the global one comes first.
    let first = usize::from(stats.photons.global.stored == 0);
    let mut radii = [Counts::default(), Counts::default()];
    for (done, tile) in tiles.iter().enumerate() {
        progress.check()?;
        progress.report(Stage::Camera, done as u64, tiles.len() as u64);
        pass.trace(tile, &mut stats)?;
        let (tracer, points) = (&pass.tracer, pass.tracer.point_count(tile));
        for (map, counts) in maps.maps().iter().zip(&mut radii[first..]) {
            // Places without a valid point would keep what an older tile left there.
            let mut encoder = gpu.encoder();
            encoder.clear_buffer(&tracer.gathered, 0, None);
            gpu.submit(encoder);
            timed(&mut stats.seconds.gather, || {
                let results = (&tracer.radiance, &tracer.gathered);
                gather.run(gpu, map, &tracer.points, points, &pass.estimate, results, progress)
            })?;
            counts.add(&gpu.read::<Gathered>(&tracer.gathered, 0, points.into())?);
        }
        pass.resolve(tile, &mut film)?;
    }
    session.close(&mut stats);
    Ok((film.finish(settings.picture.spp), Measured { stats, radii: radii.map(|counts| counts.finish()) }))
}

/// Mean of pictures of one size; the other layers are the first one's.
pub(super) fn mean_frame(frames: Vec<Frame>) -> Frame {
    let scale = 1.0 / frames.len().max(1) as f32;
    let mut frames = frames.into_iter();
    let mut mean = frames.next().unwrap_or_default();
    for frame in frames {
        mean.radiance.iter_mut().zip(&frame.radiance).for_each(|(a, b)| (0..3).for_each(|c| a[c] += b[c]));
    }
    mean.radiance.iter_mut().flatten().for_each(|x| *x *= scale);
    mean
}
