//! Two-pass photon mapping (Jensen 1996, "Global Illumination Using Photon Maps"), in one screen: [`render`].

use std::time::Instant;

use glam::Vec3;

use crate::{
    bvh::Bvh,
    error::{Error, Result},
    gpu::Gpu,
    image::Frame,
    layout::TilePixel,
    passes::{
        CameraTracer, Gather, GatherOptions, GatherSettings, MapKernels, PhotonMap, PhotonTracer, RawMap, SceneBuffers,
        StepCount, Tile,
    },
    progress::{Progress, Stage},
    scene::{Camera, Scene},
    settings::Settings,
    stats::{DeviceStats, MapStats, Stats, timed},
};

/// Height of a picture whose size was not asked for.
const DEFAULT_HEIGHT: u32 = 512;
/// Pixels of the largest picture.
const MAX_PIXELS: u64 = 1 << 28;

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
    settings.check()?;
    scene.check_renderable()?;
    let camera = scene.camera(settings.camera.as_deref())?;
    let size = picture_size(camera, settings)?;
    let mut stats = Stats {
        device: DeviceStats { name: gpu.name.clone(), driver: gpu.driver.clone() },
        warnings: scene.warnings.clone(),
        ..Stats::default()
    };
    gpu.memory.restart_peak();

    progress.report(Stage::Bvh, 0, 1);
    let bvh = timed(&mut stats.seconds.bvh, || Bvh::build(scene));
    let buffers = SceneBuffers::new(gpu, scene, &bvh, settings)?;
    drop(bvh);
    let maps = photon_maps(gpu, scene, &buffers, settings, progress, &mut stats)?;
    let frame = picture(gpu, &buffers, &maps, camera, size, settings, progress, &mut stats)?;

    warn_of_faults(&mut stats);
    stats.peak_device_bytes = gpu.memory.peak();
    stats.seconds.total = start.elapsed().as_secs_f64();
    Ok(Render { frame, stats })
}

/// First pass: photons leave the lights and are stored in a global and a caustic map.
fn photon_maps(
    gpu: &Gpu,
    scene: &Scene,
    buffers: &SceneBuffers,
    settings: &Settings,
    progress: &dyn Progress,
    stats: &mut Stats,
) -> Result<Vec<PhotonMap>> {
    if !settings.mode.traces_photons() {
        return Ok(Vec::new());
    }
    let caustics = scene.has_delta();
    let traced = timed(&mut stats.seconds.photons, || {
        PhotonTracer::new(gpu, buffers).trace(gpu, buffers, settings, caustics, progress)
    })?;
    stats.rays += traced.rays;
    stats.photons.global = map_stats(&traced.global);
    stats.photons.caustic = map_stats(&traced.caustic);
    stats.photons.lost_to_bounce_limit = traced.lost;
    count_faults(stats, traced.media_overflows, traced.unfinished);
    stats.warnings.extend(traced.warnings);
    progress.report(Stage::Grid, 0, 1);
    timed(&mut stats.seconds.grid, || {
        let kernels = MapKernels::new(gpu);
        let maps = [traced.global, traced.caustic].into_iter().filter(|map| map.stored > 0);
        let build = |map: RawMap| PhotonMap::build(gpu, &kernels, map.photons, map.stored as u32, map.emitted);
        maps.map(build).collect()
    })
}

/// Second pass: camera rays, direct light and the radiance estimate, tile by tile.
#[expect(clippy::too_many_arguments, reason = "all that the first pass and the caller know meets here")]
fn picture(
    gpu: &Gpu,
    buffers: &SceneBuffers,
    maps: &[PhotonMap],
    camera: &Camera,
    size: (u32, u32),
    settings: &Settings,
    progress: &dyn Progress,
    stats: &mut Stats,
) -> Result<Frame> {
    let tracer = CameraTracer::new(gpu, buffers, camera, size, settings)?;
    let mut gather = Gather::new(gpu, GatherOptions::default());
    let estimate = GatherSettings {
        neighbors: settings.neighbors,
        cone_constant: settings.cone_constant,
        max_radius: settings.max_radius,
    };
    let mut film = Film::new(size);
    let tiles = tracer.tiles();
    for (done, tile) in tiles.iter().enumerate() {
        progress.check()?;
        progress.report(Stage::Camera, done as u64, tiles.len() as u64);
        let count = timed(&mut stats.seconds.camera, || tracer.trace(gpu, buffers, tile))?;
        add_step(stats, count);
        if settings.mode.direct_by_rays() {
            let count = timed(&mut stats.seconds.direct, || tracer.light_directly(gpu, buffers, tile))?;
            add_step(stats, count);
        }
        for map in maps {
            timed(&mut stats.seconds.gather, || {
                let points = tracer.point_count(tile);
                let results = (&tracer.radiance, &tracer.gathered);
                gather.run(gpu, map, &tracer.points, points, &estimate, results, progress)
            })?;
        }
        film.add(&tracer, tile, &tracer.resolve(gpu, tile)?);
    }
    progress.report(Stage::Camera, tiles.len() as u64, tiles.len() as u64);
    Ok(film.finish(settings.spp))
}

/// Sums over samples, on the host: device memory does not grow with the picture.
struct Film {
    size: (u32, u32),
    sums: Vec<TilePixel>,
}

impl Film {
    fn new(size: (u32, u32)) -> Self {
        Self { size, sums: vec![TilePixel::default(); size.0 as usize * size.1 as usize] }
    }

    fn add(&mut self, tracer: &CameraTracer, tile: &Tile, pixels: &[TilePixel]) {
        for (i, pixel) in (0..).zip(pixels) {
            let Some((x, y)) = tracer.pixel(tile, i) else { continue };
            let sum = &mut self.sums[y as usize * self.size.0 as usize + x as usize];
            let add = |a: &mut [f32; 3], b: [f32; 3]| *a = (Vec3::from(*a) + Vec3::from(b)).to_array();
            add(&mut sum.radiance, pixel.radiance);
            add(&mut sum.normal, pixel.normal);
            add(&mut sum.albedo, pixel.albedo);
            sum.alpha += pixel.alpha;
            sum.depth += pixel.depth;
        }
    }

    /// Means: of radiance and coverage over all samples, of the rest over those that hit something.
    fn finish(self, spp: u32) -> Frame {
        let per_sample = 1.0 / spp as f32;
        let per_hit = |p: &TilePixel| if p.alpha > 0.0 { 1.0 / p.alpha } else { 0.0 };
        let scaled = |v: [f32; 3], s: f32| (Vec3::from(v) * s).to_array();
        Frame {
            width: self.size.0,
            height: self.size.1,
            radiance: self.sums.iter().map(|p| scaled(p.radiance, per_sample)).collect(),
            alpha: self.sums.iter().map(|p| p.alpha * per_sample).collect(),
            depth: self.sums.iter().map(|p| p.depth * per_hit(p)).collect(),
            normal: self.sums.iter().map(|p| scaled(p.normal, per_hit(p))).collect(),
            albedo: self.sums.iter().map(|p| scaled(p.albedo, per_hit(p))).collect(),
        }
    }
}

/// The asked size, or the default height at the camera's aspect.
fn picture_size(camera: &Camera, settings: &Settings) -> Result<(u32, u32)> {
    let (width, height) = settings.size.unwrap_or_else(|| {
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
    Ok((width, height))
}

fn map_stats(map: &RawMap) -> MapStats {
    MapStats { emitted: map.emitted, stored: map.stored }
}

fn add_step(stats: &mut Stats, count: StepCount) {
    stats.rays += count.rays;
    count_faults(stats, count.media_overflows, count.unfinished);
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
    if stats.media_overflows > 0 {
        stats.warnings.push(format!(
            "paths entered more than {} nested media {} times; the outer ones count there",
            crate::layout::MEDIA_DEPTH,
            stats.media_overflows
        ));
    }
}
