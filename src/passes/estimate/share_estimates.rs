//! Light at the visible points of a tile with fewer queries than points. An estimate is a mean over
//! a disc; points share it where the disc is much wider than the distance between them. Kernels:
//! `choose_queries`, `share_estimates`.

use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{MARGIN_CELL, MARGIN_SAMPLES, ShareRound, VisiblePoint},
};

/// Pixels of a cell in each round. Cells coarser than 8 x 8 save little, because the queries are
/// few already. Sizes between these save little too, because each round costs time of its own.
const ROUNDS: [u32; 3] = [64, 4, 1];
/// Minimum number of samples of a cell. Of fewer, most would be queries themselves.
const MIN_CELL: u32 = 4;
/// Stride of the pixels of a cell in the first round that have a candidate sample for its query.
const FIRST_STEP: u32 = ROUNDS[0] / MARGIN_SAMPLES;
const _: () = assert!(ROUNDS[0] == MARGIN_CELL * MARGIN_CELL);

/// The visible points of a tile that share estimates.
#[derive(Debug)]
pub struct SharedPoints<'a> {
    /// [`VisiblePoint`]s: for each pixel, in Morton order, its samples, each with its branches;
    /// then those of the margin.
    pub points: &'a Buffer,
    /// Of a square, a power of 2, at least 64.
    pub pixels: u32,
    pub samples: u32,
    pub branches: u32,
    /// Cells of the margin.
    pub margin: u32,
    /// Whether the pixels are those of a square. Others share nothing with each other.
    pub is_square: bool,
    /// Radiance from each point, `vec4f`, and room for results of gathers,
    /// [`Gathered`](crate::layout::Gathered).
    pub radiance: &'a Buffer,
    pub gathered: &'a Buffer,
}

/// Points at which estimates are requested.
#[derive(Debug)]
pub struct EstimateRequest<'a> {
    /// [`VisiblePoint`]s. Those that wait for the map take part.
    pub points: &'a Buffer,
    pub count: u32,
    /// Number of the map gathered, from 1.
    pub map_number: u32,
    /// Radiance that the estimates are added to, `vec4f`, and result of each query,
    /// [`Gathered`](crate::layout::Gathered).
    pub radiance: &'a Buffer,
    pub gathered: &'a Buffer,
}

/// Computes estimates over one map.
pub type Estimates<'a> = dyn FnMut(&EstimateRequest) -> Result<()> + 'a;

/// The kernels, and room for queries.
#[derive(Debug)]
pub struct EstimateSharing {
    choose: Kernel,
    share: Kernel,
    /// Distance within which points share an estimate, as a fraction of the estimate's radius.
    reach: f32,
    scratch: Option<Scratch>,
}

#[derive(Debug)]
struct Scratch {
    capacity: u32,
    queries: Buffer,
    irradiance: Buffer,
}

impl EstimateSharing {
    /// Compiles the kernels. `reach`: distance within which points share an estimate, as a fraction
    /// of the estimate's radius; 0: no sharing.
    #[must_use]
    pub fn new(gpu: &Gpu, reach: f32) -> Self {
        let kernel = |stem| Kernel::new(gpu, stem, &[]);
        Self { choose: kernel("choose_queries"), share: kernel("share_estimates"), reach, scratch: None }
    }

    /// Has the kernels compiled ahead of their use.
    pub fn prefetch(gpu: &Gpu) {
        let _ = Self::new(gpu, 0.0);
    }

    /// Adds the light of a map's photons to the radiance of the tile's points. Queries are made in
    /// large cells of pixels, then in smaller cells for the points that are left, and finally for
    /// each remaining point. Maps are numbered from 1.
    ///
    /// # Errors
    /// Those of `estimates`.
    pub fn run(&mut self, gpu: &Gpu, map_number: u32, tile: &SharedPoints, estimates: &mut Estimates) -> Result<()> {
        let count = tile.pixels * tile.samples * tile.branches;
        for cell_pixels in ROUNDS {
            if self.reach == 0.0 || cell_pixels * tile.samples < MIN_CELL {
                break;
            }
            if !tile.is_square && cell_pixels > 1 {
                continue;
            }
            let is_first = cell_pixels == ROUNDS[0];
            let round = ShareRound {
                cells: tile.pixels / cell_pixels,
                cell_pixels,
                samples: tile.samples,
                candidates: if cell_pixels > 1 { 1 } else { tile.samples },
                step: if is_first { FIRST_STEP } else { 1 },
                margin: if is_first { tile.margin } else { 0 },
                branches: tile.branches,
                reach_squared: self.reach * self.reach,
                points: count,
                map_number,
                is_listed: (!tile.is_square).into(),
            };
            self.run_round(gpu, &round, tile, estimates)?;
        }
        estimates(&EstimateRequest {
            points: tile.points,
            count,
            map_number,
            radiance: tile.radiance,
            gathered: tile.gathered,
        })
    }

    fn run_round(
        &mut self,
        gpu: &Gpu,
        round: &ShareRound,
        tile: &SharedPoints,
        estimates: &mut Estimates,
    ) -> Result<()> {
        let queries = (round.cells + round.margin) * round.branches;
        if self.scratch.as_ref().is_none_or(|s| s.capacity < queries) {
            self.scratch = Some(Scratch::new(gpu, queries)?);
        }
        let scratch = self.scratch.as_ref().expect("made above");
        let uniform = gpu.uniform("share round", round);
        let buffers = [
            ("round", &uniform),
            ("points", tile.points),
            ("queries", &scratch.queries),
            ("query_rows", &scratch.queries),
            ("irradiance", &scratch.irradiance),
            ("radiance", tile.radiance),
            ("gathered", tile.gathered),
        ];
        let mut encoder = gpu.encoder();
        self.choose.dispatch(&mut encoder, &self.choose.bind(gpu, &buffers), queries.into());
        gpu.submit(encoder);
        // The tile's buffer has room for the results, since there are fewer queries than points.
        let (radiance, gathered) = (&scratch.irradiance, tile.gathered);
        estimates(&EstimateRequest { points: &scratch.queries, count: queries, map_number: 1, radiance, gathered })?;
        let mut encoder = gpu.encoder();
        self.share.dispatch(&mut encoder, &self.share.bind(gpu, &buffers), round.points.into());
        gpu.submit(encoder);
        Ok(())
    }
}

impl Scratch {
    fn new(gpu: &Gpu, capacity: u32) -> Result<Self> {
        Ok(Self {
            capacity,
            queries: gpu.storage::<VisiblePoint>("queries", capacity.into())?,
            irradiance: gpu.storage::<[f32; 4]>("irradiance at queries", capacity.into())?,
        })
    }
}
