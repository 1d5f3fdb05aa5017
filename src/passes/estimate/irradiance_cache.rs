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
        let CellTable { slots, per_metre, levels } = table;
        let grid = CellGrid { per_metre, levels, mask: slots.len() as u32 - 1, ..CellGrid::default() };
        let cells = gpu.storage_with("irradiance cells", &slots)?;
        Ok(Some(Self { kernel: Kernel::new(gpu, "reuse_irradiance", &[]), cells, grid }))
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
