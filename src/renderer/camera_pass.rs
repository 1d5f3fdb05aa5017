//! The second pass step by step: tiles of camera samples, and the film that sums them.

use glam::Vec3;

use super::{Session, count_faults, picture_size};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu},
    image::{Frame, PlaceInWhole},
    layout::{TilePixel, VisiblePoint},
    passes::{CameraTracer, FinalGather, GatherSettings, StepCount, Tile},
    settings::{Crop, Settings},
    stats::{Stats, timed},
    upload::SceneBuffers,
};

/// A picture under way. For each tile: [`Self::trace`], then light is added to the radiance of its visible points,
/// then [`Self::resolve`].
pub(crate) struct CameraPass<'a> {
    pub gpu: &'a Gpu,
    buffers: &'a SceneBuffers,
    /// Holds the visible points and the radiance of the tile that was traced last.
    pub tracer: CameraTracer,
    /// If the settings ask for it.
    final_gather: Option<FinalGather>,
    /// The radiance estimate that the settings ask for.
    pub estimate: GatherSettings,
    size: (u32, u32),
    window: Crop,
    direct: bool,
}

impl<'a> CameraPass<'a> {
    pub fn new(session: &'a Session<'a>, settings: &Settings) -> Result<Self> {
        settings.check()?;
        let number = session.scene.camera_number(settings.picture.camera.as_deref())?;
        let (camera, media) = (&session.scene.cameras[number], session.camera_media[number]);
        let size = picture_size(camera, settings)?;
        let (gpu, buffers) = (session.gpu, &session.buffers);
        let tracer = CameraTracer::new(gpu, buffers, camera, media, size, settings)?;
        let rays = Some(settings.photons.final_gather).filter(|rays| *rays > 0);
        Ok(Self {
            gpu,
            buffers,
            final_gather: rays.map(|rays| FinalGather::new(gpu, buffers, &tracer, rays)).transpose()?,
            tracer,
            estimate: GatherSettings::from(&settings.estimate),
            size,
            window: settings.picture.window(size),
            direct: settings.photons.mode.direct_by_rays(),
        })
    }

    /// An empty film of the asked part of the picture.
    pub fn film(&self) -> Film {
        Film::new(self.size, self.window)
    }

    /// Camera rays to the tile's visible points, and direct light there if the mode takes it from shadow rays.
    pub fn trace(&self, tile: &Tile, stats: &mut Stats) -> Result<()> {
        let (gpu, buffers) = (self.gpu, self.buffers);
        let count = timed(&mut stats.seconds.camera, || self.tracer.trace(gpu, buffers, tile))?;
        stats.non_finite.camera += count.non_finite;
        add_step(stats, count);
        if self.direct {
            let count = timed(&mut stats.seconds.direct, || self.tracer.light_directly(gpu, buffers, tile))?;
            stats.non_finite.direct += count.non_finite;
            add_step(stats, count);
        }
        Ok(())
    }

    /// Rays of final gathering per visible point; 0 without.
    pub fn final_rays(&self) -> u32 {
        self.final_gather.as_ref().map_or(0, FinalGather::rays)
    }

    /// Traces one ray of final gathering from each of the tile's visible points; returns what they see.
    pub fn trace_final(&self, tile: &Tile, ray: u32) -> Result<(&Buffer, StepCount)> {
        let gather = self.final_gather.as_ref().expect("the settings ask for it");
        Ok((&gather.seen, gather.trace(self.gpu, self.buffers, &self.tracer, tile, ray)?))
    }

    /// The tile's visible points, some of them not valid.
    pub fn points(&self, tile: &Tile) -> Result<Vec<VisiblePoint>> {
        self.gpu.read(&self.tracer.points, 0, self.tracer.point_count(tile).into())
    }

    /// Radiance from each of them so far.
    pub fn radiance(&self, tile: &Tile) -> Result<Vec<[f32; 4]>> {
        self.gpu.read(&self.tracer.radiance, 0, self.tracer.point_count(tile).into())
    }

    /// Replaces it.
    pub fn set_radiance(&self, radiance: &[[f32; 4]]) {
        self.gpu.write(&self.tracer.radiance, 0, radiance);
    }

    /// Sums the tile's radiance into the film.
    pub fn resolve(&self, tile: &Tile, film: &mut Film) -> Result<()> {
        film.add(&self.tracer, tile, &self.tracer.resolve(self.gpu, tile)?);
        Ok(())
    }
}

/// Sums over samples, on the host: device memory does not grow with the picture.
pub(crate) struct Film {
    /// The whole picture, and the part of it that is here.
    whole: (u32, u32),
    window: Crop,
    sums: Vec<TilePixel>,
    /// Samples that are not in the sums, as these would not be finite with them.
    pub non_finite: u64,
}

impl Film {
    fn new(whole: (u32, u32), window: Crop) -> Self {
        let pixels = window.width as usize * window.height as usize;
        Self { whole, window, sums: vec![TilePixel::default(); pixels], non_finite: 0 }
    }

    fn add(&mut self, tracer: &CameraTracer, tile: &Tile, pixels: &[TilePixel]) {
        for (i, pixel) in (0..).zip(pixels) {
            let Some((x, y)) = tracer.pixel(tile, i) else { continue };
            let sum = &mut self.sums[y as usize * self.window.width as usize + x as usize];
            let add = |a: &mut [f32; 3], b: [f32; 3]| *a = (Vec3::from(*a) + Vec3::from(b)).to_array();
            self.non_finite += u64::from(pixel.non_finite);
            if (Vec3::from(sum.radiance) + Vec3::from(pixel.radiance)).is_finite() {
                add(&mut sum.radiance, pixel.radiance);
            } else {
                self.non_finite += u64::from(tile.samples);
            }
            add(&mut sum.normal, pixel.normal);
            add(&mut sum.albedo, pixel.albedo);
            sum.alpha += pixel.alpha;
            sum.depth += pixel.depth;
        }
    }

    /// Means: of radiance and coverage over all samples, of the rest over those that hit something.
    pub fn finish(self, spp: u32) -> Frame {
        let per_sample = 1.0 / spp as f32;
        let per_hit = |p: &TilePixel| if p.alpha > 0.0 { 1.0 / p.alpha } else { 0.0 };
        let scaled = |v: [f32; 3], s: f32| (Vec3::from(v) * s).to_array();
        Frame {
            width: self.window.width,
            height: self.window.height,
            place: PlaceInWhole::of(self.whole, self.window),
            radiance: self.sums.iter().map(|p| scaled(p.radiance, per_sample)).collect(),
            alpha: self.sums.iter().map(|p| p.alpha * per_sample).collect(),
            depth: self.sums.iter().map(|p| p.depth * per_hit(p)).collect(),
            normal: self.sums.iter().map(|p| scaled(p.normal, per_hit(p))).collect(),
            albedo: self.sums.iter().map(|p| scaled(p.albedo, per_hit(p))).collect(),
        }
    }
}

pub(super) fn add_step(stats: &mut Stats, count: StepCount) {
    stats.rays += count.rays;
    count_faults(stats, count.media_overflows, count.unfinished);
}
