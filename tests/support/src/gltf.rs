//! Small glTF files built in code.

use std::path::Path;

use base64::Engine as _;
use caustica::scene::{LoadOptions, Scene};
use serde_json::{Value, json};

/// Numbers as a data URI.
pub fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

pub fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A triangle in the plane z = 0 that faces +Z, seen by a camera and lit by a point light of 1
/// W/sr.
pub fn triangle() -> Value {
    let positions = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let indices: Vec<u8> = [0_u16, 1, 2, 0].iter().flat_map(|i| i.to_le_bytes()).collect();
    let bytes = [positions, indices].concat();
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_specular"],
        "scene": 0,
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [
            { "mesh": 0 },
            { "name": "lamp", "translation": [0, 0, 2], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "name": "view", "translation": [0, 0, 3], "camera": 0 },
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.6, "znear": 0.1 } }],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point" }] } },
        "materials": [lambert([0.5, 0.25, 0.125])],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 8 },
        ],
        "buffers": [{ "byteLength": bytes.len(), "uri": data_uri(&bytes) }],
    })
}

/// A purely diffuse material.
pub fn lambert([r, g, b]: [f32; 3]) -> Value {
    json!({
        "name": "paint",
        "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1], "metallicFactor": 0, "roughnessFactor": 1 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 } },
    })
}

/// Appends an accessor over new bytes in a buffer of their own; returns its index.
pub fn add_accessor(gltf: &mut Value, bytes: &[u8], component: u32, count: usize, kind: &str) -> usize {
    let buffer = push(gltf, "buffers", json!({ "byteLength": bytes.len(), "uri": data_uri(bytes) }));
    let view = push(gltf, "bufferViews", json!({ "buffer": buffer, "byteLength": bytes.len() }));
    push(gltf, "accessors", json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }))
}

pub fn push(gltf: &mut Value, list: &str, item: Value) -> usize {
    let list = gltf[list].as_array_mut().expect("a list");
    list.push(item);
    list.len() - 1
}

/// Appends an accessor without bytes of its own, all zeros.
pub fn add_zeros(gltf: &mut Value, component: u32, count: u64, kind: &str) -> usize {
    push(gltf, "accessors", json!({ "componentType": component, "count": count, "type": kind }))
}

/// Reads bytes as those of `test.gltf` in a folder that is not there.
pub fn load_bytes(bytes: &[u8]) -> caustica::Result<Scene> {
    Scene::read(bytes, Path::new("not/there/test.gltf"), &LoadOptions::default())
}

/// Reads a file from memory, as `test.gltf` in a folder that is not there.
pub fn read_with(gltf: &Value, options: &LoadOptions) -> caustica::Result<Scene> {
    Scene::read(gltf.to_string().as_bytes(), Path::new("not/there/test.gltf"), options)
}

pub fn load(gltf: &Value) -> caustica::Result<Scene> {
    load_bytes(gltf.to_string().as_bytes())
}

/// A scene that must load.
pub fn loaded(gltf: &Value) -> Scene {
    load(gltf).unwrap_or_else(|error| panic!("{error}"))
}

/// The message of a file that must be refused, from the file's name on.
pub fn message(result: caustica::Result<Scene>) -> String {
    let text = result.map(|scene| scene.describe()).expect_err("the file must be refused").to_string();
    assert!(!text.contains('\n'), "one line: {text}");
    text.split_once("test.gltf: ").map_or(text.clone(), |(_, rest)| rest.to_owned())
}
