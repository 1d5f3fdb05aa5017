//! What a small version of a picture tells before the picture: where rays of final gathering end,
//! and which places there are bright.

use super::{tally, tiles::CameraPass};
use crate::{
    error::Result,
    layout::VisiblePoint,
    passes::{BrightPlaces, IrradianceCache, RayEnd, StepCount, wavefront::LEAST_QUEUE},
    progress::{Progress, Stage},
    stats::{Stats, timed},
};

/// Ends of the preview's rays at most by whose light bright places are found.
const LIT_ENDS: usize = LEAST_QUEUE as usize;

/// A point whose radiance is its irradiance.
pub fn bare(point: &VisiblePoint) -> VisiblePoint {
    VisiblePoint { weight: [1.0; 3], above: 0, ..*point }
}

/// The ends of all final-gather rays of a pass, weighed as if all that it sees were white, and the
/// number of its rays.
pub fn ends_of_rays(pass: &CameraPass, stats: &mut Stats, progress: &dyn Progress) -> Result<(Vec<VisiblePoint>, u64)> {
    let (mut ends, mut count_of_rays) = (Vec::new(), 0);
    pass.for_each_tile(Some(Stage::Cells), stats, progress, &mut |tile, stats| {
        let gather = || {
            let points: Vec<_> = pass.points(tile)?.iter().map(bare).collect();
            pass.set_points(&points);
            pass.gather_finally(tile, progress, &mut |gather, rays, _| {
                let found: Vec<VisiblePoint> = pass.gpu.read(&gather.ends, 0, rays.all().into())?;
                count_of_rays += u64::from(rays.all());
                ends.extend(found.into_iter().filter(|point| point.next_map != 0));
                Ok(StepCount::default())
            })
        };
        let count = timed(&mut stats.seconds.gather, gather)?;
        stats.non_finite.gather += count.non_finite;
        tally::add_step(stats, count);
        Ok(())
    })?;
    Ok((ends, count_of_rays))
}

/// Finds bright places by the light of some of the ends of so many rays.
pub fn bright_places(
    preview: &CameraPass,
    (marks, rays): (&[VisiblePoint], u64),
    cache: &IrradianceCache,
    stats: &mut Stats,
) -> Result<BrightPlaces> {
    let some: Vec<_> = marks.iter().step_by(marks.len().div_ceil(LIT_ENDS) | 1).copied().collect();
    let fraction = some.len() as f64 / marks.len() as f64;
    let (gpu, count) = (preview.gpu, some.len() as u32);
    let points = gpu.storage_with("ends of the preview's rays", &some)?;
    let radiance = gpu.storage_with("light of the preview's rays", &vec![[0.0_f32; 4]; some.len()])?;
    let direct = || preview.light_ends_directly((&points, &radiance, count));
    let done = timed(&mut stats.seconds.direct, direct)?;
    stats.non_finite.direct += done.non_finite;
    tally::add_step(stats, done);
    cache.light(gpu, &points, count, &radiance);
    let light: Vec<[f32; 4]> = gpu.read(&radiance, 0, count.into())?;
    // Each ray carries π over their number.
    let scale = f64::from(preview.final_rays()) / std::f64::consts::PI;
    let end = |(mark, light): (&VisiblePoint, &[f32; 4])| RayEnd {
        position: mark.position.into(),
        normal: mark.ng.into(),
        radiance: scale * light[..3].iter().map(|x| f64::from(*x)).sum::<f64>(),
    };
    let ends: Vec<_> = some.iter().zip(&light).map(end).collect();
    Ok(BrightPlaces::find(&ends, fraction * rays as f64, cache.width()))
}
