//! Second pass: the one loop over the tiles of a picture.

use std::cell::RefCell;

use super::{
    obstacles::Obstacles,
    ray_start::ray_start,
    size::picture_size,
    tally,
    unevenness::{Square, doublings},
};
use crate::{
    bvh::Media,
    error::Result,
    gpu::{Buffer, Gpu},
    image::{Film, cryptomatte::hash, layers::LightComponent},
    layout::{ArrivingLight, PixelSums, VisiblePoint},
    passes::{
        BrightPlaces, CameraTracer, FinalGather, FinalRays, Further, GatherSettings, StepCount, Tile, morton_number,
    },
    progress::{Progress, Stage},
    scene::Camera,
    settings::{Crop, EstimateSettings, ExtraLayers, PhotonSettings, PictureSettings, PixelGrid},
    stats::{Stats, timed},
    upload::SceneBuffers,
};

/// Source of the photons' light at the visible points of a tile.
pub(crate) trait Gatherer {
    /// Adds the light to the radiance of the tile's points. `film` gets what is known of
    /// it: components and estimates.
    fn gather(
        &mut self,
        pass: &CameraPass,
        tile: &Tile,
        film: &mut Film,
        stats: &mut Stats,
        progress: &dyn Progress,
    ) -> Result<()>;

    /// Receives a pass over a small version of the whole picture, before the picture. The default
    /// does nothing with it. Returns whether a larger version would tell more.
    fn prepare(&mut self, _preview: &CameraPass, _stats: &mut Stats, _progress: &dyn Progress) -> Result<bool> {
        Ok(false)
    }

    /// Width of what is seen blurred from which on this gatherer has light for it, metres; 0: none.
    fn blur(&self) -> f32 {
        0.0
    }

    /// Places that rays of final gathering are aimed at.
    fn bright_places(&self) -> BrightPlaces {
        BrightPlaces::default()
    }

    /// Receives a preview whose rays are aimed at the bright places, if there are any. The default
    /// does nothing with it.
    fn prepare_aimed(&mut self, _aimed: &CameraPass, _stats: &mut Stats, _progress: &dyn Progress) -> Result<()> {
        Ok(())
    }

    /// Receives a pass over a picture that is coarser by `spacing`, before the picture, to keep
    /// records of irradiance at its visible points. The default does nothing with it.
    fn keep_records(
        &mut self,
        _coarse: &CameraPass,
        _size: (u32, u32),
        _stats: &mut Stats,
        _progress: &dyn Progress,
    ) -> Result<()> {
        Ok(())
    }

    /// Number of pictures that it makes of the same visible points.
    fn pictures(&self) -> usize {
        1
    }

    /// Sets the tile's radiance to that of one picture, for gatherers of several.
    fn show(&mut self, _picture: usize, _pass: &CameraPass) {}
}

/// Adds light at the ends of rays to what they have found. The last argument has the indices of the
/// points that they started from.
pub(crate) type RayLight<'a> = dyn FnMut(&FinalGather, FinalRays, &[u32]) -> Result<StepCount> + 'a;

/// Device part of a camera pass: camera paths, direct light, rays of final gathering.
pub(crate) struct CameraPass<'a> {
    pub gpu: &'a Gpu,
    pub scene: &'a SceneBuffers,
    /// Holds the visible points and the radiance of the tile that was traced last.
    pub tracer: CameraTracer,
    /// `None` if the photons were not traced for final gathering.
    pub final_gather: Option<FinalGather>,
    /// The radiance estimate that the settings ask for.
    pub estimate: GatherSettings,
    pub size: (u32, u32),
    pub window: Crop,
    spp: u32,
    /// Number of times that the samples of a pixel with uneven neighbours double at most.
    doublings: u32,
    /// Direct light comes from shadow rays.
    direct: bool,
    pub(super) obstacles: Obstacles<'a>,
    /// Sums of the tile's pixels when the last component of the light was finished.
    pub(super) finished: RefCell<Vec<[f32; 4]>>,
    /// Light of the maps that are gathered at visible points, of each pixel of the tile, mean of
    /// its samples and of the channels; empty where no one has asked for it.
    pub(super) by_maps: RefCell<Vec<f32>>,
    /// Layers that the film has besides.
    pub(super) layers: Vec<ExtraLayers>,
    /// Hashes of names for mattes, of objects and of materials.
    pub(super) hashes: [Vec<u32>; 2],
}

/// Camera samples of a stage that are done, with further ones in some pixels of a tile.
pub(crate) struct SampleCount<'p> {
    progress: &'p dyn Progress,
    stage: Option<Stage>,
    /// All of them but further ones.
    even: u64,
    done: u64,
    /// Those of the tile that is rendered.
    of_tile: u64,
    /// Further ones that are done.
    further: u64,
}

impl SampleCount<'_> {
    /// Reports what is done, if there is a stage; `left` further samples of this tile are not.
    /// Tiles to come are expected to have as many of them as those before.
    fn report(&self, left: u64) {
        let Some(stage) = self.stage else { return };
        let begun = (self.done + self.of_tile).min(self.even).max(1);
        let expected = (self.further + left) as f64 * self.even as f64 / begun as f64;
        self.progress.report(stage, self.done + self.further, self.even + expected.round() as u64);
    }
}

impl<'a> CameraPass<'a> {
    /// `media` are those around the middle of the camera; `obstacles` are of the scene in the
    /// buffers.
    pub fn new(
        gpu: &'a Gpu,
        (obstacles, scene): (Obstacles<'a>, &'a SceneBuffers),
        (camera, media): (&Camera, Media),
        photons: &PhotonSettings,
        estimate: &EstimateSettings,
        picture: &PictureSettings,
    ) -> Result<Self> {
        let geometry = obstacles.scene;
        let size = picture_size(camera, picture)?;
        let shares = estimate.share_reach > 0.0 && photons.mode.traces_photons();
        let start = ray_start((geometry, &scene.solids), (camera, media), size);
        let tracer = CameraTracer::new(gpu, scene, (camera, start.media), size, photons, picture, shares)?;
        let tracer = if start.depth < 0.0 { tracer.starting_at(start.depth) } else { tracer };
        // Samples that find no records about them share the rays of their pixel.
        let sharing = if estimate.gather_spacing > 0 { picture.spp } else { 1 };
        let rays = Some(photons.final_gather.div_ceil(sharing)).filter(|rays| *rays > 0);
        let final_gather = rays.map(|rays| FinalGather::new(gpu, scene, &tracer, photons.sampler, rays));
        Ok(Self {
            gpu,
            scene,
            final_gather: final_gather.transpose()?,
            tracer,
            estimate: GatherSettings::from(estimate),
            size,
            window: picture.window(size),
            spp: picture.spp,
            doublings: picture.doublings(),
            direct: photons.mode.direct_by_rays(),
            obstacles,
            finished: RefCell::default(),
            by_maps: RefCell::default(),
            layers: picture.layers.clone(),
            hashes: [
                geometry.objects.iter().map(|name| hash(name)).collect(),
                geometry.materials.iter().map(|material| hash(&material.name)).collect(),
            ],
        })
    }

    /// Takes the samples of one of several passes, from index `first_sample` on, if there is one.
    pub fn of_pass(self, picture: &PictureSettings, first_sample: Option<u32>) -> Result<Self> {
        let Some(first) = first_sample else { return Ok(self) };
        Ok(Self { tracer: self.tracer.of_pass(self.gpu, picture, first)?, ..self })
    }

    /// Leaves out all pixels but those of the picture's grid. The film has their columns and rows.
    pub fn at_grid(self) -> Self {
        let grid = PixelGrid::of(self.size);
        let whole = grid.window(Crop { column: 0, row: 0, width: self.size.0, height: self.size.1 });
        let (size, window) = ((whole.width, whole.height), grid.window(self.window));
        Self { tracer: self.tracer.at_grid(grid), size, window, ..self }
    }

    /// Leaves points that are seen as blurred as that, metres, to the gatherer's cells; 0: none.
    /// Layers of components and of estimates are about each point.
    pub fn seeing_by_cells(mut self, blur: f32) -> Self {
        if !self.is_apart() {
            self.tracer.see_by_cells(blur);
        }
        self
    }

    /// Has rays of final gathering bring the light of wide coats too, where the picture shows all
    /// light: see [`CameraTile::gathers_coats`](crate::layout::CameraTile::gathers_coats). Layers
    /// of components and of estimates are about each way of light.
    pub fn gathering_coats(mut self) -> Self {
        if self.direct && self.final_rays() > 0 && self.scene.materials.has_rough && !self.is_apart() {
            let others = self.obstacles.scene.has_light_beside_gathers() || self.scene.has_veils();
            self.tracer.gather_coats(others);
        }
        self
    }

    /// Whether layers ask for each point and each way of light by itself.
    fn is_apart(&self) -> bool {
        [ExtraLayers::Components, ExtraLayers::Estimates].iter().any(|layer| self.layers.contains(layer))
    }

    /// Makes the rays of final gathering of all points one set of numbers.
    pub fn with_joint_rays(self) -> Self {
        Self { final_gather: self.final_gather.map(FinalGather::joint), ..self }
    }

    /// Has rays of final gathering see gleams, lights by way of mirrors, metal and glass, where
    /// there are rough lobes to show them.
    pub fn seeing_gleams(self) -> Self {
        let sees = |gather: FinalGather| if self.scene.materials.has_rough { gather.seeing_gleams() } else { gather };
        Self { final_gather: self.final_gather.map(sees), ..self }
    }

    /// Aims a part of the rays at bright places.
    pub fn aiming_at(self, bright: &BrightPlaces) -> Self {
        Self { tracer: self.tracer.aiming_at(self.gpu, bright), ..self }
    }

    /// Renders tile by tile: camera rays to visible points, direct light, the light of photons,
    /// sums over the samples of each pixel. Returns one film for each of the gatherer's pictures.
    pub fn render(
        &self,
        gatherer: &mut dyn Gatherer,
        stage: Stage,
        stats: &mut Stats,
        progress: &dyn Progress,
    ) -> Result<Vec<Film>> {
        let film = Film::new(self.size, self.window, self.spp).with_layers(&self.layers).with_doublings(self.doublings);
        let mut films = vec![film; gatherer.pictures()];
        // Previews have lost paths of their own.
        let lost_before = stats.lost_camera_paths;
        self.for_each_tile(Some(stage), stats, progress, &mut |tile, stats, count| {
            let sums = self.light(tile, gatherer, &mut films, stats, progress)?;
            if self.doublings == 0 {
                return Ok(());
            }
            let further = self.further_samples(tile, &sums);
            let extra_tiles = self.tracer.extra_tiles(tile, &further);
            let mut left = extra_tiles.iter().map(|extra| self.samples_of(extra)).sum();
            for extra in &extra_tiles {
                progress.check()?;
                count.report(left);
                self.trace(extra, stats)?;
                self.light(extra, gatherer, &mut films, stats, progress)?;
                let done = self.samples_of(extra);
                count.further += done;
                left -= done;
            }
            for (pixel, at) in (0..tile.pixels).filter_map(|pixel| Some((pixel, self.tracer.pixel(tile, pixel)?))) {
                films.iter_mut().for_each(|film| film.weigh(at, further[pixel as usize].doublings));
            }
            Ok(())
        })?;
        stats.extra_samples += films.iter().map(Film::extra_samples).sum::<u64>();
        stats.non_finite.film += films.iter().map(Film::non_finite).sum::<u64>();
        let of_all_pixels = f64::from(self.window.width) * f64::from(self.window.height) * f64::from(self.spp);
        let paths = of_all_pixels + films.first().map_or(0, Film::extra_samples) as f64;
        stats.warnings.extend(tally::lost_in_chains((stats.lost_camera_paths - lost_before) / paths));
        Ok(films)
    }

    /// Calls `work` for each tile of the data window, with its camera paths traced to their visible
    /// points. Samples are reported as units of the stage, if there is one.
    pub fn for_each_tile(
        &self,
        stage: Option<Stage>,
        stats: &mut Stats,
        progress: &dyn Progress,
        work: &mut dyn FnMut(&Tile, &mut Stats, &mut SampleCount) -> Result<()>,
    ) -> Result<()> {
        let tiles = self.tracer.tiles();
        let even = tiles.iter().map(|tile| self.samples_of(tile)).sum();
        let mut count = SampleCount { progress, stage, even, done: 0, of_tile: 0, further: 0 };
        for tile in &tiles {
            progress.check()?;
            count.of_tile = self.samples_of(tile);
            count.report(0);
            self.trace(tile, stats)?;
            work(tile, stats, &mut count)?;
            count.done += count.of_tile;
        }
        count.report(0);
        Ok(())
    }

    /// Camera samples of a tile within the picture.
    fn samples_of(&self, tile: &Tile) -> u64 {
        let within = |first: u32, side: u32, whole: u32| u64::from((first + side).min(whole).saturating_sub(first));
        let square = || {
            let (columns, rows) = tile.sides();
            within(tile.first_column, columns, self.size.0) * within(tile.first_row, rows, self.size.1)
        };
        let pixels = tile.listed.as_ref().map_or_else(square, |listed| listed.pixels.len() as u64);
        pixels * u64::from(tile.samples)
    }

    /// Traces a tile's camera paths to their visible points.
    fn trace(&self, tile: &Tile, stats: &mut Stats) -> Result<()> {
        let trace = || self.tracer.trace(self.gpu, self.scene, tile);
        let count = timed(&mut stats.seconds.camera, trace)?;
        stats.non_finite.camera += count.non_finite;
        tally::add_step(stats, count);
        Ok(())
    }

    /// Lights the visible points of a tile that was traced, and adds its samples to the films.
    /// Returns the sums of the last one.
    fn light(
        &self,
        tile: &Tile,
        gatherer: &mut dyn Gatherer,
        films: &mut [Film],
        stats: &mut Stats,
        progress: &dyn Progress,
    ) -> Result<Vec<PixelSums>> {
        self.finished.borrow_mut().clear();
        self.by_maps.borrow_mut().clear();
        self.finished_component(tile, LightComponent::Emission, &mut films[0])?;
        if self.direct {
            self.light_directly(tile, &mut films[0], stats)?;
        }
        gatherer.gather(self, tile, &mut films[0], stats, progress)?;
        let mut sums = Vec::new();
        for (picture, film) in films.iter_mut().enumerate() {
            gatherer.show(picture, self);
            sums = self.resolve(tile, film)?;
        }
        Ok(sums)
    }

    /// What each of the tile's pixels has besides.
    fn further_samples(&self, tile: &Tile, sums: &[PixelSums]) -> Vec<Further> {
        let (columns, rows) = tile.sides();
        let size = self.size;
        let is_in = |column, row| tile.first_column + column < size.0 && tile.first_row + row < size.1;
        let of = |column, row| is_in(column, row).then(|| &sums[morton_number(column, row) as usize]);
        let square = Square { columns, rows, samples: tile.samples, sums: &of };
        let by_maps = self.by_maps.borrow();
        let of_maps = |column, row| by_maps.get(morton_number(column, row) as usize).copied();
        let mut further = vec![Further { doublings: 0, one_in: 1 }; tile.pixels as usize];
        for (place, error) in square.uneven() {
            let doublings = doublings(error).min(self.doublings);
            let one_in = square.one_in(place, error, &of_maps);
            further[morton_number(place.0, place.1) as usize] = Further { doublings, one_in };
        }
        further
    }

    /// Whether pixels may have further samples.
    pub fn may_go_on(&self) -> bool {
        self.doublings > 0
    }

    /// Adds light of maps to the radiance at the tile's points by `gather`, and keeps what each
    /// pixel has of it.
    pub fn keep_light_of_maps(&self, tile: &Tile, gather: &mut dyn FnMut() -> Result<()>) -> Result<()> {
        let light = || -> Result<Vec<f32>> {
            let sums = self.tracer.resolve(self.gpu, tile)?;
            Ok(sums.iter().map(|sums| sums[0][..3].iter().sum::<f32>() / (3 * tile.samples) as f32).collect())
        };
        let before = light()?;
        gather()?;
        *self.by_maps.borrow_mut() = light()?.iter().zip(before).map(|(after, before)| after - before).collect();
        Ok(())
    }

    /// Adds direct light at the tile's visible points by shadow rays.
    fn light_directly(&self, tile: &Tile, film: &mut Film, stats: &mut Stats) -> Result<()> {
        let light = || self.tracer.light_directly(self.gpu, self.scene, tile);
        let count = timed(&mut stats.seconds.direct, light)?;
        stats.non_finite.direct += count.non_finite;
        tally::add_step(stats, count);
        self.finished_component(tile, LightComponent::Direct, film)
    }

    /// Rays of final gathering per visible point; 0 without.
    pub fn final_rays(&self) -> u32 {
        self.final_gather.as_ref().map_or(0, FinalGather::rays)
    }

    /// Traces rays of final gathering of all of the tile's visible points that still wait, in steps
    /// of as many as there is room for. After each step, `light` receives the rays, and adds the
    /// light at their ends to what they have found. The result is then in the points' radiance.
    pub fn gather_finally(&self, tile: &Tile, progress: &dyn Progress, light: &mut RayLight) -> Result<StepCount> {
        let mut done = StepCount::default();
        let Some(gather) = &self.final_gather else { return Ok(done) };
        let chosen = gather.waiting.list(self.gpu, &self.tracer.points, self.tracer.point_count(tile))?;
        if chosen.is_empty() {
            return Ok(done);
        }
        // The rays of a pixel are those of all its samples.
        let samples = tile.listed.as_ref().map_or(self.spp, |listed| listed.samples);
        let each = (gather.rays() * self.spp).div_ceil(samples);
        gather.choose(self.gpu, &self.tracer, tile, (&chosen, each));
        let at_once = (self.tracer.room() as u32 / chosen.len() as u32).min(each);
        for first in (0..each).step_by(at_once as usize) {
            progress.check()?;
            let rays = FinalRays { first, count: at_once.min(each - first), chosen: chosen.len() as u32, each };
            done += gather.trace(self.gpu, self.scene, &self.tracer, tile, rays)?;
            done += light(gather, rays, &chosen)?;
            gather.add(self.gpu, &self.tracer, rays);
        }
        Ok(done)
    }

    /// Adds direct light at ends of rays from all over the picture to their radiance.
    pub fn light_ends_directly(&self, (ends, radiance, count): (&Buffer, &Buffer, u32)) -> Result<StepCount> {
        let (Some(gather), Some(tile)) = (&self.final_gather, self.tracer.tiles().first().cloned()) else {
            return Ok(StepCount::default());
        };
        gather.light_ends(self.gpu, self.scene, &self.tracer, &tile, (ends, radiance, count))
    }

    /// Reads the tile's visible points; some slots have no point.
    pub fn points(&self, tile: &Tile) -> Result<Vec<VisiblePoint>> {
        self.gpu.read(&self.tracer.points, 0, self.tracer.point_count(tile).into())
    }

    /// Replaces the visible points.
    pub fn set_points(&self, points: &[VisiblePoint]) {
        self.gpu.write(&self.tracer.points, 0, points);
    }

    /// Forgets where the light at the tile's points came from.
    pub fn clear_arriving(&self) {
        let Some(gather) = &self.final_gather else { return };
        let mut encoder = self.gpu.encoder();
        encoder.clear_buffer(&gather.arriving, 0, None);
        self.gpu.submit(encoder);
    }

    /// Directions from which light arrives at the tile's points, by rays of final gathering.
    pub fn arriving(&self, tile: &Tile) -> Result<Vec<ArrivingLight>> {
        let Some(gather) = &self.final_gather else { return Ok(Vec::new()) };
        self.gpu.read(&gather.arriving, 0, self.tracer.point_count(tile).into())
    }

    /// Reads the radiance of the visible points so far.
    pub fn radiance(&self, tile: &Tile) -> Result<Vec<[f32; 4]>> {
        self.gpu.read(&self.tracer.radiance, 0, self.tracer.point_count(tile).into())
    }

    /// Replaces the radiance of the visible points.
    pub fn set_radiance(&self, radiance: &[[f32; 4]]) {
        self.gpu.write(&self.tracer.radiance, 0, radiance);
    }
}
