//! Covers: open sheets that stand for the surface of a liquid, and of other solids of which nothing
//! but the free face is modelled.

use glam::Vec3;

use super::shells::Shell;
use crate::scene::{Bounds, CompleteTree, Material, Surface, Triangle, Visit};

/// Largest gap between the rim of a sheet and what it ends at, over the size of the sheet; and
/// points of the rim that are looked at.
const RIM_GAP: f32 = 0.01;
const RIM_PROBES: usize = 64;
/// Least part of a sheet's area that is left of it in projection where it is flat, and least cosine
/// between a liquid's face and the vertical.
const FLAT: f32 = 0.9;
const LEVEL: f32 = 0.95;
/// Walks behind a sheet, surfaces that each meets, and the part of them that may get out, as by a
/// gap at the rim.
const WALKS: u32 = 64;
const STEPS: u32 = 6;
const MOST_OUT: u32 = WALKS / 8;
/// Points that are tried for the start of a walk where the sheet runs on in a wall or below a
/// shore.
const TRIES: u32 = 16;
/// Height off a surface at which walks go on, over the size of the sheet.
const LIFT: f32 = 1e-5;
/// Index from which on a level sheet is glass and no liquid if a camera looks at it from below.
const GLASS_INDEX: f32 = 1.4;
/// Points of a sheet that a camera is tried to see.
const VIEWS: usize = 32;

/// Triangles in a tree over their boxes.
pub(super) struct Surfaces {
    triangles: Vec<Triangle>,
    tree: CompleteTree<Bounds>,
}

/// What stands around sheets: opaque triangles, and the cameras of the file.
pub(super) struct Surroundings<'a> {
    pub opaque: Surfaces,
    pub eyes: &'a [Vec3],
}

impl Surfaces {
    pub fn new(triangles: Vec<Triangle>) -> Self {
        let tree = CompleteTree::of_boxes(&triangles.iter().map(Bounds::from).collect::<Vec<_>>());
        Self { triangles, tree }
    }

    /// The opaque triangles of a scene.
    pub fn opaque(triangles: &[Triangle], materials: &[Material]) -> Self {
        let is_opaque = |t: &&Triangle| !materials[t.material as usize].surface.transmits();
        Self::new(triangles.iter().filter(is_opaque).copied().collect())
    }

    /// Nearest hit of a ray up to a distance: that distance, and the geometric normal.
    fn hit(&self, from: Vec3, along: Vec3, most: f32) -> Option<(f32, Vec3)> {
        let (mut nearest, mut found) = (most, None);
        self.tree.visit(|visit| match visit {
            Visit::Node(_, bounds) => bounds.entry(from, along, nearest).is_some(),
            Visit::Leaf(items) => {
                for triangle in items.iter().map(|i| &self.triangles[*i as usize]) {
                    if let Some(t) = distance_along(triangle, from, along).filter(|t| *t < nearest) {
                        nearest = t;
                        found = Some((t, triangle.geometric_normal()));
                    }
                }
                true
            }
        });
        found
    }

    /// Whether a point lies below the ground or in a wall: the next surface above it faces up.
    fn is_below(&self, point: Vec3, lift: f32) -> bool {
        self.hit(point + lift * Vec3::Y, Vec3::Y, f32::INFINITY).is_some_and(|(_, normal)| normal.y > 0.0)
    }

    /// Whether a triangle comes as near to a point as that.
    fn is_near(&self, point: Vec3, reach: f32) -> bool {
        let mut found = false;
        self.tree.near(&Bounds { min: point - reach, max: point + reach }, |i| {
            found = distance(point, &self.triangles[i]) <= reach;
            !found
        });
        found
    }
}

/// Whether a sheet is a cover, and then whether its faces look the wrong way. It ends at or in
/// opaque surfaces all around, as the water of a pool does, and these part what lies behind it from
/// what lies before it. A flat one is level: a window is a pane.
pub(super) fn cover(
    shell: &Shell,
    triangles: &[Triangle],
    materials: &[Material],
    around: &Surroundings,
) -> Option<bool> {
    let size = shell.bounds.diagonal();
    let sheet: Vec<Triangle> = shell.triangles.iter().map(|i| triangles[*i as usize]).collect();
    let area: f32 = sheet.iter().map(|t| t.area() as f32).sum();
    let facing: Vec3 = sheet.iter().map(|t| t.area() as f32 * t.geometric_normal()).sum();
    let is_flat = facing.length() > FLAT * area;
    let is_turned = is_flat && facing.y < 0.0;
    if is_flat && facing.y.abs() < LEVEL * facing.length() {
        return None;
    }
    let ends_there = |point: &Vec3| {
        around.opaque.is_near(*point, RIM_GAP * size) || is_flat && around.opaque.is_below(*point, LIFT * size)
    };
    let step = (shell.rim.len() / RIM_PROBES).max(1);
    if shell.rim.is_empty() || !shell.rim.iter().step_by(step).all(ends_there) {
        return None;
    }
    let sheet = Surfaces::new(sheet);
    let behind = if is_turned { 1.0 } else { -1.0 };
    let out = (0..WALKS).filter(|walk| gets_out(&sheet, behind, &around.opaque, size, *walk)).count();
    let is_glass = |surface: &Surface| matches!(surface, Surface::Glass { ior, .. } if *ior >= GLASS_INDEX);
    let is_skylight = is_flat
        && is_glass(&materials[triangles[shell.triangles[0] as usize].material as usize].surface)
        && around.eyes.iter().any(|eye| sees_back(&sheet, behind, &around.opaque, *eye));
    (out as u32 <= MOST_OUT && !is_skylight).then_some(is_turned)
}

/// Whether a walk from behind a sheet, from one opaque surface to the next, comes to its front or
/// goes off into the distance. At each surface it looks for the front.
fn gets_out(sheet: &Surfaces, behind: f32, opaque: &Surfaces, size: f32, walk: u32) -> bool {
    let mut state = walk.wrapping_mul(0x9e37_79b9) ^ 0x5bd1_e995;
    let mut next = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        ((word >> 22) ^ word) as f32 / 4_294_967_296.0
    };
    let count = sheet.triangles.len();
    let mut number = walk as usize * count / WALKS as usize;
    let mut start = point_on(&sheet.triangles[number], next(), next());
    for _ in 0..TRIES {
        if !opaque.is_below(start, LIFT * size) {
            break;
        }
        number = ((next() * count as f32) as usize).min(count - 1);
        start = point_on(&sheet.triangles[number], next(), next());
    }
    let mut normal = behind * sheet.triangles[number].geometric_normal();
    let mut from = start + LIFT * size * normal;
    for step in 0..STEPS {
        if step > 0 {
            let goal = &sheet.triangles[((next() * count as f32) as usize).min(count - 1)];
            let to = point_on(goal, next(), next()) - from;
            let is_front = behind * to.dot(goal.geometric_normal()) > 0.0;
            let most = to.length() * (1.0 - 1e-4);
            let along = to.normalize_or_zero();
            if is_front && opaque.hit(from, along, most).is_none() && sheet.hit(from, along, most).is_none() {
                return true;
            }
        }
        let along = direction_about(normal, next(), next());
        let [surface, own] = [opaque, sheet].map(|all| all.hit(from, along, f32::INFINITY));
        let (t, its) = match (surface, own) {
            (Some(a), Some(b)) if b.0 < a.0 => b,
            (Some(a), _) => a,
            (None, Some(b)) => b,
            (None, None) => return true,
        };
        normal = if its.dot(along) > 0.0 { -its } else { its };
        from += t * along + LIFT * size * normal;
    }
    false
}

/// Whether a point sees a sheet from behind.
fn sees_back(sheet: &Surfaces, behind: f32, opaque: &Surfaces, eye: Vec3) -> bool {
    let step = (sheet.triangles.len() / VIEWS).max(1);
    sheet.triangles.iter().step_by(step).any(|triangle| {
        let to = point_on(triangle, 0.5, 0.5) - eye;
        let is_back = behind * to.dot(triangle.geometric_normal()) < 0.0;
        is_back && opaque.hit(eye, to.normalize_or_zero(), to.length() * (1.0 - 1e-4)).is_none()
    })
}

/// A point of a triangle by two numbers from 0 to 1, spread evenly.
fn point_on(triangle: &Triangle, u: f32, v: f32) -> Vec3 {
    let [a, b, c] = triangle.positions;
    let root = u.sqrt();
    a + root * (1.0 - v) * (b - a) + root * v * (c - a)
}

/// A direction about a normal, distributed as its cosine.
fn direction_about(normal: Vec3, u: f32, v: f32) -> Vec3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
    (u.sqrt() * (cos * tangent + sin * bitangent) + (1.0 - u).max(0.0).sqrt() * normal).normalize()
}

/// Distance along a ray at which it meets a triangle (Möller and Trumbore 1997).
fn distance_along(triangle: &Triangle, from: Vec3, along: Vec3) -> Option<f32> {
    let [a, b, c] = triangle.positions.map(Vec3::as_dvec3);
    let (e1, e2, s, along) = (b - a, c - a, from.as_dvec3() - a, along.as_dvec3());
    let p = along.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let (u, q) = (s.dot(p) * inverse, s.cross(e1));
    let (v, t) = (along.dot(q) * inverse, e2.dot(q) * inverse);
    (u >= -1e-6 && v >= -1e-6 && u + v <= 1.0 + 1e-6 && t > 0.0 && t.is_finite()).then_some(t as f32)
}

/// Distance of a point from a triangle (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
fn distance(point: Vec3, triangle: &Triangle) -> f32 {
    let [a, b, c] = triangle.positions;
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
