//! Statistics of a render, which scripts read as JSON.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};

/// Seconds by stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Reading the scene.
    pub load: f64,
    /// Building the BVH of the scene.
    pub bvh: f64,
    /// Tracing photons.
    pub photons: f64,
    /// Sorting photons into the grid.
    pub grid: f64,
    /// Tracing camera rays.
    pub camera: f64,
    /// Direct light by shadow rays.
    pub direct: f64,
    /// Radiance estimates.
    pub gather: f64,
    /// All of the above, and the time between them where the caller measures it.
    pub total: f64,
}

/// One photon map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapStats {
    /// Paths that the map is normalised by.
    pub emitted: u64,
    /// Photons in the map.
    pub stored: u64,
    /// Those that the camera sees; `None` where nobody asks
    /// ([`counts_seen`](crate::settings::Settings::counts_seen)).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen: Option<SeenStats>,
}

/// Photons of a sample of a map that the camera sees: those in the picture, on a side of a surface
/// that faces the camera, with nothing opaque between. What mirrors show does not count; glass,
/// panes and surfaces with holes hide nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeenStats {
    /// Photons that were looked at: the first of the map, in the order of their paths.
    pub sampled: u64,
    /// Those of them that the camera sees.
    pub seen: u64,
}

impl MapStats {
    /// Adds the map of another pass.
    pub fn add(&mut self, other: Self) {
        self.emitted += other.emitted;
        self.stored += other.stored;
        if let Some(more) = other.seen {
            let all = self.seen.get_or_insert_default();
            all.sampled += more.sampled;
            all.seen += more.seen;
        }
    }
}

/// One light. All surfaces of one emissive material count as one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LightStats {
    /// Name of the light, of the material, or of the environment.
    pub name: String,
    /// `point`, `spot`, `directional`, `surface` or `environment`.
    pub kind: String,
    /// Power, W in each channel. Of directional lights and environments: the power that the
    /// bounding sphere of the scene receives.
    pub power: [f64; 3],
    /// Photons of this light in both maps.
    pub photons: u64,
}

/// Both maps.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PhotonStats {
    /// The map of light scattered by at least one diffuse surface, or of all light where the mode
    /// says so.
    pub global: MapStats,
    /// The map of light from mirrors and glass.
    pub caustic: MapStats,
    /// Flux in W that the limits of bounces took, mean of the channels, over all emitted paths; of
    /// several passes their mean, since each has all the light.
    pub lost_to_bounce_limit: f64,
    /// Each light.
    #[serde(default)]
    pub lights: Vec<LightStats>,
}

/// Number of infinite or NaN values by stage. The path or sample of each was left out of the
/// picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NonFinite {
    /// Photon paths.
    pub photons: u64,
    /// Camera paths.
    pub camera: u64,
    /// Samples of direct light.
    pub direct: u64,
    /// Rays of final gathering.
    pub gather: u64,
    /// Samples of the picture whose estimate, or whose pixel's sum with them, was not finite.
    pub film: u64,
}

impl NonFinite {
    /// Sum over all stages.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.photons + self.camera + self.direct + self.gather + self.film
    }
}

impl NonFinite {
    fn add(&mut self, other: Self) {
        self.photons += other.photons;
        self.camera += other.camera;
        self.direct += other.direct;
        self.gather += other.gather;
        self.film += other.film;
    }
}

/// Adapter and driver.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DeviceStats {
    /// Name of the adapter.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
}

/// Passes of a picture, and its estimated relative errors
/// ([`crate::image::ErrorEstimate`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PassStats {
    /// First pass.
    pub first: u32,
    /// The pass behind the last one.
    pub end: u32,
    /// Noise; `None` for one pass.
    pub noise: Option<f64>,
    /// Bias; `None` for one pass.
    pub bias: Option<f64>,
}

/// Everything that one render reports.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stats {
    /// The device that rendered the picture.
    pub device: DeviceStats,
    /// Time by stage.
    pub seconds: Seconds,
    /// Photons of both maps.
    pub photons: PhotonStats,
    /// Rays traced: photon paths' segments, camera rays and shadow rays.
    pub rays: u64,
    /// Weight of the camera paths that ended in mirrors and glass without having met anything else,
    /// in paths.
    #[serde(default)]
    pub lost_camera_paths: f64,
    /// Camera samples of the picture beyond those that every pixel has.
    #[serde(default)]
    pub extra_samples: u64,
    /// Times that more solids met in one place than are told apart.
    pub media_overflows: u64,
    /// Rays given up: late ones for which there was no room, none on software; their light is lost.
    pub unfinished_rays: u64,
    /// Infinite or NaN values that were left out.
    #[serde(default)]
    pub non_finite: NonFinite,
    /// Peak device memory of buffers, bytes.
    pub peak_device_bytes: u64,
    /// Seconds that the device itself took for each kernel; none where it is software or has no
    /// clock.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub kernel_seconds: BTreeMap<String, f64>,
    /// Passes, of a picture that is rendered in passes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub passes: Option<PassStats>,
    /// Warnings for the user, one line each.
    pub warnings: Vec<String>,
}

impl Stats {
    /// Adds a further pass to `passes` of them. Counts add up; of flux it is the mean that counts.
    pub fn add_pass(&mut self, pass: &Self, passes: u32) {
        let (n, lost) = (f64::from(passes), self.photons.lost_to_bounce_limit);
        self.add(pass);
        self.photons.lost_to_bounce_limit = (n * lost + pass.photons.lost_to_bounce_limit) / (n + 1.0);
    }

    /// Adds further work for the same picture, as that for other lights. A warning that differs in
    /// numbers only is kept once.
    pub fn add(&mut self, more: &Self) {
        let (s, t) = (&mut self.seconds, &more.seconds);
        for (sum, seconds) in [
            (&mut s.photons, t.photons),
            (&mut s.grid, t.grid),
            (&mut s.camera, t.camera),
            (&mut s.direct, t.direct),
            (&mut s.gather, t.gather),
        ] {
            *sum += seconds;
        }
        s.total = s.bvh + s.photons + s.grid + s.camera + s.direct + s.gather;
        let (p, q) = (&mut self.photons, &more.photons);
        p.global.add(q.global);
        p.caustic.add(q.caustic);
        p.lost_to_bounce_limit += q.lost_to_bounce_limit;
        p.lights.iter_mut().zip(&q.lights).for_each(|(light, other)| light.photons += other.photons);
        self.rays += more.rays;
        self.lost_camera_paths += more.lost_camera_paths;
        self.extra_samples += more.extra_samples;
        self.media_overflows += more.media_overflows;
        self.unfinished_rays += more.unfinished_rays;
        self.non_finite.add(more.non_finite);
        self.peak_device_bytes = self.peak_device_bytes.max(more.peak_device_bytes);
        for (kernel, seconds) in &more.kernel_seconds {
            *self.kernel_seconds.entry(kernel.clone()).or_default() += seconds;
        }
        let words = |line: &String| line.chars().filter(|c| !c.is_ascii_digit()).collect::<String>();
        for warning in &more.warnings {
            if self.warnings.iter().all(|told| words(told) != words(warning)) {
                self.warnings.push(warning.clone());
            }
        }
    }
}

/// Adds the time that `work` takes to `seconds`.
pub fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *seconds += Duration::as_secs_f64(&start.elapsed());
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_add_up_and_warnings_are_told_once() {
        let of = |n: u64| Stats {
            rays: n,
            photons: PhotonStats {
                global: MapStats { emitted: n, stored: 1, seen: Some(SeenStats { sampled: n, seen: 1 }) },
                ..PhotonStats::default()
            },
            warnings: vec![format!("{n} rays were given up"), "the same".to_owned()],
            peak_device_bytes: n,
            ..Stats::default()
        };
        let mut sum = of(3);
        sum.add(&Stats { warnings: vec!["7 rays were given up".into(), "another".into()], ..of(5) });
        assert_eq!((sum.rays, sum.peak_device_bytes, sum.photons.global.emitted), (8, 5, 8));
        assert_eq!(sum.photons.global.seen, Some(SeenStats { sampled: 8, seen: 2 }));
        assert_eq!(sum.warnings, ["3 rays were given up", "the same", "another"]);
    }

    #[test]
    fn lost_flux_is_the_mean_of_passes_and_the_sum_of_lights() {
        let of = |lost_to_bounce_limit: f64| Stats {
            rays: 1,
            photons: PhotonStats { lost_to_bounce_limit, ..PhotonStats::default() },
            ..Stats::default()
        };
        let mut lights = of(2.0);
        lights.add(&of(4.0));
        assert_eq!((lights.photons.lost_to_bounce_limit, lights.rays), (6.0, 2));
        let mut passes = lights;
        passes.add_pass(&of(9.0), 1);
        passes.add_pass(&of(3.0), 2);
        assert_eq!((passes.photons.lost_to_bounce_limit, passes.rays), (6.0, 4));
    }
}
