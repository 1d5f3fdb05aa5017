//! A tree over primitives by the planes that they lie in, for those that lie in each other.
//!
//! Boxes alone do not tell apart thousands of nearly equal things in nearly one place, nor
//! triangles that all meet at one corner. What lies in each other has one plane, up to rounding.
//! Primitives are therefore divided by whatever separates them best: the direction of their planes,
//! their height along it, their place in it, or their size.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::overlap::{MAX_SINE, Shape, Sizes, TOLERANCE, corners, reach};
use crate::{
    layout::{Primitive, SPHERE_BIT},
    scene::{Bounds, CompleteTree},
};

/// Ratio of sizes, as a power of two, by which primitives are worth a division.
const SIZE_STEP: f64 = 3.0;
/// Coordinates by which primitives are divided: place and height, normal, size.
const COORDINATES: usize = 7;

/// Rounding of a corner's place in a plane, over the tolerance.
const ROUNDING: f64 = 1e-6;

/// A primitive to be divided.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    /// Its index in the list of all.
    index: u32,
    patch: u32,
    /// Normal of its plane, of the sign that makes its largest component positive; for spheres an
    /// axis.
    normal: Vec3,
    /// Corners of a triangle; for a sphere its middle and the radius.
    points: [Vec3; 3],
    is_sphere: bool,
    /// Box in which another one has to begin or end to lie in it.
    bounds: Bounds,
    sizes: Sizes,
    /// Longest side of the box as a power of two.
    exponent: f64,
    /// Coordinate by which it is divided from others.
    key: f64,
}

/// What is below a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planes {
    bounds: Bounds,
    /// Direction along which all lies between `low` and `high`, metres; for spheres their radii do.
    axis: DVec3,
    low: f64,
    high: f64,
    /// Sine of the largest angle between a plane's normal and the axis.
    sine: f64,
    /// Largest coordinate or extent, metres.
    reach: f64,
    /// Mean size, and mean extent along the axis, of an item, metres.
    width: f64,
    thickness: f64,
    sizes: Sizes,
    /// The patch of all; `None` where there are several.
    pub patch: Option<u32>,
}

/// The tree. Spheres and triangles never lie in each other, and have trees of their own.
pub(super) type PlaneTree = CompleteTree<Planes>;

/// The tree over some primitives of a list, all of them triangles or all spheres, with the patch of
/// each.
pub(super) fn plane_tree(list: &[Primitive], some: &[(u32, u32)]) -> PlaneTree {
    let item = |&(index, patch): &(u32, u32)| Item::new(&list[index as usize], index, patch);
    CompleteTree::new(some.par_iter().filter_map(item).collect(), Planes::new, divide, |item| item.index)
}

impl Item {
    /// `None` for a triangle that has no plane.
    fn new(primitive: &Primitive, index: u32, patch: u32) -> Option<Self> {
        let [v0, e1, e2] = [Vec3::from(primitive.v0), Vec3::from(primitive.e1), Vec3::from(primitive.e2)];
        let is_sphere = primitive.material & SPHERE_BIT != 0;
        let points = if is_sphere { [v0, Vec3::splat(e1.x), Vec3::ZERO] } else { [v0, v0 + e1, v0 + e2] };
        let bounds = if is_sphere { Bounds { min: v0, max: v0 } } else { exact_bounds(primitive) };
        let size = f64::from((bounds.max - bounds.min).max_element());
        Some(Self {
            index,
            patch,
            normal: normal(primitive)?.as_vec3(),
            points,
            is_sphere,
            bounds,
            sizes: Sizes::of(primitive),
            exponent: size.max(f64::MIN_POSITIVE).log2(),
            key: 0.0,
        })
    }

    /// Where it begins and ends along an axis; the radius of a sphere.
    fn heights(&self, axis: DVec3) -> (f64, f64) {
        let [a, b, c] = self.points;
        if self.is_sphere {
            return (f64::from(b.x), f64::from(b.x));
        }
        let (a, b, c) = (a.as_dvec3().dot(axis), b.as_dvec3().dot(axis), c.as_dvec3().dot(axis));
        (a.min(b).min(c), a.max(b).max(c))
    }

    /// Distance below which it may be taken for another one, metres.
    fn tolerance(&self) -> f64 {
        let [a, b, c] = self.points;
        TOLERANCE * f64::from(a.abs().max(b.abs()).max(c.abs()).max_element())
    }

    fn size(&self) -> f64 {
        f64::from((self.bounds.max - self.bounds.min).max_element())
    }

    fn coordinates(&self, axes: [DVec3; 3]) -> [f64; COORDINATES] {
        let middle = (0.5 * (self.bounds.min + self.bounds.max)).as_dvec3();
        let (low, high) = self.heights(axes[2]);
        let normal = self.normal.as_dvec3();
        [middle.dot(axes[0]), middle.dot(axes[1]), 0.5 * (low + high), normal.x, normal.y, normal.z, self.exponent]
    }
}

impl Planes {
    fn new(items: &[Item]) -> Self {
        let first = items[0].normal;
        let aligned = |item: &Item| (if item.normal.dot(first) < 0.0 { -item.normal } else { item.normal }).as_dvec3();
        let axis = items.iter().map(aligned).sum::<DVec3>().normalize_or(first.as_dvec3());
        let mut all = Self {
            bounds: Bounds::EMPTY,
            axis,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            sine: 0.0,
            reach: 0.0,
            width: 0.0,
            thickness: 0.0,
            sizes: Sizes::NONE,
            patch: Some(items[0].patch),
        };
        for item in items {
            let (low, high) = item.heights(axis);
            let tolerance = item.tolerance();
            all.reach = all.reach.max(tolerance / TOLERANCE);
            all.bounds = all.bounds.union(item.bounds);
            all.sizes = all.sizes.union(item.sizes);
            (all.low, all.high) = (all.low.min(low), all.high.max(high));
            all.sine = all.sine.max(item.normal.as_dvec3().cross(axis).length());
            all.width += item.size() + tolerance;
            all.thickness += high - low + tolerance;
            all.patch = all.patch.filter(|own| item.patch == *own);
        }
        // Edges may be as long as a box around coordinates of both signs.
        let Bounds { min, max } = all.bounds;
        all.reach = all.reach.max(f64::from(min.abs().max(max.abs()).max(max - min).max_element()));
        all.width /= items.len() as f64;
        all.thickness /= items.len() as f64;
        all
    }

    /// Whether something below may lie in a primitive.
    pub fn may_touch(&self, asked: &Asked) -> bool {
        let slack = 2.0 * TOLERANCE * asked.reach.max(self.reach);
        if !asked.is_near(&self.bounds, self.sizes, slack) {
            return false;
        }
        // The sine of a sum of angles is at most the sum of their sines.
        if asked.normal.cross(self.axis).length_squared() > (self.sine + 2.0 * MAX_SINE).powi(2) {
            return false;
        }
        let (low, high) = asked.item.heights(self.axis);
        let is_level = low <= self.high + slack && high >= self.low - slack;
        let middle = 0.5 * (self.bounds.min.as_dvec3() + self.bounds.max.as_dvec3());
        let half = 0.5 * (self.bounds.max - self.bounds.min).as_dvec3().dot(asked.normal.abs());
        let above = middle.dot(asked.normal) - asked.height;
        is_level && (asked.item.is_sphere || above.abs() <= half + slack)
    }
}

/// A primitive in which others are looked for.
pub(super) struct Asked<'a> {
    pub primitive: &'a Primitive,
    pub shape: Shape,
    item: Item,
    bounds: [DVec3; 2],
    normal: DVec3,
    /// Directions in which another one may be apart from it: along the normal, for a sphere all.
    ways: DVec3,
    /// Of its plane, along the normal.
    height: f64,
    reach: f64,
}

impl<'a> Asked<'a> {
    /// `None` for a triangle that has no plane.
    pub fn new(primitive: &'a Primitive) -> Option<Self> {
        let (item, normal) = (Item::new(primitive, 0, 0)?, normal(primitive)?);
        let height = Vec3::from(primitive.v0).as_dvec3().dot(normal);
        let (bounds, shape) = ([item.bounds.min, item.bounds.max].map(Vec3::as_dvec3), Shape::new(primitive));
        let ways = if item.is_sphere { DVec3::ONE } else { normal.abs() + ROUNDING };
        Some(Self { primitive, shape, item, bounds, normal, ways, height, reach: reach(primitive) })
    }

    /// Whether a box may hold what lies in it, of these sizes: whether more than a line lies in the
    /// boxes of both.
    fn is_near(&self, other: &Bounds, sizes: Sizes, slack: f64) -> bool {
        let [min, max] = self.bounds;
        let grown = slack * self.ways;
        let common = max.min(other.max.as_dvec3() + grown) - min.max(other.min.as_dvec3() - grown);
        if common.min_element() < 0.0 {
            return false;
        }
        // No polygon in a box is larger than three of its sides.
        let most = common.x * common.y + common.y * common.z + common.z * common.x;
        self.item.is_sphere || self.shape.sizes.union(sizes).negligible().is_none_or(|least| most > least)
    }

    /// Whether the boxes of both meet in more than a line, up to the tolerance.
    pub fn meets(&self, other: &Primitive) -> bool {
        let slack = 2.0 * TOLERANCE * self.reach.max(reach(other));
        self.item.is_sphere || self.is_near(&exact_bounds(other), Sizes::of(other), slack)
    }

    /// Whether another primitive of its kind may lie in it.
    pub fn may_touch(&self, other: &Primitive) -> bool {
        if self.item.is_sphere {
            return true;
        }
        let slack = 2.0 * TOLERANCE * self.reach.max(reach(other));
        let [v0, e1, e2] = [Vec3::from(other.v0), Vec3::from(other.e1), Vec3::from(other.e2)];
        let above = v0.as_dvec3().dot(self.normal) - self.height;
        let (along_1, along_2) = (e1.as_dvec3().dot(self.normal), e2.as_dvec3().dot(self.normal));
        let (low, high) = (along_1.min(along_2).min(0.0), along_1.max(along_2).max(0.0));
        let is_level = above + low <= slack && above + high >= -slack;
        is_level && self.shape.is_parallel(other) && !self.shape.is_beside(other)
    }
}

/// Box around a triangle, rounded outwards.
fn exact_bounds(triangle: &Primitive) -> Bounds {
    let [a, b, c] = corners(triangle);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let below = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
    let above = |x: f64| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 };
    Bounds {
        min: Vec3::new(below(low.x), below(low.y), below(low.z)),
        max: Vec3::new(above(high.x), above(high.y), above(high.z)),
    }
}

/// Unit normal of a primitive's plane.
fn normal(primitive: &Primitive) -> Option<DVec3> {
    if primitive.material & SPHERE_BIT != 0 {
        return Some(DVec3::X);
    }
    let [a, b, c] = corners(primitive);
    let normal = (b - a).cross(c - a).try_normalize()?;
    Some(normal * normal[normal.abs().max_position()].signum())
}

/// Orders items by the coordinate that separates them best, so that the lower half of them come
/// first.
fn divide(items: &mut [Item], all: &Planes) {
    let (u, v) = all.axis.any_orthonormal_pair();
    let axes = [u, v, all.axis];
    let (mut low, mut high) = ([f64::INFINITY; COORDINATES], [f64::NEG_INFINITY; COORDINATES]);
    for item in items.iter() {
        for (k, x) in item.coordinates(axes).into_iter().enumerate() {
            (low[k], high[k]) = (low[k].min(x), high[k].max(x));
        }
    }
    // What two of them have to differ by to be apart.
    let [width, thickness] = [all.width.max(f64::MIN_POSITIVE), all.thickness.max(f64::MIN_POSITIVE)];
    let apart = [width, width, thickness, MAX_SINE, MAX_SINE, MAX_SINE, SIZE_STEP];
    let gain = |k: &usize| (high[*k] - low[*k]) / apart[*k];
    let best = (0..COORDINATES).max_by(|a, b| gain(a).total_cmp(&gain(b)).then(b.cmp(a))).unwrap_or(0);
    items.iter_mut().for_each(|item| item.key = item.coordinates(axes)[best]);
    items.select_nth_unstable_by(items.len() / 2, |a, b| a.key.total_cmp(&b.key).then(a.index.cmp(&b.index)));
}
