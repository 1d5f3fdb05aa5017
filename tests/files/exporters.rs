//! One scene as two exporters write it: a textured quad of rough plastic with a normal map, beside
//! a lamp and a camera. Their files differ in all that glTF leaves open.

use std::path::Path;

use caustica::scene::{Alpha, LoadOptions, Scene, Wrap};
use serde_json::{Value, json};
use support::gltf::{data_uri, floats};

use super::pictures::{four, png, uniform};

const POSITIONS: [f32; 12] = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, -1.0, 1.0, 0.0, 1.0, 1.0, 0.0];
const NORMALS: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
const UVS: [f32; 8] = [0.0, 2.0, 2.0, 2.0, 0.0, 0.0, 2.0, 0.0];
const INDICES: [u16; 6] = [0, 1, 3, 0, 3, 2];

fn map() -> Vec<u8> {
    png(uniform(1, 1, [140, 120, 250, 255]))
}

/// A GLB as Blender's exporter writes it: one buffer with a view for each attribute and image,
/// named everything, defaults left out, coordinates scaled by KHR_texture_transform, light and
/// camera turned by their nodes.
fn blender() -> Vec<u8> {
    let mut bin = Vec::new();
    let mut views = Vec::new();
    let halved = UVS.map(|x| x / 2.0);
    let indices = INDICES.iter().flat_map(|i| i.to_le_bytes()).collect();
    for bytes in [floats(&POSITIONS), floats(&NORMALS), floats(&halved), indices, png(four()), map()] {
        views.push(json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len() }));
        bin.extend(bytes);
        bin.resize(bin.len().next_multiple_of(4), 0);
    }
    let accessor = |view: usize, component: u32, count: usize, kind: &str| json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
    let scaled = json!({ "KHR_texture_transform": { "offset": [0, 0], "scale": [2, 2] } });
    let mut gltf = json!({
        "asset": { "generator": "Khronos glTF Blender I/O v4.3.47", "version": "2.0" },
        "extensionsUsed": ["KHR_materials_specular", "KHR_materials_ior", "KHR_lights_punctual", "KHR_texture_transform"],
        "extensionsRequired": ["KHR_texture_transform"],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "color": [1, 1, 1], "intensity": 5, "type": "point", "name": "lamp" }] } },
        "scene": 0,
        "scenes": [{ "name": "Scene", "nodes": [0, 1, 2] }],
        "nodes": [
            { "mesh": 0, "name": "Plane" },
            { "extensions": { "KHR_lights_punctual": { "light": 0 } }, "name": "lamp",
                "rotation": [-0.5, 0.5, 0.5, 0.5], "translation": [0, 0, 2] },
            { "camera": 0, "name": "view", "translation": [0, 0, 3] },
        ],
        "cameras": [{ "name": "view", "type": "perspective",
            "perspective": { "aspectRatio": 1.5, "yfov": 0.5, "zfar": 100, "znear": 0.1 } }],
        "materials": [{
            "doubleSided": true,
            "name": "Plastic",
            "alphaMode": "MASK",
            "normalTexture": { "index": 1, "scale": 0.5, "extensions": scaled },
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": scaled }, "metallicFactor": 0,
                "roughnessFactor": 0.5 },
            "extensions": { "KHR_materials_ior": { "ior": 1.45 }, "KHR_materials_specular": { "specularColorFactor": [1, 0.5, 0.5] } },
        }],
        "meshes": [{ "name": "Plane", "primitives": [
            { "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0 }] }],
        "textures": [{ "sampler": 0, "source": 0 }, { "sampler": 0, "source": 1 }],
        "images": [
            { "bufferView": 4, "mimeType": "image/png", "name": "paint" },
            { "bufferView": 5, "mimeType": "image/png", "name": "bumps" },
        ],
        "samplers": [{ "magFilter": 9729, "minFilter": 9987 }],
        "accessors": [accessor(0, 5126, 4, "VEC3"), accessor(1, 5126, 4, "VEC3"), accessor(2, 5126, 4, "VEC2"), accessor(3, 5123, 6, "SCALAR")],
        "bufferViews": views,
        "buffers": [{ "byteLength": bin.len() }],
    });
    gltf["accessors"][0]["min"] = json!([-1, -1, 0]);
    gltf["accessors"][0]["max"] = json!([1, 1, 0]);
    glb(&gltf, bin)
}

fn glb(gltf: &Value, bin: Vec<u8>) -> Vec<u8> {
    let word = |n: usize| (n as u32).to_le_bytes();
    let mut text = gltf.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + text.len() + 8 + bin.len();
    [b"glTF", &word(2)[..], &word(length), &word(text.len()), b"JSON", &text, &word(bin.len()), b"BIN\0", &bin].concat()
}

/// A glTF as three.js' exporter writes it: data URIs, attributes interleaved in one view, indices
/// of 32 bits, matrices, all members of samplers and materials, and more objects in another order.
fn three(change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let vertex = |v: usize| [&POSITIONS[3 * v..][..3], &NORMALS[3 * v..][..3], &UVS[2 * v..][..2]].concat();
    let vertices: Vec<u8> = (0..4).flat_map(|v| floats(&vertex(v))).collect();
    let indices: Vec<u8> = INDICES.iter().flat_map(|i| u32::from(*i).to_le_bytes()).collect();
    let image = |bytes: &[u8]| data_uri(bytes).replace("application/octet-stream", "image/png");
    let accessor = |offset: usize, kind: &str| json!({ "bufferView": 0, "byteOffset": offset, "componentType": 5126, "count": 4, "type": kind });
    let mut gltf = json!({
        "asset": { "version": "2.0", "generator": "THREE.GLTFExporter r170" },
        "scenes": [{ "name": "", "nodes": [0] }],
        "scene": 0,
        "nodes": [
            { "name": "all", "children": [1, 3, 2] },
            { "name": "Plane", "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] },
            { "name": "view", "camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3, 1] },
            { "name": "lamp", "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 2, 1],
                "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        ],
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_ior", "KHR_materials_specular"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "name": "lamp", "color": [1, 1, 1], "intensity": 5, "type": "point" }] } },
        "cameras": [{ "type": "perspective", "perspective": { "aspectRatio": 1.5, "yfov": 0.5, "zfar": 100, "znear": 0.1 } }],
        "buffers": [{ "uri": data_uri(&vertices), "byteLength": vertices.len() }, { "uri": data_uri(&indices), "byteLength": 24 }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": vertices.len(), "byteStride": 32, "target": 34962 },
            { "buffer": 1, "byteOffset": 0, "byteLength": 24, "target": 34963 },
        ],
        "accessors": [accessor(0, "VEC3"), accessor(12, "VEC3"), accessor(24, "VEC2"),
            { "bufferView": 1, "componentType": 5125, "count": 6, "type": "SCALAR" }],
        "materials": [{
            "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "roughnessFactor": 0.5,
                "baseColorTexture": { "index": 0, "texCoord": 0 } },
            "normalTexture": { "index": 1, "texCoord": 0, "scale": 0.5 },
            "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": true, "name": "Plastic",
            "extensions": {
                "KHR_materials_ior": { "ior": 1.45 },
                "KHR_materials_specular": { "specularFactor": 1, "specularColorFactor": [1, 0.5, 0.5] },
            },
        }],
        "samplers": [{ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 }],
        "textures": [{ "sampler": 0, "source": 1, "name": "paint" }, { "sampler": 0, "source": 0, "name": "bumps" }],
        "images": [{ "mimeType": "image/png", "uri": image(&map()) }, { "mimeType": "image/png", "uri": image(&png(four())) }],
        "meshes": [{ "primitives": [
            { "mode": 4, "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0 }] }],
    });
    change(&mut gltf);
    gltf.to_string().into_bytes()
}

fn read(bytes: &[u8]) -> Scene {
    let path = Path::new("not/there/test.gltf");
    Scene::read(bytes, path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// All that a picture depends on. Texture coordinates are those where the images are sampled;
/// images count by what they show, whatever their names.
fn shown(scene: &Scene) -> impl PartialEq + std::fmt::Debug + use<> {
    let mut material = scene.materials[0].clone();
    let [color, normal] = [&mut material.textures.base_color, &mut material.textures.normal].map(|texture| {
        let texture = texture.as_mut().expect("a texture");
        let [u, v] = std::mem::replace(&mut texture.transform, caustica::scene::Texture::IDENTITY);
        let image = &scene.images[texture.image as usize];
        ([u, v], (image.width, image.height, image.texels.clone()))
    });
    let sampled = |[u, v]: [[f32; 3]; 2]| {
        let at = move |uv: glam::Vec2| [u, v].map(|row| row[0] * uv.x + row[1] * uv.y + row[2]);
        scene.attributes.iter().map(|attributes| attributes.uvs[0].map(at)).collect::<Vec<_>>()
    };
    let tangents: Vec<_> = scene.attributes.iter().map(|attributes| attributes.tangents).collect();
    let samples = [sampled(color.0), sampled(normal.0)];
    let lights = (scene.lights.clone(), scene.cameras.clone(), scene.center);
    ((scene.triangles.clone(), tangents, samples), (material, color.1, normal.1), lights)
}

#[test]
fn exports_of_one_scene_are_one_scene() {
    let (first, second) = (read(&blender()), read(&three(|_| {})));
    assert_eq!((&first.warnings, &second.warnings), (&vec![], &vec![]));
    assert_eq!(shown(&first), shown(&second));
    let material = &first.materials[0];
    assert_eq!((material.alpha, material.double_sided), (Alpha::Mask { cutoff: 0.5 }, true));
    assert_eq!(material.textures.normal.map(|texture| texture.wrap), Some([Wrap::Repeat; 2]));
}

#[test]
fn other_exports_are_other_scenes() {
    let expected = shown(&read(&blender()));
    let changes: [fn(&mut Value); 6] = [
        |g| g["materials"][0]["normalTexture"]["scale"] = 1.into(),
        |g| g["textures"][0]["source"] = 0.into(),
        |g| g["samplers"][0]["wrapS"] = 33071.into(),
        |g| g["accessors"][2]["byteOffset"] = 20.into(),
        |g| g["materials"][0]["extensions"]["KHR_materials_ior"]["ior"] = 1.5.into(),
        |g| g["nodes"][1]["matrix"][0] = json!(-1),
    ];
    for (i, change) in changes.into_iter().enumerate() {
        assert!(shown(&read(&three(change))) != expected, "change {i}");
    }
}
