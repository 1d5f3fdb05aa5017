//! A Cornell-like room: x and z in -1..1 and y in 0..2, open to the camera at z = 1.

use glam::{Quat, Vec3};
use serde_json::json;

use super::builder::{Builder, Data};

/// A flat rectangle: a corner and two edges; its normal is their cross product.
pub struct Quad(pub Vec3, pub Vec3, pub Vec3);

/// White floor, ceiling and back, red left and green right wall. Returns the white material.
pub fn add_room(b: &mut Builder) -> usize {
    let white = b.diffuse("white", [0.725, 0.71, 0.68]);
    let (red, green) = (b.diffuse("red", [0.63, 0.065, 0.05]), b.diffuse("green", [0.14, 0.45, 0.091]));
    add_walls(b, 1.0, 2.0, [white, white, white, red, green]);
    white
}

/// Walls of a room of half width `w` and height `h`: floor, ceiling, back, left, right.
pub fn add_walls(b: &mut Builder, w: f32, h: f32, [floor, ceiling, back, left, right]: [usize; 5]) {
    let (x, y, z) = (Vec3::X * 2.0 * w, Vec3::Y * h, Vec3::Z * 2.0 * w);
    let corner = Vec3::new(-w, 0.0, -w);
    add_quads(b, "floor", &[Quad(corner, z, x)], floor);
    add_quads(b, "ceiling", &[Quad(corner + y, x, z)], ceiling);
    add_quads(b, "back", &[Quad(corner, x, y)], back);
    add_quads(b, "left", &[Quad(corner, y, z)], left);
    add_quads(b, "right", &[Quad(corner + x, z, y)], right);
}

/// The tall block of the Cornell box: 0.6 x 1.2 x 0.6 m, rotated by 18 degrees.
pub fn add_block(b: &mut Builder, material: usize) {
    let turn = Quat::from_rotation_y(18_f32.to_radians());
    let (x, y, z) = (turn * Vec3::X * 0.6, Vec3::Y * 1.2, turn * Vec3::Z * 0.6);
    let corner = Vec3::new(-0.38, 0.0, -0.35) - 0.5 * (x + z);
    let sides = [
        Quad(corner, x, z),
        Quad(corner + y, z, x),
        Quad(corner, y, x),
        Quad(corner + z, x, y),
        Quad(corner, z, y),
        Quad(corner + x, y, z),
    ];
    add_quads(b, "block", &sides, material);
}

/// A node with a mesh of flat rectangles.
pub fn add_quads(b: &mut Builder, name: &str, quads: &[Quad], material: usize) {
    let corners = |Quad(at, e, f): &Quad| [*at, *at + *e, *at + *e + *f, *at + *f];
    let positions: Vec<Vec3> = quads.iter().flat_map(corners).collect();
    let normals: Vec<Vec3> = quads.iter().flat_map(|Quad(_, e, f)| [e.cross(*f).normalize(); 4]).collect();
    let indices: Vec<u16> =
        (0..quads.len() as u16).flat_map(|i| [0, 1, 2, 0, 2, 3].map(|corner| 4 * i + corner)).collect();
    let range = [
        positions.iter().copied().reduce(Vec3::min).unwrap_or_default(),
        positions.iter().copied().reduce(Vec3::max).unwrap_or_default(),
    ];
    let mesh = b.mesh(name, floats(&positions, Some(range)), floats(&normals, None), indices_u16(&indices), material);
    b.node(json!({ "name": name, "mesh": mesh }));
}

fn floats(vectors: &[Vec3], range: Option<[Vec3; 2]>) -> Data {
    Data {
        bytes: vectors.iter().flat_map(|v| v.to_array()).flat_map(f32::to_le_bytes).collect(),
        count: vectors.len(),
        component: 5126,
        kind: "VEC3",
        normalized: false,
        stride: None,
        range: range.map(|range| range.map(|v| v.to_array().map(f64::from).to_vec())),
    }
}

/// 16-bit indices.
pub fn indices_u16(indices: &[u16]) -> Data {
    Data {
        bytes: indices.iter().copied().flat_map(u16::to_le_bytes).collect(),
        count: indices.len(),
        component: 5123,
        kind: "SCALAR",
        normalized: false,
        stride: None,
        range: None,
    }
}
