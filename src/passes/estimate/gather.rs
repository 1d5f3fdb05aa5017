//! Radiance from the photons around a point. Kernels: `mark_points`, `key_points`, `search_radius`,
//! `survey_surface`, `gather`, `finish_gather`.

use crate::{
    density::Density,
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{self, GATHER_STATE_BYTES, GatherInfo, Gathered, SEARCH_STATE_BYTES},
    passes::maps::{
        photon_map::PhotonMap,
        radix_sort::{RadixSort, scan_levels},
    },
    progress::Progress,
    settings::{EstimateSettings, Search},
    upload::SceneBuffers,
};

/// Points that are searched together; more go in several batches.
const BATCH: u32 = 32_768;
/// Bits of a point's key: the upper word of its Hilbert key.
const POINT_KEY_BITS: u32 = 3 * layout::KEY_BITS;
/// By how many of them, the highest, up to so many points are sorted: few points have few blocks of
/// packets to be dealt to, and lie in the order of pixels, which near ones keep. More are sorted by
/// all.
const FEW_SORTED_BITS: [(u32, u32); 2] = [(4096, 8), (16_384, 16)];
/// Packets that are searched or wait together.
const BLOCK: u64 = layout::PACKET_BLOCK as u64;
/// Queries of one invocation.
const PACKET: u32 = layout::QUERY_BLOCK / layout::PACKET_BLOCK;
// The shaders hold them in the components of vectors.
const _: () = assert!(PACKET == 4);
/// Of how many blocks of packets one is searched in each dispatch of the search: pilots first, the
/// others start from the radii of these.
const STRIDES: [u32; 3] = [layout::FIRST_PILOT_STRIDE, layout::PILOT_STRIDE, 1];

/// The radiance estimate that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherSettings {
    /// k, photons of an estimate, 1 to 1000.
    pub neighbors: u32,
    /// Radius of the estimate, metres: all photons within it count, whatever `neighbors` and
    /// `max_radius` are.
    pub radius: Option<f32>,
    /// Largest radius, metres.
    pub max_radius: Option<f32>,
    /// The kernel.
    pub density: Density,
}

impl From<&EstimateSettings> for GatherSettings {
    fn from(settings: &EstimateSettings) -> Self {
        Self {
            neighbors: settings.neighbors,
            radius: settings.radius.filter(|_| settings.search == Search::Radius),
            max_radius: settings.max_radius,
            density: settings.density(),
        }
    }
}

/// Rays that measure the area of a disc of which some is missing.
const SURVEY_SAMPLES: usize = 24;
/// Nodes and primitives that one of them visits at most; together they stay within what software
/// Vulkan can loop.
const SURVEY_TRACE_BUDGET: u32 = 230;
// Software Vulkan ends all loops of a subgroup after 65,535 iterations in total.
const _: () = assert!(layout::MOST_RAYS * (SURVEY_TRACE_BUDGET + 1) < 65_535);

/// How the kernels are compiled; for tests and benchmarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherOptions {
    /// Only photons that come from the viewer's side of the surface count. Without it the
    /// interpolated normal has no say either.
    pub side_test: bool,
    /// Loop iterations after which a query goes on in the next dispatch.
    pub step_budget: u32,
    /// Makes [`Gathered::fingerprint`]: the wrapping sum of a hash of the places in the sorted map
    /// of the photons summed.
    pub fingerprint: bool,
    /// Photons that do not lie on the point's surface, as far as it is flat and no wall stands on
    /// it, are not summed.
    pub rejects: bool,
    /// The estimate divides by the area of that surface that is there.
    pub corrects: bool,
}

impl GatherOptions {
    /// Both halves of the estimate on flat surfaces; each alone is wrong at edges and corners.
    #[must_use]
    pub fn flat() -> Self {
        Self { rejects: true, corrects: true, ..Self::default() }
    }

    fn surveys(self) -> bool {
        self.rejects || self.corrects
    }
}

impl Default for GatherOptions {
    fn default() -> Self {
        Self { side_test: true, step_budget: 25_000, fingerprint: false, rejects: false, corrects: false }
    }
}

/// What a gather did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GatherStats {
    /// Dispatches until no query was open, over all batches.
    pub dispatches: u32,
}

/// The compiled kernels and the memory of one batch.
#[derive(Debug)]
pub struct Gather<'s> {
    options: GatherOptions,
    /// Where the surfaces are, if they matter.
    scene: Option<&'s SceneBuffers>,
    mark: Kernel,
    key: Kernel,
    radix: RadixSort,
    /// Search and sum, each variant compiled when first needed.
    compiled: Vec<(Variant, Compiled)>,
    scratch: Option<Scratch>,
}

/// What the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Variant {
    /// Windows of the map.
    windows: u32,
    /// Coefficients of the kernel's polynomial, and its power of the distance.
    moments: u32,
    power: u32,
    /// The search does not know how many photons are summed.
    counts: bool,
}

impl Variant {
    fn of(settings: &GatherSettings, windows: u32) -> Self {
        let polynomial = settings.density.polynomial();
        let (moments, power) = (polynomial.moments, polynomial.power);
        Self { windows, moments, power, counts: settings.radius.is_some() }
    }
}

#[derive(Debug)]
struct Compiled {
    search: Kernel,
    survey: Option<Kernel>,
    sum: Kernel,
    finish: Kernel,
}

#[derive(Debug)]
struct Scratch {
    capacity: u32,
    entries: [Buffer; 2],
    states: Buffer,
    sums: Buffer,
    open: Buffer,
}

impl<'s> Gather<'s> {
    /// A gather that knows nothing of surfaces: `rejects` and `corrects` are passed over.
    #[must_use]
    pub fn new(gpu: &Gpu, options: GatherOptions) -> Self {
        Self::with_scene(gpu, None, GatherOptions { rejects: false, corrects: false, ..options })
    }

    /// A gather among the surfaces of the scene.
    #[must_use]
    pub fn over(gpu: &Gpu, scene: &'s SceneBuffers, options: GatherOptions) -> Self {
        Self::with_scene(gpu, Some(scene), options)
    }

    fn with_scene(gpu: &Gpu, scene: Option<&'s SceneBuffers>, options: GatherOptions) -> Self {
        let kernel = |stem| Kernel::new(gpu, stem, &[]);
        let (mark, key) = (kernel("mark_points"), kernel("key_points"));
        Self { options, scene, mark, key, radix: RadixSort::new(gpu), compiled: Vec::new(), scratch: None }
    }

    /// Has the kernels compiled for maps of one window, while others run.
    pub fn prefetch(&mut self, gpu: &Gpu, settings: &GatherSettings) {
        self.compile(gpu, Variant::of(settings, 1));
    }

    /// Adds the radiance of the first `count` points (`array<VisiblePoint>`) to `radiance`
    /// (`array<vec4f>`), and writes the radius and number of photons of each to `gathered`
    /// (`array<Gathered>`).
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

    /// As [`Self::run`], for those of the first `count` points that wait for the estimate of a map,
    /// given by its number; see [`crate::layout::VisiblePoint::next_map`].
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
        let polynomial = settings.density.polynomial();
        let compiled = self.compile(gpu, Variant::of(settings, map.windows()));
        if self.scratch.as_ref().is_none_or(|s| s.capacity < count.min(BATCH)) {
            self.scratch = Some(Scratch::new(gpu, count.min(BATCH))?);
        }
        let [first_four @ .., fifth] = polynomial.from_rim().map(|c| c as f32);
        let quantile = |i| polynomial.quantile((i as f64 + 0.5) / SURVEY_SAMPLES as f64) as f32;
        let radii = gpu.storage_with("survey radii", &(0..SURVEY_SAMPLES).map(quantile).collect::<Vec<_>>())?;
        let mut stats = GatherStats::default();
        for first in (0..count).step_by(BATCH as usize) {
            let info = GatherInfo {
                count: BATCH.min(count - first),
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
                &self.compiled[compiled].1,
                &info,
                [points, radiance, gathered, &radii],
                progress,
            )?;
        }
        Ok(stats)
    }

    /// One batch: sort, then search and sum until no query is open. Returns the number of
    /// dispatches.
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
        let (entries, waiting) = self.order(gpu, map, info, points, scratch)?;
        if waiting == 0 {
            return Ok(0);
        }
        let mut buffers = map.bindings().to_vec();
        buffers.extend([
            ("points", points),
            ("entries", entries),
            ("states", &scratch.states),
            ("open_count", &scratch.open),
            ("sums_left", &scratch.sums),
            ("radii", radii),
            ("radiance", radiance),
            ("gathered", gathered),
        ]);
        let with_info = |info| [buffers.as_slice(), &[("gather_info", info)]].concat();
        let infos = STRIDES.map(|stride| gpu.uniform("gather info", &GatherInfo { count: waiting, stride, ..*info }));
        let search_bindings = infos.each_ref().map(|info| search.bind(gpu, &with_info(info)));
        let (sum_bindings, finish_bindings) =
            (sum.bind(gpu, &with_info(&infos[0])), finish.bind(gpu, &with_info(&infos[0])));
        let survey = survey.as_ref().zip(self.scene);
        let survey = survey.map(|(kernel, scene)| (kernel, kernel.bind(gpu, &scene.with(&with_info(&infos[0])))));
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
            for (bindings, stride) in search_bindings.iter().zip(STRIDES) {
                let packets = packets.div_ceil(BLOCK).div_ceil(stride.into()) * BLOCK;
                search.dispatch(&mut encoder, bindings, packets);
            }
            if let Some((survey, bindings)) = &survey {
                survey.dispatch(&mut encoder, bindings, waiting.into());
            }
            sum.dispatch(&mut encoder, &sum_bindings, packets);
            finish.dispatch(&mut encoder, &finish_bindings, waiting.into());
            gpu.submit(encoder);
            dispatches += 1;
            if gpu.read::<u32>(&scratch.open, 0, 1)?[0] == 0 {
                return Ok(dispatches);
            }
        }
    }

    /// Sorts the points of a batch that wait; returns their order and number.
    fn order<'b>(
        &self,
        gpu: &Gpu,
        map: &PhotonMap,
        info: &GatherInfo,
        points: &Buffer,
        scratch: &'b Scratch,
    ) -> Result<(&'b Buffer, u32)> {
        let uniform = gpu.uniform("gather info", info);
        let marks = scan_levels(gpu, u64::from(info.count) + 1)?;
        let mut buffers = map.bindings().to_vec();
        buffers.extend([
            ("gather_info", &uniform),
            ("points", points),
            ("values", &marks[0]),
            ("places", &marks[0]),
            ("keyed", &scratch.entries[0]),
        ]);
        let mut encoder = gpu.encoder();
        self.mark.dispatch(&mut encoder, &self.mark.bind(gpu, &buffers), u64::from(info.count) + 1);
        self.radix.prefix_sums(gpu, &mut encoder, &marks);
        self.key.dispatch(&mut encoder, &self.key.bind(gpu, &buffers), info.count.into());
        gpu.submit(encoder);
        let waiting = gpu.read::<u32>(&marks[0], info.count.into(), 1)?[0];
        let entries = [&scratch.entries[0], &scratch.entries[1]];
        let bits = FEW_SORTED_BITS.iter().find(|(most, _)| waiting <= *most).map_or(POINT_KEY_BITS, |(_, bits)| *bits);
        let sorted = self.radix.sort(gpu, entries, waiting, POINT_KEY_BITS - bits..POINT_KEY_BITS)?;
        Ok((&scratch.entries[sorted], waiting))
    }

    /// Place of the kernels of a variant, which are compiled once.
    fn compile(&mut self, gpu: &Gpu, variant: Variant) -> usize {
        if let Some(place) = self.compiled.iter().position(|(v, _)| *v == variant) {
            return place;
        }
        let overrides = [
            ("WINDOWS", f64::from(variant.windows)),
            ("MOMENTS", f64::from(variant.moments)),
            ("POWER", f64::from(variant.power)),
            ("COUNTS", f64::from(u8::from(variant.counts))),
            ("SIDE_TEST", f64::from(u8::from(self.options.side_test))),
            ("STEP_BUDGET", f64::from(self.options.step_budget)),
            ("FINGERPRINT", f64::from(u8::from(self.options.fingerprint))),
            ("REJECTS", f64::from(u8::from(self.options.rejects))),
            ("CORRECTS", f64::from(u8::from(self.options.corrects))),
        ];
        let kernel = |stem| Kernel::new(gpu, stem, &overrides);
        let with_budget = [overrides.as_slice(), &[("TRACE_BUDGET", SURVEY_TRACE_BUDGET.into())]].concat();
        let survey = |scene: &SceneBuffers| scene.kernel_with(gpu, "survey_surface", &with_budget);
        let compiled = Compiled {
            search: kernel("search_radius"),
            survey: self.scene.filter(|_| self.options.surveys()).map(survey),
            sum: kernel("gather"),
            finish: kernel("finish_gather"),
        };
        self.compiled.push((variant, compiled));
        self.compiled.len() - 1
    }
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
        })
    }
}

/// A buffer for the results of `count` points.
///
/// # Errors
/// [`crate::Error::Limit`] if one binding cannot hold them.
pub fn gathered_buffer(gpu: &Gpu, count: u32) -> Result<Buffer> {
    gpu.storage::<Gathered>("gathered", count.into())
}
