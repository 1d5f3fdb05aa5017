//! Irradiance at some of the picture's visible points, filtered over their surroundings for all of
//! them. Kernel: `filter_irradiance`.

use glam::Vec3;
use rayon::prelude::*;

use super::record_walls::wall_distances;
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel, Table},
    layout::{ArrivingLight, CameraTile, IrradianceRecord, LightDirections, RecordGrid, VisiblePoint, octahedral},
};

/// Pixels of the record grid on each side of a point among which the filter looks for records at
/// most.
const MAX_FOOTPRINT: u32 = 8;

/// Pixels of the record grid on each side of a point among which a filter of that radius, in pixels
/// of the picture, looks for records.
#[must_use]
pub fn filter_footprint(radius: f32, spacing: u32) -> u32 {
    ((radius / spacing as f32).ceil() as u32).clamp(1, MAX_FOOTPRINT)
}

/// Largest reach of a record: that of the widest filter, `MAX_RADIUS` in `filter_irradiance.wesl`.
const MAX_REACH: f32 = 8.0;

/// Reach of a coat's record as a fraction of that of irradiance, of a lobe of width 1: what it
/// shows is blurred over twice its width times the distance, and the filter adds little to that.
const COAT_REACH: f32 = 0.3;

/// A slot without a point.
const NO_RECORD: IrradianceRecord =
    IrradianceRecord { position: [0.0; 3], ng: 0, irradiance: [-1.0; 3], reach: 0.0, coat: [-1.0; 3], coat_reach: 0.0 };

/// Slots of records of a picture at most: 192 MiB in a table.
const MAX_RECORDS: u64 = 1 << 22;

/// Pixels between the points of final gathering: more than asked for where the whole picture would
/// have too many of them.
///
/// # Panics
/// Never: a picture of one point has few.
#[must_use]
pub fn record_spacing((width, height): (u32, u32), spacing: u32, branches: u32) -> u32 {
    let slots =
        |spacing: u32| u64::from(width.div_ceil(spacing)) * u64::from(height.div_ceil(spacing)) * u64::from(branches);
    (spacing..).find(|spacing| slots(*spacing) <= MAX_RECORDS).expect("a picture of one point has few")
}

/// Records in the order of a grid, as they are taken.
#[derive(Debug)]
pub struct Records {
    columns: usize,
    branches: usize,
    records: Vec<IrradianceRecord>,
    directions: Vec<LightDirections>,
    /// Harmonic mean distance of each point to what is around it, metres.
    distances: Vec<f32>,
    /// The same as coats see it, times the width of their lobes.
    coat_distances: Vec<f32>,
}

impl Records {
    /// No record yet.
    #[must_use]
    pub fn new((columns, rows): (u32, u32), branches: u32) -> Self {
        let slots = columns as usize * rows as usize * branches as usize;
        let (columns, branches) = (columns as usize, branches as usize);
        Self {
            columns,
            branches,
            records: vec![NO_RECORD; slots],
            directions: vec![LightDirections::default(); slots],
            distances: vec![f32::INFINITY; slots],
            coat_distances: vec![f32::INFINITY; slots],
        }
    }

    /// Takes the light that `rays` brought to a point, for a pixel of the grid and a branch of its
    /// sample.
    pub fn put(
        &mut self,
        (column, row): (u32, u32),
        branch: usize,
        point: &VisiblePoint,
        light: [f32; 4],
        arriving: &ArrivingLight,
        rays: u32,
    ) {
        let slot = (row as usize * self.columns + column as usize) * self.branches + branch;
        let normal = Vec3::from(point.ng);
        let direction = |[x, y, z, light]: [f32; 4], fluence: f32| {
            let (all, light) = (Vec3::new(x, y, z), light.max(f32::MIN_POSITIVE));
            let along = (all - normal * all.dot(normal)) / light;
            let [x, y, z] = (along / (1.0 + along.length())).to_array();
            let mean_cosine = light / fluence.max(light);
            [mean_cosine, z, y, x].iter().fold(0, |word, x| word << 8 | snorm8(*x))
        };
        self.records[slot] = IrradianceRecord {
            position: point.position,
            ng: octahedral(point.ng.into()),
            irradiance: [light[0], light[1], light[2]],
            reach: 0.0,
            coat: coat(light, arriving),
            coat_reach: 0.0,
        };
        let [red, green, blue] = arriving.fluence;
        self.directions[slot] = LightDirections {
            red: direction(arriving.red, red),
            green: direction(arriving.green, green),
            blue: direction(arriving.blue, blue),
            open_reach: 0.0,
        };
        self.distances[slot] = rays as f32 / arriving.nearness;
        let [.., roughness] = point.above.to_le_bytes().map(|byte| f32::from(byte) / 255.0);
        self.coat_distances[slot] = COAT_REACH * roughness * roughness / arriving.coat[3];
    }

    /// All records, with their reach: that fraction of the distance to what is around each, and no
    /// farther than to a wall on its surface. `radius`: that of the filter at a position, metres;
    /// `between`: metres from one point to what hides another from it.
    #[must_use]
    pub fn finish(
        mut self,
        fraction: f32,
        radius: impl Fn(Vec3) -> f32 + Sync,
        between: impl Fn(Vec3, Vec3) -> Option<f32> + Sync,
    ) -> (Vec<IrradianceRecord>, Vec<LightDirections>) {
        let walls = wall_distances(&self.records, (self.columns, self.branches), between);
        let reaches = |(slot, wall): (usize, f32)| {
            let (distance, radius) = (self.distance(slot), radius(self.records[slot].position.into()));
            let reach = |metres: f32| (metres / radius).clamp(1e-3, MAX_REACH);
            [wall.min(fraction * distance), fraction * distance, fraction * self.coat_distances[slot]].map(reach)
        };
        let reaches: Vec<_> = walls.into_par_iter().enumerate().map(reaches).collect();
        for (slot, [reach, open_reach, coat_reach]) in reaches.into_iter().enumerate() {
            self.records[slot].reach = reach;
            self.records[slot].coat_reach = coat_reach;
            self.directions[slot].open_reach = open_reach;
        }
        // All that lies beyond the grid has the slot behind all others.
        self.records.push(NO_RECORD);
        self.directions.push(LightDirections::default());
        (self.records, self.directions)
    }

    /// Distance to what is around a record. It is no farther away than from a neighbour by way of
    /// that (Křivánek et al. 2006, "Making Radiance and Irradiance Caching Practical", neighbour
    /// clamping).
    fn distance(&self, slot: usize) -> f32 {
        let here = Vec3::from(self.records[slot].position);
        let (pixel, branch) = (slot / self.branches, slot % self.branches);
        let (row, column) = (pixel / self.columns, pixel % self.columns);
        let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
        let around = (row.saturating_sub(1)..row + 2).flat_map(|row| columns.clone().map(move |column| (row, column)));
        let neighbors = around.map(|(row, column)| (row * self.columns + column) * self.branches + branch);
        let there = neighbors.filter_map(|n| Some((self.records.get(n)?, self.distances[n])));
        there
            .filter(|(record, _)| record.irradiance[0] >= 0.0)
            .map(|(record, distance)| distance + here.distance(record.position.into()))
            .fold(self.distances[slot], f32::min)
    }
}

/// What a coat reflects, of all the light at a point: that of ends which were lit later was not
/// there when rays were added up.
fn coat(all: [f32; 4], arriving: &ArrivingLight) -> [f32; 3] {
    let [.., nearness] = arriving.coat;
    let added = [arriving.red, arriving.green, arriving.blue].map(|[.., light]| light);
    let part = |c: usize| if added[c] > 0.0 { arriving.coat[c] * (all[c] / added[c]) } else { 0.0 };
    if nearness > 0.0 { [part(0), part(1), part(2)] } else { [-1.0; 3] }
}

/// A number up to 1 in size, signed and normalised, in eight bits.
fn snorm8(x: f32) -> u32 {
    u32::from((x * 127.0).round() as i8 as u8)
}

/// The kernel, with the records that it reads.
#[derive(Debug)]
pub struct IrradianceRecords {
    kernel: Kernel,
    grid: RecordGrid,
}

impl IrradianceRecords {
    /// Takes records by the rows of `grid`.
    ///
    /// # Errors
    /// Limits of the adapter.
    pub fn new(
        gpu: &Gpu,
        (records, directions): &(Vec<IrradianceRecord>, Vec<LightDirections>),
        grid: RecordGrid,
    ) -> Result<Self> {
        let records = Table::new(gpu, "irradiance records", records)?;
        let directions = Table::new(gpu, "directions of irradiance records", directions)?;
        let kernel = Kernel::new(gpu, "filter_irradiance", &[]);
        let kernel = kernel.with_tables(&[("records", &records), ("light_directions", &directions)]);
        Ok(Self { kernel, grid })
    }

    /// Has the kernel compiled ahead of its use.
    pub fn prefetch(gpu: &Gpu) {
        let _ = Kernel::new(gpu, "filter_irradiance", &[]);
    }

    /// Adds the light of the records to the radiance of a tile's points. Those that it lights wait
    /// for no map then; others have too few records about them.
    pub fn light(&self, gpu: &Gpu, tile: &CameraTile, (points, radiance, lists): (&Buffer, &Buffer, &Buffer)) {
        let invocations = u64::from(tile.pixels) * u64::from(tile.branches);
        let grid = gpu.uniform("record grid", &self.grid);
        let tile = gpu.uniform("camera tile", tile);
        let buffers =
            [("tile", &tile), ("record_grid", &grid), ("points", points), ("radiance", radiance), ("lists", lists)];
        let mut encoder = gpu.encoder();
        self.kernel.dispatch(&mut encoder, &self.kernel.bind(gpu, &buffers), invocations);
        gpu.submit(encoder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_in_the_next_column() {
        let reach = |near: (u32, u32)| {
            let mut records = Records::new((4, 2), 1);
            let light = |nearness: f32| ArrivingLight { nearness, ..Default::default() };
            for (place, nearness) in [((0, 1), 1.0), (near, 100.0)] {
                let point = VisiblePoint { ng: [0.0, 1.0, 0.0], ..Default::default() };
                records.put(place, 0, &point, [1.0; 4], &light(nearness), 1);
            }
            // What is near at one limits the other: the distance is 1.5 units, or a hundredth.
            records.finish(1.5, |_| 3.0, |_, _| None).0[4].reach
        };
        assert_eq!(reach((1, 0)), 0.005, "above and beside it");
        assert_eq!(reach((3, 0)), 0.5, "control: the end of the row before");
    }

    #[test]
    fn records_of_any_picture_fit_a_binding() {
        assert_eq!(record_spacing((256, 256), 2, 4), 2);
        assert_eq!(record_spacing((2048, 2048), 2, 4), 2);
        assert_eq!(record_spacing((2049, 2048), 2, 4), 3, "one column more");
        assert_eq!(record_spacing((4096, 4096), 2, 1), 2);
        assert_eq!(record_spacing((65_535, 65_535), 1, 4), 64);
    }
}
