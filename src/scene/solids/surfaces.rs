//! Surfaces in trees over their boxes, for rays and distances at load.

use std::borrow::Cow;

use glam::{DVec3, Mat3, Vec3};
use rayon::prelude::*;

use crate::scene::{Bounds, CompleteTree, Instance, Material, SharedMesh, Triangle, Visit};

/// Directions in which a point looks for a sheet.
const VIEWS: usize = 32;
/// Part of the distance to a surface, at its end, in which nothing is looked for.
const END: f32 = 1e-4;

/// Triangles in a tree over their boxes.
#[derive(Debug)]
pub(crate) struct Surfaces<'a> {
    pub triangles: Cow<'a, [Triangle]>,
    tree: CompleteTree<Bounds>,
}

impl<'a> Surfaces<'a> {
    pub fn new(triangles: impl Into<Cow<'a, [Triangle]>>) -> Self {
        let triangles = triangles.into();
        let tree = CompleteTree::of_boxes(&triangles.iter().map(Bounds::from).collect::<Vec<_>>());
        Self { triangles, tree }
    }

    fn bounds(&self) -> Bounds {
        self.tree.nodes.first().copied().unwrap_or(Bounds::EMPTY)
    }

    /// Nearest hit of a ray up to a distance: that distance, in lengths of `along`, and the
    /// geometric normal.
    pub fn hit(&self, from: Vec3, along: Vec3, most: f32) -> Option<(f32, Vec3)> {
        let (mut nearest, mut found) = (most, None);
        self.tree.visit(|visit| match visit {
            Visit::Node(_, bounds) => bounds.entry(from, along, nearest).is_some(),
            Visit::Leaf(items) => {
                for triangle in items.iter().map(|i| &self.triangles[*i as usize]) {
                    let t = distance_along(triangle, from.as_dvec3(), along.as_dvec3()).map(|t| t as f32);
                    if let Some(t) = t.filter(|t| *t < nearest) {
                        nearest = t;
                        found = Some((t, triangle));
                    }
                }
                true
            }
        });
        found.map(|(t, triangle)| (t, triangle.geometric_normal()))
    }

    /// On which side of the sheet a point lies: positive behind it, negative before it, 0 where it
    /// sees nothing of it. What it meets first of the sheet on the way to some of its triangles
    /// decides, so that the back of a dome behind its own front does not count; most of them, so
    /// that a gap at the rim does not. `is_free` tells whether light may go from the point in a
    /// direction up to a distance.
    pub fn side(&self, point: Vec3, is_free: impl Fn(Vec3, f32) -> bool + Sync) -> i32 {
        let step = self.triangles.len().div_ceil(VIEWS).max(1);
        let vote = |triangle: &Triangle| {
            let [a, b, c] = triangle.positions;
            let along = ((a + b + c) / 3.0 - point).normalize_or_zero();
            match self.hit(point, along, f32::INFINITY) {
                Some((t, normal)) if is_free(along, t * (1.0 - END)) => normal.dot(along).signum() as i32,
                _ => 0,
            }
        };
        self.triangles.par_iter().step_by(step).map(vote).sum()
    }
}

/// The opaque surfaces of a scene.
#[derive(Debug)]
pub(super) struct Opaque<'a> {
    own: Surfaces<'a>,
    meshes: Vec<Surfaces<'a>>,
    /// Copies of these, in a tree over their boxes.
    copies: Vec<MeshCopy>,
    tree: CompleteTree<Bounds>,
}

/// A mesh in one place.
#[derive(Debug)]
struct MeshCopy {
    instance: Instance,
    to_mesh: Mat3,
}

impl<'a> Opaque<'a> {
    /// Of single triangles, and of meshes that instances share: each of these has one tree, however
    /// many copies there are.
    pub fn new(
        triangles: &[Triangle],
        materials: &[Material],
        meshes: &'a [SharedMesh],
        instances: &[Instance],
    ) -> Self {
        let is_opaque = |t: &&Triangle| !materials[t.material as usize].surface.transmits();
        let own = Surfaces::new(triangles.iter().filter(is_opaque).copied().collect::<Vec<_>>());
        let meshes: Vec<Surfaces<'a>> =
            meshes.par_iter().map(|mesh| Surfaces::new(mesh.triangles.as_slice())).collect();
        let place = |instance: &Instance| MeshCopy { instance: *instance, to_mesh: instance.linear.inverse() };
        let copies: Vec<MeshCopy> = instances.iter().map(place).collect();
        let around =
            |copy: &MeshCopy| moved(&meshes[copy.instance.mesh as usize].bounds(), |p| copy.instance.position(p));
        let tree = CompleteTree::of_boxes(&copies.iter().map(around).collect::<Vec<_>>());
        Self { own, meshes, copies, tree }
    }

    /// Where no sheet asks for them.
    pub fn none() -> Self {
        Self::new(&[], &[], &[], &[])
    }

    /// As [`Surfaces::hit`].
    pub fn hit(&self, from: Vec3, along: Vec3, most: f32) -> Option<(f32, Vec3)> {
        let mut found = self.own.hit(from, along, most);
        let mut nearest = found.map_or(most, |(t, _)| t);
        self.tree.visit(|visit| match visit {
            Visit::Node(_, bounds) => bounds.entry(from, along, nearest).is_some(),
            Visit::Leaf(items) => {
                for copy in items.iter().map(|i| &self.copies[*i as usize]) {
                    let (from, along) = (copy.to_mesh * (from - copy.instance.offset), copy.to_mesh * along);
                    if let Some((t, normal)) = self.meshes[copy.instance.mesh as usize].hit(from, along, nearest) {
                        nearest = t;
                        found = Some((t, (copy.to_mesh.transpose() * normal).normalize_or_zero()));
                    }
                }
                true
            }
        });
        found
    }

    /// Whether nothing lies in a direction from a point up to a distance.
    pub fn is_free(&self, from: Vec3, along: Vec3, most: f32) -> bool {
        self.hit(from, along, most).is_none()
    }

    /// Whether a point lies below the ground or in a wall: the next surface above it faces up.
    pub fn is_below(&self, point: Vec3, lift: f32) -> bool {
        self.hit(point + lift * Vec3::Y, Vec3::Y, f32::INFINITY).is_some_and(|(_, normal)| normal.y > 0.0)
    }

    /// Whether a triangle comes as near to a point as that.
    pub fn is_near(&self, point: Vec3, reach: f32) -> bool {
        let around = Bounds { min: point - reach, max: point + reach };
        let mut found = false;
        self.own.tree.near(&around, |i| {
            found = distance(point, self.own.triangles[i].positions) <= reach;
            !found
        });
        self.tree.near(&around, |i| {
            let MeshCopy { instance, to_mesh } = &self.copies[i];
            let mesh = &self.meshes[instance.mesh as usize];
            let in_mesh = moved(&around, |p| *to_mesh * (p - instance.offset));
            mesh.tree.near(&in_mesh, |i| {
                found |= distance(point, mesh.triangles[i].positions.map(|p| instance.position(p))) <= reach;
                !found
            });
            !found
        });
        found
    }
}

/// The box around a box that is moved.
fn moved(bounds: &Bounds, to: impl Fn(Vec3) -> Vec3) -> Bounds {
    let pick = |bit: usize, axis: usize| if bit >> axis & 1 == 1 { bounds.max[axis] } else { bounds.min[axis] };
    Bounds::around((0..8).map(|i| to(Vec3::new(pick(i, 0), pick(i, 1), pick(i, 2)))))
}

/// Distance along a ray at which it meets a triangle (Möller and Trumbore 1997).
pub(super) fn distance_along(triangle: &Triangle, from: DVec3, along: DVec3) -> Option<f64> {
    let [a, b, c] = triangle.positions.map(Vec3::as_dvec3);
    let (e1, e2, s) = (b - a, c - a, from - a);
    let p = along.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let (u, q) = (s.dot(p) * inverse, s.cross(e1));
    let (v, t) = (along.dot(q) * inverse, e2.dot(q) * inverse);
    (u >= -1e-6 && v >= -1e-6 && u + v <= 1.0 + 1e-6 && t > 0.0 && t.is_finite()).then_some(t)
}

/// Distance of a point from a triangle (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
fn distance(point: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let along = |from: Vec3, to: Vec3| {
        let edge = to - from;
        let t = ((point - from).dot(edge) / edge.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        (from + t * edge).distance(point)
    };
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(point - *p).dot(normal) >= 0.0);
    let plane = (point - a).dot(normal.normalize_or_zero()).abs();
    if inside { plane } else { along(a, b).min(along(b, c)).min(along(c, a)) }
}
