//! The comparison itself: one set of maps, gathered by both sides tile by tile.

use super::{
    measure::{Histogram, Measure},
    report::Report,
    sides::{GridGather, KdTreeGather},
};
use crate::{
    error::{Error, Result},
    gpu::Gpu,
    image::{Film, Frame},
    passes::Tile,
    progress::{Progress, Stage},
    renderer::{self, CameraPass, Gatherer, Session, finish_stats},
    scene::Scene,
    settings::{EstimateSettings, Search, Settings},
    stats::Stats,
};

/// Default of [`Options::tolerance`].
pub const TOLERANCE: f64 = 1e-4;

/// Limits of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Largest relative difference of a channel's radiance, and of the radius, at any query without
    /// a tie; ≥ 0.
    pub tolerance: f64,
    /// Number of photons that the kd-tree leaves out, a negative control of the comparison: it must
    /// then fail.
    pub sabotage: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance: TOLERANCE, sabotage: 0 }
    }
}

/// A finished comparison.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Counts and measurements.
    pub report: Report,
    /// Picture gathered with the grid.
    pub grid: Frame,
    /// Picture gathered with the kd-tree; all layers but the radiance are those of the grid's
    /// picture.
    pub kdtree: Frame,
    /// Statistics of the render.
    pub stats: Stats,
    pub(super) tolerance: f64,
    /// Number of queries that differ in photons that are not tied.
    different: u64,
    pub(super) histogram: Histogram,
}

/// Traces the photons once and gathers every visible point of the picture with both searches.
///
/// # Errors
/// As [`crate::renderer::render`]; also if the settings' mode has no photons, or `tolerance` is no
/// number ≥ 0.
pub fn compare(
    gpu: &Gpu,
    scene: &Scene,
    settings: &Settings,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Comparison> {
    check(settings, options)?;
    renderer::check(scene, settings)?;
    let session = Session::open(gpu, scene, &settings.lights, progress)?;
    let maps = session.photon_maps(&settings.photons, progress)?;
    let mut sides = Sides {
        grid: GridGather::new(gpu, maps.maps())?,
        kdtree: KdTreeGather::new(gpu, maps.maps(), settings)?,
        measure: Measure::default(),
        sabotage: options.sabotage,
        radiance: Default::default(),
    };
    // Every visible point is gathered: no two share an estimate. Both sides make the raw one.
    let estimate = EstimateSettings { share_reach: 0.0, raw: true, ..settings.estimate.clone() };
    let (films, mut stats) =
        session.films(&maps, &estimate, &settings.picture, (&mut sides, Stage::Compare), progress)?;
    let [grid, kdtree] = [0, 1].map(|side: usize| films[side].finish());
    stats.seconds.gather = sides.grid.seconds + sides.kdtree.seconds;
    finish_stats(gpu, &mut stats);
    Ok(Comparison {
        report: Report::new(&sides.measure, &sides.grid, &sides.kdtree, &stats),
        grid,
        kdtree,
        stats,
        tolerance: options.tolerance,
        different: sides.measure.different,
        histogram: sides.measure.histogram,
    })
}

/// State of a comparison: both sides and the counts.
struct Sides<'a> {
    grid: GridGather<'a>,
    kdtree: KdTreeGather<'a>,
    measure: Measure,
    /// Number of photons that the kd-tree has still to leave out.
    sabotage: u32,
    /// Radiance of the tile's points by the grid and by the kd-tree.
    radiance: [Vec<[f32; 4]>; 2],
}

impl Gatherer for Sides<'_> {
    /// Gathers the tile's points over all maps with both sides.
    fn gather(
        &mut self,
        pass: &CameraPass,
        tile: &Tile,
        _: &mut Film,
        _: &mut Stats,
        progress: &dyn Progress,
    ) -> Result<()> {
        let points = pass.points(tile)?;
        self.sabotage -= self.kdtree.leave_out(self.sabotage, &points);
        let mut by_grid = pass.radiance(tile)?;
        let mut by_kdtree = by_grid.clone();
        for map in 0..self.grid.maps.len() {
            let ours = self.grid.gather(map, pass, tile, progress)?;
            let theirs = self.kdtree.gather(map, &points, progress)?;
            self.measure.add(&points, &ours, &theirs, |i, gathered| {
                self.kdtree.explains(map, &points[i], &theirs[i], gathered)
            });
            for i in 0..points.len() {
                for c in 0..3 {
                    by_grid[i][c] += ours.radiance[i][c];
                    by_kdtree[i][c] += theirs[i].radiance[c] as f32;
                }
            }
        }
        self.radiance = [by_grid, by_kdtree];
        Ok(())
    }

    fn pictures(&self) -> usize {
        2
    }

    fn show(&mut self, picture: usize, pass: &CameraPass) {
        pass.set_radiance(&self.radiance[picture]);
    }
}

fn check(settings: &Settings, options: &Options) -> Result<()> {
    let fail = |name, value: String, problem: &str| Err(Error::Setting { name, value, problem: problem.to_string() });
    if !settings.photons.mode.traces_photons() {
        return fail("photons.mode", settings.photons.mode.name().to_string(), "has no photons to compare");
    }
    if settings.photons.final_gather > 0 {
        return fail("photons.final_gather", settings.photons.final_gather.to_string(), "is not compared");
    }
    if settings.estimate.search == Search::Radius {
        return fail("estimate.search", "radius".to_string(), "has no nearest photons to compare");
    }
    if !(options.tolerance >= 0.0 && options.tolerance.is_finite()) {
        return fail("tolerance", options.tolerance.to_string(), "must be at least 0");
    }
    Ok(())
}

impl Comparison {
    /// Checks that both sides agree.
    ///
    /// # Errors
    /// [`Error::Differs`] if a query differs in photons that are not tied, a difference exceeds the
    /// tolerance, or there was no query.
    pub fn verdict(&self) -> Result<()> {
        let report = &self.report;
        let beyond = |what: &str, found: f64| {
            Some(format!("the {what} differs by up to {found:.3e}, more than the tolerance {:.3e}", self.tolerance))
                .filter(|_| found > self.tolerance || found.is_nan())
        };
        let queries = report.queries;
        let problem = if queries == 0 {
            Some("no query: there is no photon or no visible diffuse surface".to_string())
        } else if self.different > 0 {
            let different = self.different;
            Some(format!("{different} of {queries} queries differ in their photons, by more than what is tied"))
        } else {
            beyond("radiance", report.radiance.max_relative_difference)
                .or_else(|| beyond("radius", report.radius.max_relative_difference))
        };
        problem.map_or(Ok(()), |problem| Err(Error::Differs(format!("grid and kd-tree differ: {problem}"))))
    }
}
