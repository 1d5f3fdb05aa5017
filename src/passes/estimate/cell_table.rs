//! Cells of space with one irradiance for each surface in them, chosen and kept in a hash table on
//! the CPU; `reuse_irradiance` reads it.

use std::collections::{HashMap, HashSet};

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    error::Result,
    layout::{
        CELL_COSINE, CELL_FLATNESS, CELL_SURFACES, IrradianceCell, SPLIT_CELL, VisiblePoint, WHOLE_CELL, WIDE_CELL,
    },
};

/// Levels of cells. Each is half as wide as the one before.
const LEVELS: u32 = 8;
/// Maximum number of entries, so that the table has at most 2^18 slots of 64 bytes.
const MAX_ENTRIES: usize = 1 << 17;
/// Marks from whose radii the width of the first level is taken, and the fraction of them whose
/// estimates are narrower.
const PILOTS: usize = 1024;
const PILOT_QUANTILE: f64 = 0.9;

/// Fraction of the wanted radius that the estimate of a cell must have to speak for cells in it
/// that have no entry of their own.
const SUBSTITUTE: f32 = 0.5;

/// Ratio of the irradiances of cells beside each other above which both are split: a wall may stand
/// in them, whose other side is another room.
const CONTRAST: f32 = 4.0;

/// Light at a point by photon maps.
#[derive(Clone, Copy, Debug)]
pub struct PointEstimate {
    /// Radiance, or irradiance, W/m², as the point's weight says.
    pub light: [f32; 3],
    /// Radius of the narrowest of the estimates, metres.
    pub radius: f32,
    /// Whether the disc of one of them is narrow.
    pub is_narrow: bool,
}

impl Default for PointEstimate {
    /// No light, by no estimate.
    fn default() -> Self {
        Self { light: [0.0; 3], radius: f32::INFINITY, is_narrow: false }
    }
}

/// Computes the irradiance at points.
pub(super) type Irradiances<'a> = dyn FnMut(&[VisiblePoint]) -> Result<Vec<PointEstimate>> + 'a;

/// Entries by cell.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CellTable {
    entries: Vec<IrradianceCell>,
    /// Width of a cell at most, in radii of its estimate.
    spacing: f32,
    /// Cells of level 0 per metre.
    pub per_metre: f32,
    pub levels: u32,
}

impl CellTable {
    /// Chooses a point for each surface in each cell that has a mark, and keeps the irradiance
    /// there. A cell is at most `spacing` times as wide as the radius of its estimate, and as
    /// bright as those beside it but for a factor; others are replaced by cells of the next level.
    /// `None` without marks.
    pub fn build(marks: &[VisiblePoint], spacing: f32, irradiances: &mut Irradiances) -> Result<Option<Self>> {
        let pilots: Vec<_> = marks.iter().step_by(marks.len().div_ceil(PILOTS) | 1).copied().collect();
        let mut radii: Vec<f32> = irradiances(&pilots)?.iter().map(|estimate| estimate.radius).collect();
        radii.sort_by(f32::total_cmp);
        let Some(radius) = radii.get((radii.len() as f64 * PILOT_QUANTILE) as usize).filter(|r| **r > 0.0) else {
            return Ok(None);
        };
        let mut table = Self { entries: Vec::new(), spacing, per_metre: 1.0 / (spacing * radius), levels: LEVELS };
        table.add(marks, irradiances)?;
        Ok(Some(table))
    }

    /// Has entries for those surfaces of further marks that have none.
    pub fn add(&mut self, marks: &[VisiblePoint], irradiances: &mut Irradiances) -> Result<()> {
        let mut known: HashMap<(u32, [i32; 3]), Vec<IrradianceCell>> = HashMap::new();
        for entry in &self.entries {
            known.entry((entry.level - 1, entry.coordinates)).or_default().push(*entry);
        }
        let mut open: Vec<&VisiblePoint> = marks.iter().collect();
        for level in 0..LEVELS {
            let per_metre = at_level(self.per_metre, level);
            let fate = |mark: &&VisiblePoint| {
                let cell = known.get(&(level, cell_at(mark, per_metre))).map_or(&[][..], Vec::as_slice);
                let is_own = |entry: &&IrradianceCell| is_flat((entry.position, entry.normal), mark, per_metre);
                match cell.iter().find(is_own) {
                    Some(entry) if entry.split == WHOLE_CELL => Fate::Covered,
                    None if cell.len() < CELL_SURFACES as usize => Fate::New,
                    _ => Fate::Split,
                }
            };
            let fates: Vec<Fate> = open.par_iter().map(fate).collect();
            let of =
                |fate| open.iter().zip(&fates).filter(move |(_, its)| **its == fate).map(|(mark, _)| *mark).collect();
            let (new, split): (Vec<_>, Vec<_>) = (of(Fate::New), of(Fate::Split));
            open = split;
            let (surfaces, crowd) = surfaces(&new, per_metre);
            if self.entries.len() + surfaces.len() > MAX_ENTRIES {
                break;
            }
            let points: Vec<_> = surfaces.iter().map(|surface| *surface.marks[0]).collect();
            let found = irradiances(&points)?;
            let contrasts = contrasts(&surfaces, &found, per_metre);
            // Clutter takes the light of similar normals. Elsewhere, further surfaces have narrower
            // cells.
            let own = surfaces.iter().zip(&found);
            let cluttered: HashSet<[i32; 3]> =
                own.filter(|(_, estimate)| estimate.is_narrow).map(|(surface, _)| surface.coordinates).collect();
            open.extend(crowd.into_iter().filter(|mark| !cluttered.contains(&cell_at(mark, per_metre))));
            for ((surface, estimate), contrasts) in surfaces.into_iter().zip(found).zip(contrasts) {
                let cells = estimate.radius * self.spacing * per_metre;
                let split = match cells {
                    _ if contrasts => WIDE_CELL,
                    1.0.. => WHOLE_CELL,
                    SUBSTITUTE.. => SPLIT_CELL,
                    _ => WIDE_CELL,
                };
                let Surface { coordinates, marks } = surface;
                let VisiblePoint { position, ng: normal, .. } = *marks[0];
                let level = level + 1;
                self.entries.push(IrradianceCell {
                    coordinates,
                    level,
                    position,
                    split,
                    normal,
                    narrow: estimate.is_narrow.into(),
                    irradiance: estimate.light,
                    pad: 0,
                });
                if split != WHOLE_CELL {
                    open.extend(marks);
                }
            }
        }
        Ok(())
    }

    /// The entries, each at its hash or in the first free slot from there on. Their number is a
    /// power of 2, and at least half of them are no entries.
    pub fn slots(&self) -> Vec<IrradianceCell> {
        let mut slots = vec![IrradianceCell::default(); (2 * self.entries.len()).next_power_of_two().max(2)];
        let mask = slots.len() - 1;
        for entry in &self.entries {
            let mut slot = cell_hash(entry.coordinates, entry.level - 1) as usize & mask;
            while slots[slot].level != 0 {
                slot = (slot + 1) & mask;
            }
            slots[slot] = *entry;
        }
        slots
    }
}

/// What becomes of a mark at a level.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    /// An entry has its light.
    Covered,
    /// Its cell has room for an entry.
    New,
    /// It is left to narrower cells.
    Split,
}

/// Coordinates of the cell of a point.
fn cell_at(point: &VisiblePoint, per_metre: f32) -> [i32; 3] {
    (Vec3::from(point.position) * per_metre).floor().as_ivec3().to_array()
}

/// Cells of that level per metre.
fn at_level(per_metre: f32, level: u32) -> f32 {
    per_metre * (1 << level) as f32
}

/// Marks of one cell that lie on one surface. The first of them is nearest to the cell's centre.
struct Surface<'a> {
    coordinates: [i32; 3],
    marks: Vec<&'a VisiblePoint>,
}

/// Groups marks by cell and surface, and returns those for whose surfaces a cell has no room.
fn surfaces<'a>(marks: &[&'a VisiblePoint], per_metre: f32) -> (Vec<Surface<'a>>, Vec<&'a VisiblePoint>) {
    let placed = |(number, mark): (usize, &&'a VisiblePoint)| {
        let at = Vec3::from(mark.position) * per_metre;
        let from_centre = at.distance_squared(at.floor() + 0.5);
        (cell_at(mark, per_metre), from_centre, number, *mark)
    };
    let mut placed: Vec<_> = marks.par_iter().enumerate().map(placed).collect();
    placed.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let cells: Vec<_> = placed.par_chunk_by(|a, b| a.0 == b.0).map(|cell| surfaces_of_cell(cell, per_metre)).collect();
    let (surfaces, crowds): (Vec<_>, Vec<_>) = cells.into_iter().unzip();
    (surfaces.into_iter().flatten().collect(), crowds.into_iter().flatten().collect())
}

/// The same for the marks of one cell, of which the nearest to its centre come first.
fn surfaces_of_cell<'a>(
    marks: &[([i32; 3], f32, usize, &'a VisiblePoint)],
    per_metre: f32,
) -> (Vec<Surface<'a>>, Vec<&'a VisiblePoint>) {
    let (mut surfaces, mut crowd) = (Vec::<Surface>::new(), Vec::new());
    for &(coordinates, _, _, mark) in marks {
        if let Some(surface) = surfaces.iter_mut().find(|s| is_flat(plane_of(s.marks[0]), mark, per_metre)) {
            surface.marks.push(mark);
        } else if surfaces.len() < CELL_SURFACES as usize {
            surfaces.push(Surface { coordinates, marks: vec![mark] });
        } else {
            crowd.push(mark);
        }
    }
    (surfaces, crowd)
}

/// Whether each surface is much brighter or darker than the same one in a cell beside its own.
fn contrasts(surfaces: &[Surface], found: &[PointEstimate], per_metre: f32) -> Vec<bool> {
    let light: Vec<f32> = found.iter().map(|estimate| estimate.light.iter().sum()).collect();
    // Surfaces of a cell follow each other, cells by their coordinates.
    let in_cell = |coordinates: [i32; 3]| {
        let first = surfaces.partition_point(|surface| surface.coordinates < coordinates);
        (first..surfaces.len()).take_while(move |i| surfaces[*i].coordinates == coordinates)
    };
    let mut contrasts = vec![false; surfaces.len()];
    for (i, surface) in surfaces.iter().enumerate() {
        for axis in 0..3 {
            let mut beside = surface.coordinates;
            beside[axis] += 1;
            for j in in_cell(beside).filter(|j| is_flat(plane_of(surface.marks[0]), surfaces[*j].marks[0], per_metre)) {
                let differ = light[i].max(light[j]) > CONTRAST * light[i].min(light[j]);
                contrasts[i] |= differ;
                contrasts[j] |= differ;
            }
        }
    }
    contrasts
}

/// Position and normal.
fn plane_of(mark: &VisiblePoint) -> ([f32; 3], [f32; 3]) {
    (mark.position, mark.ng)
}

/// Whether `point` takes the irradiance at a place of that position and normal.
fn is_flat((position, normal): ([f32; 3], [f32; 3]), point: &VisiblePoint, per_metre: f32) -> bool {
    let normal = Vec3::from(normal);
    let height = normal.dot(Vec3::from(point.position) - Vec3::from(position));
    height.abs() * per_metre <= CELL_FLATNESS && normal.dot(Vec3::from(point.ng)) >= CELL_COSINE
}

/// Hash of a cell. Twin of the function in `shaders/lib/core/cell_hash.wesl`.
#[must_use]
pub fn cell_hash(coordinates: [i32; 3], level: u32) -> u32 {
    let [x, y, z] = coordinates.map(|c| c as u32);
    let mut h = x.wrapping_mul(0x9e37_79b1)
        ^ y.wrapping_mul(0x85eb_ca77)
        ^ z.wrapping_mul(0xc2b2_ae3d)
        ^ level.wrapping_mul(0x27d4_eb2f);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks on the plane y = 0 about x = 0 and x = 100.
    fn marks() -> Vec<VisiblePoint> {
        let grid = (0..4096).map(|i| [(i % 64) as f32 / 64.0, 0.0, (i / 64) as f32 / 64.0]);
        grid.flat_map(|[x, y, z]| [[x, y, z], [x + 100.0, y, z]])
            .map(|position| VisiblePoint { position, ng: [0.0, 1.0, 0.0], next_map: 1, ..Default::default() })
            .collect()
    }

    fn even(light: f32, radius: f32) -> PointEstimate {
        PointEstimate { light: [light; 3], radius, is_narrow: false }
    }

    /// Estimates that have a small radius about x = 0.
    fn found(points: &[VisiblePoint]) -> Result<Vec<PointEstimate>> {
        let of = |p: &VisiblePoint| even(p.position[0], if p.position[0] < 50.0 { 0.1 } else { 0.8 });
        Ok(points.iter().map(of).collect())
    }

    #[test]
    fn cells_are_as_wide_as_their_estimates_allow() {
        let table = CellTable::build(&marks(), 0.5, &mut found).unwrap().unwrap();
        let kept: Vec<_> = table.entries.iter().filter(|e| e.split == WHOLE_CELL).collect();
        let width = |e: &IrradianceCell| 1.0 / at_level(table.per_metre, e.level - 1);
        for entry in &kept {
            let most = if entry.position[0] < 50.0 { 0.05 } else { 0.4 };
            assert!(width(entry) <= most * 1.0001 && width(entry) > most / 2.1, "{entry:?}");
        }
        let narrow = kept.iter().filter(|e| e.position[0] < 50.0).count();
        assert!(narrow > 300 && kept.len() - narrow < 40, "{narrow} of {}", kept.len());
        assert!(table.slots().len() >= 2 * kept.len());
    }

    #[test]
    fn cells_are_narrow_where_irradiance_leaps() {
        let split_between = |ratio: f32| {
            let mut found = |points: &[VisiblePoint]| {
                let light = |p: &VisiblePoint| if p.position[0] % 100.0 < 0.55 { 1.0 } else { ratio };
                Ok(points.iter().map(|p| even(light(p), 0.4)).collect())
            };
            let table = CellTable::build(&marks(), 0.5, &mut found).unwrap().unwrap();
            table.entries.iter().filter(|entry| entry.level > 1).map(|entry| entry.position[0]).collect::<Vec<_>>()
        };
        let narrow = split_between(0.02);
        assert!(narrow.iter().any(|x| (x - 0.55).abs() < 0.03), "{narrow:?}");
        assert!(narrow.iter().all(|x| (x % 100.0 - 0.55).abs() < 0.4), "{narrow:?}");
        assert_eq!(split_between(0.5), [0.0_f32; 0], "control: it changes little");
    }

    #[test]
    fn surfaces_of_a_cell_have_irradiances_of_their_own() {
        let at = |y: f32, ng: [f32; 3]| VisiblePoint { position: [0.3, y, 0.3], ng, next_map: 1, ..Default::default() };
        let marks = [at(0.1, [0.0, 1.0, 0.0]), at(0.1, [0.0, -1.0, 0.0]), at(0.6, [0.0, 1.0, 0.0])];
        let mut found = |points: &[VisiblePoint]| Ok(points.iter().map(|_| even(1.0, 2.0)).collect());
        let table = CellTable::build(&marks, 0.5, &mut found).unwrap().unwrap();
        assert_eq!(table.entries.iter().filter(|e| e.level == 1).count(), 3);
    }

    #[test]
    fn further_marks_have_entries_where_there_are_none() {
        let [near, far]: [Vec<VisiblePoint>; 2] =
            [false, true].map(|is_far| marks().into_iter().filter(|p| (p.position[0] > 50.0) == is_far).collect());
        let mut table = CellTable::build(&far, 0.5, &mut found).unwrap().unwrap();
        let before = table.clone();
        let mut none = |points: &[VisiblePoint]| {
            assert!(points.is_empty(), "an estimate where there is an entry");
            Ok(Vec::new())
        };
        table.add(&far, &mut none).unwrap();
        assert_eq!(table, before);
        table.add(&near, &mut found).unwrap();
        let added = &table.entries[before.entries.len()..];
        assert!(added.len() > 300 && added.iter().all(|entry| entry.position[0] < 50.0), "{} entries", added.len());
        let narrowest = added.iter().map(|entry| entry.level).max();
        assert!(narrowest > before.entries.iter().map(|entry| entry.level).max(), "as wide as their estimates");
    }

    #[test]
    fn without_marks_there_is_no_table() {
        assert_eq!(CellTable::build(&[], 0.5, &mut |_| Ok(Vec::new())).unwrap(), None);
    }
}
