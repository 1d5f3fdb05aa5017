//! Who looks for the nearest photons: the grid on the device, or the kd-tree on the CPU in its place.

use super::{CameraPass, PhotonMaps, Session};
use crate::{
    error::Result,
    gpu::Gpu,
    layout::{Gathered, VisiblePoint},
    passes::{Asked, EstimateSharing, Gather, PhotonMap, StepCount, Tile},
    progress::Progress,
    reference::{Estimate, KdMap},
    settings::{Search, Settings},
};

/// A search over the maps, ready to gather.
pub(super) struct Searcher<'a> {
    search: Searches<'a>,
    sharing: EstimateSharing,
    settings: &'a Settings,
}

enum Searches<'a> {
    Grid(Box<Gather<'a>>),
    /// A tree of each map.
    KdTree(Vec<KdMap>),
}

impl<'a> Searcher<'a> {
    pub fn new(session: &'a Session, maps: &PhotonMaps, settings: &'a Settings) -> Result<Self> {
        let search = match settings.estimate.search {
            Search::Grid | Search::Radius => Searches::Grid(Box::new(session.gather(settings))),
            Search::KdTree => {
                let trees = maps.maps.iter().map(|map| kd_map(session.gpu, map)).collect::<Result<_>>()?;
                Searches::KdTree(trees)
            }
        };
        Ok(Self { search, sharing: EstimateSharing::new(session.gpu, settings.estimate.share_reach), settings })
    }

    /// Adds the light of the maps' photons to the radiance of the tile's visible points: that of all maps; with final gathering
    /// of the caustic map alone, and of all maps where the rays end. Returns what these rays did.
    pub fn gather(
        &mut self,
        pass: &CameraPass,
        maps: &PhotonMaps,
        tile: &Tile,
        progress: &dyn Progress,
    ) -> Result<StepCount> {
        let shared = pass.tracer.shared_points(tile);
        let (search, settings) = (&mut self.search, self.settings);
        let mut estimate = |asked: &Asked, index: usize| match search {
            Searches::Grid(gather) => {
                let (points, results) = ((asked.count, asked.turn), (asked.radiance, asked.gathered));
                let map = &maps.maps[index];
                gather.run_turn(pass.gpu, map, asked.points, points, &pass.estimate, results, progress).map(drop)
            }
            Searches::KdTree(trees) => kd_estimates(pass.gpu, &trees[index], settings, asked, progress),
        };
        let first = if pass.final_rays() > 0 { maps.global } else { 0 };
        for (index, turn) in (first..maps.maps.len()).zip(1..) {
            self.sharing.run(pass.gpu, turn, &shared, &mut |asked| estimate(asked, index))?;
        }
        let mut done = StepCount::default();
        for ray in 0..pass.final_rays() {
            progress.check()?;
            let (points, step) = pass.trace_final(tile, ray)?;
            done += step;
            let (radiance, gathered, count) = (shared.radiance, shared.gathered, pass.tracer.point_count(tile));
            for index in 0..maps.maps.len() {
                estimate(&Asked { points, count, turn: 1, radiance, gathered }, index)?;
            }
        }
        Ok(done)
    }
}

/// What [`Gather::run_turn`] does, by a tree.
fn kd_estimates(gpu: &Gpu, tree: &KdMap, settings: &Settings, asked: &Asked, progress: &dyn Progress) -> Result<()> {
    let mut points: Vec<VisiblePoint> = gpu.read(asked.points, 0, asked.count.into())?;
    points.iter_mut().filter(|p| p.valid > asked.turn).for_each(|p| p.valid = 0);
    let mut radiance: Vec<[f32; 4]> = gpu.read(asked.radiance, 0, asked.count.into())?;
    let mut gathered: Vec<Gathered> = gpu.read(asked.gathered, 0, asked.count.into())?;
    for (i, estimate) in tree.gather(&points, &settings.estimate, progress)?.into_iter().enumerate() {
        if points[i].valid != 0 {
            (0..3).for_each(|c| radiance[i][c] += estimate.radiance[c] as f32);
            let Estimate { radius_squared, count, fingerprint, .. } = estimate;
            radiance[i][3] = radius_squared;
            gathered[i] = Gathered { radius_squared, count, fingerprint };
        }
    }
    gpu.write(asked.radiance, 0, &radiance);
    gpu.write(asked.gathered, 0, &gathered);
    Ok(())
}

/// The map's photons, read back, in a kd-tree.
fn kd_map(gpu: &Gpu, map: &PhotonMap) -> Result<KdMap> {
    let (places, fluxes) = map.read(gpu)?;
    Ok(KdMap::new(places, fluxes, map.emitted()))
}
