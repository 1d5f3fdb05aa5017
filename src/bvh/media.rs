//! Media around a point: the solids of glass that contain it.
//!
//! A straight path from infinity to the point enters and leaves solids; those that it has entered
//! more often than left contain the point. Six such paths run along the axes, and the most frequent
//! result is taken, so that a hole in one solid does not change it. Along an axis, the crossing
//! test of a triangle is a winding number in the plane perpendicular to the axis. Edges follow a
//! half-open rule (Sunday 2021, "Practical Geometry Algorithms", winding number), which is the same
//! for both triangles of an edge. A path through edges or corners of a closed mesh therefore enters
//! it as often as it leaves it.
//!
//! A cover, as the water of a pool, is a sheet and encloses nothing. What sees its back before its
//! front is in the water.

use std::collections::{BTreeMap, HashSet};

use glam::{DVec2, DVec3, Vec3};

use super::{Bvh, BvhChild, FILLER};
use crate::{
    layout::{MEDIA_WORDS, Primitive},
    scene::{Bounds, NO_SLOT, Scene, Solids, Surfaces, Triangle},
};

/// Relative widening of boxes, which covers the rounding of their corners.
const BOX_SLACK: f64 = 1e-6;

/// Surfaces that let light through between a point and a cover at most.
const MOST_BETWEEN: usize = 32;

/// Set of the slots of [`Solids`] that contain a point: bit `i % 32` of word `i / 32` for slot `i`.
pub type Media = [u32; MEDIA_WORDS];

/// Finds the media around points of a scene.
#[derive(Debug)]
pub struct MediaProbe<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    solids: &'a Solids,
    /// Box around all solids but covers, metres.
    bounds: Bounds,
    /// Slots of covers, and their surfaces.
    covers: Vec<(u32, Surfaces<'a>)>,
}

/// Intersection of a line along an axis with the surface of a solid.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// Distance along the axis from the point, metres.
    height: f64,
    /// Whether the outside lies ahead along the axis.
    outside_ahead: bool,
    slot: u32,
}

impl<'a> MediaProbe<'a> {
    /// Prepares queries for points of `scene`, whose hierarchy is `bvh` and whose solids these are.
    #[must_use]
    pub fn new(scene: &'a Scene, bvh: &'a Bvh, solids: &'a Solids) -> Self {
        let bounds = match solids.is_empty() {
            true => Bounds::EMPTY,
            false => {
                let triangles = scene.triangles.iter().map(Bounds::from);
                let all = triangles.chain(scene.spheres.iter().map(Bounds::from)).zip(0..);
                let is_solid = |slot: u32| slot != NO_SLOT && !solids.is_cover(slot);
                let of_solids = all.filter(|(_, i)| is_solid(solids.slot(*i))).map(|(bounds, _)| bounds);
                of_solids.fold(Bounds::EMPTY, Bounds::union)
            }
        };
        Self { scene, bvh, solids, bounds, covers: covers(scene, solids) }
    }

    /// The media that contain a point (coordinates in metres).
    #[must_use]
    pub fn at(&self, point: DVec3) -> Media {
        let mut media = self.around(point);
        let point = point.as_vec3();
        for (slot, sheet) in &self.covers {
            let is_behind = sheet.side(point, |along, most| self.is_free(point, along, most)) > 0;
            media[*slot as usize / 32] |= u32::from(is_behind) << (slot % 32);
        }
        media
    }

    /// Whether light goes from a point up to a distance, through whatever lets it through.
    fn is_free(&self, point: Vec3, along: Vec3, most: f32) -> bool {
        let mut from = point;
        for _ in 0..MOST_BETWEEN {
            let Some(hit) = self.bvh.nearest_hit(from, along) else { return true };
            if hit.position.distance(point) >= most {
                return true;
            }
            if !self.scene.materials[hit.material as usize].surface.transmits() {
                return false;
            }
            from = hit.position;
        }
        false
    }

    /// The closed solids that contain a point.
    fn around(&self, point: DVec3) -> Media {
        let (min, max) = (self.bounds.min.as_dvec3(), self.bounds.max.as_dvec3());
        if !(point.cmpge(min).all() && point.cmple(max).all()) {
            return Media::default();
        }
        let found: Vec<Media> = (0..3)
            .flat_map(|axis| {
                let crossings = self.crossings(point, axis);
                [media_along(&crossings, true), media_along(&crossings, false)]
            })
            .collect();
        let votes = |media: &Media| found.iter().filter(|other| *other == media).count();
        // `max_by_key` returns the last of several maxima; the reversed order makes it the first
        // axis.
        found.iter().rev().max_by_key(|media| votes(media)).copied().unwrap_or_default()
    }

    /// Intersections of the line through `point` along an axis with solids that have a medium.
    fn crossings(&self, point: DVec3, axis: usize) -> Vec<Crossing> {
        let (mut found, mut known) = (Vec::new(), HashSet::new());
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            for child in self.bvh.nodes[node as usize].children() {
                if !is_on_line(&child, point, axis) {
                    continue;
                }
                if child.count == 0 {
                    waiting.push(child.first);
                }
                for primitive in child.first..child.first + child.count {
                    let primitive = &self.bvh.primitives[primitive as usize];
                    // Large primitives may be listed several times.
                    if known.insert(primitive.id) {
                        self.cross(primitive, point, axis, &mut found);
                    }
                }
            }
        }
        found
    }

    fn cross(&self, primitive: &Primitive, point: DVec3, axis: usize, found: &mut Vec<Crossing>) {
        if primitive.id == FILLER {
            return;
        }
        let slot = self.solids.slot(primitive.id);
        if slot == NO_SLOT || self.solids.is_cover(slot) {
            return;
        }
        let id = primitive.id as usize;
        if let Some(triangle) = self.scene.triangles.get(id) {
            let corners = triangle.positions.map(|corner| split(corner.as_dvec3() - point, axis));
            let crossed = cross_triangle(corners);
            found.extend(crossed.map(|(height, outside_ahead)| Crossing { height, outside_ahead, slot }));
        } else {
            let sphere = &self.scene.spheres[id - self.scene.triangles.len()];
            let (aside, middle) = split(sphere.center.as_dvec3() - point, axis);
            let half_squared = f64::from(sphere.radius).powi(2) - aside.length_squared();
            if half_squared > 0.0 {
                let half = half_squared.sqrt();
                found.push(Crossing { height: middle - half, outside_ahead: false, slot });
                found.push(Crossing { height: middle + half, outside_ahead: true, slot });
            }
        }
    }
}

/// The slots of covers, and the surfaces of each.
fn covers<'a>(scene: &Scene, solids: &Solids) -> Vec<(u32, Surfaces<'a>)> {
    let mut found: BTreeMap<u32, Vec<Triangle>> = BTreeMap::new();
    let slots = scene.triangles.iter().zip(0..).map(|(triangle, i)| (triangle, solids.slot(i)));
    for (triangle, slot) in slots.filter(|(_, slot)| solids.is_cover(*slot)) {
        found.entry(slot).or_default().push(*triangle);
    }
    found.into_iter().map(|(slot, triangles)| (slot, Surfaces::new(triangles))).collect()
}

/// Media that a path along the axis, from infinity ahead or behind, has entered more often than
/// left at the point.
fn media_along(crossings: &[Crossing], from_ahead: bool) -> Media {
    let mut winding = [0_i32; NO_SLOT as usize];
    for crossing in crossings.iter().filter(|c| if from_ahead { c.height > 0.0 } else { c.height < 0.0 }) {
        winding[crossing.slot as usize] += if crossing.outside_ahead == from_ahead { 1 } else { -1 };
    }
    let mut media = Media::default();
    for (slot, _) in winding.iter().enumerate().filter(|(_, winding)| **winding > 0) {
        media[slot / 32] |= 1 << (slot % 32);
    }
    media
}

/// Components of a vector perpendicular to an axis, and the component along it.
fn split(v: DVec3, axis: usize) -> (DVec2, f64) {
    (DVec2::new(v[(axis + 1) % 3], v[(axis + 2) % 3]), v[axis])
}

/// Whether the line along the axis may pass through the box.
fn is_on_line(child: &BvhChild, point: DVec3, axis: usize) -> bool {
    [(axis + 1) % 3, (axis + 2) % 3].into_iter().all(|k| {
        let (min, max) = (f64::from(child.bounds.min[k]), f64::from(child.bounds.max[k]));
        let slack = BOX_SLACK * min.abs().max(max.abs());
        (min - slack..=max + slack).contains(&point[k])
    })
}

/// Coordinate along the axis at which the axis through the origin intersects a triangle, and
/// whether the triangle's outside lies ahead.
fn cross_triangle(corners: [(DVec2, f64); 3]) -> Option<(f64, bool)> {
    let [a, b, c] = corners;
    let winding = edge_winding(a.0, b.0) + edge_winding(b.0, c.0) + edge_winding(c.0, a.0);
    if winding == 0 {
        return None;
    }
    // Barycentric weights up to a common factor.
    let weights = [b.0.perp_dot(c.0), c.0.perp_dot(a.0), a.0.perp_dot(b.0)];
    let sum: f64 = weights.iter().sum();
    let height = weights.iter().zip(corners).map(|(w, corner)| w * corner.1).sum::<f64>() / sum;
    Some((if height.is_finite() { height } else { a.1 }, winding > 0))
}

/// Contribution of an edge to the winding number about the origin; the negative of the reversed
/// edge's.
fn edge_winding(from: DVec2, to: DVec2) -> i32 {
    let side = from.perp_dot(to);
    if from.y <= 0.0 && to.y > 0.0 && side > 0.0 {
        return 1;
    }
    if from.y > 0.0 && to.y <= 0.0 && side < 0.0 { -1 } else { 0 }
}

#[cfg(test)]
mod tests {
    use glam::{dvec3, vec3};

    use super::*;
    use crate::scene::{Material, Sphere, Surface};

    fn scene(surfaces: usize) -> Scene {
        let material = |i: usize| Material::new("", Surface::Glass { ior: 1.0 + i as f32, tint: Vec3::ONE });
        Scene { materials: (0..surfaces).map(material).collect(), ..Scene::default() }
    }

    /// Cube about the origin whose corners, edges and diagonals lie on axis-parallel lines through
    /// round numbers.
    fn add_cube(scene: &mut Scene, half: f32, material: u32, faces: usize) {
        let corner = |u: f32, v: f32, axis: usize, side: f32| {
            let mut p = Vec3::ZERO;
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side * half, u * half, v * half);
            p
        };
        for face in 0..faces {
            let (axis, side) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
            let at = |u, v| corner(u, v * side, axis, side);
            for positions in [[at(-1., -1.), at(1., -1.), at(1., 1.)], [at(-1., -1.), at(1., 1.), at(-1., 1.)]] {
                scene.triangles.push(Triangle::new(positions, [Vec3::X; 3], material));
            }
        }
    }

    /// Indices of refraction of the media around a point, the one that fills the space first.
    fn media(scene: &Scene, point: DVec3) -> Vec<f32> {
        let solids = Solids::new(scene);
        let media = MediaProbe::new(scene, &Bvh::build(scene), &solids).at(point);
        let holds = |slot: &usize| media[slot / 32] >> (slot % 32) & 1 == 1;
        (0..solids.media.len()).filter(holds).map(|slot| solids.media[slot].ior).collect()
    }

    #[test]
    fn nested_solids_are_found_from_the_inside_out() {
        let mut scene = scene(3);
        scene.spheres.push(Sphere { center: Vec3::ZERO, radius: 1.0, material: 2, object: 0 });
        add_cube(&mut scene, 2.0, 1, 6);
        add_cube(&mut scene, 4.0, 0, 6);
        // Points on and off the edges and diagonals of the faces as projected along all axes.
        for (point, around) in [
            (dvec3(0.0, 0.0, 0.0), vec![3.0, 2.0, 1.0]),
            (dvec3(1.5, 1.5, 1.5), vec![2.0, 1.0]),
            (dvec3(1.25, -1.25, 0.5), vec![2.0, 1.0]),
            (dvec3(3.0, 3.0, 2.0), vec![1.0]),
            (dvec3(2.0 - 1e-9, 0.0, 0.1), vec![2.0, 1.0]),
            (dvec3(2.0 + 1e-9, 0.0, 0.1), vec![1.0]),
            (dvec3(5.0, 0.0, 0.0), vec![]),
        ] {
            assert_eq!(media(&scene, point), around, "at {point}");
        }
    }

    #[test]
    fn a_missing_face_does_not_decide() {
        let mut open = scene(1);
        add_cube(&mut open, 2.0, 0, 5);
        assert_eq!(media(&open, dvec3(0.3, 0.2, 0.1)), [1.0]);
        let mut sheet = scene(1);
        add_cube(&mut sheet, 2.0, 0, 1);
        assert!(media(&sheet, dvec3(2.0, 0.2, 0.1)).is_empty(), "control: a single sheet is no solid");
    }

    #[test]
    fn a_cavity_with_inward_faces_is_outside() {
        let mut shell = scene(1);
        add_cube(&mut shell, 2.0, 0, 6);
        let outer = shell.triangles.len();
        add_cube(&mut shell, 1.0, 0, 6);
        shell.triangles[outer..].iter_mut().for_each(|t| t.positions.swap(1, 2));
        assert!(media(&shell, dvec3(0.5, 0.5, 0.5)).is_empty());
        assert_eq!(media(&shell, dvec3(1.5, 0.5, 0.5)), [1.0]);
        assert!(media(&shell, vec3(1.5, 9.0, 0.5).as_dvec3()).is_empty());
    }
}
