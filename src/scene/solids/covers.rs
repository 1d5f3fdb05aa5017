//! Covers: open sheets that stand for the surface of a liquid, and of other solids of which nothing
//! but the free face is modelled.

use glam::Vec3;

use super::{
    shells::Shell,
    surfaces::{Opaque, Surfaces},
};
use crate::scene::{Material, Surface, Triangle};

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

/// Whether a sheet is a cover, and then whether its faces look the wrong way. It ends at or in
/// opaque surfaces all around, as the water of a pool does, and these part what lies behind it from
/// what lies before it. A flat one is level: a window is a pane.
pub(super) fn cover(
    shell: &Shell,
    triangles: &[Triangle],
    materials: &[Material],
    opaque: &Opaque,
    eyes: &[Vec3],
) -> Option<bool> {
    let size = shell.bounds.diagonal();
    let mut sheet: Vec<Triangle> = shell.triangles.iter().map(|i| triangles[*i as usize]).collect();
    let area: f32 = sheet.iter().map(|t| t.area() as f32).sum();
    let facing: Vec3 = sheet.iter().map(|t| t.area() as f32 * t.geometric_normal()).sum();
    let is_flat = facing.length() > FLAT * area;
    let is_turned = is_flat && facing.y < 0.0;
    if is_flat && facing.y.abs() < LEVEL * facing.length() {
        return None;
    }
    let ends_there =
        |point: &Vec3| opaque.is_near(*point, RIM_GAP * size) || is_flat && opaque.is_below(*point, LIFT * size);
    let step = (shell.rim.len() / RIM_PROBES).max(1);
    if shell.rim.is_empty() || !shell.rim.iter().step_by(step).all(ends_there) {
        return None;
    }
    if is_turned {
        sheet.iter_mut().for_each(|triangle| triangle.positions.swap(1, 2));
    }
    let sheet = Surfaces::new(sheet);
    let out = (0..WALKS).filter(|walk| gets_out(&sheet, opaque, size, *walk)).count();
    let is_glass = |surface: &Surface| matches!(surface, Surface::Glass { ior, .. } if *ior >= GLASS_INDEX);
    let is_skylight = is_flat
        && is_glass(&materials[triangles[shell.triangles[0] as usize].material as usize].surface)
        && eyes.iter().any(|eye| sheet.side(*eye, |along, most| opaque.is_free(*eye, along, most)) > 0);
    (out as u32 <= MOST_OUT && !is_skylight).then_some(is_turned)
}

/// Whether a walk from behind a sheet, from one opaque surface to the next, comes to its front or
/// goes off into the distance. At each surface it looks for the front.
fn gets_out(sheet: &Surfaces, opaque: &Opaque, size: f32, walk: u32) -> bool {
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
    let mut normal = -sheet.triangles[number].geometric_normal();
    let mut from = start + LIFT * size * normal;
    for step in 0..STEPS {
        if step > 0 {
            let goal = &sheet.triangles[((next() * count as f32) as usize).min(count - 1)];
            let to = point_on(goal, next(), next()) - from;
            let is_front = to.dot(goal.geometric_normal()) < 0.0;
            let most = to.length() * (1.0 - 1e-4);
            let along = to.normalize_or_zero();
            if is_front && opaque.is_free(from, along, most) && sheet.hit(from, along, most).is_none() {
                return true;
            }
        }
        let along = direction_about(normal, next(), next());
        let (surface, own) = (opaque.hit(from, along, f32::INFINITY), sheet.hit(from, along, f32::INFINITY));
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
