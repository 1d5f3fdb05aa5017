//! Shapes: triangles and exact spheres.

use std::f64::consts::PI;

use glam::Vec3;

/// Triangle in scene coordinates. Its outside is the side from which the vertices run
/// counterclockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Vertices, metres.
    pub positions: [Vec3; 3],
    /// Unit vertex normals, interpolated across the face.
    pub normals: [Vec3; 3],
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: u32,
    /// Index into [`Scene::attributes`](super::Scene::attributes) plus one; 0 for none.
    pub attributes: u32,
    /// Index into [`Scene::objects`](super::Scene::objects).
    pub object: u32,
    /// The second and the third corner were exchanged after the attributes were read.
    pub is_turned: bool,
}

impl Triangle {
    /// A triangle without attributes.
    #[must_use]
    pub fn new(positions: [Vec3; 3], normals: [Vec3; 3], material: u32) -> Self {
        Self { positions, normals, material, attributes: 0, object: 0, is_turned: false }
    }

    /// Unit normal of the plane, towards the outside; zero for a degenerate triangle.
    #[must_use]
    pub fn geometric_normal(&self) -> Vec3 {
        // Computes in f64: the product of two edges of a small triangle underflows f32.
        let [a, b, c] = self.positions.map(Vec3::as_dvec3);
        (b - a).cross(c - a).normalize_or_zero().as_vec3()
    }

    /// Whether the normals of all corners point to the back, as in a mesh that is wound the wrong
    /// way round, or has its normals inside out.
    #[must_use]
    pub fn has_normals_behind(&self) -> bool {
        let flat = self.geometric_normal();
        self.normals.iter().all(|normal| normal.dot(flat) < 0.0)
    }

    /// Square metres.
    #[must_use]
    pub fn area(&self) -> f64 {
        let [a, b, c] = self.positions.map(Vec3::as_dvec3);
        0.5 * (b - a).cross(c - a).length()
    }
}

/// A vertex by its bits, by which equal ones are found; −0 is 0.
pub(crate) fn vertex_bits(position: Vec3) -> [u32; 3] {
    (position + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// An exact sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre, metres.
    pub center: Vec3,
    /// Metres, > 0.
    pub radius: f32,
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: u32,
    /// Index into [`Scene::objects`](super::Scene::objects).
    pub object: u32,
}

impl Sphere {
    /// Square metres.
    #[must_use]
    pub fn area(&self) -> f64 {
        4.0 * PI * f64::from(self.radius).powi(2)
    }
}

/// Axis-aligned bounding box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates, metres.
    pub min: Vec3,
    /// Largest coordinates, metres.
    pub max: Vec3,
}

impl Bounds {
    /// Empty box: the identity of [`Bounds::union`].
    pub const EMPTY: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Smallest box that contains points.
    #[must_use]
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Bounds {
        points.into_iter().fold(Self::EMPTY, |all, point| all.union(Bounds { min: point, max: point }))
    }

    /// Smallest box that contains both.
    #[must_use]
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether both have a point in common.
    #[must_use]
    pub fn touches(&self, other: &Bounds) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Distance of a point from the box; 0 within.
    pub(crate) fn distance(&self, point: Vec3) -> f32 {
        point.distance(point.max(self.min).min(self.max))
    }

    /// Distance at which a ray enters the box, if it meets it within reach; `direction` is a unit
    /// vector.
    pub(crate) fn entry(&self, origin: Vec3, direction: Vec3, reach: f32) -> Option<f32> {
        let (a, b) = ((self.min - origin) / direction, (self.max - origin) / direction);
        // Zero over zero is not a number: `min` and `max` then leave the other operand.
        let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
        let is_missed = enter.max(0.0) > leave * (1.0 + 1e-6) || enter > reach;
        (!is_missed).then_some(enter)
    }

    /// Half of the surface, m²; 0 for the empty box.
    #[must_use]
    pub fn half_area(self) -> f32 {
        let size = (self.max - self.min).max(Vec3::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// Length of the diagonal, metres; 0 for the empty box.
    #[must_use]
    pub fn diagonal(&self) -> f32 {
        (self.max - self.min).max(Vec3::ZERO).length()
    }
}

impl From<&Triangle> for Bounds {
    fn from(triangle: &Triangle) -> Self {
        let [a, b, c] = triangle.positions;
        Bounds { min: a.min(b).min(c), max: a.max(b).max(c) }
    }
}

impl From<&Sphere> for Bounds {
    fn from(sphere: &Sphere) -> Self {
        Bounds { min: sphere.center - sphere.radius, max: sphere.center + sphere.radius }
    }
}
