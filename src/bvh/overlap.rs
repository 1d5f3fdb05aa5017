//! Overlap of primitives: whether one reaches into a box, and whether two lie in each other.

use glam::{DVec2, DVec3, Vec3};

use super::build::bounds;
use crate::{
    layout::{Primitive, SPHERE_BIT},
    scene::Bounds,
};

/// Distance below which two surfaces are one, over their largest coordinate: 2^-21, four steps of
/// 32-bit numbers.
pub(super) const TOLERANCE: f64 = 1.0 / (1 << 21) as f64;
/// Largest sine of the angle between the planes of two surfaces that are one.
pub(super) const MAX_SINE: f64 = 1e-3;
/// Fraction of the size of the smaller triangle by which two must overlap.
const MIN_OVERLAP: f64 = 1e-4;
/// Area of a parallelogram over the square of the longest edge below which rounding is not small
/// against that fraction of it.
const THIN: f64 = 1e-8;

/// How large triangles are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    /// Of the parallelogram on the edges of the smallest, m².
    area: f64,
    /// Square of the longest edge, m².
    edge_squared: f64,
}

impl Sizes {
    /// Identity of [`Self::union`].
    pub const NONE: Self = Self { area: f64::INFINITY, edge_squared: 0.0 };

    pub fn of(triangle: &Primitive) -> Self {
        let [e1, e2] = [Vec3::from(triangle.e1).as_dvec3(), Vec3::from(triangle.e2).as_dvec3()];
        let edge_squared = e1.length_squared().max(e2.length_squared()).max((e2 - e1).length_squared());
        Self { area: e1.cross(e2).length(), edge_squared }
    }

    pub fn union(self, other: Self) -> Self {
        Self { area: self.area.min(other.area), edge_squared: self.edge_squared.max(other.edge_squared) }
    }

    /// Area of an overlap that is too small for two of these to lie in each other, and twice that;
    /// none where rounding may be as large.
    pub fn negligible(self) -> Option<f64> {
        (self.area > THIN * self.edge_squared).then_some(0.25 * MIN_OVERLAP * self.area)
    }
}

/// A primitive as boxes are tested against it.
pub(super) struct Shape {
    bounds: Bounds,
    /// Corners and directions of a triangle: normal and edges; `None` for a sphere.
    triangle: Option<([DVec3; 3], [DVec3; 4])>,
    pub sizes: Sizes,
    /// Largest coordinate that the tolerance follows, beside those of the primitive.
    reach: f64,
}

impl Shape {
    pub fn new(primitive: &Primitive) -> Self {
        let triangle = (primitive.material & SPHERE_BIT == 0).then(|| {
            let [a, b, c] = corners(primitive);
            ([a, b, c], [(b - a).cross(c - a), b - a, c - b, a - c])
        });
        Self { bounds: bounds(primitive), triangle, sizes: Sizes::of(primitive), reach: 0.0 }
    }

    /// The same with the tolerance of coordinates up to `reach`.
    pub fn widened(self, reach: f64) -> Self {
        Self { reach, ..self }
    }

    /// Whether the planes of two triangles are parallel, so that they may be one; true for spheres.
    pub fn is_parallel(&self, other: &Primitive) -> bool {
        let Some((_, [normal, ..])) = &self.triangle else { return true };
        let [e1, e2] = [other.e1, other.e2].map(|edge| Vec3::from_array(edge).as_dvec3());
        let its = e1.cross(e2);
        normal.cross(its).length_squared() <= MAX_SINE * MAX_SINE * normal.length_squared() * its.length_squared()
    }

    /// Whether an edge of one of two triangles, which are parallel, has the other one on its outer
    /// side, at least up to a part of both that is too small to count: [`coincide`] is then false.
    ///
    /// What lies inside of an edge by `x` times the height above it is less than `2 x` of a
    /// triangle.
    pub fn is_beside(&self, other: &Primitive) -> bool {
        let Some((corners, [normal, edges @ ..])) = &self.triangle else { return false };
        let b0 = Vec3::from_array(other.v0).as_dvec3();
        let [e1, e2] = [Vec3::from_array(other.e1).as_dvec3(), Vec3::from_array(other.e2).as_dvec3()];
        let its_corners = [b0, b0 + e1, b0 + e2];
        let its_normal = e1.cross(e2);
        let Some(negligible) = self.sizes.union(Sizes::of(other)).negligible() else { return false };
        let least = negligible * self.sizes.area;
        let turn = normal.dot(its_normal).signum();
        are_outside(&its_corners, corners, edges, *normal, least)
            || are_outside(corners, &its_corners, &[e1, e2 - e1, -e2], turn * *normal, least)
    }

    /// Whether it reaches into a box, up to the tolerance (Akenine-Möller 2001, "Fast 3D
    /// Triangle-Box Overlap Testing"); for a sphere, whether its own box does.
    pub fn meets(&self, other: &Bounds) -> bool {
        let Some(grown) = self.grown(other) else { return false };
        let Some((corners, [normal, edges @ ..])) = &self.triangle else { return true };
        let across = |edge: &DVec3| DVec3::AXES.iter().all(|axis| reaches(corners, edge.cross(*axis), grown));
        reaches(corners, *normal, grown) && edges.iter().all(across)
    }

    /// The same at a lower price, true for some boxes beside the edges of a triangle too: of those
    /// that are not smaller than it, few are beside it.
    pub fn may_meet(&self, other: &Bounds) -> bool {
        if other.diagonal() < self.bounds.diagonal() {
            return self.meets(other);
        }
        let Some(grown) = self.grown(other) else { return false };
        let Some((corners, [normal, ..])) = &self.triangle else { return true };
        reaches(corners, *normal, grown)
    }

    /// Middle and half size of a box that is larger by the tolerance, if its own box meets it.
    fn grown(&self, other: &Bounds) -> Option<[DVec3; 2]> {
        let largest = |bounds: &Bounds| f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
        let slack = 2.0 * TOLERANCE * largest(&self.bounds).max(largest(other)).max(self.reach);
        let [low, high] = [other.min.as_dvec3() - slack, other.max.as_dvec3() + slack];
        let meets = self.bounds.min.as_dvec3().cmple(high).all() && low.cmple(self.bounds.max.as_dvec3()).all();
        meets.then(|| [0.5 * (low + high), 0.5 * (high - low)])
    }
}

/// Whether an edge of a triangle, which turns left about `up`, has all points on its right, or less
/// than `least` to its left: a distance times the lengths of the edge and of `up`.
fn are_outside(points: &[DVec3; 3], corners: &[DVec3; 3], edges: &[DVec3; 3], up: DVec3, least: f64) -> bool {
    let is_outer = |from: DVec3, edge: DVec3| {
        let inward = up.cross(edge);
        let [p, q, r] = points;
        (*p - from).dot(inward).max((*q - from).dot(inward)).max((*r - from).dot(inward)) <= least
    };
    is_outer(corners[0], edges[0]) || is_outer(corners[1], edges[1]) || is_outer(corners[2], edges[2])
}

/// Whether an axis separates neither side of a box, by its middle and half size, from a triangle.
fn reaches(corners: &[DVec3; 3], axis: DVec3, [center, half]: [DVec3; 2]) -> bool {
    let radius = half.dot(axis.abs());
    let [a, b, c] = corners.map(|corner| (corner - center).dot(axis));
    a.min(b).min(c) <= radius && a.max(b).max(c) >= -radius
}

/// Largest coordinate that a primitive is computed from, metres.
pub(super) fn reach(primitive: &Primitive) -> f64 {
    let [v0, e1, e2] = [Vec3::from(primitive.v0), Vec3::from(primitive.e1), Vec3::from(primitive.e2)];
    f64::from(v0.abs().max(e1.abs()).max(e2.abs()).max_element())
}

/// Whether two primitives, which are parallel, lie in each other over more than an edge.
pub(super) fn coincide(a: &Primitive, b: &Primitive) -> bool {
    if b.id == a.id || (a.material ^ b.material) & SPHERE_BIT != 0 {
        return false;
    }
    let tolerance = reach(a).max(reach(b)) * TOLERANCE;
    let [a0, b0] = [a, b].map(|p| Vec3::from_array(p.v0).as_dvec3());
    if a.material & SPHERE_BIT != 0 {
        let radii = [a, b].map(|p| f64::from(p.e1[0]));
        return a0.distance(b0) <= tolerance && (radii[0] - radii[1]).abs() <= tolerance;
    }
    let [ca, cb] = [a, b].map(corners);
    let [na, nb] = [ca, cb].map(|[p, q, r]| (q - p).cross(r - p).normalize_or_zero());
    if na == DVec3::ZERO || nb == DVec3::ZERO {
        return false;
    }
    // In the plane of the first, up to the tolerance where they overlap.
    let tangent = na.any_orthonormal_vector();
    let flat = |corner: DVec3| DVec2::new((corner - a0).dot(tangent), (corner - a0).dot(na.cross(tangent)));
    let overlap = clipped(&ca.map(flat), &cb.map(flat));
    let size = area(&ca.map(flat)).abs().min(area(&cb.map(flat)).abs());
    let height = |p: DVec2| {
        let on_a = a0 + p.x * tangent + p.y * na.cross(tangent);
        ((on_a - b0).dot(nb) / na.dot(nb)).abs()
    };
    area(overlap.corners()).abs() > MIN_OVERLAP * size && overlap.corners().iter().all(|p| height(*p) <= tolerance)
}

pub(super) fn corners(primitive: &Primitive) -> [DVec3; 3] {
    let [v0, e1, e2] = [Vec3::from(primitive.v0), Vec3::from(primitive.e1), Vec3::from(primitive.e2)];
    let [v0, e1, e2] = [v0.as_dvec3(), e1.as_dvec3(), e2.as_dvec3()];
    [v0, v0 + e1, v0 + e2]
}

/// A convex polygon of few corners; each of three cuts adds one at most.
#[derive(Clone, Copy, Default)]
struct Polygon {
    corners: [DVec2; 6],
    count: usize,
}

impl Polygon {
    fn corners(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }

    fn push(&mut self, corner: DVec2) {
        // Rounding may let an edge cross a line more than twice.
        if self.count < self.corners.len() {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }
}

/// The part of one triangle that lies in another one, corner by corner (Sutherland and Hodgman
/// 1974).
fn clipped(subject: &[DVec2; 3], clip: &[DVec2; 3]) -> Polygon {
    let turn = area(clip).signum();
    let mut polygon = Polygon::default();
    subject.iter().for_each(|corner| polygon.push(*corner));
    for edge in 0..3 {
        let (from, to) = (clip[edge], clip[(edge + 1) % 3]);
        let side = |p: DVec2| turn * (to - from).perp_dot(p - from);
        let mut kept = Polygon::default();
        for (i, &p) in polygon.corners().iter().enumerate() {
            let q = polygon.corners()[(i + 1) % polygon.count];
            let (here, next) = (side(p), side(q));
            if here >= 0.0 {
                kept.push(p);
            }
            if (here >= 0.0) != (next >= 0.0) {
                kept.push(p.lerp(q, here / (here - next)));
            }
        }
        polygon = kept;
    }
    polygon
}

/// Signed area of a polygon.
fn area(polygon: &[DVec2]) -> f64 {
    let edges = (0..polygon.len()).map(|i| polygon[i].perp_dot(polygon[(i + 1) % polygon.len()]));
    0.5 * edges.sum::<f64>()
}
