//! The camera pass: the picture's samples, tile by tile: camera rays to their visible points, direct light, and the
//! sum over each pixel's samples. Memory depends on the size of a tile alone.

use super::direct_light::DirectLighting;
use crate::{
    bvh::Media,
    error::{Error, Result},
    gpu::{Buffer, Gpu, Kernel},
    layout::{CameraTile, Counters, FirstHit, Gathered, MARGIN_CELL, MARGIN_SAMPLES, Path, TilePixel, VisiblePoint},
    passes::estimate::SharedPoints,
    scene::{Camera, Projection},
    settings::{Crop, Settings},
    upload::SceneBuffers,
};

/// Visible points that a tile has room for, without its margin.
const TILE_POINTS: u64 = 1 << 16;
/// Places for paths of a sample where the scene has dielectrics: both ways are followed at the first two interfaces.
const BRANCHES: u32 = 4;
/// Samples of one pixel that a tile holds at most.
const PIXEL_SAMPLES: u32 = 256;
/// Dispatches of direct light whose shadow rays are counted together: with one ray of each point they stay far below 2^32.
const DIRECT_STEPS_PER_READ: u32 = 1024;
/// Bounces handed to the device at once.
const BOUNCES_PER_SUBMISSION: u32 = 32;
/// Pixels of a tile at least.
const MIN_TILE_PIXELS: u32 = 64;

/// A part of the picture's samples.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// Pixels, a power of 2, in Morton order; some of them may lie outside the picture.
    pub pixels: u32,
    /// Pixel of the upper left corner.
    pub first_column: u32,
    pub first_row: u32,
    pub first_sample: u32,
    /// Samples of each pixel.
    pub samples: u32,
}

/// Kernels of the camera pass.
#[derive(Debug)]
pub struct CameraKernels {
    start: Kernel,
    advance: Kernel,
    trace: Kernel,
    direct: DirectLighting,
    resolve: Kernel,
}

impl CameraKernels {
    #[must_use]
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, settings: &Settings) -> Self {
        let sees_lights = f64::from(u8::from(settings.photons.mode.sees_lights()));
        Self {
            start: scene.kernel(gpu, "start_camera"),
            advance: Kernel::new(gpu, "advance_queue", &[]),
            trace: scene.kernel_with(gpu, "trace_camera", &[("SEES_LIGHTS", sees_lights)]),
            direct: DirectLighting::new(gpu, scene, settings.picture.light_samples),
            resolve: Kernel::new(gpu, "resolve", &[]),
        }
    }
}

/// Kernels and buffers of the camera pass.
#[derive(Debug)]
pub struct CameraTracer {
    kernels: CameraKernels,
    paths: Buffer,
    queues: [Buffer; 2],
    counters: Buffer,
    dispatch_arguments: Buffer,
    /// A [`VisiblePoint`] per place for a path, some of them not valid.
    pub points: Buffer,
    /// Radiance that reaches the camera from each visible point, `vec4f`.
    pub radiance: Buffer,
    /// What the last gather found at each visible point, [`Gathered`].
    pub gathered: Buffer,
    first_hits: Buffer,
    pixels: Buffer,
    filter_table: Buffer,
    view: CameraTile,
    window: Crop,
}

/// What one step did, for the statistics.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepCount {
    pub rays: u64,
    pub media_overflows: u64,
    pub unfinished: u64,
    pub non_finite: u64,
}

impl CameraTracer {
    /// All rays start inside of `media`, those around the middle of the camera.
    ///
    /// # Errors
    /// Limits of the adapter; a lens before an orthographic camera.
    pub fn new(
        gpu: &Gpu,
        scene: &SceneBuffers,
        camera: &Camera,
        media: Media,
        size: (u32, u32),
        settings: &Settings,
    ) -> Result<Self> {
        let branches = if scene.has_dielectrics { BRANCHES } else { 1 };
        let offsets = settings.picture.pixel_filter_offsets();
        let view =
            CameraTile { branches, filter_steps: offsets.len() as u32 - 1, media, ..view(camera, size, settings)? };
        let has_margin = settings.estimate.share_reach > 0.0 && settings.photons.mode.traces_photons();
        // Estimates that are shared need the cells around a tile.
        let margin = if has_margin { margin_cells(tile_sides(&view)) * MARGIN_SAMPLES } else { 0 };
        let samples = TILE_POINTS / u64::from(branches) + u64::from(margin);
        let places = samples * u64::from(branches);
        let queue = || gpu.storage::<u32>("camera queue", places);
        Ok(Self {
            kernels: CameraKernels::new(gpu, scene, settings),
            paths: gpu.storage::<Path>("camera paths", places)?,
            queues: [queue()?, queue()?],
            counters: gpu.storage::<Counters>("camera counters", 1)?,
            dispatch_arguments: gpu.storage::<[u32; 3]>("camera dispatch arguments", 1)?,
            points: gpu.storage::<VisiblePoint>("visible points", places)?,
            radiance: gpu.storage::<[f32; 4]>("radiance", places)?,
            gathered: gpu.storage::<Gathered>("gathered", TILE_POINTS)?,
            first_hits: gpu.storage::<FirstHit>("first hits", samples)?,
            pixels: gpu.storage::<TilePixel>("tile pixels", TILE_POINTS / u64::from(branches))?,
            filter_table: gpu.storage_with("pixel filter", &offsets)?,
            view: CameraTile { margin, ..view },
            window: settings.picture.window(size),
        })
    }

    /// The tiles of the whole picture that the asked part of it touches, in order: a tile is the same whatever the part, down to
    /// the last bit.
    #[must_use]
    pub fn tiles(&self) -> Vec<Tile> {
        let samples = self.view.spp.min(PIXEL_SAMPLES);
        let (width, height) = tile_sides(&self.view);
        let mut tiles = Vec::new();
        for first_row in (0..self.view.height).step_by(height as usize) {
            for first_column in (0..self.view.width).step_by(width as usize) {
                if !self.window.touches((first_column, first_row), (width, height)) {
                    continue;
                }
                for first_sample in (0..self.view.spp).step_by(samples as usize) {
                    let samples = samples.min(self.view.spp - first_sample);
                    tiles.push(Tile { pixels: width * height, first_column, first_row, first_sample, samples });
                }
            }
        }
        tiles
    }

    /// Visible points of a tile, at most, without its margin.
    #[must_use]
    pub fn point_count(&self, tile: &Tile) -> u32 {
        self.view.branches * tile.pixels * tile.samples
    }

    /// Visible points that any tile has at most, without its margin.
    #[must_use]
    pub fn room(&self) -> u64 {
        TILE_POINTS
    }

    /// What a tile's estimates are shared among.
    #[must_use]
    pub fn shared_points(&self, tile: &Tile) -> SharedPoints<'_> {
        SharedPoints {
            points: &self.points,
            pixels: tile.pixels,
            samples: tile.samples,
            branches: self.view.branches,
            margin: self.view.margin / MARGIN_SAMPLES,
            radiance: &self.radiance,
            gathered: &self.gathered,
        }
    }

    /// Column and row of the `i`-th pixel of a tile in the asked part of the picture; `None` outside.
    #[must_use]
    pub fn pixel(&self, tile: &Tile, i: u32) -> Option<(u32, u32)> {
        let even_bits = |i: u32| (0..16).fold(0, |sum, bit| sum | ((i >> bit) & (1 << bit)));
        let (x, y) = (tile.first_column + even_bits(i), tile.first_row + even_bits(i >> 1));
        let window = &self.window;
        let (x, y) = (x.checked_sub(window.column)?, y.checked_sub(window.row)?);
        (x < window.width && y < window.height).then_some((x, y))
    }

    /// Traces the tile's camera paths to their visible points; sets all radiance to 0.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn trace(&self, gpu: &Gpu, scene: &SceneBuffers, tile: &Tile) -> Result<StepCount> {
        let uniform = gpu.uniform("camera tile", &self.tile_view(tile));
        let own = [("tile", &uniform), ("points", &self.points), ("filter_table", &self.filter_table)];
        self.follow(
            gpu,
            scene,
            (&self.kernels.start, &own, tile.pixels * tile.samples + self.view.margin),
            (&self.kernels.trace, &own),
        )
    }

    /// Runs `start` in that many invocations and follows the paths that it starts with `trace`, each with its own buffers besides
    /// the paths'.
    pub(crate) fn follow<'b>(
        &'b self,
        gpu: &Gpu,
        scene: &'b SceneBuffers,
        (start, started, invocations): (&Kernel, &[(&'b str, &'b Buffer)], u32),
        (trace, followed): (&Kernel, &[(&'b str, &'b Buffer)]),
    ) -> Result<StepCount> {
        let named = |input: usize, own: &[(&'b str, &'b Buffer)]| {
            let shared = [
                ("paths", &self.paths),
                ("queue_in", &self.queues[input]),
                ("queue_out", &self.queues[1 - input]),
                ("counters", &self.counters),
                ("dispatch_arguments", &self.dispatch_arguments),
                ("first_hits", &self.first_hits),
                ("radiance", &self.radiance),
            ];
            scene.with(&[&shared, own].concat())
        };
        let advance = self.kernels.advance.bind(gpu, &named(0, &[]));
        let bindings = [0, 1].map(|input| trace.bind(gpu, &named(input, followed)));
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&self.counters, 0, None);
        start.dispatch(&mut encoder, &start.bind(gpu, &named(1, started)), invocations.into());
        let most = (u64::from(invocations) * u64::from(self.view.branches))
            .min(TILE_POINTS + u64::from(self.view.margin * self.view.branches));
        // The surface that ends the chain comes after max_bounces delta surfaces.
        let mut surfaces = 0;
        loop {
            for _ in 0..BOUNCES_PER_SUBMISSION.min(self.view.max_bounces + 1 - surfaces) {
                self.kernels.advance.dispatch(&mut encoder, &advance, 1);
                let bindings = &bindings[(surfaces % 2) as usize];
                trace.dispatch_indirect(&mut encoder, bindings, &self.dispatch_arguments, most);
                surfaces += 1;
            }
            gpu.submit(encoder);
            let counters: Counters = gpu.read(&self.counters, 0, 1)?[0];
            if counters.next == 0 || surfaces > self.view.max_bounces {
                return Ok(StepCount::from(counters));
            }
            encoder = gpu.encoder();
        }
    }

    /// Adds the light that reaches the tile's visible points straight from the lights.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn light_directly(&self, gpu: &Gpu, scene: &SceneBuffers, tile: &Tile) -> Result<StepCount> {
        let uniform = gpu.uniform("camera tile", &self.tile_view(tile));
        let buffers =
            [("tile", &uniform), ("points", &self.points), ("radiance", &self.radiance), ("counters", &self.counters)];
        let (steps, points) = (self.kernels.direct.steps(scene), self.point_count(tile));
        let mut count = StepCount::default();
        for first in (0..steps).step_by(DIRECT_STEPS_PER_READ as usize) {
            let mut encoder = gpu.encoder();
            encoder.clear_buffer(&self.counters, 0, None);
            for step in first..steps.min(first + DIRECT_STEPS_PER_READ) {
                self.kernels.direct.add(gpu, scene, &mut encoder, (step, points), &buffers);
            }
            gpu.submit(encoder);
            let counters: Counters = gpu.read(&self.counters, 0, 1)?[0];
            count += StepCount { rays: u64::from(counters.next), ..StepCount::from(counters) };
        }
        Ok(count)
    }

    /// Sums over the tile's samples of each of its pixels.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn resolve(&self, gpu: &Gpu, tile: &Tile) -> Result<Vec<TilePixel>> {
        let uniform = gpu.uniform("camera tile", &self.tile_view(tile));
        let bindings = self.kernels.resolve.bind(
            gpu,
            &[
                ("tile", &uniform),
                ("radiance", &self.radiance),
                ("first_hits", &self.first_hits),
                ("pixels", &self.pixels),
            ],
        );
        let mut encoder = gpu.encoder();
        self.kernels.resolve.dispatch(&mut encoder, &bindings, u64::from(tile.pixels));
        gpu.submit(encoder);
        gpu.read(&self.pixels, 0, u64::from(tile.pixels))
    }

    pub(crate) fn tile_view(&self, tile: &Tile) -> CameraTile {
        CameraTile {
            first_column: tile.first_column,
            first_row: tile.first_row,
            pixels: tile.pixels,
            first_sample: tile.first_sample,
            samples: tile.samples,
            ..self.view
        }
    }
}

impl std::ops::AddAssign for StepCount {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.media_overflows += other.media_overflows;
        self.unfinished += other.unfinished;
        self.non_finite += other.non_finite;
    }
}

impl From<Counters> for StepCount {
    fn from(counters: Counters) -> Self {
        Self {
            rays: counters.all_rays(),
            media_overflows: u64::from(counters.media_overflows),
            unfinished: u64::from(counters.unfinished),
            non_finite: u64::from(counters.non_finite),
        }
    }
}

/// Pixels along the sides of each tile, powers of 2.
fn tile_sides(view: &CameraTile) -> (u32, u32) {
    let pixels = (TILE_POINTS as u32 / (view.branches * view.spp.min(PIXEL_SAMPLES))).max(MIN_TILE_PIXELS);
    let side_bits = |side: u32| side.next_power_of_two().ilog2();
    let needed = 2 * side_bits(view.width.max(view.height)).max(MIN_TILE_PIXELS.ilog2() / 2);
    let bits = pixels.ilog2().min(needed);
    (1 << bits.div_ceil(2), 1 << (bits / 2))
}

/// Cells around a tile.
fn margin_cells((width, height): (u32, u32)) -> u32 {
    2 * (width / MARGIN_CELL + 2) + 2 * (height / MARGIN_CELL)
}

/// The camera for a picture of that size: the vertical angle is kept, the horizontal one follows from the aspect.
fn view(camera: &Camera, (width, height): (u32, u32), settings: &Settings) -> Result<CameraTile> {
    let parallel = matches!(camera.projection, Projection::Orthographic { .. });
    if parallel && settings.picture.aperture > 0.0 {
        let problem = "needs a perspective camera; this one is orthographic".to_owned();
        return Err(Error::Setting { name: "aperture", value: settings.picture.aperture.to_string(), problem });
    }
    let half_height = camera.half_height_at(1.0, (width, height));
    let half_width = half_height * width as f32 / height as f32;
    Ok(CameraTile {
        position: camera.position.to_array(),
        seed: settings.photons.seed,
        right: (camera.right * half_width).to_array(),
        width,
        up: (camera.up * half_height).to_array(),
        height,
        forward: camera.forward.to_array(),
        spp: settings.picture.spp,
        max_bounces: settings.photons.bounce_limit(),
        parallel: u32::from(parallel),
        lens_radius: 0.5 * settings.picture.aperture,
        focus: settings.picture.focus.unwrap_or(1.0),
        ..Default::default()
    })
}
