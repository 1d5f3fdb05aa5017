//! Irradiance at some of the picture's visible points, filtered over their surroundings for all of
//! them. Kernel: `filter_irradiance`.

use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{CameraTile, IrradianceRecord, RecordGrid},
};

/// Pixels of the record grid on each side of a point among which the filter looks for records at
/// most.
const MAX_WINDOW: u32 = 8;

/// Pixels of the record grid on each side of a point among which a filter of that radius, in pixels
/// of the picture, looks for records.
#[must_use]
pub fn filter_window(radius: f32, spacing: u32) -> u32 {
    ((radius / spacing as f32).ceil() as u32).clamp(1, MAX_WINDOW)
}

/// A slot without a point.
pub const NO_RECORD: IrradianceRecord =
    IrradianceRecord { position: [0.0; 3], ng: 0, irradiance: [-1.0; 3], mean_direction: 0 };

/// The kernel and the records that it reads.
#[derive(Debug)]
pub struct IrradianceRecords {
    kernel: Kernel,
    records: Buffer,
    grid: RecordGrid,
}

impl IrradianceRecords {
    /// Takes records by the rows of `grid`, whose number of points is left open.
    ///
    /// # Errors
    /// Limits of the adapter.
    pub fn new(gpu: &Gpu, records: &[IrradianceRecord], grid: RecordGrid) -> Result<Self> {
        let records = gpu.storage_with("irradiance records", records)?;
        Ok(Self { kernel: Kernel::new(gpu, "filter_irradiance", &[]), records, grid })
    }

    /// Adds the light of the records to the radiance of a tile's points. Those that it lights wait
    /// for no map then; others have too few records about them.
    pub fn light(&self, gpu: &Gpu, tile: &CameraTile, count: u32, (points, radiance): (&Buffer, &Buffer)) {
        let grid = gpu.uniform("record grid", &RecordGrid { points: count, ..self.grid });
        let tile = gpu.uniform("camera tile", tile);
        let buffers = [
            ("tile", &tile),
            ("record_grid", &grid),
            ("records", &self.records),
            ("points", points),
            ("radiance", radiance),
        ];
        let mut encoder = gpu.encoder();
        self.kernel.dispatch(&mut encoder, &self.kernel.bind(gpu, &buffers), count.into());
        gpu.submit(encoder);
    }
}
