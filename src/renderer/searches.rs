//! Search of the photon maps: by the grid on the device, or by a kd-tree on the CPU.

use super::{maps::PhotonMaps, tiles::CameraPass};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu},
    layout::{Gathered, VisiblePoint},
    passes::{EstimateRequest, Gather, GatherOptions, PhotonMap, PointEstimate, Tile},
    progress::Progress,
    reference::{Estimate, KdMap},
    settings::{EstimateSettings, Search},
    upload::SceneBuffers,
};

/// The search of all maps.
pub(super) enum Searches<'a> {
    Grid(Box<Gather<'a>>),
    /// One tree per map.
    KdTree(Vec<KdMap>),
}

/// Creates the gather of the estimate that the settings ask for.
pub(super) fn gather_for<'a>(gpu: &Gpu, scene: &'a SceneBuffers, estimate: &EstimateSettings) -> Gather<'a> {
    if estimate.raw {
        return Gather::new(gpu, GatherOptions::default());
    }
    Gather::over(gpu, scene, GatherOptions::flat())
}

impl<'a> Searches<'a> {
    pub fn new(gpu: &Gpu, scene: &'a SceneBuffers, maps: &PhotonMaps, estimate: &EstimateSettings) -> Result<Self> {
        Ok(match estimate.search {
            Search::Grid | Search::Radius => Self::Grid(Box::new(gather_for(gpu, scene, estimate))),
            Search::KdTree => Self::KdTree(maps.maps().iter().map(|map| kd_map(gpu, map)).collect::<Result<_>>()?),
        })
    }

    /// Same as [`Self::estimates_at`].
    pub fn estimates(
        &mut self,
        pass: &CameraPass,
        maps: &PhotonMaps,
        settings: &EstimateSettings,
        points: &[VisiblePoint],
        progress: &dyn Progress,
    ) -> Result<Vec<PointEstimate>> {
        let count = points.len() as u32;
        let points = pass.gpu.storage_with("single points", points)?;
        self.estimates_at(pass, maps, settings, (&points, count), progress)
    }

    /// Estimates by all maps at each of the first points of a buffer.
    fn estimates_at(
        &mut self,
        pass: &CameraPass,
        maps: &PhotonMaps,
        settings: &EstimateSettings,
        (points, count): (&Buffer, u32),
        progress: &dyn Progress,
    ) -> Result<Vec<PointEstimate>> {
        let gpu = pass.gpu;
        let mut found = vec![PointEstimate::default(); count as usize];
        let radiance = gpu.storage_with("radiance of single points", &vec![[0.0_f32; 4]; found.len()])?;
        let gathered = gpu.storage::<Gathered>("gathered at single points", count.into())?;
        for index in 0..maps.maps().len() {
            let request = EstimateRequest { points, count, map_number: 1, radiance: &radiance, gathered: &gathered };
            self.answer(pass, maps, index, settings, &request, progress)?;
            let all: Vec<Gathered> = gpu.read(&gathered, 0, count.into())?;
            for (estimate, one) in found.iter_mut().zip(all) {
                estimate.radius = estimate.radius.min(one.radius_squared.sqrt());
                estimate.is_narrow |= one.narrow != 0;
            }
        }
        let sums: Vec<[f32; 4]> = gpu.read(&radiance, 0, count.into())?;
        found.iter_mut().zip(sums).for_each(|(estimate, [r, g, b, _])| estimate.light = [r, g, b]);
        Ok(found)
    }

    /// Adds the light at ends of rays to the visible points that the rays come from: the indices of
    /// the points, and the ends in a buffer.
    pub fn light_ends(
        &mut self,
        pass: &CameraPass,
        (maps, settings): (&PhotonMaps, &EstimateSettings),
        tile: &Tile,
        (indices, ends): (&[usize], &Buffer),
        progress: &dyn Progress,
    ) -> Result<()> {
        let found = self.estimates_at(pass, maps, settings, (ends, indices.len() as u32), progress)?;
        let mut radiance = pass.radiance(tile)?;
        for (&index, estimate) in indices.iter().zip(found) {
            (0..3).for_each(|c| radiance[index][c] += estimate.light[c]);
        }
        pass.set_radiance(&radiance);
        Ok(())
    }

    /// Answers a request for estimates of one map.
    pub fn answer(
        &mut self,
        pass: &CameraPass,
        maps: &PhotonMaps,
        index: usize,
        estimate: &EstimateSettings,
        request: &EstimateRequest,
        progress: &dyn Progress,
    ) -> Result<()> {
        match self {
            Self::Grid(gather) => {
                let (points, results) = ((request.count, request.map_number), (request.radiance, request.gathered));
                let map = &maps.maps()[index];
                gather.run_waiting(pass.gpu, map, request.points, points, &pass.estimate, results, progress).map(drop)
            }
            Self::KdTree(trees) => kd_estimates(pass.gpu, &trees[index], estimate, request, progress),
        }
    }
}

/// Counterpart of [`Gather::run_waiting`] for a kd-tree.
fn kd_estimates(
    gpu: &Gpu,
    tree: &KdMap,
    settings: &EstimateSettings,
    request: &EstimateRequest,
    progress: &dyn Progress,
) -> Result<()> {
    let mut points: Vec<VisiblePoint> = gpu.read(request.points, 0, request.count.into())?;
    points.iter_mut().filter(|p| p.next_map > request.map_number).for_each(|p| p.next_map = 0);
    let mut radiance: Vec<[f32; 4]> = gpu.read(request.radiance, 0, request.count.into())?;
    let mut gathered: Vec<Gathered> = gpu.read(request.gathered, 0, request.count.into())?;
    for (i, estimate) in tree.gather(&points, settings, progress)?.into_iter().enumerate() {
        if points[i].next_map != 0 {
            (0..3).for_each(|c| radiance[i][c] += estimate.radiance[c] as f32);
            let Estimate { radius_squared, count, fingerprint, .. } = estimate;
            gathered[i] = Gathered { radius_squared, count, fingerprint, narrow: 0 };
        }
    }
    gpu.write(request.radiance, 0, &radiance);
    gpu.write(request.gathered, 0, &gathered);
    Ok(())
}

/// Reads a map's photons back and builds a kd-tree of them.
fn kd_map(gpu: &Gpu, map: &PhotonMap) -> Result<KdMap> {
    let (photons, fluxes) = map.read(gpu)?;
    Ok(KdMap::new(photons, fluxes, map.emitted()))
}
