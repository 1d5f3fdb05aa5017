//! Who looks for the nearest photons: the grid on the device, or the kd-tree on the CPU in its place.

use super::{CameraPass, PhotonMaps, Session};
use crate::{
    error::Result,
    gpu::Gpu,
    passes::{Gather, PhotonMap, Tile},
    progress::Progress,
    reference::KdMap,
    settings::{Search, Settings},
};

/// A search over the maps, ready to gather.
pub(super) enum Searcher<'a> {
    Grid(Box<Gather<'a>>),
    KdTree(Vec<KdMap>, &'a Settings),
}

impl<'a> Searcher<'a> {
    pub fn new(session: &'a Session, maps: &PhotonMaps, settings: &'a Settings) -> Result<Self> {
        Ok(match settings.search {
            Search::Grid | Search::Radius => Self::Grid(Box::new(session.gather(settings))),
            Search::KdTree => {
                let trees = maps.maps.iter().map(|map| kd_map(session.gpu, map)).collect::<Result<_>>()?;
                Self::KdTree(trees, settings)
            }
        })
    }

    /// Adds the light of all maps' photons to the radiance of the tile's visible points.
    pub fn gather(&mut self, pass: &CameraPass, maps: &PhotonMaps, tile: &Tile, progress: &dyn Progress) -> Result<()> {
        match self {
            Self::Grid(gather) => {
                let (points, count) = (&pass.tracer.points, pass.tracer.point_count(tile));
                let results = (&pass.tracer.radiance, &pass.tracer.gathered);
                for map in &maps.maps {
                    gather.run(pass.gpu, map, points, count, &pass.estimate, results, progress)?;
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
