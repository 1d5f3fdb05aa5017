//! The camera pass renders the picture's samples, tile by tile. It traces camera rays to their
//! visible points, adds direct light, and sums over each pixel's samples. Memory depends only on
//! the size of a tile.

use glam::Vec3;

use super::{
    bright_places::BrightPlaces,
    camera_kernels::CameraKernels,
    direct_light::DirectLighting,
    tile::{StepCount, Tile, margin_cells, room_for, tile_sides},
    view::{UNCLIPPED, view},
};
use crate::{
    bvh::Media,
    emitters::lamps_in_glass::LampsInGlass,
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{
        self, BrightPatch, CameraTile, Counters, FirstHit, Gathered, LobePoint, MARGIN_SAMPLES, MAX_PATCHES, PixelSums,
        VisiblePoint,
    },
    passes::{
        estimate::SharedPoints,
        wavefront::{Step, Wavefront},
    },
    scene::Camera,
    settings::{Crop, PhotonSettings, PictureSettings, PixelGrid, first_extra_sample, square_bits},
    upload::SceneBuffers,
};

/// Path slots per sample if the scene has dielectrics: reflection and refraction are both followed
/// at the first two interfaces.
const BRANCHES: u32 = 4;
/// Path slots per sample if the scene has veils, or glass in a picture of an environment, small
/// bright parts of which a faint reflection would find by chance: enough for the four walls of a
/// hollow vessel.
const MANY_BRANCHES: u32 = 8;
/// Dispatches of direct light per readback of the counter of shadow rays. With one ray per point
/// and dispatch, it stays far below 2^32.
const DIRECT_STEPS_PER_READ: u32 = 1024;
/// Surfaces before the near plane that a ray passes at most.
const MAX_UNSEEN: u32 = 1 << 12;

/// Kernels and buffers of the camera pass.
#[derive(Debug)]
pub struct CameraTracer {
    kernels: CameraKernels,
    pub(super) wavefront: Wavefront,
    /// A [`VisiblePoint`] per path slot; some slots have no point.
    pub points: Buffer,
    /// Radiance that reaches the camera from each visible point, `vec4f`.
    pub radiance: Buffer,
    /// Result of the last gather at each visible point, [`Gathered`].
    pub gathered: Buffer,
    first_hits: Buffer,
    /// A [`LobePoint`] per path slot, if the scene has rough lobes.
    lobe_points: Buffer,
    /// Sums over the samples of each pixel, [`LAYER_ROWS`] + 1 rows a pixel.
    pixel_rows: Buffer,
    filter_table: Buffer,
    /// The bright patches that rays are aimed at.
    patches: Buffer,
    lamps: LampsInGlass,
    pub(super) view: CameraTile,
    pub(super) window: Crop,
    /// Index of the first sample beyond those that every pixel has.
    pub(super) first_extra: u32,
    /// Samples of a pixel at most besides those of every pixel.
    extra: u32,
    /// Maximum number of visible points of a tile, without its margin.
    pub(super) room: u64,
}

impl CameraTracer {
    /// `media`: the media around the camera's centre, in which all rays start. `shares`: points
    /// share estimates, for which a tile needs a margin.
    ///
    /// # Errors Limits of the adapter; a lens on an orthographic camera.
    pub fn new(
        gpu: &Gpu,
        scene: &SceneBuffers,
        (camera, media): (&Camera, Media),
        size: (u32, u32),
        photons: &PhotonSettings,
        picture: &PictureSettings,
        shares: bool,
    ) -> Result<Self> {
        let branches = match scene.splits {
            true if scene.has_environment_map => MANY_BRANCHES,
            _ if scene.has_veils() => MANY_BRANCHES,
            true => BRANCHES,
            false => 1,
        };
        let offsets = picture.pixel_filter_offsets();
        let view = CameraTile {
            branches,
            filter_steps: offsets.len() as u32 - 1,
            media,
            merges_layers: u32::from(photons.final_gather > 0),
            ..view(camera, size, photons, picture)?
        };
        let room = room_for(&view, gpu.batch, photons.final_gather);
        let margin = if shares { margin_cells(tile_sides(&view, room)) * MARGIN_SAMPLES } else { 0 };
        let samples = room / u64::from(branches) + u64::from(margin);
        let slots = samples * u64::from(branches);
        let keys = if photons.final_gather > 0 { room } else { 0 };
        let tracer = Self {
            kernels: CameraKernels::new(gpu, scene, photons, picture.light_samples),
            wavefront: Wavefront::new(gpu, scene, "camera", (slots, room / u64::from(branches)), keys)?,
            points: gpu.storage::<VisiblePoint>("visible points", slots)?,
            radiance: gpu.storage::<[f32; 4]>("radiance", slots)?,
            gathered: gpu.storage::<Gathered>("gathered", room)?,
            first_hits: gpu.storage::<FirstHit>("first hits", samples)?,
            lobe_points: gpu.storage::<LobePoint>("lit lobes", if scene.materials.has_rough { slots } else { 1 })?,
            pixel_rows: gpu.storage::<PixelSums>("sums of pixels", room / u64::from(branches))?,
            filter_table: gpu.storage_with("pixel filter", &offsets)?,
            patches: gpu.uniform("bright patches", &[BrightPatch::default(); MAX_PATCHES]),
            lamps: scene.lights.lamps.clone(),
            first_extra: first_extra_sample(photons, picture),
            extra: picture.extra_samples(),
            view: CameraTile { margin, square_bits: square_bits(photons, picture), ..view },
            window: picture.window(size),
            room,
        };
        Ok(tracer.aiming_at(gpu, &BrightPlaces::default()))
    }

    /// Has parallel rays start at a depth below 0, where `media` of [`Self::new`] are; the camera
    /// sees what it saw before.
    #[must_use]
    pub fn starting_at(self, depth: f32) -> Self {
        let near_depth = if self.view.near_depth == UNCLIPPED { 0.0 } else { self.view.near_depth };
        Self { view: CameraTile { start_depth: depth, near_depth, ..self.view }, ..self }
    }

    /// Aims a part of the rays of final gathering, and of those that rough lobes send on, at bright
    /// places; the latter at gleams and at lamps in glass as well.
    #[must_use]
    pub fn aiming_at(self, gpu: &Gpu, bright: &BrightPlaces) -> Self {
        let all = [&bright.patches[..], &bright.gleams, &self.lamps.patches].concat();
        let mut patches = [BrightPatch::default(); MAX_PATCHES];
        patches[..all.len()].copy_from_slice(&all);
        // Where no rays have looked, it is told by the lamps.
        let other_light = if bright.other_light > 0.0 { bright.other_light } else { self.lamps.mean_light };
        let [patches_of_rays, lobe_patches] = [bright.patches.len(), all.len()].map(|count| count as u32);
        let sharp_glass = u32::from(!self.lamps.patches.is_empty());
        let view = CameraTile { patches: patches_of_rays, lobe_patches, other_light, sharp_glass, ..self.view };
        Self { patches: gpu.uniform("bright patches", &patches), view, ..self }
    }

    /// Has points wait for irradiance kept in cells, [`layout::BY_CELL`], where what a sample sees
    /// by rough lobes is at least as wide, metres.
    pub fn see_by_cells(&mut self, width: f32) {
        self.view.cells_from = width;
    }

    /// Has rays of final gathering bring the light of wide coats. `others`: some light comes by
    /// ways that these leave out.
    pub fn gather_coats(&mut self, others: bool) {
        self.view.gathers_coats = if others { 1 } else { layout::NO_LIGHTS_LEFT };
    }

    /// Whether points may wait for irradiance kept in cells.
    #[must_use]
    pub fn sees_by_cells(&self) -> bool {
        self.view.cells_from > 0.0
    }

    /// Takes the samples of a pass from index `first` on. All passes together have many samples a
    /// pixel, so that even a single one is spread over the pixel filter.
    ///
    /// # Errors
    /// Limits of the adapter.
    pub fn of_pass(self, gpu: &Gpu, picture: &PictureSettings, first: u32) -> Result<Self> {
        let offsets = picture.pixel_filter.offsets();
        let first_extra = self.first_extra + first / self.view.spp * self.extra;
        let view = CameraTile {
            first_sample: first,
            filter_steps: offsets.len() as u32 - 1,
            // Its bias would stay over all passes.
            merges_layers: if first == 0 { self.view.merges_layers } else { 0 },
            ..self.view
        };
        Ok(Self { filter_table: gpu.storage_with("pixel filter", &offsets)?, first_extra, view, ..self })
    }

    /// Leaves out all pixels but those of a grid. Tiles and data window count its cells.
    #[must_use]
    pub fn at_grid(self, grid: PixelGrid) -> Self {
        let (left_out, shift) = (grid.every() - 1, grid.shift());
        let view = CameraTile { left_out, shift, margin: 0, ..self.view };
        Self { view, window: grid.window(self.window), ..self }
    }

    /// Maximum number of visible points of this tile, without its margin.
    #[must_use]
    pub fn point_count(&self, tile: &Tile) -> u32 {
        self.view.branches * tile.pixels * tile.samples
    }

    /// Path slots of each sample.
    #[must_use]
    pub fn branches(&self) -> u32 {
        self.view.branches
    }

    /// Height of a pixel at a distance of one metre, or everywhere if rays are parallel, metres.
    #[must_use]
    pub fn pixel_height(&self) -> f32 {
        2.0 * Vec3::from(self.view.up).length() / self.view.height as f32
    }

    /// Ratio of the width of what a pixel sees at a place to [`Self::pixel_height`].
    #[must_use]
    pub fn scale_at(&self, place: Vec3) -> f32 {
        if self.view.parallel != 0 { 1.0 } else { place.distance(self.view.position.into()) }
    }

    /// Maximum number of visible points of any tile, without its margin.
    #[must_use]
    pub fn room(&self) -> u64 {
        self.room
    }

    /// The lists that kernels with the tile's view read.
    #[must_use]
    pub fn lists(&self) -> &Buffer {
        self.wavefront.lists.binding().1
    }

    /// The visible points of a tile, which share estimates.
    #[must_use]
    pub fn shared_points(&self, tile: &Tile) -> SharedPoints<'_> {
        SharedPoints {
            points: &self.points,
            pixels: tile.pixels,
            samples: tile.samples,
            branches: self.view.branches,
            margin: self.view.margin / MARGIN_SAMPLES,
            is_square: tile.listed.is_none(),
            radiance: &self.radiance,
            gathered: &self.gathered,
        }
    }

    /// Traces the tile's camera paths to their visible points, and sets all radiance to 0.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn trace(&self, gpu: &Gpu, scene: &SceneBuffers, tile: &Tile) -> Result<StepCount> {
        let view = self.tile_view(tile);
        let uniform = gpu.uniform("camera tile", &view);
        if let Some(listed) = &tile.listed {
            self.wavefront.lists.write_pixels(gpu, &listed.pixels);
        }
        let own = [("tile", &uniform), ("points", &self.points), ("filter_table", &self.filter_table)];
        let start = Step { kernel: &self.kernels.start, buffers: &own };
        let trace = Step { kernel: &self.kernels.trace, buffers: &own };
        self.follow(
            gpu,
            scene,
            (&start, tile.pixels * tile.samples + view.margin),
            &trace,
            (self.kernels.lobes.as_ref(), &self.radiance),
        )
    }

    /// Starts paths by `start` in that many invocations and traces them by `trace`. Both steps have
    /// their own buffers besides those of the wavefront and the tile. `lobes` adds direct light at
    /// rough lobes. All add light to `radiance`, by the slots of paths.
    pub(super) fn follow(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        (start, invocations): (&Step, u32),
        trace: &Step,
        (lobes, radiance): (Option<&Kernel>, &Buffer),
    ) -> Result<StepCount> {
        let most_paths = (u64::from(invocations) * u64::from(self.view.branches))
            .min(self.room + u64::from(self.view.margin * self.view.branches));
        let tile = [
            ("first_hits", &self.first_hits),
            ("radiance", radiance),
            ("lobe_points", &self.lobe_points),
            ("patches", &self.patches),
        ];
        let (started, followed) = ([start.buffers, &tile].concat(), [trace.buffers, &tile].concat());
        let start = Step { kernel: start.kernel, buffers: &started };
        let trace = Step { kernel: trace.kernel, buffers: &followed };
        let light = lobes.map(|kernel| Step { kernel, buffers: &followed });
        let steps: Vec<Step> = light.into_iter().chain([trace]).collect();
        // Without mirrors and glass, the first surface that the camera sees ends every path.
        let veils = if scene.has_veils() { layout::MOST_VEILS } else { 0 };
        let surfaces = if scene.has_lobes { layout::CHAIN_LIMIT } else { 1 + veils };
        let most_surfaces = surfaces + if self.view.near_depth == UNCLIPPED { 0 } else { MAX_UNSEEN };
        let counters = self.wavefront.run(
            gpu,
            scene,
            (&start, invocations.into()),
            &steps,
            most_paths,
            (surfaces, most_surfaces),
        )?;
        let given_up = u64::from(counters.unfinished) + u64::from(counters.next);
        Ok(StepCount { unfinished: given_up, ..StepCount::from(counters) })
    }

    /// Adds direct light at the tile's visible points.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn light_directly(&self, gpu: &Gpu, scene: &SceneBuffers, tile: &Tile) -> Result<StepCount> {
        let points = (&self.points, &self.radiance, self.point_count(tile));
        self.light_points(gpu, scene, &self.kernels.direct, &self.tile_view(tile), points)
    }

    /// Adds direct light to the radiance of points, whose numbers are those of samples of a tile.
    pub(super) fn light_points(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        direct: &DirectLighting,
        view: &CameraTile,
        (points, radiance, count): (&Buffer, &Buffer, u32),
    ) -> Result<StepCount> {
        let uniform = gpu.uniform("camera tile", view);
        let (counters, lists) = (("counters", &self.wavefront.counters), &self.wavefront.lists);
        let queues = self.wavefront.queues();
        let buffers =
            [("tile", &uniform), ("points", points), ("radiance", radiance), counters, queues, lists.binding()];
        let steps = direct.steps(scene);
        let mut done = StepCount::default();
        let at_once = if scene.has_late_rays(gpu) { 1 } else { DIRECT_STEPS_PER_READ };
        for first in (0..steps).step_by(at_once as usize) {
            let mut encoder = gpu.encoder();
            self.wavefront.queue_points(gpu, &mut encoder, points, count);
            for step in first..steps.min(first + at_once) {
                let (kernel, bindings) = direct.step(gpu, scene, step, &buffers);
                self.wavefront.dispatch(&mut encoder, (kernel, &bindings), count.into());
            }
            gpu.submit(encoder);
            let mut counters: Counters = gpu.read(&self.wavefront.counters, 0, 1)?[0];
            if counters.unfinished > 0 {
                let kernel = direct.late(gpu, scene, first, &buffers);
                let given_up = lists.finish(gpu, &self.wavefront.counters, counters.unfinished, &[kernel])?;
                counters = gpu.read(&self.wavefront.counters, 0, 1)?[0];
                counters.unfinished = given_up;
            }
            done += StepCount { rays: u64::from(counters.shadow_rays), ..StepCount::from(counters) };
        }
        Ok(done)
    }

    /// Sums over the tile's samples, for each of its pixels.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn resolve(&self, gpu: &Gpu, tile: &Tile) -> Result<Vec<PixelSums>> {
        let uniform = gpu.uniform("camera tile", &self.tile_view(tile));
        let bindings = self.kernels.resolve.bind(
            gpu,
            &[
                ("tile", &uniform),
                ("radiance", &self.radiance),
                ("sample_rows", &self.first_hits),
                ("pixel_rows", &self.pixel_rows),
            ],
        );
        let mut encoder = gpu.encoder();
        self.kernels.resolve.dispatch(&mut encoder, &bindings, u64::from(tile.pixels));
        gpu.submit(encoder);
        gpu.read(&self.pixel_rows, 0, u64::from(tile.pixels))
    }

    /// Reads the first hits of the tile's samples, pixel by pixel.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn first_hits(&self, gpu: &Gpu, tile: &Tile) -> Result<Vec<FirstHit>> {
        gpu.read(&self.first_hits, 0, u64::from(tile.pixels) * u64::from(tile.samples))
    }

    pub(crate) fn tile_view(&self, tile: &Tile) -> CameraTile {
        CameraTile {
            first_column: tile.first_column,
            first_row: tile.first_row,
            pixels: tile.pixels,
            first_sample: tile.first_sample,
            samples: tile.samples,
            listed: tile.listed.is_some().into(),
            listed_at: self.wavefront.lists.pixels_at(),
            margin: if tile.listed.is_none() { self.view.margin } else { 0 },
            ..self.view
        }
    }
}
