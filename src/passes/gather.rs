//! Radiance from the k nearest photons. Kernels: `key_points`, `aim_search`,
//! `count_photons`, `gather`, `finish_gather`.

use super::{photon_map::PhotonMap, radix_sort::RadixSort};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{GATHER_STATE_BYTES, GatherInfo, Gathered, SEARCH_STATE_BYTES},
    progress::Progress,
};

/// Points that are searched together; more go in several batches.
const BATCH: u32 = 65_536;
/// Bits of a point's key: 30 of its place on the curve, and one that puts those without a place last.
const POINT_KEY_BITS: u32 = 31;
/// Queries of one invocation.
const PACKET: u32 = 4;
/// Packets that are searched or wait together.
const BLOCK: u64 = 8;
/// Of how many blocks of packets one is searched in each dispatch of the search: pilots first, the others start from
/// their radius; and rounds of counting in one submission.
const STRIDES: [(u32, u32); 3] = [(64, 4), (8, 3), (1, 2)];

/// The radiance estimate that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherSettings {
    /// k, photons of an estimate, 1 to 1000.
    pub neighbors: u32,
    /// C of the cone filter, ≥ 1.
    pub cone_constant: f32,
    /// Largest radius, metres.
    pub max_radius: Option<f32>,
}

/// How the kernels are compiled; for tests and benchmarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherOptions {
    /// Only photons that come from the viewer's side of the surface count. Without it the interpolated normal has no say either.
    pub side_test: bool,
    /// Loop iterations after which a query goes on in the next dispatch.
    pub step_budget: u32,
    /// Makes [`Gathered::fingerprint`]: the wrapping sum of a hash of the places in the sorted map of the photons summed.
    pub fingerprint: bool,
}

impl Default for GatherOptions {
    fn default() -> Self {
        Self { side_test: true, step_budget: 25_000, fingerprint: false }
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
pub struct Gather {
    options: GatherOptions,
    key: Kernel,
    radix: RadixSort,
    /// Search and sum for maps of one window and of two, compiled when first needed.
    search: [Option<Search>; 2],
    scratch: Option<Scratch>,
}

#[derive(Debug)]
struct Search {
    aim: Kernel,
    count: Kernel,
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
    valid: Buffer,
}

impl Gather {
    /// Compiles the kernels.
    #[must_use]
    pub fn new(gpu: &Gpu, options: GatherOptions) -> Self {
        let key = Kernel::new(gpu, "key_points", &[]);
        let mut gather = Self { options, key, radix: RadixSort::new(gpu), search: [None, None], scratch: None };
        gather.compile(gpu, 1);
        gather
    }

    /// Adds the radiance of the first `count` points (`array<VisiblePoint>`) to `radiance` (`array<vec4f>`), and writes the
    /// radius and number of photons of each valid one to `gathered` (`array<Gathered>`).
    ///
    /// # Errors
    /// [`crate::Error::Stopped`] when `progress` says so, [`crate::Error::Gpu`] if the driver fails.
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
        self.run_turn(gpu, map, points, (count, u32::MAX), settings, results, progress)
    }

    /// As [`Self::run`], for those of the first `count` points that wait for the estimate of a turn; see
    /// [`crate::layout::VisiblePoint::valid`].
    ///
    /// # Errors
    /// As [`Self::run`].
    #[allow(clippy::too_many_arguments)]
    pub fn run_turn(
        &mut self,
        gpu: &Gpu,
        map: &PhotonMap,
        points: &Buffer,
        (count, turn): (u32, u32),
        settings: &GatherSettings,
        (radiance, gathered): (&Buffer, &Buffer),
        progress: &dyn Progress,
    ) -> Result<GatherStats> {
        self.compile(gpu, map.windows());
        if self.scratch.as_ref().is_none_or(|s| s.capacity < count.min(BATCH)) {
            self.scratch = Some(Scratch::new(gpu, count.min(BATCH))?);
        }
        let mut stats = GatherStats::default();
        for first in (0..count).step_by(BATCH as usize) {
            let info = GatherInfo {
                count: BATCH.min(count - first),
                first,
                neighbors: settings.neighbors,
                cone_constant: settings.cone_constant,
                max_radius_squared: settings.max_radius.map_or(-1.0, |r| r * r),
                per_path: (1.0 / map.emitted().max(1) as f64) as f32,
                turn,
                ..GatherInfo::default()
            };
            stats.dispatches += self.run_batch(gpu, map, &info, [points, radiance, gathered], progress)?;
        }
        Ok(stats)
    }

    /// One batch: sort, then search and sum until no query is open. Returns the number of dispatches.
    fn run_batch(
        &self,
        gpu: &Gpu,
        map: &PhotonMap,
        info: &GatherInfo,
        [points, radiance, gathered]: [&Buffer; 3],
        progress: &dyn Progress,
    ) -> Result<u32> {
        let scratch = self.scratch.as_ref().expect("run has made it");
        let (entries, valid) = self.order(gpu, map, info, points, scratch)?;
        if valid == 0 {
            return Ok(0);
        }
        let Search { aim, count, sum, finish } =
            self.search[map.windows() as usize - 1].as_ref().expect("run has compiled it");
        let mut buffers = map.bindings().to_vec();
        buffers.extend([
            ("points", points),
            ("entries", entries),
            ("states", &scratch.states),
            ("open_count", &scratch.open),
            ("sums_left", &scratch.sums),
            ("radiance", radiance),
            ("gathered", gathered),
        ]);
        let with_info = |info| [buffers.as_slice(), &[("gather_info", info)]].concat();
        let infos =
            STRIDES.map(|(stride, _)| gpu.uniform("gather info", &GatherInfo { count: valid, stride, ..*info }));
        let search_bindings =
            infos.each_ref().map(|info| (aim.bind(gpu, &with_info(info)), count.bind(gpu, &with_info(info))));
        let (sum_bindings, finish_bindings) =
            (sum.bind(gpu, &with_info(&infos[0])), finish.bind(gpu, &with_info(&infos[0])));
        let packets = u64::from(valid.div_ceil(PACKET));
        let mut dispatches = 0;
        loop {
            progress.check()?;
            let mut encoder = gpu.encoder();
            if dispatches == 0 {
                encoder.clear_buffer(&scratch.states, 0, None);
                encoder.clear_buffer(&scratch.sums, 0, None);
            }
            encoder.clear_buffer(&scratch.open, 0, None);
            for ((aim_bindings, count_bindings), (stride, rounds)) in search_bindings.iter().zip(STRIDES) {
                let packets = packets.div_ceil(BLOCK).div_ceil(stride.into()) * BLOCK;
                for _ in 0..rounds {
                    aim.dispatch(&mut encoder, aim_bindings, packets * u64::from(PACKET));
                    count.dispatch(&mut encoder, count_bindings, packets);
                }
                aim.dispatch(&mut encoder, aim_bindings, packets * u64::from(PACKET));
            }
            sum.dispatch(&mut encoder, &sum_bindings, packets);
            finish.dispatch(&mut encoder, &finish_bindings, valid.into());
            gpu.submit(encoder);
            dispatches += 1;
            if gpu.read::<u32>(&scratch.open, 0, 1)?[0] == 0 {
                return Ok(dispatches);
            }
        }
    }

    /// Sorts the points of a batch, the valid ones first; returns their order and the number of valid ones.
    fn order<'s>(
        &self,
        gpu: &Gpu,
        map: &PhotonMap,
        info: &GatherInfo,
        points: &Buffer,
        scratch: &'s Scratch,
    ) -> Result<(&'s Buffer, u32)> {
        let uniform = gpu.uniform("gather info", info);
        let mut buffers = map.bindings().to_vec();
        buffers.extend([
            ("gather_info", &uniform),
            ("points", points),
            ("keyed", &scratch.entries[0]),
            ("valid_count", &scratch.valid),
        ]);
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&scratch.valid, 0, None);
        self.key.dispatch(&mut encoder, &self.key.bind(gpu, &buffers), info.count.into());
        gpu.submit(encoder);
        let sorted = self.radix.sort(gpu, [&scratch.entries[0], &scratch.entries[1]], info.count, POINT_KEY_BITS)?;
        Ok((&scratch.entries[sorted], gpu.read::<u32>(&scratch.valid, 0, 1)?[0]))
    }

    /// Compiles search and sum for maps of that many windows, once.
    fn compile(&mut self, gpu: &Gpu, windows: u32) {
        let common = [
            ("WINDOWS", f64::from(windows)),
            ("SIDE_TEST", f64::from(u8::from(self.options.side_test))),
            ("STEP_BUDGET", f64::from(self.options.step_budget)),
            ("FINGERPRINT", f64::from(u8::from(self.options.fingerprint))),
        ];
        self.search[windows as usize - 1].get_or_insert_with(|| {
            let kernel = |stem| Kernel::new(gpu, stem, &common);
            Search {
                aim: kernel("aim_search"),
                count: kernel("count_photons"),
                sum: kernel("gather"),
                finish: kernel("finish_gather"),
            }
        });
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
            valid: gpu.storage::<u32>("valid points", 1)?,
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
