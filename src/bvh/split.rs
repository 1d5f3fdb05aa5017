//! Splitting of large primitives whose boxes overlap, before the tree is built: long thin triangles
//! that cross each other would let every ray visit most of them.
//!
//! The boxes, not the triangles, are split: a primitive is listed once for each of its boxes
//! (Ernst and Greiner 2007, "Early Split Clipping for Bounding Volume Hierarchies").

use std::collections::BinaryHeap;

use glam::Vec3;
use obvhs::splits::split_triangle;

use crate::{
    layout::{INSTANCE, Primitive, SPHERE_BIT},
    scene::Bounds,
};

/// Boxes of triangles that hold the middle of a triangle on average, at which splitting begins.
/// Meshes have a handful. Where these are all that a ray meets, however large the rest of the scene
/// is, a ray that leaves one of them visits as many.
const CROWDED: f32 = 200.0;
/// Triangles whose middles are looked at, and boxes that are, at most.
const MIDDLES: usize = 256;
const BOXES: usize = 1 << 14;
/// Largest number of boxes of a primitive on average, and of all that splitting adds.
const PIECES: usize = 32;
const MAX_ADDED: usize = 2_000_000;

/// A box of a primitive, ordered by area.
struct Piece {
    area: f32,
    bounds: Bounds,
    primitive: u32,
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Piece {}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.area.total_cmp(&other.area).then(other.primitive.cmp(&self.primitive))
    }
}

/// The boxes of all primitives, whose whole boxes are given, each with the index of its primitive.
pub(super) fn pieces(primitives: &[Primitive], whole: Vec<Bounds>) -> (Vec<Bounds>, Vec<u32>) {
    let mut indices: Vec<u32> = (0..primitives.len() as u32).collect();
    if crowd(primitives, &whole) < CROWDED {
        return (whole, indices);
    }
    let piece = |(bounds, primitive): (&Bounds, &u32)| Piece {
        area: bounds.half_area(),
        bounds: *bounds,
        primitive: *primitive,
    };
    let mut heap: BinaryHeap<Piece> = whole.iter().zip(&indices).map(piece).collect();
    let most = whole.len() + (whole.len() * (PIECES - 1)).min(MAX_ADDED);
    let mut done = Vec::new();
    while heap.len() + done.len() < most {
        let Some(largest) = heap.pop() else { break };
        match halves(&largest, &primitives[largest.primitive as usize]) {
            Some(halves) => heap.extend(halves),
            None => done.push(largest),
        }
    }
    done.extend(heap.into_vec());
    // In the order of the primitives, so that the tree does not depend on that of the heap.
    done.sort_by(|a, b| {
        let corner = |piece: &Piece| piece.bounds.min.to_array().map(f32::to_bits);
        a.primitive.cmp(&b.primitive).then_with(|| corner(a).cmp(&corner(b)))
    });
    indices.clear();
    indices.extend(done.iter().map(|piece| piece.primitive));
    (done.iter().map(|piece| piece.bounds).collect(), indices)
}

/// Mean number of boxes of triangles that hold the middle of the box of one, by a sample of both.
fn crowd(primitives: &[Primitive], whole: &[Bounds]) -> f32 {
    let all: Vec<&Bounds> = primitives.iter().zip(whole).filter(|(p, _)| is_triangle(p)).map(|(_, b)| b).collect();
    let spread = |most: usize| all.iter().step_by(all.len().div_ceil(most).max(1));
    let boxes: Vec<&Bounds> = spread(BOXES).copied().collect();
    let holding =
        |middle: Vec3| boxes.iter().filter(|b| b.min.cmple(middle).all() && b.max.cmpge(middle).all()).count();
    let found: usize = spread(MIDDLES).map(|b| holding(0.5 * (b.min + b.max))).sum();
    found as f32 / spread(MIDDLES).len().max(1) as f32 * (all.len() as f32 / boxes.len().max(1) as f32)
}

fn is_triangle(primitive: &Primitive) -> bool {
    primitive.material & SPHERE_BIT == 0 && primitive.emitter != INSTANCE
}

/// The boxes of the parts of a triangle on both sides of the middle of its box; `None` where that
/// gains nothing.
fn halves(piece: &Piece, primitive: &Primitive) -> Option<[Piece; 2]> {
    if !is_triangle(primitive) {
        return None;
    }
    let size = piece.bounds.max - piece.bounds.min;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let middle = 0.5 * (piece.bounds.min[axis] + piece.bounds.max[axis]);
    let [v0, e1, e2] = [primitive.v0, primitive.e1, primitive.e2].map(Vec3::from_array);
    let corners = [v0, v0 + e1, v0 + e2, v0].map(Into::into);
    let (low, high) = split_triangle(axis as u32, middle, corners);
    let mut sides = [low, high].map(|side| {
        let (min, max): (Vec3, Vec3) = (side.min.into(), side.max.into());
        // Covers the rounding of the cut.
        let slack = 4.0 * f32::EPSILON * min.abs().max(max.abs());
        Bounds { min: (min - slack).max(piece.bounds.min), max: (max + slack).min(piece.bounds.max) }
    });
    sides[0].max[axis] = sides[0].max[axis].min(middle);
    sides[1].min[axis] = sides[1].min[axis].max(middle);
    let areas = sides.map(|side| side.half_area());
    let valid = sides.iter().all(|side| side.min.cmple(side.max).all());
    let made = |i: usize| Piece { area: areas[i], bounds: sides[i], primitive: piece.primitive };
    (valid && areas[0] + areas[1] < 0.9 * piece.area).then(|| [made(0), made(1)])
}
