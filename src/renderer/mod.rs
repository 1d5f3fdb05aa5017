//! Two-pass photon mapping (Jensen 1996, "Global Illumination Using Photon Maps"), in one screen: [`render`].
//!
//! [`Session`] holds its steps one by one, for those who make several pictures of the same photons.

mod camera_pass;
mod searcher;

use std::time::Instant;

pub(crate) use camera_pass::CameraPass;
use searcher::Searcher;

use crate::{
    bvh::{Bvh, Media, MediaProbe, packed, too_deep},
    emitters::LightGroup,
    error::{Error, Result},
    gpu::Gpu,
    image::Frame,
    memory::available,
    passes::{CameraKernels, EstimateSharing, Gather, GatherOptions, MapKernels, PhotonMap, PhotonTracer, RawMap},
    progress::{Progress, Stage},
    scene::{Camera, Scene},
    settings::{Crop, Search, Settings},
    stats::{DeviceStats, LightStats, MapStats, NonFinite, Stats, timed},
    upload::SceneBuffers,
};

/// Height of a picture whose size was not asked for.
const DEFAULT_HEIGHT: u32 = 512;
/// Pixels of the largest picture.
const MAX_PIXELS: u64 = 1 << 28;
/// Host memory that a pixel takes: sums, all layers of the frame, and the file of these before it is written, bytes.
const BYTES_PER_PIXEL: u64 = 160;

/// A finished render.
#[derive(Clone, Debug)]
pub struct Render {
    pub frame: Frame,
    pub stats: Stats,
}

/// Renders the scene. The seconds of `load` are the caller's to add.
///
/// # Errors
/// A setting out of its range, a scene without light or without anything to draw, a limit of the adapter, a fault of
/// the driver, or [`Error::Stopped`].
pub fn render(gpu: &Gpu, scene: &Scene, settings: &Settings, progress: &dyn Progress) -> Result<Render> {
    let start = Instant::now();
    let session = Session::open(gpu, scene, settings, progress)?;
    session.compile_ahead(settings);
    let maps = session.photon_maps(settings, progress)?;
    let mut render = session.picture(&maps, settings, progress)?;
    render.stats.seconds.total = start.elapsed().as_secs_f64();
    Ok(render)
}

/// A scene on the device. Photons are traced once for each call of [`Self::photon_maps`]; any number of pictures
/// can be made of the same maps.
#[derive(Debug)]
pub struct Session<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    buffers: SceneBuffers,
    /// What the scene's cameras are inside of.
    camera_media: Vec<Media>,
    stats: Stats,
}

/// The photons of a first pass on the device: the global and the caustic map, those of them that hold a photon.
#[derive(Debug)]
pub struct PhotonMaps {
    maps: Vec<PhotonMap>,
    /// Global maps, 0 or 1; they come first.
    global: usize,
    stats: Stats,
}

impl PhotonMaps {
    /// The maps, the global one first; none if no photon was traced or stored.
    #[must_use]
    pub fn maps(&self) -> &[PhotonMap] {
        &self.maps
    }

    /// The global map alone, or the caustic map alone, for pictures of its part of the light.
    #[doc(hidden)]
    #[must_use]
    pub fn only(mut self, global: bool) -> Self {
        let caustic = self.maps.split_off(self.global);
        if !global {
            self.maps = caustic;
            self.global = 0;
        }
        self
    }

    /// What happened up to here: the session's stages and the first pass.
    #[must_use]
    pub fn stats(&self) -> &Stats {
        &self.stats
    }
}

impl<'a> Session<'a> {
    /// Puts the scene on the device. What the settings say of lights (`light_sampling`, `light_photons`, `light_unit`) holds for the whole session; the
    /// others are only checked, so that a wrong one fails before the work. The peak of device memory counts from here.
    ///
    /// # Errors
    /// As [`render`].
    pub fn open(gpu: &'a Gpu, scene: &'a Scene, settings: &Settings, progress: &dyn Progress) -> Result<Self> {
        settings.check()?;
        scene.check_renderable()?;
        picture_size(scene.camera(settings.picture.camera.as_deref())?, settings)?;
        let mut stats = Stats {
            device: DeviceStats { name: gpu.name.clone(), driver: gpu.driver.clone() },
            warnings: scene.warnings.clone(),
            ..Stats::default()
        };
        gpu.memory.restart_peak();
        progress.report(Stage::Bvh, 0, 1);
        let bvh = timed(&mut stats.seconds.bvh, || Bvh::build(scene));
        let buffers = SceneBuffers::new(gpu, scene, &bvh, settings)?;
        stats.warnings.extend(buffers.lights.warnings.iter().cloned());
        let probe = MediaProbe::new(scene, &bvh);
        let around = scene.cameras.iter().map(|camera| packed(&probe.at(camera.position.as_dvec3())));
        let (camera_media, fits): (Vec<Media>, Vec<bool>) = around.unzip();
        stats.warnings.extend(too_deep("cameras", fits.iter().filter(|fits| !**fits).count()));
        Ok(Self { gpu, scene, buffers, camera_media, stats })
    }

    /// Has the kernels compiled that a picture by these settings needs, in their order, while the first of them run. Those of final
    /// gathering, and any that were not asked for here, are compiled when they are needed.
    pub fn compile_ahead(&self, settings: &Settings) {
        let (gpu, scene) = (self.gpu, &self.buffers);
        if settings.photons.mode.traces_photons() {
            drop((PhotonTracer::new(gpu, scene), MapKernels::new(gpu)));
        }
        drop(CameraKernels::new(gpu, scene, settings));
        if settings.photons.mode.traces_photons() && settings.estimate.search != Search::KdTree {
            drop(EstimateSharing::new(gpu, settings.estimate.share_reach));
            self.gather(settings).compile_ahead(gpu, &(&settings.estimate).into());
        }
    }

    /// First pass: photons leave the lights and are stored in a global and a caustic map, as `mode`, the photon
    /// counts, `max_bounces` and `seed` of the settings say.
    ///
    /// # Errors
    /// As [`render`].
    pub fn photon_maps(&self, settings: &Settings, progress: &dyn Progress) -> Result<PhotonMaps> {
        settings.check()?;
        let (gpu, mut stats) = (self.gpu, self.stats.clone());
        if !settings.photons.mode.traces_photons() {
            return Ok(PhotonMaps { maps: Vec::new(), global: 0, stats });
        }
        let caustics = self.scene.has_delta();
        let traced = timed(&mut stats.seconds.photons, || {
            PhotonTracer::new(gpu, &self.buffers).trace(gpu, &self.buffers, settings, caustics, progress)
        })?;
        stats.rays += traced.rays;
        stats.photons.global = map_stats(&traced.global);
        stats.photons.caustic = map_stats(&traced.caustic);
        stats.photons.lost_to_bounce_limit = traced.lost;
        stats.photons.lights = light_stats(&self.buffers, &traced.of_lights);
        count_faults(&mut stats, traced.media_overflows, traced.unfinished);
        stats.non_finite.photons += traced.non_finite;
        stats.warnings.extend(traced.warnings);
        progress.report(Stage::Grid, 0, 1);
        let global = usize::from(traced.global.stored > 0);
        let maps = timed(&mut stats.seconds.grid, || {
            let kernels = MapKernels::new(gpu);
            let maps = [traced.global, traced.caustic].into_iter().filter(|map| map.stored > 0);
            let build = |map: RawMap| PhotonMap::build(gpu, &kernels, map.photons, map.stored as u32, map.emitted);
            maps.map(build).collect::<Result<_>>()
        })?;
        Ok(PhotonMaps { maps, global, stats })
    }

    /// Second pass: camera rays, direct light and the radiance estimate, tile by tile. `mode` is that of the maps; what
    /// concerns the picture alone (`neighbors`, `kernel`, `cone_constant`, `max_radius`, `search`, `spp`, `size`, `camera`) is free. Maps
    /// for final gathering are of no use without it, nor others with it. The
    /// statistics are those of the maps and of this picture; `total` is their sum.
    ///
    /// # Errors
    /// As [`render`].
    pub fn picture(&self, maps: &PhotonMaps, settings: &Settings, progress: &dyn Progress) -> Result<Render> {
        let mut stats = maps.stats.clone();
        let pass = CameraPass::new(self, settings)?;
        let mut searcher = timed(&mut stats.seconds.grid, || Searcher::new(self, maps, settings))?;
        let mut film = pass.film();
        let tiles = pass.tracer.tiles();
        for (done, tile) in tiles.iter().enumerate() {
            progress.check()?;
            progress.report(Stage::Camera, done as u64, tiles.len() as u64);
            pass.trace(tile, &mut stats)?;
            let count = timed(&mut stats.seconds.gather, || searcher.gather(&pass, maps, tile, progress))?;
            stats.non_finite.gather += count.non_finite;
            camera_pass::add_step(&mut stats, count);
            pass.resolve(tile, &mut film)?;
        }
        progress.report(Stage::Camera, tiles.len() as u64, tiles.len() as u64);
        stats.non_finite.film += film.non_finite;
        self.close(&mut stats);
        Ok(Render { frame: film.finish(settings.picture.spp), stats })
    }

    /// The gather of the estimate that the settings ask for.
    pub(crate) fn gather(&self, settings: &Settings) -> Gather<'_> {
        if settings.estimate.raw {
            return Gather::new(self.gpu, GatherOptions::default());
        }
        Gather::over(self.gpu, &self.buffers, GatherOptions::flat())
    }

    /// What can be said of a picture only when it is finished.
    pub(crate) fn close(&self, stats: &mut Stats) {
        warn_of_faults(stats);
        stats.peak_device_bytes = self.gpu.memory.peak();
        let s = &mut stats.seconds;
        s.total = s.bvh + s.photons + s.grid + s.camera + s.direct + s.gather;
    }
}

/// The asked size of the whole picture, or the default height at the camera's aspect.
pub(crate) fn picture_size(camera: &Camera, settings: &Settings) -> Result<(u32, u32)> {
    let (width, height) = settings.picture.size.unwrap_or_else(|| {
        let width = (DEFAULT_HEIGHT as f32 * camera.aspect.unwrap_or(1.0)).round();
        ((width as u32).max(1), DEFAULT_HEIGHT)
    });
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(Error::Setting {
            name: "size",
            value: format!("{width}x{height}"),
            problem: format!("must have from 1 to {MAX_PIXELS} pixels"),
        });
    }
    if let Some(Crop { column, row, width: w, height: h }) = settings.picture.crop {
        let inside = |first: u32, size: u32, whole: u32| size > 0 && first < whole && size <= whole - first;
        if !inside(column, w, width) || !inside(row, h, height) {
            return Err(Error::Setting {
                name: "crop",
                value: format!("{column},{row},{w},{h}"),
                problem: format!("must have pixels, all of them in the picture of {width}x{height}"),
            });
        }
    }
    let Crop { width: w, height: h, .. } = settings.picture.window((width, height));
    let needed = BYTES_PER_PIXEL * u64::from(w) * u64::from(h);
    if let Some(free) = available().filter(|free| needed > *free) {
        return Err(Error::Setting {
            name: "size",
            value: format!("{width}x{height}"),
            problem: format!(
                "needs about {} MiB of memory, {} MiB are free; ask for a smaller --size, or for parts of it with --crop",
                needed >> 20,
                free >> 20
            ),
        });
    }
    Ok((width, height))
}

fn map_stats(map: &RawMap) -> MapStats {
    MapStats { emitted: map.emitted, stored: map.stored }
}

fn light_stats(buffers: &SceneBuffers, photons: &[u32]) -> Vec<LightStats> {
    let groups = buffers.lights.table.groups.iter().zip(photons);
    let stats = |(group, photons): (&LightGroup, &u32)| LightStats {
        name: group.name.clone(),
        kind: group.kind.to_owned(),
        power: group.power.to_array(),
        photons: u64::from(*photons),
    };
    groups.map(stats).collect()
}

fn count_faults(stats: &mut Stats, media_overflows: u64, unfinished: u64) {
    stats.media_overflows += media_overflows;
    stats.unfinished_rays += unfinished;
}

/// Says what was counted along the way and takes light from the picture.
fn warn_of_faults(stats: &mut Stats) {
    if stats.unfinished_rays > 0 {
        stats
            .warnings
            .push(format!("{} rays were given up after their loop budget; their light is lost", stats.unfinished_rays));
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
            "paths entered more than {} nested media {} times; the outer ones count there",
            crate::layout::MEDIA_DEPTH,
            stats.media_overflows
        ));
    }
}
