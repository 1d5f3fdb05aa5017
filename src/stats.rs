//! Statistics of a render, for scripts: the `--stats` file.

use std::time::{Duration, Instant};

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
    /// Flux in W that the limits of bounces took, mean of the channels, over all emitted paths.
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

/// Adapter and driver.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DeviceStats {
    /// Name of the adapter.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
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
    /// Times that more solids met in one place than are told apart.
    pub media_overflows: u64,
    /// Rays abandoned when the loop budget was spent; their light is lost.
    pub unfinished_rays: u64,
    /// Infinite or NaN values that were left out.
    #[serde(default)]
    pub non_finite: NonFinite,
    /// Peak device memory of buffers, bytes.
    pub peak_device_bytes: u64,
    /// Warnings for the user, one line each.
    pub warnings: Vec<String>,
}

/// Adds the time that `work` takes to `seconds`.
pub fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *seconds += Duration::as_secs_f64(&start.elapsed());
    result
}
