//! Search of the photon maps: by the grid on the device, or by a kd-tree on the CPU.

use super::{maps::PhotonMaps, preview::bare, tiles::CameraPass};
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

/// Fraction of the light at a point below which what a map gives may be wrong there: neither its
/// radius nor its shape says how far the light of the point is that of others.
const NEGLIGIBLE: f32 = 0.01;

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

    /// Irradiance by all maps at points, as [`Self::estimates_at`].
    pub fn irradiances(
        &mut self,
        pass: &CameraPass,
        maps: &PhotonMaps,
        settings: &EstimateSettings,
        points: &[VisiblePoint],
        progress: &dyn Progress,
    ) -> Result<Vec<PointEstimate>> {
        let count = points.len() as u32;
        let points: Vec<_> = points.iter().map(bare).collect();
        let points = pass.gpu.storage_with("single points", &points)?;
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
        let radiance = gpu.storage_with("radiance of single points", &vec![[0.0_f32; 4]; count as usize])?;
        let gathered = gpu.storage::<Gathered>("gathered at single points", count.into())?;
        let mut of_maps = Vec::new();
        for index in 0..maps.maps().len() {
            let request = EstimateRequest { points, count, map_number: 1, radiance: &radiance, gathered: &gathered };
            self.answer(pass, maps, index, settings, &request, progress)?;
            let sums: Vec<[f32; 4]> = gpu.read(&radiance, 0, count.into())?;
            let discs: Vec<Gathered> = gpu.read(&gathered, 0, count.into())?;
            of_maps.push((sums, discs));
        }
        Ok(together(&of_maps))
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

/// The light at each of several points, from the sums after each map and the discs of its
/// estimates.
fn together(of_maps: &[(Vec<[f32; 4]>, Vec<Gathered>)]) -> Vec<PointEstimate> {
    let all = of_maps.last().map(|(sums, _)| sums.as_slice()).unwrap_or_default();
    let estimate = |(i, [r, g, b, _]): (usize, &[f32; 4])| {
        let mut found = PointEstimate { light: [*r, *g, *b], ..PointEstimate::default() };
        let mut before = 0.0;
        for (sums, discs) in of_maps {
            let sum: f32 = sums[i][..3].iter().sum();
            if sum - before >= NEGLIGIBLE * (r + g + b) {
                found.radius = found.radius.min(discs[i].radius_squared.sqrt());
                found.is_narrow |= discs[i].narrow != 0;
            }
            before = sum;
        }
        found
    };
    all.iter().enumerate().map(estimate).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_gives_next_to_nothing_says_nothing_of_the_light() {
        let disc = |radius: f32, narrow| Gathered { radius_squared: radius * radius, narrow, ..Gathered::default() };
        let found = |caustic: f32| {
            let sums = |light: f32| vec![[light, light, light, 0.0]];
            together(&[(sums(1.0), vec![disc(0.2, 0)]), (sums(1.0 + caustic), vec![disc(0.05, 1)])])[0]
        };
        let faint = found(0.005);
        assert_eq!((faint.radius, faint.is_narrow, faint.light), (0.2, false, [1.005; 3]));
        let bright = found(0.05);
        assert_eq!((bright.radius, bright.is_narrow), (0.05, true), "control");
        let none = together(&[(vec![[0.0; 4]], vec![disc(0.2, 0)])])[0];
        assert_eq!(none.radius, 0.2, "without light");
    }
}
