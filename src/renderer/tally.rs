//! Counts of a render, and the warnings that follow from them.

use crate::{
    emitters::NamedLight,
    gpu::Gpu,
    layout::CHAIN_LIMIT,
    passes::{RawMap, StepCount},
    stats::{LightStats, MapStats, NonFinite, Stats},
    upload::SceneBuffers,
};

pub(super) fn map_stats(map: &RawMap) -> MapStats {
    MapStats { emitted: map.emitted, stored: map.stored, seen: None }
}

pub(super) fn light_stats(buffers: &SceneBuffers, photons: &[u32]) -> Vec<LightStats> {
    let lights = buffers.lights.table.named.iter().zip(photons);
    let stats = |(light, photons): (&NamedLight, &u32)| LightStats {
        name: light.name.clone(),
        kind: light.kind.to_owned(),
        power: light.power.to_array(),
        photons: u64::from(*photons),
    };
    lights.map(stats).collect()
}

pub(super) fn count_faults(stats: &mut Stats, media_overflows: u64, unfinished: u64) {
    stats.media_overflows += media_overflows;
    stats.unfinished_rays += unfinished;
}

/// Adds a warning for each counted fault that changes the light of the picture.
fn warn_of_faults(stats: &mut Stats) {
    if stats.unfinished_rays > 0 {
        stats.warnings.push(format!(
            "{} rays were given up, since they meet too many surfaces; their light is lost",
            stats.unfinished_rays
        ));
    }
    if stats.non_finite.total() > 0 {
        let NonFinite { photons, camera, direct, gather, film } = stats.non_finite;
        stats.warnings.push(format!(
            "numbers came out infinite or undefined and were left out: {photons} photon paths, {camera} camera paths, \
             {direct} samples of direct light, {gather} rays of final gathering, {film} samples of the picture; lights \
             or sizes are beyond the range of 32-bit numbers"
        ));
    }
    if stats.media_overflows > 0 {
        stats.warnings.push(format!(
            "{} times more surfaces of glass lay in one place, or a ray of final gathering started in more solids, than \
             are told apart; the rest counts as not there",
            stats.media_overflows
        ));
    }
}

/// Warning for light that camera paths lost in mirrors and glass, as a fraction of all paths.
pub(super) fn lost_in_chains(fraction: f64) -> Option<String> {
    (fraction > 1e-4).then(|| {
        // Paths at the rims of tiles, beyond the picture, count too.
        let percent = 100.0 * fraction.min(1.0);
        format!("{percent:.2} % of the camera's paths met {CHAIN_LIMIT} mirrors and glasses and ended there, dark")
    })
}

/// Warning for light that the limit of diffuse surfaces took, as a fraction of all light.
pub(super) fn lost_between_surfaces(fraction: f64, limit: u32) -> Option<String> {
    (fraction > 0.01).then(|| {
        let percent = 100.0 * fraction;
        format!(
            "{percent:.0} % of the light met more than {limit} diffuse surfaces, the limit of bounces, and was followed \
             no further: the picture is too dark"
        )
    })
}

pub(super) fn add_step(stats: &mut Stats, count: StepCount) {
    stats.rays += count.rays;
    stats.lost_camera_paths += count.lost;
    count_faults(stats, count.media_overflows, count.unfinished);
}

/// Completes the statistics of a finished picture: warnings of faults, peak device memory, seconds
/// of kernels, total seconds.
pub(crate) fn finish_stats(gpu: &Gpu, stats: &mut Stats) {
    warn_of_faults(stats);
    stats.peak_device_bytes = gpu.memory.peak();
    stats.kernel_seconds = gpu.take_kernel_seconds();
    let s = &mut stats.seconds;
    s.total = s.bvh + s.photons + s.grid + s.camera + s.direct + s.gather;
}
