//! Decoding of compressed files.

use super::loading_geometry::{inward, surface};
use serde_json::{Value, json};
use support::gltf::{data_uri, load, loaded, message, push, triangle};

/// Bytes in hexadecimal.
fn hex(text: &str) -> Vec<u8> {
    (0..text.len() / 2).map(|i| u8::from_str_radix(&text[2 * i..2 * i + 2], 16).expect("hexadecimal")).collect()
}

/// Streams of meshoptimizer 1.0: the corners of an octahedron of radius 1000 as 16-bit integers,
/// the same of radius 0.75 by the exponential filter and its normals by the octahedral one; its
/// triangles, as a triangle stream and as an index sequence.
const POSITIONS: &str = "a0013c000000602f013c0000000d08010fc000002f602f010fc00000060d080100f000002f600100f00000060d\
                         0000000000000000000000000000000000000000000000000000e803000000000000";
const EXPONENTIAL: &str = "a000013c000000bf6001180000000000010fc0000060bf60010180000000000100f0000060bf010010000000\
                           0000000000000000000000000000000000000000003000f2000000f2000000f2";
const NORMALS: &str =
    "a0013c30000004fefe010ff00000fe04fefe0000000000000000000000000000000000000000000000000000000000007f007f00";
const TRIANGLES: &str = "e1fe100d048f021115ff040404007687566778a9866589689801690000";
const SEQUENCE: &str = "d100080806020c0a0804020a100606140e040c060610120c0800000000";

/// Appends an accessor over a compressed view of `count` elements of `stride` bytes.
fn add_compressed(gltf: &mut Value, bytes: &[u8], stride: usize, count: usize, mode: &str, filter: &str) -> usize {
    let size = stride * count;
    let held = push(gltf, "buffers", json!({ "byteLength": bytes.len(), "uri": data_uri(bytes) }));
    let fallback = json!({ "byteLength": size, "extensions": { "EXT_meshopt_compression": { "fallback": true } } });
    let fallback = push(gltf, "buffers", fallback);
    let compressed = json!({ "buffer": held, "byteLength": bytes.len(), "byteStride": stride, "count": count,
        "mode": mode, "filter": filter });
    let mut view = json!({ "buffer": fallback, "byteLength": size,
        "extensions": { "EXT_meshopt_compression": compressed } });
    if mode == "ATTRIBUTES" {
        view["byteStride"] = stride.into();
    }
    push(gltf, "bufferViews", view)
}

#[test]
fn compressed_views_hold_what_was_put_in() {
    let octahedron = |positions: &str, stride: usize, component: u32, filter: &str, indices: &str, mode: &str| {
        let mut gltf = triangle();
        gltf["extensionsUsed"] = json!(["KHR_mesh_quantization", "EXT_meshopt_compression"]);
        gltf["extensionsRequired"] = gltf["extensionsUsed"].clone();
        let view = add_compressed(&mut gltf, &hex(positions), stride, 6, "ATTRIBUTES", filter);
        let accessor = |view: usize, component: u32, count: usize, kind: &str| json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        let p = push(&mut gltf, "accessors", accessor(view, component, 6, "VEC3"));
        let view = add_compressed(&mut gltf, &hex(NORMALS), 4, 6, "ATTRIBUTES", "OCTAHEDRAL");
        let n = push(&mut gltf, "accessors", accessor(view, 5120, 6, "VEC3"));
        gltf["accessors"][n]["normalized"] = true.into();
        let view = add_compressed(&mut gltf, &hex(indices), 2, 24, mode, "NONE");
        let i = push(&mut gltf, "accessors", accessor(view, 5123, 24, "SCALAR"));
        gltf["meshes"][0]["primitives"] = json!([{ "attributes": { "POSITION": p, "NORMAL": n }, "indices": i }]);
        gltf
    };
    let gltf = octahedron(POSITIONS, 8, 5122, "NONE", TRIANGLES, "TRIANGLES");
    let scene = loaded(&gltf);
    assert_eq!((scene.triangles.len(), inward(&scene.triangles)), (8, 0));
    assert!((scene.bounding_sphere().1 - 1000.0).abs() < 1e-3);
    for triangle in &scene.triangles {
        assert!(triangle.positions.iter().zip(triangle.normals).all(|(p, n)| (*p / 1000.0 - n).length() < 1e-6));
    }
    let plain = octahedron(POSITIONS, 8, 5122, "NONE", SEQUENCE, "INDICES");
    assert_eq!(surface(&loaded(&plain)), surface(&scene));
    let small = octahedron(EXPONENTIAL, 12, 5126, "EXPONENTIAL", TRIANGLES, "TRIANGLES");
    assert!((loaded(&small).bounding_sphere().1 - 0.75).abs() < 1e-4);

    // Damaged data and false sizes: every change is an error.
    for stream in [POSITIONS, TRIANGLES, SEQUENCE] {
        for cut in (2..stream.len()).step_by(4) {
            let mode = if stream == SEQUENCE { "INDICES" } else { "TRIANGLES" };
            let indices = if stream == POSITIONS { TRIANGLES } else { &stream[..cut] };
            let positions = if stream == POSITIONS { &stream[..cut] } else { POSITIONS };
            let said = message(load(&octahedron(positions, 8, 5122, "NONE", indices, mode)));
            assert!(said.ends_with("EXT_meshopt_compression: the compressed data is damaged"), "{said}");
        }
    }
    let refused = |change: fn(&mut Value)| {
        let mut gltf = gltf.clone();
        change(&mut gltf["bufferViews"][2]);
        message(load(&gltf))
    };
    let place = "bufferViews[2].extensions.EXT_meshopt_compression";
    let lie = refused(|view| view["extensions"]["EXT_meshopt_compression"]["count"] = 1_u64.wrapping_shl(60).into());
    assert_eq!(lie, format!("{place}: 1152921504606846976 elements of 8 bytes do not fill the view's 48"));
    let bomb = refused(|view| {
        view["byteLength"] = (8_u64 << 40).into();
        view["extensions"]["EXT_meshopt_compression"]["count"] = (1_u64 << 40).into();
    });
    assert_eq!(bomb, format!("{place}: 8796093022208 bytes are more than the file's buffers can hold compressed"));
    let odd = refused(|view| view["extensions"]["EXT_meshopt_compression"]["mode"] = "FAKE".into());
    assert_eq!(odd, format!("{place}: mode \"FAKE\" with a stride of 8 and a count of 6"));
    let beyond = refused(|view| view["extensions"]["EXT_meshopt_compression"]["byteOffset"] = 9.into());
    assert!(beyond.contains("bytes at 9 run past buffers[1]"), "{beyond}");
}

/// A Draco stream of the same octahedron with a radius of 1, positions in 12 bits and normals in 8.
const DRACO: &str = "445241434f02020101000000060801070000026f15010110ff02cc4002ff000000000001000903000002010109030001030101\
                     01000d2f01400100ffffff000000ffffffffffff00f0ffff0f0000f0fffddfff00f0ff00000000ff0f0000000080bf000080\
                     bf000080bf000000400c0003010102ff015515fff705205505fff35505052192f7b282ff0000007f00000008";

#[test]
fn compressed_primitives_hold_what_was_put_in() {
    let octahedron = |stream: &[u8]| {
        let mut gltf = triangle();
        gltf["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
        gltf["extensionsRequired"] = gltf["extensionsUsed"].clone();
        let buffer = push(&mut gltf, "buffers", json!({ "byteLength": stream.len(), "uri": data_uri(stream) }));
        let view = push(&mut gltf, "bufferViews", json!({ "buffer": buffer, "byteLength": stream.len() }));
        gltf["accessors"] = json!([
            { "componentType": 5126, "count": 6, "type": "VEC3" },
            { "componentType": 5126, "count": 6, "type": "VEC3" },
            { "componentType": 5123, "count": 24, "type": "SCALAR" },
        ]);
        let compressed = json!({ "bufferView": view, "attributes": { "POSITION": 0, "NORMAL": 1 } });
        gltf["meshes"][0]["primitives"] = json!([{ "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2,
            "extensions": { "KHR_draco_mesh_compression": compressed } }]);
        gltf
    };
    let stream = hex(DRACO);
    let gltf = octahedron(&stream);
    let scene = loaded(&gltf);
    assert_eq!((scene.triangles.len(), inward(&scene.triangles)), (8, 0));
    for triangle in &scene.triangles {
        let near = |(p, n): (&glam::Vec3, glam::Vec3)| (p.length() - 1.0).abs() < 1e-3 && (*p - n).length() < 0.02;
        assert!(triangle.positions.iter().zip(triangle.normals).all(near), "{triangle:?}");
    }
    // One stream shared by two nodes, and by two primitives.
    let mut twice = gltf.clone();
    let primitive = twice["meshes"][0]["primitives"][0].clone();
    push(&mut twice["meshes"][0], "primitives", primitive);
    assert_eq!(loaded(&twice).triangles.len(), 16);

    let place = "meshes[0].primitives[0].extensions.KHR_draco_mesh_compression";
    for cut in 0..stream.len() - 1 {
        let said = message(load(&octahedron(&stream[..cut])));
        assert!(said.starts_with(&format!("{place}: the compressed data is damaged: ")), "{cut}: {said}");
    }
    let refused = |change: fn(&mut Value)| {
        let mut gltf = gltf.clone();
        change(&mut gltf);
        message(load(&gltf))
    };
    let indices = refused(|g| g["accessors"][2]["count"] = 27.into());
    assert_eq!(indices, format!("{place}: holds 8 triangles, the accessor 27 indices"));
    let vertices = refused(|g| {
        g["accessors"][0]["count"] = 7.into();
        g["accessors"][1]["count"] = 7.into();
    });
    assert_eq!(vertices, format!("{place}: holds 6 vertices, the accessors 7"));
    let kind = refused(|g| g["accessors"][1]["type"] = "VEC2".into());
    assert_eq!(kind, format!("{place}.attributes.NORMAL: has 3 components, not the 2 of its accessor"));
    let many = refused(|g| g["accessors"][2]["count"] = (1_u64 << 60).into());
    assert_eq!(many, format!("{place}: 6 vertices and 1152921504606846976 indices are too many"));
    let strip = refused(|g| g["meshes"][0]["primitives"][0]["mode"] = 5.into());
    assert_eq!(strip, format!("{place}: is read for lists of indexed triangles only"));
}
