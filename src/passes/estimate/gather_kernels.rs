//! Kernels of the search and the sum, and what they are compiled for. Kernels: `search_radius`,
//! `survey_surface`, `survey_area`, `survey_narrow`, `gather`, `finish_gather`.

use crate::{
    density::Polynomial,
    gpu::{Gpu, Kernel},
    layout,
    upload::SceneBuffers,
};

/// Maximum of the nodes and primitives that one survey ray visits. Together the rays stay within
/// the loop iterations of software Vulkan.
const SURVEY_TRACE_BUDGET: u32 = 230;
// Software Vulkan ends all loops of a subgroup after 65,535 iterations in total.
const _: () = assert!(layout::MAX_RAYS * (SURVEY_TRACE_BUDGET + 1) < 65_535);

/// Options that the kernels are compiled with; for tests and benchmarks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherOptions {
    /// Counts only photons that arrive on the viewer's side of the surface. Without it the
    /// interpolated normal is not tested either.
    pub side_test: bool,
    /// Loop iterations after which a query continues in the next dispatch.
    pub step_budget: u32,
    /// Computes [`Gathered::fingerprint`](layout::Gathered::fingerprint): the wrapping sum of a
    /// hash of the positions of the summed photons in the sorted map.
    pub fingerprint: bool,
    /// Leaves out photons that do not lie on the point's surface, as far as it is flat and no wall
    /// stands on it.
    pub rejects: bool,
    /// Divides the estimate by the existing area of that surface within the disc.
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

/// Constants that one set of kernels is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Variant {
    /// Segments of the map.
    segments: u32,
    /// Coefficients of the density kernel's polynomial, and its power of the distance.
    moments: u32,
    power: u32,
    /// The radius is fixed, and the search does not know how many photons are summed.
    counts: bool,
}

impl Variant {
    pub(super) fn new(kernel: Polynomial, fixed_radius: bool, segments: u32) -> Self {
        Self { segments, moments: kernel.moments, power: kernel.power, counts: fixed_radius }
    }
}

/// Kernels of one variant.
#[derive(Debug)]
pub(super) struct Compiled {
    pub(super) search: Kernel,
    pub(super) survey: Option<[Kernel; 3]>,
    pub(super) sum: Kernel,
    pub(super) finish: Kernel,
}

/// Kernels of all variants, each compiled when first needed.
#[derive(Debug)]
pub(super) struct GatherKernels<'s> {
    options: GatherOptions,
    /// Surfaces of the survey; `None` in a gather without surfaces.
    pub(super) scene: Option<&'s SceneBuffers>,
    compiled: Vec<(Variant, Compiled)>,
}

impl<'s> GatherKernels<'s> {
    pub(super) fn new(scene: Option<&'s SceneBuffers>, options: GatherOptions) -> Self {
        Self { options, scene, compiled: Vec::new() }
    }

    /// Index of the kernels of a variant, which are compiled once.
    pub(super) fn compile(&mut self, gpu: &Gpu, variant: Variant) -> usize {
        if let Some(index) = self.compiled.iter().position(|(v, _)| *v == variant) {
            return index;
        }
        let overrides = [
            ("SEGMENTS", f64::from(variant.segments)),
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
        let survey = |scene: &SceneBuffers| {
            ["survey_surface", "survey_area", "survey_narrow"].map(|stem| scene.kernel_with(gpu, stem, &with_budget))
        };
        let compiled = Compiled {
            search: kernel("search_radius"),
            survey: self.scene.filter(|_| self.options.surveys()).map(survey),
            sum: kernel("gather"),
            finish: kernel("finish_gather"),
        };
        self.compiled.push((variant, compiled));
        self.compiled.len() - 1
    }

    /// Kernels at an index from [`Self::compile`].
    pub(super) fn at(&self, index: usize) -> &Compiled {
        &self.compiled[index].1
    }
}
