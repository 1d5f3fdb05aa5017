//! The two sides of a comparison, each with its timer.

use super::measure::{GridAnswer, explained_by_ties};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu},
    layout::{Gathered, Photon, VisiblePoint},
    passes::{Gather, GatherOptions, MapKernels, PhotonMap, PhotonStore, Tile},
    progress::Progress,
    reference::{Estimate, KdMap, mix},
    renderer::CameraPass,
    settings::Settings,
    stats::timed,
};

/// Number of points that a warm-up gathers.
const WARM_UP: u32 = 64;

/// The grid's side, on the device.
pub(super) struct GridGather<'a> {
    pub maps: &'a [PhotonMap],
    gather: Gather<'static>,
    /// Radiance of one map alone.
    radiance: Option<Buffer>,
    warm: bool,
    /// Seconds that sorting the photons and building the grids take once the kernels are compiled.
    pub build_seconds: f64,
    /// Seconds of all gathers, without reading back.
    pub seconds: f64,
}

impl<'a> GridGather<'a> {
    pub fn new(gpu: &Gpu, maps: &'a [PhotonMap]) -> Result<Self> {
        let gather = Gather::new(gpu, GatherOptions { fingerprint: true, ..GatherOptions::default() });
        Ok(Self { maps, gather, radiance: None, warm: false, build_seconds: build_seconds(gpu, maps)?, seconds: 0.0 })
    }

    /// Gathers the tile that `pass` has traced.
    pub fn gather(
        &mut self,
        map: usize,
        pass: &CameraPass,
        tile: &Tile,
        progress: &dyn Progress,
    ) -> Result<GridAnswer> {
        let (gpu, points, gathered) = (pass.gpu, &pass.tracer.points, &pass.tracer.gathered);
        let count = pass.tracer.point_count(tile);
        let radiance = match self.radiance.take() {
            Some(buffer) => buffer,
            None => gpu.storage::<[u8; 1]>("radiance of one map", pass.tracer.radiance.size())?,
        };
        let results = (&radiance, gathered);
        if !self.warm {
            // Drivers compile a kernel at its first dispatch, which must not count as query time.
            for map in self.maps {
                self.gather.run(gpu, map, points, count.min(WARM_UP), &pass.estimate, results, progress)?;
            }
            self.warm = true;
        }
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&radiance, 0, None);
        gpu.submit(encoder);
        gpu.wait()?;
        timed(&mut self.seconds, || {
            self.gather.run(gpu, &self.maps[map], points, count, &pass.estimate, results, progress)
        })?;
        let answer = GridAnswer {
            gathered: gpu.read(gathered, 0, count.into())?,
            radiance: gpu.read(&radiance, 0, count.into())?,
        };
        self.radiance = Some(radiance);
        Ok(answer)
    }

    /// Memory of the photons and the grids over them, bytes.
    pub fn bytes(&self) -> u64 {
        self.maps.iter().map(PhotonMap::bytes).sum()
    }
}

/// Rebuilds the maps to time them without kernel compilation, which drivers do at the first
/// dispatch. The photons are shuffled to the disorder in which the tracer stores them.
fn build_seconds(gpu: &Gpu, maps: &[PhotonMap]) -> Result<f64> {
    let kernels = MapKernels::new(gpu);
    let mut seconds = 0.0;
    for map in maps {
        let (photons, fluxes) = map.read(gpu)?;
        let photon = |i: u32| {
            let (photon, flux) = (&photons[i as usize], &fluxes[i as usize]);
            Photon { position: photon.position, wi: photon.wi, flux: flux.flux, normal: flux.normal }
        };
        let mut order: Vec<u32> = (0..photons.len() as u32).collect();
        order.sort_unstable_by_key(|&i| mix(i));
        let photons: Vec<Photon> = order.into_iter().map(photon).collect();
        let few = &photons[..photons.len().min(WARM_UP as usize)];
        PhotonMap::build(gpu, &kernels, PhotonStore::with(gpu, few)?, few.len() as u32, map.emitted())?;
        let store = PhotonStore::with(gpu, &photons)?;
        gpu.wait()?;
        timed(&mut seconds, || PhotonMap::build(gpu, &kernels, store, map.count(), map.emitted()))?;
    }
    Ok(seconds)
}

/// The kd-tree's side, on the CPU.
pub(super) struct KdTreeGather<'a> {
    maps: Vec<KdMap>,
    settings: &'a Settings,
    pub build_seconds: f64,
    /// Seconds of all gathers.
    pub seconds: f64,
}

impl<'a> KdTreeGather<'a> {
    /// Reads the maps' photons back and builds balanced trees of them.
    pub fn new(gpu: &Gpu, maps: &[PhotonMap], settings: &'a Settings) -> Result<Self> {
        let mut build_seconds = 0.0;
        let mut build = |map: &PhotonMap| {
            let (photons, fluxes) = map.read(gpu)?;
            Ok(timed(&mut build_seconds, || KdMap::new(photons, fluxes, map.emitted())))
        };
        let maps = maps.iter().map(&mut build).collect::<Result<_>>()?;
        Ok(Self { maps, settings, build_seconds, seconds: 0.0 })
    }

    /// Removes up to `count` photons from the first map, each the nearest to one of the points.
    /// Returns their number.
    pub fn leave_out(&mut self, count: u32, points: &[VisiblePoint]) -> u32 {
        let Some(map) = self.maps.first_mut() else { return 0 };
        let limit = self.settings.estimate.max_radius.map_or(f32::INFINITY, |r| r * r);
        let valid: Vec<&VisiblePoint> = points.iter().filter(|p| p.next_map != 0).collect();
        let some = (count as usize).min(valid.len());
        let mut lost = 0;
        for point in (0..some).map(|i| valid[i * valid.len() / some]) {
            // With k = 1 and no maximum radius, no photon is summed: the only one defines the
            // radius.
            if let [(_, nearest), rest @ ..] = &map.search(point, 2, limit)[..]
                && (!rest.is_empty() || limit.is_finite())
            {
                map.leave_out(*nearest);
                lost += 1;
            }
        }
        lost
    }

    /// Gathers the points.
    pub fn gather(&mut self, map: usize, points: &[VisiblePoint], progress: &dyn Progress) -> Result<Vec<Estimate>> {
        timed(&mut self.seconds, || self.maps[map].gather(points, &self.settings.estimate, progress))
    }

    /// Whether the grid's photons differ from those of the estimate only in tied ones.
    pub fn explains(&self, map: usize, point: &VisiblePoint, estimate: &Estimate, gathered: &Gathered) -> bool {
        explained_by_ties(&self.maps[map], point, self.settings, estimate, gathered)
    }

    /// Memory of the photons and the trees, bytes.
    pub fn bytes(&self) -> u64 {
        self.maps.iter().map(KdMap::bytes).sum()
    }
}
