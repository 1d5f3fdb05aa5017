//! Walls that stand on a surface between irradiance records: the boards of a shelf on its back, or
//! a partition between two rooms with one floor. Light differs on both sides.

use glam::Vec3;
use rayon::prelude::*;

use crate::layout::{IrradianceRecord, from_octahedral};

/// Records of a row or column of the grid up to which the next one of the same surface is looked
/// for: what stands between is seen as well.
const STEPS: usize = 4;
/// Cosine between the normals of records of one surface, and height above its plane over distance.
const COSINE: f32 = 0.9;
const FLATNESS: f32 = 0.1;
/// Ratio of irradiances up to which it does not matter whether a wall is between.
const ALIKE: f32 = 1.25;
/// Height above the surface, over the distance of the records, at which a wall is looked for.
const HEIGHT: f32 = 0.25;

/// Distance of each record to the nearest wall on its surface, metres; infinite where there is
/// none. `between`: metres from one point to what hides another from it.
pub(super) fn wall_distances(
    records: &[IrradianceRecord],
    (columns, branches): (usize, usize),
    between: impl Fn(Vec3, Vec3) -> Option<f32> + Sync,
) -> Vec<f32> {
    let stride = columns * branches;
    let walls = |slot: usize| {
        let between = &between;
        let in_row = columns - 1 - slot % stride / branches;
        let in_column = (records.len() - 1 - slot) / stride;
        [(branches, in_row), (stride, in_column)].into_iter().filter_map(move |(step, count)| {
            let here = &records[slot];
            let next = (1..=count.min(STEPS)).map(|n| slot + n * step).find(|n| on_one_surface(here, &records[*n]))?;
            let there = &records[next];
            let distance = if differ(here, there) { wall_between(here, there, between)? } else { return None };
            let apart = Vec3::from(here.position).distance(there.position.into());
            Some([(slot, distance), (next, apart - distance)])
        })
    };
    let found: Vec<_> = (0..records.len()).into_par_iter().flat_map_iter(walls).collect();
    let mut distances = vec![f32::INFINITY; records.len()];
    for (slot, distance) in found.into_iter().flatten() {
        distances[slot] = distances[slot].min(distance);
    }
    if distances.iter().any(|distance| distance.is_finite()) {
        spread(records, (columns, branches), &mut distances);
    }
    distances
}

/// Distances by way of neighbours: of those before each record, then of those behind it.
fn spread(records: &[IrradianceRecord], (columns, branches): (usize, usize), distances: &mut [f32]) {
    let rows = records.len() / (columns * branches);
    let offsets = [(-1, 0), (-1, -1), (0, -1), (1, -1)];
    let mut visit = |slot: usize, sign: isize| {
        let (pixel, branch) = (slot / branches, slot % branches);
        let (column, row) = ((pixel % columns) as isize, (pixel / columns) as isize);
        for (x, y) in offsets.map(|(x, y)| (column + sign * x, row + sign * y)) {
            if (0..columns as isize).contains(&x) && (0..rows as isize).contains(&y) {
                let other = (y as usize * columns + x as usize) * branches + branch;
                if distances[other].is_finite() && on_one_surface(&records[slot], &records[other]) {
                    let apart = Vec3::from(records[slot].position).distance(records[other].position.into());
                    distances[slot] = distances[slot].min(distances[other] + apart);
                }
            }
        }
    };
    (0..records.len()).for_each(|slot| visit(slot, 1));
    (0..records.len()).rev().for_each(|slot| visit(slot, -1));
}

fn on_one_surface(a: &IrradianceRecord, b: &IrradianceRecord) -> bool {
    if a.irradiance[0] < 0.0 || b.irradiance[0] < 0.0 {
        return false;
    }
    let apart = Vec3::from(b.position) - Vec3::from(a.position);
    let [na, nb] = [a, b].map(|record| from_octahedral(record.ng));
    let height = na.dot(apart).abs().max(nb.dot(apart).abs());
    na.dot(nb) >= COSINE && height <= FLATNESS * apart.length()
}

fn differ(a: &IrradianceRecord, b: &IrradianceRecord) -> bool {
    let [a, b] = [a, b].map(|record| record.irradiance.iter().sum::<f32>());
    a.max(b) > ALIKE * a.min(b)
}

/// Metres from one record to the wall between both.
fn wall_between(
    a: &IrradianceRecord,
    b: &IrradianceRecord,
    between: impl Fn(Vec3, Vec3) -> Option<f32>,
) -> Option<f32> {
    let [from, to] = [a, b].map(|record| Vec3::from(record.position));
    let height = HEIGHT * from.distance(to);
    between(from + height * from_octahedral(a.ng), to + height * from_octahedral(b.ng))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::octahedral;

    /// Records in a grid on a floor, brighter from x = 2.5 on, with two branches, of which the
    /// second has none.
    fn floor(bright: f32) -> Vec<IrradianceRecord> {
        let record = |i: usize| IrradianceRecord {
            position: [(i / 2 % 6) as f32, 0.0, (i / 12) as f32],
            ng: octahedral(Vec3::Y),
            irradiance: if i % 2 == 1 { [-1.0; 3] } else { [if i / 2 % 6 > 2 { bright } else { 1.0 }; 3] },
            reach: 0.0,
            coat: [-1.0; 3],
            coat_reach: 0.0,
        };
        (0..60).map(record).collect()
    }

    /// A wall at x = 2.4 as far as z = 3.5.
    fn wall(from: Vec3, to: Vec3) -> Option<f32> {
        let crosses = (from.x < 2.4) != (to.x < 2.4) && from.z < 3.5;
        crosses.then(|| (2.4 - from.x).abs())
    }

    #[test]
    fn records_know_the_distance_to_a_wall() {
        let distances = wall_distances(&floor(5.0), (6, 2), wall);
        let at = |x: usize, z: usize| distances[2 * (6 * z + x)];
        for (x, right) in [(0, 2.4), (2, 0.4), (3, 0.6), (5, 2.6)] {
            assert!((at(x, 1) - right).abs() < 1e-5, "{x}: {}", at(x, 1));
        }
        assert!((at(2, 4) - 1.4).abs() < 1e-5, "beside its end: {}", at(2, 4));
        assert!(distances.iter().skip(1).step_by(2).all(|distance| distance.is_infinite()), "no records");
        let dark = wall_distances(&floor(1.2), (6, 2), wall);
        assert!(dark.iter().all(|distance| distance.is_infinite()), "control: light is alike");
        let open = wall_distances(&floor(5.0), (6, 2), |_, _| None);
        assert!(open.iter().all(|distance| distance.is_infinite()), "control: no wall");
    }
}
