//! Irradiance kept for the ends of final-gather rays, so that few of them need an estimate of their
//! own. Kernel: `reuse_irradiance`.

use super::cell_table::{CellTable, Irradiances};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{BY_CELL, CellGrid, VisiblePoint},
};

/// The kernel and the table that it reads.
#[derive(Debug)]
pub struct IrradianceCache {
    kernel: Kernel,
    table: CellTable,
    cells: Buffer,
    grid: CellGrid,
}

impl IrradianceCache {
    /// Keeps irradiance in cells about the marks: points like those that will be lit. A cell is at
    /// most `spacing` radii of its estimate wide. `None` if nothing can be kept.
    ///
    /// # Errors
    /// Those of `irradiances`; limits of the adapter.
    pub fn build(
        gpu: &Gpu,
        marks: &[VisiblePoint],
        spacing: f32,
        irradiances: &mut Irradiances,
    ) -> Result<Option<Self>> {
        let Some(table) = CellTable::build(marks, spacing, irradiances)? else { return Ok(None) };
        let (cells, grid) = on_device(gpu, &table)?;
        Ok(Some(Self { kernel: Kernel::new(gpu, "reuse_irradiance", &[]), table, cells, grid }))
    }

    /// Keeps irradiance about those of further marks that have none.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn add(&mut self, gpu: &Gpu, marks: &[VisiblePoint], irradiances: &mut Irradiances) -> Result<()> {
        self.table.add(marks, irradiances)?;
        (self.cells, self.grid) = on_device(gpu, &self.table)?;
        Ok(())
    }

    /// Has the kernel compiled ahead of its use.
    pub fn prefetch(gpu: &Gpu) {
        let _ = Kernel::new(gpu, "reuse_irradiance", &[]);
    }

    /// Width of the largest cells, metres.
    #[must_use]
    pub fn width(&self) -> f32 {
        1.0 / self.grid.per_metre
    }

    /// Adds the light of those of the first `count` points that wait for the first map to
    /// `radiance`, where their cell has one. Those then wait for no map.
    pub fn light(&self, gpu: &Gpu, points: &Buffer, count: u32, radiance: &Buffer) {
        self.light_waiting(gpu, points, (count, 1), radiance);
    }

    /// The same for points that are seen blurred, [`BY_CELL`]. Others of these then wait for the
    /// first map.
    pub fn light_blurred(&self, gpu: &Gpu, points: &Buffer, count: u32, radiance: &Buffer) {
        self.light_waiting(gpu, points, (count, BY_CELL), radiance);
    }

    fn light_waiting(&self, gpu: &Gpu, points: &Buffer, (count, next_map): (u32, u32), radiance: &Buffer) {
        let grid = gpu.uniform("cell grid", &CellGrid { points: count, next_map, ..self.grid });
        let buffers = [("cell_grid", &grid), ("points", points), ("cells", &self.cells), ("radiance", radiance)];
        let mut encoder = gpu.encoder();
        self.kernel.dispatch(&mut encoder, &self.kernel.bind(gpu, &buffers), count.into());
        gpu.submit(encoder);
    }
}

fn on_device(gpu: &Gpu, table: &CellTable) -> Result<(Buffer, CellGrid)> {
    let slots = table.slots();
    let mask = slots.len() as u32 - 1;
    let grid = CellGrid { per_metre: table.per_metre, levels: table.levels, mask, ..CellGrid::default() };
    Ok((gpu.storage_with("irradiance cells", &slots)?, grid))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::PointEstimate;

    fn at(position: [f32; 3], ng: [f32; 3]) -> VisiblePoint {
        VisiblePoint { position, ng, ns: ng, weight: [1.0; 3], next_map: 1, ..VisiblePoint::default() }
    }

    /// Lights points of those normals by marks of others in the same cell, each as bright as its
    /// normal points up. `None` for a point that still waits.
    fn lit(is_narrow: bool, marks: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<Option<f32>> {
        let marks: Vec<_> = marks.iter().zip(1..).map(|(ng, i)| at([0.1 * i as f32, 0.5, 0.5], *ng)).collect();
        let points: Vec<_> = normals.iter().map(|ng| at([0.9, 0.9, 0.9], *ng)).collect();
        lit_points(is_narrow, &marks, &points)
    }

    fn lit_points(is_narrow: bool, marks: &[VisiblePoint], points: &[VisiblePoint]) -> Vec<Option<f32>> {
        let gpu = &Gpu::open(None).expect("a device");
        let mut found = |points: &[VisiblePoint]| {
            let of = |p: &VisiblePoint| PointEstimate { light: [2.0 + p.ng[1]; 3], radius: 2.0, is_narrow };
            Ok(points.iter().map(of).collect())
        };
        let cache = IrradianceCache::build(gpu, marks, 0.5, &mut found).expect("a table").expect("marks");
        let buffer = gpu.storage_with("points", points).expect("points");
        let radiance = gpu.storage_with("radiance", &vec![[0.0_f32; 4]; points.len()]).expect("radiance");
        cache.light(gpu, &buffer, points.len() as u32, &radiance);
        let after: Vec<VisiblePoint> = gpu.read(&buffer, 0, points.len() as u64).expect("points");
        let light: Vec<[f32; 4]> = gpu.read(&radiance, 0, points.len() as u64).expect("radiance");
        after.iter().zip(light).map(|(point, light)| (point.next_map == 0).then_some(light[0])).collect()
    }

    #[test]
    fn more_surfaces_than_a_cell_holds_have_light_of_their_own() {
        // The sides of a lampshade, which lie in one cell.
        let side = |i: u32| {
            let (sin, cos) = (std::f32::consts::TAU / 12.0 * i as f32).sin_cos();
            at([0.5 + 0.4 * cos, 0.5 + 0.4 * sin, 0.5], [cos, sin, 0.0])
        };
        let sides: Vec<_> = (0..12).map(side).collect();
        let found = lit_points(false, &sides, &sides);
        for (side, light) in sides.iter().zip(&found) {
            let right = 2.0 + side.ng[1];
            assert!(light.is_some_and(|light| (light - right).abs() < 1e-3), "{light:?} for {right}");
        }
        let below = |side: &VisiblePoint| at([side.position[0], side.position[1], 0.05], side.ng);
        let below: Vec<_> = sides.iter().map(below).collect();
        let none = lit_points(false, &sides, &below).iter().filter(|light| light.is_none()).count();
        assert_eq!(none, 4, "control: those of narrower cells are not in the same ones");
    }

    #[test]
    fn clutter_takes_the_light_of_the_most_similar_normal() {
        let (up, down, aside) = ([0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]);
        let leaning = [0.6, 0.8, 0.0];
        assert_eq!(lit(true, &[up, down], &[leaning, up, down]), [Some(3.0), Some(3.0), Some(1.0)]);
        assert_eq!(lit(true, &[up, aside], &[[0.8, 0.6, 0.0]]), [Some(2.0)], "the nearer one of two");
        assert_eq!(lit(true, &[up], &[down, aside]), [None, None], "none is similar");
        assert_eq!(lit(false, &[up, down], &[leaning, up, down]), [None; 3], "control: a flat surface is not there");
    }
}
