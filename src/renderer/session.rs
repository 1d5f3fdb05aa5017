//! A scene on the device, and the single stages of a render.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use super::{
    gatherer::{MapGatherer, Observer},
    maps::{PhotonMaps, trace_maps},
    obstacles::Obstacles,
    searches::gather_for,
    seen::Viewer,
    size::picture_size,
    tally,
    tiles::{CameraPass, Gatherer},
};
use crate::{
    bvh::{Bvh, Media, MediaProbe, contacts},
    emitters::light_table::LightTable,
    error::{Error, Result},
    gpu::Gpu,
    image::{Film, Frame},
    passes::{
        CameraKernels, EstimateSharing, FinalGather, IrradianceCache, IrradianceRecords, MapKernels, PathRanges,
        PhotonTracer, filter_footprint, record_spacing,
    },
    pixel_filter::PixelFilter,
    progress::{Progress, Stage},
    scene::Scene,
    settings::{
        Crop, EstimateSettings, LightSettings, PhotonSettings, PictureSettings, Search, Settings, check_samples,
    },
    stats::{DeviceStats, Stats, timed},
    upload::SceneBuffers,
};

/// Samples of each pixel of a grid.
const GRID_SAMPLES: u32 = 4;
/// Rays of final gathering that the preview of a picture traces at most, in all and for each pixel
/// of the picture: first, and where few of them bring most of the light.
const PREVIEW_RAYS: [(f64, f64); 2] = [((1 << 17) as f64, 2.0), ((1 << 19) as f64, 16.0)];

/// A finished render.
#[derive(Clone, Debug)]
pub struct Render {
    /// The picture.
    pub frame: Frame,
    /// Statistics of the render.
    pub stats: Stats,
}

/// A scene on the device. Photons are traced once for each call of [`Self::photon_maps`]; any
/// number of pictures can be made of the same maps.
#[derive(Debug)]
pub struct Session<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    buffers: SceneBuffers,
    /// Media that contain each of the scene's cameras.
    camera_media: Vec<Media>,
    bvh: Arc<Bvh>,
    /// What pictures show of the scene, where photons that are seen are counted.
    viewed: Option<PictureSettings>,
    stats: Stats,
    /// Number among the sessions of the process.
    id: u64,
}

/// Sessions that were opened so far.
static SESSIONS: AtomicU64 = AtomicU64::new(0);

impl<'a> Session<'a> {
    /// Builds the hierarchy and copies the scene to the device, with lights as the settings say.
    /// The peak of device memory is counted from here.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn open(gpu: &'a Gpu, scene: &'a Scene, lights: &LightSettings, progress: &dyn Progress) -> Result<Self> {
        Ok(Self::open_lit(gpu, scene, (lights, None), None, progress)?.remove(0))
    }

    /// Variant of [`Self::open`] for the settings of a picture; once for each group of the scene's
    /// lights, if there are any groups.
    pub(super) fn open_groups(
        gpu: &'a Gpu,
        scene: &'a Scene,
        settings: &Settings,
        groups: &[String],
        progress: &dyn Progress,
    ) -> Result<Vec<Self>> {
        let viewed = settings.counts_seen.then_some(&settings.picture);
        let groups = (!groups.is_empty()).then_some(groups);
        Self::open_lit(gpu, scene, (&settings.lights, viewed), groups, progress)
    }

    fn open_lit(
        gpu: &'a Gpu,
        scene: &'a Scene,
        (lights, viewed): (&LightSettings, Option<&PictureSettings>),
        groups: Option<&[String]>,
        progress: &dyn Progress,
    ) -> Result<Vec<Self>> {
        lights.check()?;
        scene.check_renderable()?;
        let mut stats = Stats {
            device: DeviceStats { name: gpu.name.clone(), driver: gpu.driver.clone() },
            warnings: scene.warnings.clone(),
            ..Stats::default()
        };
        gpu.memory.restart_peak();
        progress.report(Stage::Bvh, 0, 1);
        let bvh = Arc::new(timed(&mut stats.seconds.bvh, || Bvh::build_watched(scene, progress))?);
        // They are those of the whole light in each of its groups.
        let contacts = Arc::new(timed(&mut stats.seconds.bvh, || contacts(scene, &bvh)));
        let lit = |group: &String| scene.lit_by(group);
        let buffers = match groups {
            None => vec![SceneBuffers::with_contacts(gpu, (scene, &bvh), Arc::clone(&contacts), lights)?],
            Some(groups) => {
                let first = SceneBuffers::with_contacts(gpu, (&lit(&groups[0]), &bvh), Arc::clone(&contacts), lights)?;
                let others = groups[1..].iter().map(|group| first.relit(gpu, &lit(group), &bvh, lights));
                let others = others.collect::<Result<Vec<_>>>()?;
                std::iter::once(first).chain(others).collect()
            }
        };
        LightTable::check_names(buffers.iter().map(|buffers| &buffers.lights.table), lights)?;
        let solids = &buffers[0].solids;
        stats.warnings.extend(solids.warning());
        stats.warnings.extend(contacts.warning.clone());
        let probe = MediaProbe::new(scene, &bvh, solids);
        let camera_media: Vec<Media> =
            scene.cameras.iter().map(|camera| probe.at(camera.position.as_dvec3())).collect();
        let session = |buffers: SceneBuffers| {
            let mut stats = stats.clone();
            stats.warnings.extend(buffers.lights.warnings.iter().cloned());
            let id = SESSIONS.fetch_add(1, Ordering::Relaxed);
            let (bvh, viewed) = (Arc::clone(&bvh), viewed.cloned());
            Self { gpu, scene, buffers, camera_media: camera_media.clone(), bvh, viewed, stats, id }
        };
        Ok(buffers.into_iter().map(session).collect())
    }

    /// Starts to compile the kernels that a picture with these settings needs, in the order of
    /// their use, so that the first ones run while others compile. Kernels that were not requested
    /// here are compiled when they are needed.
    pub fn prefetch(&self, settings: &Settings) {
        let (gpu, scene) = (self.gpu, &self.buffers);
        let Settings { photons, estimate, picture, .. } = settings;
        if photons.mode.traces_photons() {
            PhotonTracer::prefetch(gpu, scene, photons.sampler);
            MapKernels::prefetch(gpu);
        }
        CameraKernels::prefetch(gpu, scene, photons, picture.light_samples);
        if photons.final_gather > 0 {
            FinalGather::prefetch(gpu, scene, photons.sampler);
        }
        if photons.mode.traces_photons() && estimate.search != Search::KdTree {
            gather_for(gpu, scene, estimate).prefetch(gpu, &estimate.into());
        }
        if photons.final_gather > 0 {
            IrradianceCache::prefetch(gpu);
            IrradianceRecords::prefetch(gpu);
        }
        if photons.mode.traces_photons() && estimate.search != Search::KdTree {
            EstimateSharing::prefetch(gpu);
        }
    }

    /// First pass: traces photons from the lights into a global and a caustic map.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn photon_maps(&self, settings: &PhotonSettings, progress: &dyn Progress) -> Result<PhotonMaps> {
        self.photon_maps_of(settings, &PathRanges::default(), progress)
    }

    /// Variant of [`Self::photon_maps`] with the photon paths of the given indices.
    pub(super) fn photon_maps_of(
        &self,
        settings: &PhotonSettings,
        paths: &PathRanges,
        progress: &dyn Progress,
    ) -> Result<PhotonMaps> {
        settings.check()?;
        let photons = (self.scene.has_specular(), paths, self.viewer()?);
        trace_maps(self.gpu, (&self.buffers, self.id), settings, photons, self.stats.clone(), progress)
    }

    fn viewer(&self) -> Result<Option<Viewer<'_>>> {
        let Some(picture) = &self.viewed else { return Ok(None) };
        let camera = self.scene.camera(picture.camera.as_deref())?;
        Ok(Some(Viewer { obstacles: self.obstacles(), camera, size: picture_size(camera, picture)? }))
    }

    fn obstacles(&self) -> Obstacles<'_> {
        Obstacles { scene: self.scene, bvh: &self.bvh }
    }

    /// Second pass: camera rays, direct light and the radiance estimate, tile by tile. Mode,
    /// bounces, sampler, seed and rays of final gathering are those of the maps. The statistics
    /// cover the maps and this picture; `total` is the sum of both.
    ///
    /// # Errors
    /// As [`super::render`]; [`Error::Setting`] for maps of another session.
    pub fn picture(
        &self,
        maps: &PhotonMaps,
        estimate: &EstimateSettings,
        picture: &PictureSettings,
        progress: &dyn Progress,
    ) -> Result<Render> {
        let (film, stats) = self.film(maps, estimate, picture, progress)?;
        Ok(Render { frame: film.finish(), stats })
    }

    /// Renders as [`Self::picture`], to a film that can be merged with those of other passes.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn film(
        &self,
        maps: &PhotonMaps,
        estimate: &EstimateSettings,
        picture: &PictureSettings,
        progress: &dyn Progress,
    ) -> Result<(Film, Stats)> {
        self.observed_film(maps, estimate, picture, None, progress)
    }

    /// Renders one sample of each pixel of the picture's grid. `stats` counts the time and the rays
    /// that it takes.
    pub(super) fn grid_film(
        &self,
        maps: &PhotonMaps,
        estimate: &EstimateSettings,
        picture: &PictureSettings,
        stats: &mut Stats,
        progress: &dyn Progress,
    ) -> Result<Film> {
        let mut gatherer = MapGatherer::new(self.gpu, &self.buffers, maps, estimate, None)?;
        let picture = PictureSettings { layers: Vec::new(), spp: GRID_SAMPLES, max_spp: None, ..picture.clone() };
        let pass = self.pass(maps, estimate, &picture)?.at_grid();
        let mut own = Stats::default();
        let mut films = pass.render(&mut gatherer, Stage::Camera, &mut own, progress)?;
        tally::finish_stats(self.gpu, &mut own);
        let Stats { rays, seconds, kernel_seconds, peak_device_bytes, .. } = own;
        stats.add(&Stats { rays, seconds, kernel_seconds, peak_device_bytes, ..Stats::default() });
        Ok(films.pop().expect("one picture"))
    }

    /// The camera pass of a picture.
    fn pass(
        &self,
        maps: &PhotonMaps,
        estimate: &EstimateSettings,
        picture: &PictureSettings,
    ) -> Result<CameraPass<'_>> {
        let number = self.scene.camera_number(picture.camera.as_deref())?;
        let camera = (&self.scene.cameras[number], self.camera_media[number]);
        let scene = (self.obstacles(), &self.buffers);
        let pass = CameraPass::new(self.gpu, scene, camera, maps.settings(), estimate, picture)?;
        pass.of_pass(picture, maps.first_sample)
    }

    /// Renders as [`Self::film`]. The observer receives the results of the estimates of each map
    /// and tile.
    pub(crate) fn observed_film<'b>(
        &'b self,
        maps: &'b PhotonMaps,
        estimate: &'b EstimateSettings,
        picture: &PictureSettings,
        observer: Option<&'b mut dyn Observer>,
        progress: &dyn Progress,
    ) -> Result<(Film, Stats)> {
        let mut seconds = 0.0;
        let gatherer = || MapGatherer::new(self.gpu, &self.buffers, maps, estimate, observer);
        let mut gatherer = timed(&mut seconds, gatherer)?;
        let (mut films, mut stats) = self.films(maps, estimate, picture, (&mut gatherer, Stage::Camera), progress)?;
        stats.seconds.grid += seconds;
        tally::finish_stats(self.gpu, &mut stats);
        Ok((films.pop().expect("one picture"), stats))
    }

    /// Renders the pictures of a gatherer; the caller finishes the statistics.
    pub(crate) fn films(
        &self,
        maps: &PhotonMaps,
        estimate: &EstimateSettings,
        picture: &PictureSettings,
        (gatherer, stage): (&mut dyn Gatherer, Stage),
        progress: &dyn Progress,
    ) -> Result<(Vec<Film>, Stats)> {
        estimate.check()?;
        picture.check()?;
        check_samples(maps.settings(), picture)?;
        if maps.session != self.id {
            let (name, value) = ("maps", format!("of session {}", maps.session));
            let problem = format!("this is session {}; its pictures take maps of its own photons", self.id);
            return Err(Error::Setting { name, value, problem });
        }
        let number = self.scene.camera_number(picture.camera.as_deref())?;
        let camera = (&self.scene.cameras[number], self.camera_media[number]);
        let scene = (self.obstacles(), &self.buffers);
        let pass = self.pass(maps, estimate, picture)?;
        let mut stats = maps.stats().clone();
        if estimate.keeps_irradiance() && pass.final_rays() > 0 && !maps.maps().is_empty() {
            // The preview of each pass looks at points of its own; that of the first is a single
            // picture's.
            let index = maps.first_sample.map(|first| first / picture.spp).filter(|index| *index > 0);
            let preview = |most| {
                let small = preview_of(picture, pass.size, maps.settings().final_gather, most);
                let preview = CameraPass::new(self.gpu, scene, camera, maps.settings(), estimate, &small)?;
                preview.of_pass(&small, index)
            };
            for most in PREVIEW_RAYS {
                if !gatherer.prepare(&preview(most)?.seeing_gleams(), &mut stats, progress)? {
                    break;
                }
            }
            let bright = gatherer.bright_places();
            if !bright.patches.is_empty() {
                gatherer.prepare_aimed(&preview(PREVIEW_RAYS[0])?.aiming_at(&bright), &mut stats, progress)?;
            }
        }
        let keeps_records = estimate.gather_spacing > 0 && pass.final_rays() > 0 && !maps.maps().is_empty();
        if keeps_records {
            let coarse = coarser(picture, &pass, estimate);
            let single = EstimateSettings { share_reach: 0.0, ..estimate.clone() };
            let records = CameraPass::new(self.gpu, scene, camera, maps.settings(), &single, &coarse)?;
            let index = maps.first_sample.map(|first| first / picture.spp).filter(|index| *index > 0);
            let records = records.of_pass(&coarse, index)?.with_joint_rays().gathering_coats();
            let records = records.seeing_by_cells(gatherer.blur());
            let records = records.aiming_at(&gatherer.bright_places());
            gatherer.keep_records(&records, pass.size, &mut stats, progress)?;
        }
        let pass = if keeps_records { pass.gathering_coats() } else { pass };
        let pass = pass.seeing_by_cells(gatherer.blur()).aiming_at(&gatherer.bright_places());
        let films = pass.render(gatherer, stage, &mut stats, progress)?;
        Ok((films, stats))
    }
}

/// Settings of a coarser version of the part of the picture that is traced, and what surrounds it
/// as far as the filter of records reaches. It has records for all of a tile: what they leave to
/// further rays, and whether a pixel's neighbours are uneven, is then the same whatever the crop.
fn coarser(picture: &PictureSettings, pass: &CameraPass, estimate: &EstimateSettings) -> PictureSettings {
    let (size, traced) = (pass.size, pass.tracer.tiled());
    let spacing = record_spacing(size, estimate.gather_spacing, pass.tracer.branches());
    let reach = filter_footprint(estimate.gather_radius, spacing);
    let along = |pixels: u32, origin: u32, count: u32| {
        let side = pixels.div_ceil(spacing);
        let scaled = |pixel: u32| (f64::from(pixel) * f64::from(side) / f64::from(pixels)) as u32;
        let first = scaled(origin).saturating_sub(reach + 1);
        (side, first, (scaled(origin + count) + reach + 2).min(side) - first)
    };
    let (columns, column, width) = along(size.0, traced.column, traced.width);
    let (rows, row, height) = along(size.1, traced.row, traced.height);
    PictureSettings {
        size: Some((columns, rows)),
        spp: 1,
        crop: Some(Crop { column, row, width, height }),
        max_spp: None,
        pixel_filter: PixelFilter::Box,
        ..picture.clone()
    }
}

/// Settings of a small version of the whole picture, with about as many rays of final gathering as
/// the constants say. It does not depend on the data window.
fn preview_of(picture: &PictureSettings, size: (u32, u32), rays: u32, most: (f64, f64)) -> PictureSettings {
    let pixels = f64::from(size.0) * f64::from(size.1);
    let most = most.0.min(most.1 * pixels);
    let scale = (most / f64::from(rays) / pixels).min(0.25).sqrt();
    let side = |pixels: u32| ((f64::from(pixels) * scale).round() as u32).max(1);
    PictureSettings { size: Some((side(size.0), side(size.1))), spp: 1, max_spp: None, crop: None, ..picture.clone() }
}
