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

/// Triangles that are split for a trial, at most, and by how much that has to thin them out.
const TRIED: usize = 2048;
const GAIN: f32 = 4.0;

/// A box of a primitive, ordered by area.
#[derive(Clone, Copy)]
struct Piece {
    area: f32,
    bounds: Bounds,
    primitive: u32,
}

impl Piece {
    fn new(bounds: Bounds, primitive: u32) -> Self {
        Self { area: bounds.half_area(), bounds, primitive }
    }
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
    let all: Vec<Piece> = whole.iter().zip(0..).map(|(bounds, i)| Piece::new(*bounds, i)).collect();
    let is_triangle = |piece: &&Piece| is_triangle(&primitives[piece.primitive as usize]);
    let triangles: Vec<Piece> = all.iter().filter(is_triangle).copied().collect();
    if crowd(&triangles) < CROWDED || !gains(primitives, &triangles) {
        return (whole, (0..primitives.len() as u32).collect());
    }
    let most = whole.len() + (whole.len() * (PIECES - 1)).min(MAX_ADDED);
    let mut done = split(primitives, all, most);
    // In the order of the primitives, so that the tree does not depend on that of the heap.
    done.sort_by(|a, b| {
        let corner = |piece: &Piece| piece.bounds.min.to_array().map(f32::to_bits);
        a.primitive.cmp(&b.primitive).then_with(|| corner(a).cmp(&corner(b)))
    });
    (done.iter().map(|piece| piece.bounds).collect(), done.iter().map(|piece| piece.primitive).collect())
}

/// Mean number of boxes that hold the middle of one of them, by a sample of both.
fn crowd(all: &[Piece]) -> f32 {
    let spread = |most: usize| all.iter().step_by(all.len().div_ceil(most).max(1)).map(|piece| piece.bounds);
    let boxes: Vec<Bounds> = spread(BOXES).collect();
    let holds = |b: &Bounds, middle: Vec3| b.min.cmple(middle).all() && b.max.cmpge(middle).all();
    let holding = |middle: Vec3| boxes.iter().filter(|b| holds(b, middle)).count();
    let found: usize = spread(MIDDLES).map(|b| holding(0.5 * (b.min + b.max))).sum();
    found as f32 / spread(MIDDLES).len().max(1) as f32 * (all.len() as f32 / boxes.len().max(1) as f32)
}

/// Whether splitting thins out the crowd of triangles, by a sample of these: it does not where they
/// lie in each other.
fn gains(primitives: &[Primitive], triangles: &[Piece]) -> bool {
    let sample: Vec<Piece> = triangles.iter().step_by(triangles.len().div_ceil(TRIED)).copied().collect();
    let before = crowd(&sample);
    let most = PIECES * sample.len();
    crowd(&split(primitives, sample, most)) < before / GAIN
}

/// Halves the largest boxes until there are `most`.
fn split(primitives: &[Primitive], boxes: Vec<Piece>, most: usize) -> Vec<Piece> {
    let mut heap = BinaryHeap::from(boxes);
    let mut done = Vec::new();
    while heap.len() + done.len() < most {
        let Some(largest) = heap.pop() else { break };
        match halves(&largest, &primitives[largest.primitive as usize]) {
            Some(halves) => heap.extend(halves),
            None => done.push(largest),
        }
    }
    done.extend(heap.into_vec());
    done
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
    let valid = sides.iter().all(|side| side.min.cmple(side.max).all());
    let made = sides.map(|side| Piece::new(side, piece.primitive));
    (valid && made[0].area + made[1].area < 0.9 * piece.area).then_some(made)
}
