//! Pearson's chi-square test of samples against a density.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3, dvec3};

/// Default number of samples of a test.
pub const SAMPLES: usize = 100_000;
/// Cells along each side of the unit square.
const SIDE: usize = 16;
/// Minimum expected count of a cell; sparser cells are pooled.
const LEAST: f64 = 10.0;

/// Result of a test: chi-square as a standard normal deviate (Wilson and Hilferty 1931).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviate(f64);

impl Deviate {
    /// Accepts at a significance of 1e-4 on either side: neither too far from the density nor too
    /// close for independent samples.
    pub fn fits(self) -> bool {
        self.0.abs() < 3.72
    }
}

/// Compares counts with their probabilities.
pub fn deviate(counts: &[f64], probabilities: &[f64]) -> Deviate {
    let total: f64 = counts.iter().sum();
    let (mut sum, mut cells) = (0.0, 0.0);
    let mut sparse = (0.0, 0.0);
    let mut add = |count: f64, expected: f64| {
        sum += (count - expected).powi(2) / expected;
        cells += 1.0;
    };
    for (count, probability) in counts.iter().zip(probabilities) {
        let expected = probability * total;
        match expected < LEAST {
            true => sparse = (sparse.0 + count, sparse.1 + expected),
            false => add(*count, expected),
        }
    }
    // Cells of nearly zero probability must be nearly empty.
    if sparse.1 > LEAST || sparse.0 > LEAST {
        add(sparse.0, f64::max(sparse.1, 1e-3));
    }
    let freedom: f64 = cells - 1.0;
    let spread = 2.0 / (9.0 * freedom);
    Deviate(((sum / freedom).cbrt() - (1.0 - spread)) / spread.sqrt())
}

/// Tests points for a uniform distribution in the unit square.
pub fn of_unit_square(points: impl IntoIterator<Item = [f64; 2]>) -> Deviate {
    let mut counts = vec![0.0; SIDE * SIDE];
    for point in points {
        let [x, y] = point.map(|u| ((u * SIDE as f64) as usize).min(SIDE - 1));
        counts[y * SIDE + x] += 1.0;
    }
    deviate(&counts, &[1.0 / (SIDE * SIDE) as f64; SIDE * SIDE])
}

/// 1 − cosine of a direction's angle to the axis, exact for narrow cones too, and its azimuth from
/// 0 to 1.
pub fn height_and_azimuth(direction: [f32; 4], axis: Vec3) -> [f64; 2] {
    let [d, axis] = [Vec3::from_slice(&direction), axis].map(|v| v.as_dvec3().normalize());
    let x = axis.any_orthonormal_vector();
    [0.5 * (d - axis).length_squared(), d.dot(axis.cross(x)).atan2(d.dot(x)) / TAU + 0.5]
}

/// Cells of equal solid angle over all directions.
pub struct Directions {
    pub rows: usize,
    pub columns: usize,
}

impl Directions {
    fn cell(&self, direction: DVec3) -> usize {
        let row = ((1.0 - direction.y) / 2.0 * self.rows as f64) as usize;
        let column = ((direction.z.atan2(direction.x) / TAU + 0.5) * self.columns as f64) as usize;
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }

    pub fn counts(&self, directions: impl IntoIterator<Item = [f32; 4]>) -> Vec<f64> {
        let mut counts = vec![0.0; self.rows * self.columns];
        directions.into_iter().for_each(|d| counts[self.cell(Vec3::from_slice(&d).as_dvec3())] += 1.0);
        counts
    }

    /// Midpoints of `steps` x `steps` equal parts of each cell, cell by cell.
    pub fn midpoints(&self, steps: usize) -> Vec<DVec3> {
        let mut points = Vec::new();
        for cell in 0..self.rows * self.columns {
            for i in 0..steps * steps {
                let part = |cell: usize, i: usize, cells: usize| {
                    (cell as f64 + (i as f64 + 0.5) / steps as f64) / cells as f64
                };
                let y = 1.0 - 2.0 * part(cell / self.columns, i / steps, self.rows);
                let phi = TAU * (part(cell % self.columns, i % steps, self.columns) - 0.5);
                let sine = (1.0 - y * y).sqrt();
                points.push(dvec3(sine * phi.cos(), y, sine * phi.sin()));
            }
        }
        points
    }

    /// Probability of each cell: the density per steradian at its midpoints times its solid angle.
    pub fn probabilities(&self, densities: &[f64]) -> Vec<f64> {
        let cells = self.rows * self.columns;
        let steps = densities.len() / cells;
        densities.chunks(steps).map(|d| d.iter().sum::<f64>() / steps as f64 * 2.0 * TAU / cells as f64).collect()
    }
}
