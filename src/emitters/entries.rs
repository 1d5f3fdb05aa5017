//! Spheres at the places where parallel light and that of the environment enter what the cameras
//! see: windows that the sky shines in by, and patches of sun. Photon paths are aimed at them, as
//! most of those that are spread over the scene would end on its roof.

use glam::{UVec3, Vec3, uvec3, vec3};
use rayon::prelude::*;

use super::{
    openings::{Openings, may_pass},
    sight::SeenPoint,
    targets::{Item, Target, spheres_around},
};
use crate::{
    bvh::Bvh,
    scene::{Bounds, LightKind, Scene},
};

/// Maximum number of spheres.
const MAX_ENTRIES: u32 = 8;
/// Minimum number of points that the sun reaches.
const FEWEST: usize = 8;
/// Minimum radius of what is seen, in that of the scene. Light that a garden or a street reflects
/// into a room would have fewer and stronger photons, if more paths were aimed at its windows.
const MOST_OF_SCENE: f32 = 0.6;
/// Fraction of what is seen that a parallel light reaches, up to which it has to be aimed.
const MOST_LIT: f32 = 0.25;
/// Fraction of what is seen that much of the sky lights, up to which that has to be aimed.
const MOST_OPEN: f32 = 0.25;
/// Radius around a point that the sun reaches, in the extent of all: what lies between them counts.
const AROUND: f32 = 0.01;
/// Cells along the longest side of the box around most origins of rays.
const CELLS: f32 = 48.0;
/// Fraction of the origins of rays, and of what is seen, beyond either end of a box around the
/// others, along each axis; and the margins of both, in the largest extent: openings lie beyond.
const TRIMMED: f32 = 0.02;
const SEEN_TRIMMED: f32 = 0.05;
const MARGIN: f32 = 0.5;
const SEEN_MARGIN: f32 = 0.1;
/// Fraction of the rays that go through the cells of the entries, and maximum number of these.
const COVERED: f32 = 0.98;
const MAX_CELLS: usize = 512;
/// Greatest sum of the cross-sections of the entries, in that of the scene: larger ones gain
/// nothing.
const LARGEST: f32 = 0.3;
/// Density of the paths to the entries over that beside them.
const LEVEL: f32 = 4.0;

/// A sphere that parallel light is aimed at, and its share of the paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    pub target: Target,
    pub share: f32,
}

/// The entries of all parallel light. The rest of the paths is spread over the scene. None if one
/// of the lights reaches much of what is seen, as paths that are spread over the scene then do; nor
/// if there is much beside what is seen.
#[must_use]
pub fn entries(
    scene: &Scene,
    bvh: &Bvh,
    seen: &[SeenPoint],
    openings: Option<&Openings>,
    whole: &Target,
) -> Vec<Entry> {
    let surfaces: Vec<(Vec3, Vec3)> = seen.iter().flat_map(SeenPoint::points).collect();
    let (low, high) = box_of_most(&surfaces, SEEN_TRIMMED, SEEN_MARGIN);
    if 0.5 * (high - low).length() < MOST_OF_SCENE * whole.radius {
        return Vec::new();
    }
    let mut parts = Vec::new();
    if scene.environment.as_ref().is_some_and(|environment| !environment.is_dark()) {
        match openings.filter(|openings| openings.open() < MOST_OPEN) {
            Some(openings) => parts.extend(narrowest(&openings.rays().collect::<Vec<_>>())),
            None => return Vec::new(),
        }
    }
    let suns = scene.lights.iter().filter(|light| light.kind == LightKind::Directional);
    let suns = suns.filter(|light| light.intensity.max_element() > 0.0).map(|light| -light.direction);
    let passes: Vec<bool> = scene.materials.iter().map(may_pass).collect();
    for sun in suns {
        let is_lit = |(position, normal): &(Vec3, Vec3)| {
            normal.dot(sun) > 0.0 && !bvh.is_blocked(*position, sun, &|m| passes[m as usize])
        };
        let lit: Vec<Vec3> = surfaces.par_iter().filter(|point| is_lit(point)).map(|point| point.0).collect();
        if lit.len() < FEWEST || lit.len() as f32 > MOST_LIT * surfaces.len() as f32 {
            return Vec::new();
        }
        let extent = Bounds::around(lit.iter().copied());
        let radius = AROUND * (extent.max - extent.min).max_element();
        parts.extend(lit.into_iter().map(|place| Item::Sphere(place, radius)));
    }
    if parts.is_empty() {
        return Vec::new();
    }
    let spheres = spheres_around(parts.into_iter().map(|part| vec![part]).collect(), MAX_ENTRIES);
    with_shares(&spheres, whole)
}

/// Entries that are small enough to gain something, with shares by which paths to them are no more
/// than some times as dense as beside them: light by an entry that was not found has stronger
/// photons then, but not much stronger ones.
fn with_shares(spheres: &[Target], whole: &Target) -> Vec<Entry> {
    let size = |sphere: &Target| sphere.radius * sphere.radius;
    let sizes: f32 = spheres.iter().map(size).sum();
    if sizes >= LARGEST * size(whole) {
        return Vec::new();
    }
    let odds = LEVEL * sizes / size(whole);
    let part = odds / (1.0 + odds);
    spheres.iter().map(|target| Entry { target: *target, share: part * size(target) / sizes }).collect()
}

/// A box around most points, for all that some lie far away, as on the houses across the street:
/// without that fraction of them at either end along each axis, and with a margin.
fn box_of_most(points: &[(Vec3, Vec3)], trimmed: f32, margin: f32) -> (Vec3, Vec3) {
    let along = |axis: usize| {
        let mut all: Vec<f32> = points.iter().map(|(position, _)| position[axis]).collect();
        all.sort_by(f32::total_cmp);
        let at = |part: f32| all.get((part * all.len() as f32) as usize).copied().unwrap_or(0.0);
        (at(trimmed), at(1.0 - trimmed))
    };
    let [x, y, z] = [0, 1, 2].map(along);
    let (low, high) = (vec3(x.0, y.0, z.0), vec3(x.1, y.1, z.1));
    let margin = margin * (high - low).max_element();
    (low - margin, high + margin)
}

/// Spheres around few cells of a grid that nearly all rays go through, found greedily. Rays through
/// an opening from all sides are closest together within it.
fn narrowest(rays: &[(Vec3, Vec3)]) -> Vec<Item> {
    let (low, high) = box_of_most(rays, TRIMMED, MARGIN);
    let rays: Vec<&(Vec3, Vec3)> =
        rays.iter().filter(|(origin, _)| origin.cmpge(low).all() && origin.cmple(high).all()).collect();
    let side = ((high - low).max_element() / CELLS).max(f32::MIN_POSITIVE);
    let size = ((high - low) / side).ceil().as_uvec3().max(UVec3::ONE);
    let cell_at = |position: Vec3| {
        let at = ((position - low) / side).as_uvec3().min(size - 1);
        at.x + size.x * (at.y + size.y * at.z)
    };
    let way = |(origin, direction): &&(Vec3, Vec3)| {
        let inside = |position: &Vec3| position.cmpge(low).all() && position.cmple(high).all();
        // No more steps than through the whole box: far from the origin they may be rounded away.
        let steps = 4 * CELLS as u32;
        let places = (0..steps).map(|i| *origin + 0.5 * side * i as f32 * *direction).take_while(inside);
        let mut cells: Vec<u32> = places.map(cell_at).collect();
        cells.dedup();
        cells
    };
    let ways: Vec<Vec<u32>> = rays.par_iter().map(way).collect();
    let mut through = vec![Vec::new(); size.element_product() as usize];
    for (ray, way) in ways.iter().enumerate() {
        way.iter().for_each(|cell| through[*cell as usize].push(ray));
    }
    let mut counts: Vec<usize> = through.iter().map(Vec::len).collect();
    let (mut is_covered, mut left) = (vec![false; rays.len()], rays.len());
    let mut chosen = Vec::new();
    while left as f32 > (1.0 - COVERED) * rays.len() as f32 && chosen.len() < MAX_CELLS {
        // The first of those with the most rays, so that the choice is the same everywhere.
        let Some(cell) = (0..counts.len()).max_by_key(|cell| (counts[*cell], usize::MAX - cell)) else { break };
        for ray in std::mem::take(&mut through[cell]) {
            if !std::mem::replace(&mut is_covered[ray], true) {
                left -= 1;
                ways[ray].iter().for_each(|other| counts[*other as usize] -= 1);
            }
        }
        let at = uvec3(cell as u32 % size.x, cell as u32 / size.x % size.y, cell as u32 / (size.x * size.y));
        chosen.push(Item::Sphere(low + side * (at.as_vec3() + 0.5), 0.5 * 3_f32.sqrt() * side));
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays from a plane to points of a square of that half side, 1 m away.
    fn rays(half: f32) -> Vec<(Vec3, Vec3)> {
        let part = |i: u32, step: f32| (i as f32 * step).fract() - 0.5;
        let ray = |i: u32| {
            let origin = vec3(4.0 * part(i, 0.618), 4.0 * part(i, 0.755), 0.0);
            let to = vec3(2.0 * half * part(i, 0.57), 2.0 * half * part(i, 0.414), 1.0);
            (origin, (to - origin).normalize())
        };
        (0..2000).map(ray).collect()
    }

    #[test]
    fn cells_that_all_rays_go_through_lie_in_the_opening() {
        let spheres = |half: f32| narrowest(&rays(half)).iter().map(Item::bounds).collect::<Vec<_>>();
        let found = spheres(0.2);
        assert!(found.len() < 20, "{} cells", found.len());
        for Bounds { min, max } in found {
            let middle = 0.5 * (min + max);
            let off = middle.truncate().abs().max_element();
            assert!((middle.z - 1.0).abs() < 0.35 && off < 0.45, "{middle}");
        }
        assert!(spheres(2.0).len() > 100, "control: rays to everywhere");
    }

    #[test]
    fn shares_leave_some_for_the_scene_and_are_not_too_uneven() {
        let sphere = |radius: f32| Target { center: Vec3::ZERO, radius };
        let entries = with_shares(&[sphere(0.5), sphere(1.0)], &sphere(4.0));
        let rest = 1.0 - entries.iter().map(|entry| entry.share).sum::<f32>();
        let density = |entry: &Entry| entry.share / entry.target.radius.powi(2);
        let ratio = density(&entries[0]) / (rest / 16.0);
        assert!((ratio / LEVEL - 1.0).abs() < 1e-3, "{ratio}");
        assert_eq!(density(&entries[0]), density(&entries[1]));
        let large = with_shares(&[sphere(3.0)], &sphere(4.0));
        assert!(large.is_empty(), "control: {large:?}");
    }
}
