//! Who looks for the nearest photons: the grid on the device, or the kd-tree on the CPU in its place.

use super::{CameraPass, PhotonMaps, Session};
use crate::{
    error::Result,
    gpu::Gpu,
    passes::{EstimateSharing, Gather, PhotonMap, Tile},
    progress::Progress,
    reference::KdMap,
    settings::{Search, Settings},
};

/// A search over the maps, ready to gather.
pub(super) enum Searcher<'a> {
    Grid(Box<Gather<'a>>, EstimateSharing),
    KdTree(Vec<KdMap>, &'a Settings),
}

impl<'a> Searcher<'a> {
    pub fn new(session: &'a Session, maps: &PhotonMaps, settings: &'a Settings) -> Result<Self> {
        Ok(match settings.search {
            Search::Grid | Search::Radius => {
                Self::Grid(Box::new(session.gather(settings)), EstimateSharing::new(session.gpu, settings.share_reach))
            }
            Search::KdTree => {
                let trees = maps.maps.iter().map(|map| kd_map(session.gpu, map)).collect::<Result<_>>()?;
                Self::KdTree(trees, settings)
            }
        })
    }

    /// Adds the light of all maps' photons to the radiance of the tile's visible points.
    pub fn gather(&mut self, pass: &CameraPass, maps: &PhotonMaps, tile: &Tile, progress: &dyn Progress) -> Result<()> {
        match self {
            Self::Grid(gather, sharing) => {
                let shared = pass.tracer.shared_points(tile);
                for (map, turn) in maps.maps.iter().zip(1..) {
                    sharing.run(pass.gpu, (gather, &pass.estimate), (map, turn), &shared, progress)?;
                }
            }
            Self::KdTree(trees, settings) => {
                let points = pass.points(tile)?;
                let mut radiance = pass.radiance(tile)?;
                for tree in trees {
                    for (sum, estimate) in radiance.iter_mut().zip(tree.gather(&points, settings, progress)?) {
                        (0..3).for_each(|c| sum[c] += estimate.radiance[c] as f32);
                    }
                }
                pass.set_radiance(&radiance);
            }
        }
        Ok(())
    }
}

/// The map's photons, read back, in a kd-tree.
fn kd_map(gpu: &Gpu, map: &PhotonMap) -> Result<KdMap> {
    let (places, fluxes) = map.read(gpu)?;
    Ok(KdMap::new(places, fluxes, map.emitted()))
}
