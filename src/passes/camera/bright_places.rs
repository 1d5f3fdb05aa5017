//! Small bright places from which much of a picture's indirect light comes: the wall behind a lamp,
//! a caustic. Rays of final gathering are aimed at them, for few of those by the cosine find one,
//! and each brings much.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::layout::BrightPatch;

/// Patches at most: every ray reads them all.
const MAX_PATCHES: usize = 16;
/// Radiance of a bright end, in units of the mean over all rays.
const BRIGHT: f64 = 8.0;
/// Fraction of the rays' variance that bright ends must cause for any ray to be aimed.
const LEAST_PART: f64 = 0.3;
/// Widths of cells that are tried, in units of the narrowest: few ends are spread over few wide
/// cells.
const WIDTHS: [f32; 4] = [1.0, 2.0, 4.0, 8.0];
/// Ends that make a patch.
const MIN_ENDS: f64 = 3.0;

/// The end of a ray that was drawn by the cosine.
#[derive(Clone, Copy, Debug)]
pub struct RayEnd {
    /// Metres.
    pub position: Vec3,
    /// Geometric.
    pub normal: Vec3,
    /// Radiance towards the start of the ray.
    pub radiance: f64,
}

/// Bright patches, and the irradiance by all else on average, in units of their power.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BrightPlaces {
    pub patches: Vec<BrightPatch>,
    pub other_light: f32,
}

/// Sums over the bright ends of a cell, with their radiance as the weight.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    ends: f64,
    light: f64,
    squares: f64,
    position: Vec3,
    normal: Vec3,
    spread: f32,
}

impl BrightPlaces {
    /// Finds places in cells of at least that width by the ends of `rays` rays from all over the
    /// picture; those that met nothing are left out.
    #[must_use]
    pub fn find(ends: &[RayEnd], rays: f64, width: f32) -> Self {
        WIDTHS.iter().find_map(|factor| Self::in_cells(ends, rays, width * factor)).unwrap_or_default()
    }

    /// The same by cells of one width; `None` if too little of the light comes from the places.
    fn in_cells(ends: &[RayEnd], rays: f64, width: f32) -> Option<Self> {
        let mean = ends.iter().map(|end| end.radiance).sum::<f64>() / rays.max(1.0);
        let is_bright = |end: &&RayEnd| end.radiance > BRIGHT * mean;
        let mut cells: BTreeMap<[i32; 4], Sums> = BTreeMap::new();
        for end in ends.iter().filter(is_bright) {
            // Surfaces that face other ways are other patches.
            let axis = end.normal.abs().max_position();
            let side = 2 * axis as i32 + i32::from(end.normal[axis] < 0.0);
            let [x, y, z] = (end.position / width).floor().as_ivec3().to_array();
            let sums = cells.entry([x, y, z, side]).or_default();
            let weight = end.radiance / (sums.light + end.radiance);
            let step = end.position - sums.position;
            sums.position += weight as f32 * step;
            sums.spread = (1.0 - weight as f32) * (sums.spread + weight as f32 * step.length_squared());
            sums.normal += end.radiance as f32 * end.normal;
            sums.ends += 1.0;
            sums.light += end.radiance;
            sums.squares += end.radiance.powi(2);
        }
        let mut cells: Vec<Sums> = cells.into_values().filter(|sums| sums.ends >= MIN_ENDS).collect();
        cells.sort_by(|a, b| b.squares.total_cmp(&a.squares));
        cells.truncate(MAX_PATCHES);
        let of_patches = |of: fn(&Sums) -> f64| cells.iter().map(of).sum::<f64>();
        let all = ends.iter().map(|end| end.radiance.powi(2)).sum::<f64>();
        if of_patches(|sums| sums.squares) <= LEAST_PART * all {
            return None;
        }
        let other = mean - of_patches(|sums| sums.light) / rays;
        Some(Self {
            patches: cells.iter().filter_map(Sums::patch).collect(),
            other_light: (std::f64::consts::PI * other.max(0.0)) as f32,
        })
    }
}

impl Sums {
    fn patch(&self) -> Option<BrightPatch> {
        // The mean square of the distance from the middle of an even disc is half of its squared
        // radius. Twice that is taken, for what is darker at the rim.
        let radius = 2.0 * (self.spread * (1.0 + 1.0 / self.ends as f32)).sqrt();
        let area = 2.0 * std::f64::consts::PI * f64::from(self.spread);
        let power = (self.light / self.ends * area) as f32;
        let normal = self.normal.try_normalize()?.to_array();
        Some(BrightPatch { position: self.position.to_array(), radius, normal, power })
            .filter(|patch| patch.radius > 0.0 && patch.power.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends all over a floor, of which those within a tenth of a metre are brighter.
    fn ends(bright: f64) -> Vec<RayEnd> {
        let at = |i: u32| Vec3::new((i % 100) as f32 / 50.0 - 1.0, 0.0, (i / 100) as f32 / 50.0 - 1.0);
        let radiance = |p: Vec3| if (p - Vec3::new(0.31, 0.0, 0.29)).length() < 0.1 { bright } else { 1.0 };
        let end = |p: Vec3| RayEnd { position: p, normal: Vec3::Y, radiance: radiance(p) };
        (0..10_000).map(|i| end(at(i))).collect()
    }

    #[test]
    fn a_bright_place_is_found_where_it_is() {
        let bright = BrightPlaces::find(&ends(500.0), 10_000.0, 1.0);
        let [patch] = bright.patches[..] else { panic!("one patch: {bright:?}") };
        assert!((Vec3::from(patch.position) - Vec3::new(0.31, 0.0, 0.29)).length() < 0.01, "{patch:?}");
        assert!(patch.radius > 0.1 && patch.radius < 0.16 && patch.normal == [0.0, 1.0, 0.0], "{patch:?}");
        assert!((patch.power / (500.0 * 0.01 * std::f32::consts::PI) - 1.0).abs() < 0.1, "{patch:?}");
        assert!((bright.other_light / std::f32::consts::PI - 1.0).abs() < 0.02, "{bright:?}");
        let narrow = BrightPlaces::find(&ends(500.0), 10_000.0, 0.1).patches;
        assert!(narrow.len() > 3 && narrow.len() <= MAX_PATCHES, "{narrow:?}");
    }

    #[test]
    fn even_light_has_none() {
        assert_eq!(BrightPlaces::find(&ends(7.0), 10_000.0, 1.0), BrightPlaces::default());
        assert_eq!(BrightPlaces::find(&[], 0.0, 1.0), BrightPlaces::default());
    }
}
