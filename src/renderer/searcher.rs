//! Who looks for the nearest photons: the grid on the device, or the kd-tree on the CPU in its place.

use super::{CameraPass, PhotonMaps, Session};
use crate::{
    error::Result,
    gpu::Gpu,
    layout::{Gathered, VisiblePoint},
    passes::{Asked, EstimateSharing, Gather, PhotonMap, Tile},
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
        let search = match settings.search {
            Search::Grid | Search::Radius => Searches::Grid(Box::new(session.gather(settings))),
            Search::KdTree => {
                let trees = maps.maps.iter().map(|map| kd_map(session.gpu, map)).collect::<Result<_>>()?;
                Searches::KdTree(trees)
            }
        };
        Ok(Self { search, sharing: EstimateSharing::new(session.gpu, settings.share_reach), settings })
    }

    /// Adds the light of all maps' photons to the radiance of the tile's visible points.
    pub fn gather(&mut self, pass: &CameraPass, maps: &PhotonMaps, tile: &Tile, progress: &dyn Progress) -> Result<()> {
        let tile = pass.tracer.shared_points(tile);
        for (index, map) in maps.maps.iter().enumerate() {
            let turn = index as u32 + 1;
            let mut estimate = |asked: &Asked| match &mut self.search {
                Searches::Grid(gather) => {
                    let (points, results) = ((asked.count, asked.turn), (asked.radiance, asked.gathered));
                    gather.run_turn(pass.gpu, map, asked.points, points, &pass.estimate, results, progress).map(drop)
                }
                Searches::KdTree(trees) => kd_estimates(pass.gpu, &trees[index], self.settings, asked, progress),
            };
            self.sharing.run(pass.gpu, turn, &tile, &mut estimate)?;
        }
        Ok(())
    }
}

/// What [`Gather::run_turn`] does, by a tree.
fn kd_estimates(
    gpu: &Gpu,
    tree: &KdMap,
    settings: &Settings,
    asked: &Asked,
    progress: &dyn Progress,
) -> Result<()> {
    let mut points: Vec<VisiblePoint> = gpu.read(asked.points, 0, asked.count.into())?;
    points.iter_mut().filter(|p| p.valid > asked.turn).for_each(|p| p.valid = 0);
    let mut radiance: Vec<[f32; 4]> = gpu.read(asked.radiance, 0, asked.count.into())?;
    let mut gathered: Vec<Gathered> = gpu.read(asked.gathered, 0, asked.count.into())?;
    for (i, estimate) in tree.gather(&points, settings, progress)?.into_iter().enumerate() {
        if points[i].valid != 0 {
            (0..3).for_each(|c| radiance[i][c] += estimate.radiance[c] as f32);
            let Estimate { radius_squared, count, fingerprint, .. } = estimate;
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
