//! What the samples of a tile add to the layers of a film.

use super::tiles::CameraPass;
use crate::{
    error::Result,
    image::{
        Film,
        layers::{HITS, LightComponent, POSITIONS, Source},
    },
    layout::{FirstHit, Gathered, NO_MATERIAL, PixelSums},
    map_kind::MapKind,
    passes::Tile,
    scene::Scene,
    settings::ExtraLayers,
};

impl CameraPass<'_> {
    /// Adds what the tile's radiance has more than before to the layer of a component of the light.
    pub fn finished_component(&self, tile: &Tile, component: LightComponent, film: &mut Film) -> Result<()> {
        if !self.layers.contains(&ExtraLayers::Components) {
            return Ok(());
        }
        let sums = self.tracer.resolve(self.gpu, tile)?;
        let mut before = self.finished.borrow_mut();
        before.resize(sums.len(), [0.0; 4]);
        for (i, (sums, before)) in (0..).zip(sums.iter().zip(before.iter_mut())) {
            let added = [0, 1, 2].map(|c| sums[0][c] - before[c]);
            *before = sums[0];
            if let Some(pixel) = self.tracer.pixel(tile, i) {
                film.add_to(Source::Component(component), pixel, &added);
            }
        }
        Ok(())
    }

    /// Whether results of estimates are wanted.
    pub fn keeps_estimates(&self) -> bool {
        self.layers.contains(&ExtraLayers::Estimates)
    }

    /// Adds the results of a map's estimates at the tile's points to the film.
    pub fn finished_estimates(&self, tile: &Tile, kind: MapKind, film: &mut Film) -> Result<()> {
        if !self.keeps_estimates() {
            return Ok(());
        }
        let points = self.tracer.point_count(tile);
        let gathered: Vec<Gathered> = self.gpu.read(&self.tracer.gathered, 0, points.into())?;
        for (i, of_pixel) in (0..).zip(gathered.chunks((points / tile.pixels) as usize)) {
            let Some(pixel) = self.tracer.pixel(tile, i) else { continue };
            for one in of_pixel.iter().filter(|one| one.radius_squared > 0.0) {
                film.add_to(Source::Estimate(kind), pixel, &[one.radius_squared.sqrt(), one.count as f32, 1.0]);
            }
        }
        Ok(())
    }

    /// Sums the tile's radiance and layers into the film.
    pub(super) fn resolve(&self, tile: &Tile, film: &mut Film) -> Result<Vec<PixelSums>> {
        let all = self.tracer.resolve(self.gpu, tile)?;
        for (i, mut sums) in (0..).zip(all.iter().copied()) {
            if let Some(pixel) = self.tracer.pixel(tile, i) {
                // Positions are relative to the centre on the device.
                let center = self.obstacles.scene.center.as_vec3() * sums[HITS.0][HITS.1];
                (0..3).for_each(|c| sums[POSITIONS.0][POSITIONS.1 + c] += center[c]);
                film.add(pixel, &sums, tile.samples);
            }
        }
        if film.has_mattes() {
            self.add_mattes(tile, film)?;
        }
        Ok(all)
    }

    /// Adds to the mattes what the tile's samples see first.
    fn add_mattes(&self, tile: &Tile, film: &mut Film) -> Result<()> {
        let Scene { triangles, spheres, instances, .. } = self.obstacles.scene;
        let object = |hit: &FirstHit| {
            let instance = (hit.instance as usize).checked_sub(1).and_then(|at| instances.get(at));
            let triangle = || triangles.get(hit.id as usize).map(|triangle| triangle.object);
            let sphere = || Some(spheres.get((hit.id as usize).checked_sub(triangles.len())?)?.object);
            instance.map(|instance| instance.object).or_else(triangle).or_else(sphere).unwrap_or(0)
        };
        let hits = self.tracer.first_hits(self.gpu, tile)?;
        for (i, hits) in (0..).zip(hits.chunks(tile.samples as usize)) {
            let Some(pixel) = self.tracer.pixel(tile, i) else { continue };
            let seen = || hits.iter().filter(|hit| hit.material != NO_MATERIAL);
            let of = |hashes: &[u32], index: u32| hashes.get(index as usize).copied();
            let [objects, materials] = &self.hashes;
            film.add_to_matte(ExtraLayers::Objects, pixel, seen().filter_map(|hit| of(objects, object(hit))));
            film.add_to_matte(ExtraLayers::Materials, pixel, seen().filter_map(|hit| of(materials, hit.material)));
        }
        Ok(())
    }
}
