//! A closed slab of water with a wavy top, hung above the floor of a room.
//!
//! The slab is one half (x in 0..1) shown twice, the second time rotated by 180° about the
//! vertical: its waves are even functions of the position, so the halves meet exactly. Coordinates
//! are 16-bit, to keep the file small.

use glam::{DVec3, Vec3};
use serde_json::json;

use super::builder::{Builder, Data};
use super::room::{add_walls, indices_u16};

/// Cells of the top along x (half of the slab) and z.
const CELLS: (usize, usize) = (80, 160);

/// Middle of the slab above the floor, and half its thickness, metres.
const HEIGHT: f64 = 0.85;
const HALF_THICKNESS: f64 = 0.12;

/// Waves of the top: amplitude in metres, and wave vector along x and z in radians per metre.
const WAVES: [(f64, f64, f64); 5] =
    [(0.016, 7.1, 2.3), (0.010, -4.6, 9.2), (0.006, 12.8, 5.9), (0.004, 3.7, -17.0), (0.003, 16.4, -11.1)];

/// Height of the top above the middle of the slab and its slope along x and z.
fn wave(x: f64, z: f64) -> (f64, f64, f64) {
    WAVES.iter().fold((HALF_THICKNESS, 0.0, 0.0), |(h, dx, dz), (a, kx, kz)| {
        let (sin, cos) = (kx * x + kz * z).sin_cos();
        (h + a * cos, dx - a * kx * sin, dz - a * kz * sin)
    })
}

/// Vertices and triangles of the half slab.
#[derive(Default)]
struct Half {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    indices: Vec<u16>,
}

impl Half {
    fn vertex(&mut self, position: DVec3, normal: DVec3) -> u16 {
        self.positions.push(position);
        self.normals.push(normal);
        (self.positions.len() - 1) as u16
    }

    /// A wall from the wavy edge along `edge` down to the bottom. The outside is to the right of
    /// the direction of the edge.
    fn wall(&mut self, edge: impl Iterator<Item = (f64, f64)>, normal: DVec3) {
        let mut last = None;
        for (x, z) in edge {
            let top = self.vertex(DVec3::new(x, wave(x, z).0, z), normal);
            let bottom = self.vertex(DVec3::new(x, -HALF_THICKNESS, z), normal);
            if let Some((t, b)) = last.replace((top, bottom)) {
                self.indices.extend([t, b, top, top, b, bottom]);
            }
        }
    }

    fn new() -> Self {
        let mut half = Self::default();
        let x = |i: usize| i as f64 / CELLS.0 as f64;
        // From the middle outwards, so that the coordinates on both sides are exact opposites.
        let z = |j: usize| (2.0 * j as f64 - CELLS.1 as f64) / CELLS.1 as f64;
        for j in 0..=CELLS.1 {
            for i in 0..=CELLS.0 {
                let (h, dx, dz) = wave(x(i), z(j));
                half.vertex(DVec3::new(x(i), h, z(j)), DVec3::new(-dx, 1.0, -dz).normalize());
            }
        }
        let row = CELLS.0 + 1;
        for (j, i) in (0..CELLS.1).flat_map(|j| (0..CELLS.0).map(move |i| (j, i))) {
            let [a, b, c, d] = [j * row + i, (j + 1) * row + i, (j + 1) * row + i + 1, j * row + i + 1];
            half.indices.extend([a, b, c, a, c, d].map(|vertex| vertex as u16));
        }
        half.wall((0..=CELLS.0).map(|i| (x(i), 1.0)), DVec3::Z);
        half.wall((0..=CELLS.1).rev().map(|j| (1.0, z(j))), DVec3::X);
        half.wall((0..=CELLS.0).rev().map(|i| (x(i), -1.0)), -DVec3::Z);
        half.bottom(x, z);
        half
    }

    /// A fan over all vertices of the walls' lower edges and of the seam.
    fn bottom(&mut self, x: impl Fn(usize) -> f64, z: impl Fn(usize) -> f64) {
        let mut border: Vec<(f64, f64)> = (0..CELLS.0).map(|i| (x(i), 1.0)).collect();
        border.extend((1..=CELLS.1).rev().map(|j| (1.0, z(j))));
        border.extend((1..=CELLS.0).rev().map(|i| (x(i), -1.0)));
        border.extend((0..CELLS.1).map(|j| (0.0, z(j))));
        let middle = self.vertex(DVec3::new(0.5, -HALF_THICKNESS, 0.0), -DVec3::Y);
        let first = middle + 1;
        for (x, z) in &border {
            self.vertex(DVec3::new(*x, -HALF_THICKNESS, *z), -DVec3::Y);
        }
        let count = border.len() as u16;
        for i in 0..count {
            self.indices.extend([middle, first + (i + 1) % count, first + i]);
        }
    }
}

/// Vectors within -1..1 as signed normalised 16-bit numbers, padded to 8 bytes.
fn quantized(vectors: &[DVec3], with_range: bool) -> Data {
    let words: Vec<[i16; 3]> = vectors.iter().map(|v| v.to_array().map(|x| (x * 32767.0).round() as i16)).collect();
    let bound = |pick: fn(i16, i16) -> i16| {
        (0..3).map(|axis| words.iter().map(|v| v[axis]).reduce(pick).map_or(0.0, f64::from)).collect::<Vec<f64>>()
    };
    let range = with_range.then(|| [bound(i16::min), bound(i16::max)]);
    let bytes = words.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0]).flat_map(i16::to_le_bytes).collect();
    Data { bytes, count: vectors.len(), component: 5122, kind: "VEC3", normalized: true, stride: Some(8), range }
}

/// The room with the slab and a light above it.
pub fn scene() -> Builder {
    let mut b = Builder::new("water");
    b.uses("KHR_mesh_quantization");
    let sand = b.diffuse("sand", [0.76, 0.7, 0.58]);
    let wall = b.diffuse("wall", [0.55, 0.6, 0.65]);
    add_walls(&mut b, 1.2, 2.4, [sand, wall, wall, wall, wall]);
    let water = b.glass("water", 1.33);
    let half = Half::new();
    let (positions, normals) = (quantized(&half.positions, true), quantized(&half.normals, false));
    let mesh = b.mesh("half of the water", positions, normals, indices_u16(&half.indices), water);
    b.node(json!({ "name": "water, right", "mesh": mesh, "translation": [0.0, HEIGHT, 0.0] }));
    b.node(json!({
        "name": "water, left", "mesh": mesh, "translation": [0.0, HEIGHT, 0.0], "rotation": [0.0, 1.0, 0.0, 0.0],
    }));
    b.light("light", Vec3::new(0.25, 2.2, -0.2), 2.0);
    b.camera(Vec3::new(0.0, 1.15, 4.8), -2.0, 33.0, 1.0);
    b
}
