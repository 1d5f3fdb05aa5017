//! Meshes of glass built in code, and glTF files that hold them.

use std::f32::consts::{PI, TAU};

use caustica::scene::Scene;
use glam::{Vec3, vec3};
use serde_json::{Value, json};

use super::gltf::{add_accessor, floats, loaded, push};

/// Vertices and triangles; outwards the vertices run counterclockwise.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A surface of revolution about the vertical axis through `foot`. The profile lists (radius,
    /// height) from below outwards and up; radius 0 makes a point.
    pub fn lathe(foot: Vec3, profile: &[(f32, f32)], segments: u32) -> Self {
        let mut mesh = Self::default();
        let mut rings: Vec<Vec<u32>> = Vec::new();
        for &(radius, height) in profile {
            let count = if radius == 0.0 { 1 } else { segments };
            let first = mesh.positions.len() as u32;
            rings.push((first..first + count).collect());
            mesh.positions.extend((0..count).map(|i| {
                let angle = TAU * i as f32 / segments as f32;
                foot + vec3(radius * angle.cos(), height, -radius * angle.sin())
            }));
        }
        for pair in rings.windows(2) {
            let (low, high) = (&pair[0], &pair[1]);
            for i in 0..segments as usize {
                let j = (i + 1) % segments as usize;
                match (low.len(), high.len()) {
                    (1, 1) => {}
                    (1, _) => mesh.triangles.push([low[0], high[j], high[i]]),
                    (_, 1) => mesh.triangles.push([low[i], low[j], high[0]]),
                    _ => mesh.triangles.extend([[low[i], low[j], high[j]], [low[i], high[j], high[i]]]),
                }
            }
        }
        mesh
    }

    pub fn ball(center: Vec3, radius: f32, segments: u32) -> Self {
        let rings = segments / 2;
        let ring = |k: u32| {
            let angle = PI * k as f32 / rings as f32;
            (if k == 0 || k == rings { 0.0 } else { radius * angle.sin() }, -radius * angle.cos())
        };
        Self::lathe(center, &(0..=rings).map(ring).collect::<Vec<_>>(), segments)
    }

    /// An axis-aligned box.
    pub fn block(min: Vec3, max: Vec3) -> Self {
        let corner = |i: u32| {
            let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 1 { high } else { low };
            vec3(pick(2, min.x, max.x), pick(1, min.y, max.y), pick(0, min.z, max.z))
        };
        let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let halves = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
        Self { positions: (0..8).map(corner).collect(), triangles: halves.collect() }
    }

    /// All faces look the other way.
    #[must_use]
    pub fn turned(mut self) -> Self {
        self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        self
    }

    /// Both meshes as one.
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|i| i + first)));
        self
    }
}

/// Glass with a volume in glTF.
pub fn glass_of(ior: f32) -> Value {
    json!({
        "name": format!("glass {ior}"),
        "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": { "thicknessFactor": 1 },
            "KHR_materials_ior": { "ior": ior },
        },
    })
}

/// A file with a node for each mesh, whose materials are indices into `materials`.
pub fn file_of(meshes: &[(Mesh, usize)], materials: &[Value]) -> Value {
    let mut file = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": [
            "KHR_materials_transmission", "KHR_materials_volume", "KHR_materials_ior", "KHR_materials_specular",
        ],
        "scene": 0, "scenes": [{ "nodes": [] }], "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
        "buffers": [], "materials": materials,
    });
    for (mesh, material) in meshes {
        let numbers: Vec<f32> = mesh.positions.iter().flat_map(|p| p.to_array()).collect();
        let positions = add_accessor(&mut file, &floats(&numbers), 5126, mesh.positions.len(), "VEC3");
        let all = mesh.positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
        file["accessors"][positions]["min"] = json!(all.0.to_array());
        file["accessors"][positions]["max"] = json!(all.1.to_array());
        let bytes: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        let indices = add_accessor(&mut file, &bytes, 5125, 3 * mesh.triangles.len(), "SCALAR");
        let primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices, "material": material });
        let name = format!("part {}", file["meshes"].as_array().map_or(0, Vec::len));
        let mesh = push(&mut file, "meshes", json!({ "name": name, "primitives": [primitive] }));
        let node = push(&mut file, "nodes", json!({ "mesh": mesh }));
        file["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
    }
    file
}

/// The scene of [`file_of`], with flat faces.
pub fn scene_of(meshes: &[(Mesh, usize)], materials: &[Value]) -> Scene {
    loaded(&file_of(meshes, materials))
}
