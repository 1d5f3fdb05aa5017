//! Light of photons at the visible points of a picture, tile by tile: from the maps themselves,
//! records of irradiance, and rays of final gathering.

use super::{
    maps::PhotonMaps,
    preview::{bright_places, ends_of_rays},
    searches::Searches,
    tally,
    tiles::{CameraPass, Gatherer},
};
use crate::{
    error::Result,
    gpu::Gpu,
    image::{Film, layers::LightComponent},
    layout::{Gathered, RecordGrid, VisiblePoint},
    map_kind::MapKind,
    passes::{
        BrightPlaces, EstimateRequest, EstimateSharing, GatherSettings, IrradianceCache, IrradianceRecords,
        QueryThinning, Records, StepCount, Tile, filter_footprint, record_spacing,
    },
    progress::{Progress, Stage},
    settings::EstimateSettings,
    stats::{Stats, timed},
    upload::SceneBuffers,
};

/// Receives the results of a map's estimates at the visible points of a tile.
pub(crate) trait Observer {
    fn observe(&mut self, kind: MapKind, gathered: &[Gathered]);
}

/// Gathers photon maps with the search of the settings.
pub(crate) struct MapGatherer<'a> {
    maps: &'a PhotonMaps,
    search: Searches<'a>,
    sharing: EstimateSharing,
    thinning: QueryThinning,
    estimate: &'a EstimateSettings,
    observer: Option<&'a mut dyn Observer>,
    /// Light at the ends of final-gather rays.
    cache: Option<IrradianceCache>,
    /// Irradiance at some of the picture's points.
    records: Option<IrradianceRecords>,
    /// What rays of final gathering are aimed at.
    bright: BrightPlaces,
    /// Rays of final gathering of a pixel with one sample, on average.
    rays_per_pixel: Option<f64>,
}

impl<'a> MapGatherer<'a> {
    pub fn new(
        gpu: &Gpu,
        scene: &'a SceneBuffers,
        maps: &'a PhotonMaps,
        estimate: &'a EstimateSettings,
        observer: Option<&'a mut dyn Observer>,
    ) -> Result<Self> {
        let search = Searches::new(gpu, scene, maps, estimate)?;
        // Kernels of few photons are stretched over more: that does not widen the area for which
        // they stand.
        let stretched = GatherSettings::from(estimate).neighbors as f32 / estimate.neighbors as f32;
        let sharing = EstimateSharing::new(gpu, estimate.share_reach / stretched.sqrt());
        Ok(Self {
            maps,
            search,
            sharing,
            thinning: QueryThinning::new(gpu),
            estimate,
            observer,
            cache: None,
            records: None,
            bright: BrightPlaces::default(),
            rays_per_pixel: None,
        })
    }

    /// Adds the light of one map at the tile's visible points. `index` is the index in the photon
    /// maps, `number` the map number.
    fn gather_map(
        &mut self,
        pass: &CameraPass,
        tile: &Tile,
        (index, number): (usize, u32),
        (film, stats): (&mut Film, &mut Stats),
        progress: &dyn Progress,
    ) -> Result<()> {
        let gathered = &pass.tracer.gathered;
        if self.observer.is_some() || pass.keeps_estimates() {
            // The gather leaves slots without a point unchanged; they may hold results of an
            // earlier tile.
            let mut encoder = pass.gpu.encoder();
            encoder.clear_buffer(gathered, 0, None);
            pass.gpu.submit(encoder);
        }
        let shared = pass.tracer.shared_points(tile);
        let Self { maps, search, sharing, estimate, .. } = self;
        let mut answer = |request: &EstimateRequest| search.answer(pass, maps, index, estimate, request, progress);
        timed(&mut stats.seconds.gather, || sharing.run(pass.gpu, number, &shared, &mut answer))?;
        let kind = self.maps.by_kind().nth(index).expect("one of the maps").0;
        pass.finished_estimates(tile, kind, film)?;
        if let Some(observer) = &mut self.observer {
            observer.observe(kind, &pass.gpu.read(gathered, 0, pass.tracer.point_count(tile).into())?);
        }
        Ok(())
    }

    /// Lights the tile's points that are seen blurred.
    fn light_blurred(&self, pass: &CameraPass, tile: &Tile) {
        if let Some(cache) = self.cache.as_ref().filter(|_| pass.tracer.sees_by_cells()) {
            let (points, count) = (&pass.tracer.points, pass.tracer.point_count(tile));
            cache.light_blurred(pass.gpu, points, count, &pass.tracer.radiance);
        }
    }

    /// Traces the rays of final gathering, and adds to each visible point the light of all maps
    /// where its rays end. `report` receives the number of rays of each step.
    fn gather_finally(
        &mut self,
        pass: &CameraPass,
        tile: &Tile,
        report: &mut dyn FnMut(u32),
        progress: &dyn Progress,
    ) -> Result<StepCount> {
        // Indices of the visible points of the ends that the cache does not light. They are few in
        // each step, and a search of few points leaves most of the device idle.
        let mut left = Vec::new();
        let Self { maps, search, estimate, cache, .. } = self;
        let done = pass.gather_finally(tile, progress, &mut |gather, rays, chosen| {
            let (points, radiance, count) = (&gather.ends, &gather.found, rays.all());
            report(rays.all());
            let direct = gather.light_directly(pass.gpu, pass.scene, &pass.tracer, tile, rays)?;
            if let Some(cache) = cache {
                cache.light(pass.gpu, points, count, radiance);
                let waiting = gather.waiting.list(pass.gpu, points, count)?;
                if (left.len() + waiting.len()) as u64 > pass.tracer.room() {
                    let full = std::mem::take(&mut left);
                    search.light_ends(pass, (maps, estimate), tile, (&full, &gather.waiting.collected), progress)?;
                }
                gather.waiting.collect(pass.gpu, points, &waiting, left.len() as u32);
                left.extend(waiting.iter().map(|ray| chosen[(ray / rays.count) as usize] as usize));
                return Ok(direct);
            }
            for index in 0..maps.maps().len() {
                let gathered = &pass.tracer.gathered;
                let request = EstimateRequest { points, count, map_number: 1, radiance, gathered };
                search.answer(pass, maps, index, estimate, &request, progress)?;
            }
            Ok(direct)
        })?;
        if let Some(gather) = pass.final_gather.as_ref().filter(|_| !left.is_empty()) {
            search.light_ends(pass, (maps, estimate), tile, (&left, &gather.waiting.collected), progress)?;
        }
        Ok(done)
    }
}

impl Gatherer for MapGatherer<'_> {
    /// Fills the cache of irradiance about the ends of the preview's final-gather rays, and finds
    /// bright places among them.
    fn prepare(&mut self, preview: &CameraPass, stats: &mut Stats, progress: &dyn Progress) -> Result<bool> {
        let ends = ends_of_rays(preview, stats, progress)?;
        let pixels = f64::from(preview.size.0) * f64::from(preview.size.1);
        self.rays_per_pixel = Some(ends.rays as f64 / pixels);
        let Self { maps, search, estimate, .. } = self;
        let mut irradiances = |points: &[VisiblePoint]| search.irradiances(preview, maps, estimate, points, progress);
        let fill = || IrradianceCache::build(preview.gpu, &ends.marks, estimate.irradiance_cells, &mut irradiances);
        self.cache = timed(&mut stats.seconds.gather, fill)?;
        let Some(cache) = &self.cache else { return Ok(false) };
        self.bright = bright_places(preview, &ends, cache, stats)?;
        Ok(self.bright.is_uneven)
    }

    fn bright_places(&self) -> BrightPlaces {
        self.bright.clone()
    }

    /// Keeps irradiance about the ends of rays that are aimed at bright places: of the others, few
    /// end there.
    fn prepare_aimed(&mut self, aimed: &CameraPass, stats: &mut Stats, progress: &dyn Progress) -> Result<()> {
        let ends = ends_of_rays(aimed, stats, progress)?;
        let Self { maps, search, estimate, cache, .. } = self;
        let Some(cache) = cache else { return Ok(()) };
        let mut irradiances = |points: &[VisiblePoint]| search.irradiances(aimed, maps, estimate, points, progress);
        timed(&mut stats.seconds.gather, || cache.add(aimed.gpu, &ends.marks, &mut irradiances))
    }

    fn blur(&self) -> f32 {
        self.cache.as_ref().map_or(0.0, IrradianceCache::width)
    }

    /// Final gathering at the visible points of the coarse picture.
    fn keep_records(
        &mut self,
        coarse: &CameraPass,
        size: (u32, u32),
        stats: &mut Stats,
        progress: &dyn Progress,
    ) -> Result<()> {
        let window = coarse.window;
        let mut taken = Records::new((window.width, window.height), coarse.tracer.branches());
        // Where the preview has no points, this has none either.
        let pixels = f64::from(window.width) * f64::from(window.height);
        let expected = (self.rays_per_pixel.unwrap_or(coarse.final_rays().into()) * pixels) as u64;
        let mut rays_done = 0;
        progress.report(Stage::Records, 0, expected);
        coarse.for_each_tile(None, stats, progress, &mut |tile, stats, _| {
            let (points, light, arriving, count) = timed(&mut stats.seconds.gather, || {
                self.light_blurred(coarse, tile);
                let points = coarse.points(tile)?;
                coarse.clear_arriving();
                coarse.set_radiance(&vec![[0.0; 4]; points.len()]);
                let mut report = |rays: u32| {
                    rays_done += u64::from(rays);
                    progress.report(Stage::Records, rays_done, expected.max(rays_done));
                };
                let count = self.gather_finally(coarse, tile, &mut report, progress)?;
                Ok((points, coarse.radiance(tile)?, coarse.arriving(tile)?, count))
            })?;
            stats.non_finite.gather += count.non_finite;
            tally::add_step(stats, count);
            let branches = coarse.tracer.branches();
            let found = (0..).zip(points.iter().zip(light).zip(&arriving)).filter(|(_, ((p, _), _))| p.next_map != 0);
            for (slot, ((point, light), arriving)) in found {
                if let Some(pixel) = coarse.tracer.pixel(tile, slot / branches) {
                    taken.put(pixel, (slot % branches) as usize, point, light, arriving, coarse.final_rays());
                }
            }
            Ok(())
        })?;
        progress.report(Stage::Records, rays_done, rays_done);
        let spacing = record_spacing(size, self.estimate.gather_spacing, coarse.tracer.branches());
        let per_pixel = |coarse: u32, fine: u32| coarse as f32 / fine as f32;
        // Measured in the picture's pixels.
        let reach = self.estimate.gather_radius * coarse.tracer.pixel_height() * per_pixel(coarse.size.1, size.1);
        let grid = RecordGrid {
            first_column: window.column,
            first_row: window.row,
            columns: window.width,
            rows: window.height,
            columns_per_pixel: per_pixel(coarse.size.0, size.0),
            rows_per_pixel: per_pixel(coarse.size.1, size.1),
            reach,
            footprint: filter_footprint(self.estimate.gather_radius, spacing),
        };
        let tracer = &coarse.tracer;
        let radius = |position| reach * tracer.scale_at(position);
        let obstacles = coarse.obstacles;
        let between = |from, to| obstacles.first_between(from, to);
        let records = timed(&mut stats.seconds.gather, || taken.finish(self.estimate.gather_reach, radius, between));
        self.records = Some(IrradianceRecords::new(coarse.gpu, &records, grid)?);
        Ok(())
    }

    /// Adds the light of all maps. With final gathering, the visible points gather the caustic map
    /// only, and the ends of the rays gather all maps.
    fn gather(
        &mut self,
        pass: &CameraPass,
        tile: &Tile,
        film: &mut Film,
        stats: &mut Stats,
        progress: &dyn Progress,
    ) -> Result<()> {
        let mut seconds = 0.0;
        timed(&mut seconds, || self.light_blurred(pass, tile));
        let final_gathering = pass.final_rays() > 0;
        let gathered_here = |kind: MapKind| !final_gathering || kind == MapKind::Caustic;
        let kinds: Vec<MapKind> = self.maps.by_kind().map(|(kind, _)| kind).collect();
        let here = (0..kinds.len()).filter(|&index| gathered_here(kinds[index]));
        let here: Vec<(usize, u32)> = here.zip(1..).collect();
        let maps = here.len() as u32;
        let thinning = self.thinning.clone();
        let mut gather_here = || {
            here.iter().try_for_each(|&map| {
                self.gather_map(pass, tile, map, (&mut *film, &mut *stats), progress)?;
                // Light of thinned queries is not what it will be.
                let kind = LightComponent::Map(kinds[map.0]);
                if final_gathering { Ok(()) } else { pass.finished_component(tile, kind, film) }
            })
        };
        match &tile.listed {
            Some(listed) if final_gathering => {
                let turns = (&*listed.one_in, &*pass.tracer.keys_of_pixels(tile));
                thinning.run(pass.gpu, &pass.tracer.shared_points(tile), turns, maps, &mut gather_here)?;
            }
            None if final_gathering && maps > 0 && pass.may_go_on() => {
                pass.keep_light_of_maps(tile, &mut gather_here)?;
            }
            _ => gather_here()?,
        }
        if final_gathering {
            pass.finished_component(tile, LightComponent::Map(MapKind::Caustic), film)?;
        }
        if let Some(records) = &self.records {
            let view = pass.tracer.tile_view(tile);
            let buffers = (&pass.tracer.points, &pass.tracer.radiance, pass.tracer.lists());
            timed(&mut seconds, || records.light(pass.gpu, &view, buffers));
        }
        let count = timed(&mut seconds, || self.gather_finally(pass, tile, &mut |_| {}, progress))?;
        stats.seconds.gather += seconds;
        stats.non_finite.gather += count.non_finite;
        tally::add_step(stats, count);
        if final_gathering {
            pass.finished_component(tile, LightComponent::Map(MapKind::Global), film)?;
        }
        Ok(())
    }
}
