//! Radiance from the photons around a point: batches of queries are sorted, searched and summed.

use super::{
    gather_kernels::{Compiled, GatherKernels, Variant},
    query_order::QueryOrder,
};
use crate::{
    density::Density,
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{self, GATHER_STATE_BYTES, GatherInfo, Gathered, SEARCH_STATE_BYTES},
    passes::maps::photon_map::PhotonMap,
    progress::Progress,
    settings::{EstimateSettings, Search},
    upload::SceneBuffers,
};

pub use super::gather_kernels::GatherOptions;

/// Points of one batch, as a fraction of those that the device is handed at once: an invocation
/// answers four of them.
const BATCH_PART: u64 = 2;
/// Packets of a block, which are searched or deferred together.
const BLOCK: u64 = layout::PACKET_BLOCK as u64;
/// Queries of one invocation.
const PACKET: u32 = layout::QUERY_BLOCK / layout::PACKET_BLOCK;
// The shaders hold them in the components of vectors.
const _: () = assert!(PACKET == 4);
/// Stride over the blocks of packets in each dispatch of the search: pilots are searched first, and
/// the other blocks start from their radii.
const STRIDES: [u32; 3] = [layout::FIRST_PILOT_STRIDE, layout::PILOT_STRIDE, 1];

/// Lists of surveyed queries, each with a word for the number of its own.
const SURVEY_LISTS: u64 = 2;
/// Rays that measure the existing area of a partly covered disc.
const SURVEY_SAMPLES: usize = 24;

/// Parameters of the radiance estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherSettings {
    /// k, number of photons of an estimate, 1 to 1000.
    pub neighbors: u32,
    /// Fixed radius of the estimate, metres: all photons within it are summed, and `neighbors` and
    /// `max_radius` are ignored.
    pub radius: Option<f32>,
    /// Largest radius, metres.
    pub max_radius: Option<f32>,
    /// Density kernel, and how far it is softened ([`Density::softened`]).
    pub density: Density,
    pub softness: u32,
}

impl GatherSettings {
    /// Kernels for a map of that many segments.
    fn variant(&self, segments: u32) -> Variant {
        Variant::new(self.density.softened(self.softness), self.radius.is_some(), segments)
    }
}

impl From<&EstimateSettings> for GatherSettings {
    /// Few photons are weighed as in [`Density::of_few`], unless the estimate is raw.
    fn from(settings: &EstimateSettings) -> Self {
        let radius = settings.radius.filter(|_| settings.search == Search::Radius);
        let (density, k) = (settings.density(), settings.neighbors);
        let is_plain = settings.raw || radius.is_some();
        let (neighbors, softness) = if is_plain { (k, 0) } else { density.of_few(k) };
        Self { neighbors, radius, max_radius: settings.max_radius, density, softness }
    }
}

/// Counts of one gather.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GatherStats {
    /// Dispatches until no query was open, over all batches.
    pub dispatches: u32,
}

/// The compiled kernels and the memory of one batch.
#[derive(Debug)]
pub struct Gather<'s> {
    order: QueryOrder,
    kernels: GatherKernels<'s>,
    scratch: Option<Scratch>,
}

/// Memory of one batch.
#[derive(Debug)]
struct Scratch {
    capacity: u32,
    entries: [Buffer; 2],
    states: Buffer,
    sums: Buffer,
    open: Buffer,
    /// Lists of the queries that the second and the third kernel of the survey go on with.
    listed: Buffer,
}

impl<'s> Gather<'s> {
    /// Gather without surfaces: `rejects` and `corrects` are ignored.
    #[must_use]
    pub fn new(gpu: &Gpu, options: GatherOptions) -> Self {
        Self::with_scene(gpu, None, GatherOptions { rejects: false, corrects: false, ..options })
    }

    /// Gather among the surfaces of the scene.
    #[must_use]
    pub fn over(gpu: &Gpu, scene: &'s SceneBuffers, options: GatherOptions) -> Self {
        Self::with_scene(gpu, Some(scene), options)
    }

    fn with_scene(gpu: &Gpu, scene: Option<&'s SceneBuffers>, options: GatherOptions) -> Self {
        Self { order: QueryOrder::new(gpu), kernels: GatherKernels::new(scene, options), scratch: None }
    }

    /// Starts to compile the kernels for maps of one segment in the background.
    pub fn prefetch(&mut self, gpu: &Gpu, settings: &GatherSettings) {
        self.kernels.compile(gpu, settings.variant(1));
    }

    /// Adds the radiance of the first `count` points (`array<VisiblePoint>`) to the first of
    /// `results` (`array<vec4f>`), and writes the radius and number of photons of each to the
    /// second (`array<Gathered>`).
    ///
    /// # Errors
    /// [`crate::Error::Stopped`] when `progress` says so, [`crate::Error::Gpu`] if the driver
    /// fails.
    #[allow(clippy::too_many_arguments)]
    pub fn run(
        &mut self,
        gpu: &Gpu,
        map: &PhotonMap,
        points: &Buffer,
        count: u32,
        settings: &GatherSettings,
        results: (&Buffer, &Buffer),
        progress: &dyn Progress,
    ) -> Result<GatherStats> {
        self.run_waiting(gpu, map, points, (count, u32::MAX), settings, results, progress)
    }

    /// Variant of [`Self::run`] for those of the first `count` points that wait for the estimate of
    /// the map of that number; see [`crate::layout::VisiblePoint::next_map`].
    ///
    /// # Errors
    /// As [`Self::run`].
    #[allow(clippy::too_many_arguments)]
    pub fn run_waiting(
        &mut self,
        gpu: &Gpu,
        map: &PhotonMap,
        points: &Buffer,
        (count, map_number): (u32, u32),
        settings: &GatherSettings,
        (radiance, gathered): (&Buffer, &Buffer),
        progress: &dyn Progress,
    ) -> Result<GatherStats> {
        let polynomial = settings.density.softened(settings.softness);
        let compiled = self.kernels.compile(gpu, settings.variant(map.segments()));
        let most = count.min(largest_batch(gpu));
        if self.scratch.as_ref().is_none_or(|s| s.capacity < most) {
            self.scratch = Some(Scratch::new(gpu, most)?);
        }
        let [first_four @ .., fifth] = polynomial.from_rim().map(|c| c as f32);
        let quantile = |i| polynomial.quantile((i as f64 + 0.5) / SURVEY_SAMPLES as f64) as f32;
        let radii = gpu.storage_with("survey radii", &(0..SURVEY_SAMPLES).map(quantile).collect::<Vec<_>>())?;
        let mut stats = GatherStats::default();
        for first in (0..count).step_by(most.max(1) as usize) {
            let info = GatherInfo {
                count: most.min(count - first),
                first,
                neighbors: settings.neighbors,
                fixed_radius: u32::from(settings.radius.is_some()),
                max_radius_squared: settings.radius.or(settings.max_radius).map_or(-1.0, |r| r * r),
                per_path: (1.0 / map.emitted().max(1) as f64) as f32,
                map_number,
                kernel_mean: polynomial.mean() as f32,
                kernel: first_four,
                kernel_fifth: fifth,
                ..GatherInfo::default()
            };
            stats.dispatches += self.run_batch(
                gpu,
                map,
                self.kernels.at(compiled),
                &info,
                [points, radiance, gathered, &radii],
                progress,
            )?;
        }
        Ok(stats)
    }

    /// Runs one batch: sorts its points, then searches and sums until no query is open. Returns the
    /// number of dispatches.
    fn run_batch(
        &self,
        gpu: &Gpu,
        map: &PhotonMap,
        Compiled { search, survey, sum, finish }: &Compiled,
        info: &GatherInfo,
        [points, radiance, gathered, radii]: [&Buffer; 4],
        progress: &dyn Progress,
    ) -> Result<u32> {
        let scratch = self.scratch.as_ref().expect("run has made it");
        let (entries, waiting) = self.order.sort(gpu, map, info, points, &scratch.entries)?;
        if waiting == 0 {
            return Ok(0);
        }
        let mut buffers = map.bindings().to_vec();
        buffers.extend([
            ("points", points),
            ("entries", entries),
            ("states", &scratch.states),
            ("open_count", &scratch.open),
            ("listed", &scratch.listed),
            ("sums_left", &scratch.sums),
            ("radii", radii),
            ("radiance", radiance),
            ("gathered", gathered),
        ]);
        let of_map = |kernel: &Kernel| kernel.clone().with_tables(&map.tables());
        let (search, sum, finish) = (&of_map(search), &of_map(sum), &of_map(finish));
        let with_info = |info| [buffers.as_slice(), &[("gather_info", info)]].concat();
        let lanes = u64::from(gpu.lanes.of_packet);
        let strides = if lanes == 1 { &STRIDES[..] } else { &[1] };
        let info = |stride| gpu.uniform("gather info", &GatherInfo { count: waiting, stride, ..*info });
        let infos: Vec<_> = strides.iter().map(|&stride| info(stride)).collect();
        let search_bindings: Vec<_> = infos.iter().map(|info| search.bind(gpu, &with_info(info))).collect();
        let (sum_bindings, finish_bindings) =
            (sum.bind(gpu, &with_info(&infos[0])), finish.bind(gpu, &with_info(&infos[0])));
        let survey = survey.as_ref().zip(self.kernels.scene);
        let survey = survey.map(|(kernels, scene)| {
            kernels.each_ref().map(|kernel| (kernel, kernel.bind(gpu, &scene.with(&with_info(&infos[0])))))
        });
        let packets = u64::from(waiting.div_ceil(PACKET));
        let mut dispatches = 0;
        loop {
            progress.check()?;
            let mut encoder = gpu.encoder();
            if dispatches == 0 {
                encoder.clear_buffer(&scratch.states, 0, None);
                encoder.clear_buffer(&scratch.sums, 0, None);
            }
            encoder.clear_buffer(&scratch.open, 0, None);
            for (bindings, &stride) in search_bindings.iter().zip(strides) {
                let packets = packets.div_ceil(BLOCK).div_ceil(stride.into()) * BLOCK;
                search.dispatch(&mut encoder, bindings, packets * lanes);
            }
            encoder.clear_buffer(&scratch.listed, 0, Some(SURVEY_LISTS * size_of::<u32>() as u64));
            for (survey, bindings) in survey.iter().flatten() {
                survey.dispatch(&mut encoder, bindings, waiting.into());
            }
            sum.dispatch(&mut encoder, &sum_bindings, packets * lanes);
            finish.dispatch(&mut encoder, &finish_bindings, waiting.into());
            gpu.submit(encoder);
            dispatches += 1;
            if gpu.read::<u32>(&scratch.open, 0, 1)?[0] == 0 {
                return Ok(dispatches);
            }
        }
    }
}

/// Maximum number of points of one batch.
fn largest_batch(gpu: &Gpu) -> u32 {
    let held = gpu.max_binding() / GATHER_STATE_BYTES as u64 * u64::from(PACKET);
    (gpu.batch / BATCH_PART).min(held) as u32
}

impl Scratch {
    fn new(gpu: &Gpu, capacity: u32) -> Result<Self> {
        let packets = u64::from(capacity.div_ceil(PACKET));
        Ok(Self {
            capacity,
            entries: [
                gpu.storage::<[u32; 2]>("query order", capacity.into())?,
                gpu.storage::<[u32; 2]>("query order", capacity.into())?,
            ],
            states: gpu.storage::<[u8; SEARCH_STATE_BYTES]>("search states", packets * u64::from(PACKET))?,
            sums: gpu.storage::<[u8; GATHER_STATE_BYTES]>("unfinished sums", packets)?,
            open: gpu.storage::<u32>("open packets", 1)?,
            listed: gpu.storage::<u32>("surveyed queries", SURVEY_LISTS * (1 + u64::from(capacity)))?,
        })
    }
}

/// Buffer for the results of `count` points.
///
/// # Errors
/// [`crate::Error::Limit`] if one binding cannot hold them.
pub fn gathered_buffer(gpu: &Gpu, count: u32) -> Result<Buffer> {
    gpu.storage::<Gathered>("gathered", count.into())
}
