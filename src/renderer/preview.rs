//! What a small version of a picture tells before the picture: where rays of final gathering end,
//! and which places there are bright.

use super::{tally, tiles::CameraPass};
use crate::{
    error::Result,
    layout::VisiblePoint,
    passes::{BrightPlaces, IrradianceCache, Leg, RayEnd, StepCount, wavefront::LEAST_QUEUE},
    progress::{Progress, Stage},
    stats::{Stats, timed},
};

/// Ends of the preview's rays at most by whose light bright places are found, and those that are
/// lit at once.
const LIT_ENDS: usize = 8 * LIT_AT_ONCE;
const LIT_AT_ONCE: usize = LEAST_QUEUE as usize;

/// A point whose radiance is its irradiance.
pub fn bare(point: &VisiblePoint) -> VisiblePoint {
    VisiblePoint { weight: [1.0; 3], above: 0, ..*point }
}

/// The ends of final-gather rays, weighed as if all that is seen were white, and how the rays
/// begin.
#[derive(Debug, Default)]
pub struct Ends {
    pub marks: Vec<VisiblePoint>,
    legs: Vec<Leg>,
    /// First legs of the rays that found light on their way, and that light in all colours.
    gleams: Vec<(Leg, f64)>,
    /// Number of all rays.
    pub rays: u64,
}

/// The ends of all final-gather rays of a pass.
pub fn ends_of_rays(pass: &CameraPass, stats: &mut Stats, progress: &dyn Progress) -> Result<Ends> {
    let mut ends = Ends::default();
    pass.for_each_tile(Some(Stage::Cells), stats, progress, &mut |tile, stats, _| {
        let gather = || {
            let mut points = pass.points(tile)?;
            points.iter_mut().for_each(|point| *point = bare(point));
            pass.set_points(&points);
            pass.gather_finally(tile, progress, &mut |gather, rays, chosen| {
                let marks: Vec<VisiblePoint> = pass.gpu.read(&gather.ends, 0, rays.all().into())?;
                let legs = gather.legs(pass.gpu, rays)?;
                ends.rays += u64::from(rays.all());
                for ((ray, mark), (direction, length, found)) in (0..).zip(marks).zip(legs) {
                    let start = points[chosen[(ray / rays.count) as usize] as usize].position.into();
                    let leg = Leg { start, direction, length };
                    if mark.next_map != 0 {
                        ends.marks.push(mark);
                        ends.legs.push(leg);
                    }
                    if found.max_element() > 0.0 {
                        ends.gleams.push((leg, found.element_sum().into()));
                    }
                }
                Ok(StepCount::default())
            })
        };
        let count = timed(&mut stats.seconds.gather, gather)?;
        stats.non_finite.gather += count.non_finite;
        tally::add_step(stats, count);
        Ok(())
    })?;
    Ok(ends)
}

/// Finds bright places by the light of some of the ends, and by all gleams.
pub fn bright_places(
    preview: &CameraPass,
    ends: &Ends,
    cache: &IrradianceCache,
    stats: &mut Stats,
) -> Result<BrightPlaces> {
    let step = ends.marks.len().div_ceil(LIT_ENDS) | 1;
    let some: Vec<_> = ends.marks.iter().step_by(step).copied().collect();
    let fraction = some.len() as f64 / ends.marks.len() as f64;
    let mut light: Vec<[f32; 4]> = Vec::with_capacity(some.len());
    for some in some.chunks(LIT_AT_ONCE) {
        let (gpu, count) = (preview.gpu, some.len() as u32);
        let points = gpu.storage_with("ends of the preview's rays", some)?;
        let radiance = gpu.storage_with("light of the preview's rays", &vec![[0.0_f32; 4]; some.len()])?;
        let direct = || preview.light_ends_directly((&points, &radiance, count));
        let done = timed(&mut stats.seconds.direct, direct)?;
        stats.non_finite.direct += done.non_finite;
        tally::add_step(stats, done);
        cache.light(gpu, &points, count, &radiance);
        light.extend(gpu.read::<[f32; 4]>(&radiance, 0, count.into())?);
    }
    // Each ray carries π over their number.
    let scale = f64::from(preview.final_rays()) / std::f64::consts::PI;
    let end = |((mark, leg), light): ((&VisiblePoint, &Leg), &[f32; 4])| RayEnd {
        leg: *leg,
        position: mark.position.into(),
        normal: mark.ng.into(),
        radiance: scale * light[..3].iter().map(|x| f64::from(*x)).sum::<f64>(),
    };
    let lit: Vec<_> = some.iter().zip(ends.legs.iter().step_by(step)).zip(&light).map(end).collect();
    let gleams: Vec<_> = ends.gleams.iter().map(|(leg, light)| RayEnd::of_gleam(*leg, scale * light)).collect();
    let rays = [fraction * ends.rays as f64, ends.rays as f64];
    Ok(BrightPlaces::find((&lit, &gleams), rays, cache.width()))
}
