//! Refused files and their error messages.

use caustica::scene::{Environment, Scene};
use glam::Vec3;
use proptest::prelude::*;
use serde_json::{Value, json};
use support::gltf::{add_accessor, add_zeros, data_uri, floats, load, load_bytes, loaded, message, triangle};

/// Error line for a modified triangle file.
fn refusal(change: impl FnOnce(&mut Value)) -> String {
    let mut gltf = triangle();
    assert!(load(&gltf).is_ok(), "the unchanged file loads");
    change(&mut gltf);
    message(load(&gltf))
}

/// The box of an orthographic camera.
fn camera_box(xmag: f64, ymag: f64) -> Value {
    json!({ "xmag": xmag, "ymag": ymag, "znear": 0.1, "zfar": 10 })
}

#[test]
fn faults_are_named_with_their_place() {
    let check = |change: fn(&mut Value), expected: &str| assert_eq!(refusal(change), expected);
    check(|g| g["asset"]["version"] = "1.0".into(), "asset.version: glTF 1.0 is not read, only 2.0");
    check(|g| g["asset"]["minVersion"] = "2.1".into(), "asset.minVersion: the file needs glTF 2.1, only 2.0 is read");
    check(
        |g| g["extensionsRequired"] = json!(["KHR_lights_punctual", "FAKE_thing"]),
        "extensionsRequired[1]: FAKE_thing is not supported; `load.ignore_required` FAKE_thing reads the file without it",
    );
    check(|g| g["scene"] = 3.into(), "scene: 3 of 1");
    check(|g| g["nodes"][0]["mesh"] = 7.into(), "nodes[0].mesh: 7 of 1");
    check(|g| g["nodes"][0]["children"] = json!([0]), "nodes[0]: is its own ancestor");
    check(|g| g["nodes"][0]["children"] = json!([1]), "scenes[0].nodes: reach node 1 twice");
    check(|g| g["nodes"][0]["rotation"] = json!([0, 0, 0, 0]), "nodes[0].rotation: [0, 0, 0, 0] is not a rotation");
    check(|g| g["nodes"][2]["scale"] = json!([0, 0, 0]), "nodes[2]: its transform leaves its camera no direction");
    check(
        |g| g["cameras"][0]["perspective"]["yfov"] = 4.into(),
        "cameras[0].perspective.yfov: 4 is not between 0 and pi",
    );
    check(
        |g| g["cameras"][0] = json!({ "type": "orthographic", "orthographic": camera_box(1.0, 0.0) }),
        "cameras[0].orthographic.ymag: 0 is not a positive number",
    );
    check(
        |g| g["cameras"][0] = json!({ "type": "orthographic", "orthographic": camera_box(1e39, 1.0) }),
        "cameras[0].orthographic.xmag: inf is not a positive number",
    );
    check(
        |g| g["cameras"][0] = json!({ "type": "orthographic", "orthographic": camera_box(1e30, 1e-30) }),
        "cameras[0].orthographic: xmag / ymag is not a positive number",
    );
    check(|g| g["cameras"][0]["type"] = "orthographic".into(), "cameras[0]: orthographic is missing");
    check(|g| g["meshes"][0]["primitives"][0]["material"] = 2.into(), "meshes[0].primitives[0].material: 2 of 1");
    check(|g| g["meshes"][0]["primitives"][0]["mode"] = 9.into(), "meshes[0].primitives[0].mode: is not one of glTF's");
    check(
        |g| g["accessors"][0]["type"] = "VEC2".into(),
        "meshes[0].primitives[0].attributes.POSITION: is Vec2 of F32, not Vec3 of F32",
    );
    check(
        |g| g["meshes"][0]["primitives"][0]["indices"] = add_accessor(g, &[0; 12], 5126, 3, "SCALAR").into(),
        "meshes[0].primitives[0].indices: is Scalar of F32, not Scalar of U8, U16 or U32",
    );
    check(|g| g["accessors"][0]["bufferView"] = 5.into(), "accessors[0].bufferView: 5 of 2");
    check(
        |g| g["accessors"][0]["count"] = 4_294_967_295_u32.into(),
        "accessors[0]: 4294967295 elements at byte 0 run past bufferViews[0], which has 36 bytes",
    );
    check(
        |g| g["accessors"][0]["byteOffset"] = u64::MAX.into(),
        "accessors[0]: 3 elements at byte 18446744073709551615 run past bufferViews[0], which has 36 bytes",
    );
    check(
        |g| g["bufferViews"][0]["byteStride"] = 8.into(),
        "bufferViews[0].byteStride: 8 is less than the 12 bytes of an element of accessors[0]",
    );
    check(
        |g| g["bufferViews"][1]["byteLength"] = 9.into(),
        "bufferViews[1]: 9 bytes at 36 run past buffers[0], which has 44",
    );
    check(|g| g["buffers"][0]["byteLength"] = 45.into(), "buffers[0]: byteLength is 45, but there are 44 bytes");
    check(
        |g| g["buffers"][0]["uri"] = "../secret.bin".into(),
        r#"buffers[0].uri: "../secret.bin" leads out of the scene's folder, which only `load.allow_outside` permits"#,
    );
    check(
        |g| g["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = json!(-1),
        "extensions.KHR_lights_punctual.lights[0]: intensity -1 times color [1.0, 1.0, 1.0] is not a positive number",
    );
    check(
        |g| g["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = 1.into(),
        "nodes[1].extensions.KHR_lights_punctual.light: 1 of 1",
    );
    check(
        |g| g["nodes"][1]["extensions"]["KHR_node_visibility"] = json!({ "visible": 0 }),
        "nodes[1].extensions.KHR_node_visibility.visible: is not true or false",
    );
}

#[test]
fn faults_of_lights_and_emission_are_named_with_their_place() {
    let spot = |spot: Value| {
        refusal(|g| {
            g["extensions"]["KHR_lights_punctual"]["lights"][0] = json!({ "type": "spot", "spot": spot });
        })
    };
    let at = "extensions.KHR_lights_punctual.lights[0].spot";
    for (cones, expected) in [
        (json!({ "outerConeAngle": 0 }), "outerConeAngle: 0 is not above 0 and at most pi/2"),
        (json!({ "outerConeAngle": 1.6 }), "outerConeAngle: 1.6 is not above 0 and at most pi/2"),
        (json!({ "outerConeAngle": 3 }), "outerConeAngle: 3 is not above 0 and at most pi/2"),
        (json!({ "outerConeAngle": -0.5 }), "outerConeAngle: -0.5 is not above 0 and at most pi/2"),
        (json!({ "innerConeAngle": 1e39 }), "innerConeAngle: inf is not between 0 and the outer angle, 0.7853982"),
        (json!({ "innerConeAngle": -0.1 }), "innerConeAngle: -0.1 is not between 0 and the outer angle, 0.7853982"),
    ] {
        assert_eq!(spot(cones), format!("{at}.{expected}"));
    }
    let light = |light: Value| refusal(|g| g["extensions"]["KHR_lights_punctual"]["lights"][0] = light);
    let at = "extensions.KHR_lights_punctual.lights[0]";
    for (change, expected) in [
        (json!({ "type": "disc" }), ".type: is not point, spot or directional"),
        (
            json!({ "type": "directional", "intensity": -2 }),
            ": intensity -2 times color [1.0, 1.0, 1.0] is not a positive number",
        ),
        (
            json!({ "type": "spot", "spot": {}, "color": [1, -1, 1] }),
            ": intensity 1 times color [1.0, -1.0, 1.0] is not a positive number",
        ),
        (
            json!({ "type": "point", "intensity": 1e39 }),
            ": intensity inf times color [1.0, 1.0, 1.0] is not a positive number",
        ),
    ] {
        assert_eq!(light(change), format!("{at}{expected}"));
    }
    for kind in ["spot", "directional"] {
        let flat = refusal(|g| {
            g["extensions"]["KHR_lights_punctual"]["lights"][0]["type"] = kind.into();
            g["nodes"][1]["scale"] = json!([1, 1, 0]);
        });
        assert_eq!(flat, "nodes[1]: its transform leaves its light no direction");
    }
    let emission = |factor: Value, strength: Value| {
        refusal(|g| {
            g["materials"][0]["emissiveFactor"] = factor;
            g["materials"][0]["extensions"]["KHR_materials_emissive_strength"] =
                json!({ "emissiveStrength": strength });
        })
    };
    let factor = "materials[0].emissiveFactor: ";
    assert_eq!(emission(json!([1, -1, 0]), 1.into()), format!("{factor}1 -1 0 is not a colour of positive numbers"));
    assert_eq!(emission(json!([1e39, 1, 0]), 1.into()), format!("{factor}inf 1 0 is not a colour of positive numbers"));
    for (strength, text) in [(json!(-1), "-1"), (json!(1e39), "inf")] {
        let expected = format!(
            "materials[0].extensions.KHR_materials_emissive_strength.emissiveStrength: {text} is not a positive number \
             that its factor can be multiplied by"
        );
        assert_eq!(emission(json!([1, 1, 1]), strength.clone()), expected);
        assert_eq!(emission(json!([0, 0, 0]), strength), expected);
    }
    let emission = refusal(|g| g["materials"][0]["emissiveFactor"] = json!([1, 1]));
    assert_eq!(emission, "materials[0].emissiveFactor: invalid length 2, expected an array of length 3");
}

#[test]
fn vertices_that_are_not_there_or_not_numbers_are_refused() {
    let nan = refusal(|g| {
        let positions = add_accessor(g, &floats(&[0.0, 0.0, 0.0, 1.0, f32::NAN, 0.0, 0.0, 1.0, 0.0]), 5126, 3, "VEC3");
        g["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
    });
    assert_eq!(nan, "accessors[2]: element 1 is not finite");
    let index = refusal(|g| {
        let indices = add_accessor(g, &[0, 1, 3], 5121, 3, "SCALAR");
        g["meshes"][0]["primitives"][0]["indices"] = indices.into();
    });
    assert_eq!(index, "meshes[0].primitives[0].indices: index 3 at 2, but there are 3 vertices");
    let normals = refusal(|g| {
        let normals = add_accessor(g, &floats(&[0.0; 6]), 5126, 2, "VEC3");
        g["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    });
    assert_eq!(normals, "meshes[0].primitives[0].attributes.NORMAL: has 2 elements, other attributes have 3");
    let sparse = refusal(|g| {
        g["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": { "bufferView": 1, "byteOffset": 2, "componentType": 5125 },
            "values": { "bufferView": 0 },
        });
    });
    assert_eq!(sparse, "accessors[0].sparse.indices: index 131073 of 3 elements");
}

#[test]
fn files_that_are_not_there_or_not_gltf_are_refused() {
    let missing = Scene::load(std::path::Path::new("no/such/scene.gltf")).expect_err("no such file").to_string();
    assert!(missing.starts_with("no/such/scene.gltf: "), "{missing}");
    assert_eq!(message(load_bytes(b"")), "file: is neither glTF JSON nor a GLB container");
    assert_eq!(message(load_bytes(b"\x89PNG\r\n")), "file: is neither glTF JSON nor a GLB container");
    assert_eq!(message(load_bytes(b"{\"asset\"")), "JSON: EOF while parsing an object at line 1 column 8");
    assert_eq!(message(load_bytes(b"glTF\x02\0\0\0")), "GLB header: needs 12 bytes, the file has 8");
    assert_eq!(message(load_bytes(b"glTF\x02\0\0\0\x07\0\0\0")), "GLB header: says 7 bytes, the file has 12");
    let no_file = refusal(|g| g["buffers"][0]["uri"] = "gone.bin".into());
    assert!(no_file.starts_with(r#"buffers[0].uri: "gone.bin": "#), "{no_file}");
    let no_base64 = refusal(|g| g["buffers"][0]["uri"] = "data:;base64,!".into());
    assert!(no_base64.starts_with("buffers[0].uri: not base64: "), "{no_base64}");
}

/// A GLB of chunks.
fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
    let word = |n: usize| (n as u32).to_le_bytes();
    let body: Vec<u8> =
        chunks.iter().flat_map(|(kind, data)| [&word(data.len())[..], &kind[..], data].concat()).collect();
    [b"glTF", &word(2)[..], &word(12 + body.len()), &body].concat()
}

#[test]
fn glb_chunks_are_read_and_unknown_ones_skipped() {
    let mut gltf = triangle();
    gltf["buffers"][0].as_object_mut().expect("a buffer").remove("uri");
    let no_data = message(load(&gltf));
    assert_eq!(no_data, "buffers[0]: has no uri, and there is no binary chunk for it");
    let data = [floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]), vec![0, 0, 1, 0, 2, 0, 0, 0]].concat();
    let text = gltf.to_string();
    let whole = glb(&[(b"JSON", text.as_bytes()), (b"note", b"1234"), (b"BIN\0", &data)]);
    let scene = load_bytes(&whole).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.triangles, loaded(&triangle()).triangles);
    for length in 0..whole.len() {
        assert!(load_bytes(&whole[..length]).is_err(), "cut to {length} bytes");
    }
    assert_eq!(scene.warnings, [""; 0]);
    let padded = load_bytes(&glb(&[(b"JSON", format!("{text}\0\0\0").as_bytes()), (b"BIN\0", &data)]));
    let padded = padded.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(padded.triangles, scene.triangles);
    assert_eq!(padded.warnings, ["the JSON of the GLB is padded with NUL bytes, not with spaces"]);
    let within = glb(&[(b"JSON", format!("{text}\0 ").as_bytes()), (b"BIN\0", &data)]);
    assert!(message(load_bytes(&within)).starts_with("JSON: trailing characters"));
    assert_eq!(message(load_bytes(&glb(&[(b"BIN\0", &data)]))), "GLB chunk: the first chunk is not JSON");
    let mut long = whole.clone();
    long[12] += 200;
    assert!(load_bytes(&long).is_err());
}

#[test]
fn scenes_without_light_or_shape_say_what_they_hold() {
    let refused = |gltf: &Value| {
        let error = loaded(gltf).check_renderable().expect_err("nothing to render").to_string();
        error.split_once("test.gltf: ").expect("the file is named").1.to_owned()
    };
    assert!(loaded(&triangle()).check_renderable().is_ok());
    let dark = "scene: no light: add a light (KHR_lights_punctual) or an emissive material to the file, or give \
                `scene.environment`";
    let mut gltf = triangle();
    gltf["scenes"][0]["nodes"] = json!([0, 2]);
    assert_eq!(refused(&gltf), dark);
    let mut scene = loaded(&gltf);
    scene.environment = Some(Environment::uniform(Vec3::new(0.0, 1e-30, 0.0)));
    assert!(scene.check_renderable().is_ok());
    scene.environment = Some(Environment::uniform(Vec3::ZERO));
    assert!(scene.check_renderable().is_ok(), "black, but named");
    // An emissive material that no surface uses gives no light.
    let lamp = json!({ "emissiveFactor": [0, 0, 0.5] });
    gltf["materials"].as_array_mut().expect("a list").push(lamp);
    assert_eq!(refused(&gltf), dark);
    gltf["meshes"][0]["primitives"][0]["material"] = 1.into();
    assert!(loaded(&gltf).check_renderable().is_ok());
    gltf["meshes"][0]["primitives"][0]["mode"] = 1.into();
    assert_eq!(
        refused(&gltf),
        "scene: nothing to draw: it holds no triangle and no sphere (points and lines are not drawn)"
    );
}

#[test]
fn json_that_is_wrong_is_named_with_its_place() {
    let check = |change: fn(&mut Value), expected: &str| assert_eq!(refusal(change), expected);
    check(|g| g["nodes"] = json!({}), "nodes: is not a list");
    check(|g| g["nodes"][1] = json!(3), "nodes[1]: is not an object");
    check(|g| g["samplers"] = json!([[]]), "samplers[0]: is not an object");
    check(
        |g| g["nodes"][0]["mesh"] = json!(-1),
        "nodes[0].mesh: invalid type: integer `-1`, expected index into child of root",
    );
    check(
        |g| g["nodes"][0]["mesh"] = json!(0.5),
        "nodes[0].mesh: invalid type: floating point `0.5`, expected index into child of root",
    );
    check(
        |g| g["nodes"][0]["rotation"] = json!([0, 0, 1]),
        "nodes[0].rotation: invalid length 3, expected an array of length 4",
    );
    check(
        |g| g["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(-1),
        "meshes[0].primitives[0].attributes.POSITION: invalid type: integer `-1`, expected index into child of root",
    );
    check(
        |g| g["extensions"]["KHR_lights_punctual"]["lights"][0]["color"] = json!([1, 1]),
        "extensions.KHR_lights_punctual.lights[0].color: invalid length 2, expected an array of length 3",
    );
    check(
        |g| g["extensions"]["KHR_lights_punctual"]["lights"][0]["color"] = json!([1, 1, 1, 1]),
        "extensions.KHR_lights_punctual.lights[0].color: invalid length 4, expected fewer elements in array",
    );
    check(|g| g["accessors"][1] = json!({ "type": "SCALAR" }), "accessors[1]: missing field `count`");
    check(|g| g["scene"] = json!("first"), "scene: invalid type: string \"first\", expected index into child of root");
    check(|g| g["asset"] = json!({}), "asset: missing field `version`");
    check(|g| drop(g.as_object_mut().map(|g| g.remove("asset"))), "asset: is missing");
    check(|g| g["materials"] = json!(vec![json!({}); 65_537]), "materials: 65537 of them, at most 65536 are read");
    let text = triangle().to_string();
    let twice = text.replacen("\"mesh\":0", "\"mesh\":0,\"mesh\":1", 1);
    let said = message(load_bytes(twice.as_bytes()));
    assert!(said.starts_with("JSON: the name \"mesh\" is there twice in one object at line 1"), "{said}");
    let deep = text.replacen("\"mesh\":0", &format!("\"mesh\":0,\"extras\":{}", "[".repeat(500_000)), 1);
    assert!(message(load_bytes(deep.as_bytes())).starts_with("JSON: recursion limit exceeded"));
    let broken = [text.as_bytes(), b"\xff"].concat();
    assert_eq!(message(load_bytes(&broken)), format!("JSON: byte {} is not UTF-8", text.len()));
}

#[test]
fn absurd_counts_cost_nothing() {
    let zeros = refusal(|g| {
        let positions = add_zeros(g, 5126, 1 << 40, "VEC3");
        g["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
    });
    assert_eq!(zeros, "accessors[2]: 1099511627776 elements without a bufferView, at most 16777216 are read");
    let instances = refusal(|g| {
        let at = add_zeros(g, 5126, 1 << 24, "VEC3");
        let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": at } } });
        g["nodes"] = json!(vec![json!({ "mesh": 0, "extensions": instancing }); 7]);
        g["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4, 5, 6]);
    });
    assert_eq!(instances, "scene: 117440512 triangles, at most 100000000 are read");
    // The maximum number of vertices without bytes, all at one position: no memory is allocated for
    // them.
    let mut gltf = triangle();
    let positions = add_zeros(&mut gltf, 5126, 3 << 22, "VEC3");
    gltf["meshes"][0]["primitives"] = json!([{ "attributes": { "POSITION": positions } }]);
    let scene = loaded(&gltf);
    assert!(scene.triangles.is_empty());
    let said = "4194304 of 4194304 triangles have no area and are not drawn";
    assert_eq!(scene.warnings.last().map(String::as_str), Some(said));
    let length = refusal(|g| g["buffers"][0]["byteLength"] = (1_u64 << 60).into());
    assert_eq!(length, "buffers[0]: byteLength is 1152921504606846976, but there are 44 bytes");
    let joints = refusal(|g| {
        let zeros = add_zeros(g, 5121, 3, "VEC4");
        g["meshes"][0]["primitives"][0]["attributes"]["JOINTS_8"] = zeros.into();
    });
    assert_eq!(joints, "meshes[0].primitives[0].attributes.JOINTS_8: is one of more than 8 sets of joints");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// With any bytes changed, the file loads or is refused. There is no panic and no NaN.
    #[test]
    fn damaged_files_never_panic(changes in prop::collection::vec((0_usize..10_000, any::<u8>()), 1..4), cut in 0_usize..20_000) {
        let mut bytes = triangle().to_string().into_bytes();
        let length = bytes.len();
        for (at, value) in changes {
            // Mostly digits and punctuation, which keep the JSON valid more often than arbitrary
            // bytes.
            bytes[at % length] = if value < 200 { b"0123456789-.e,:[]{}\"x"[value as usize % 21] } else { value };
        }
        bytes.truncate(cut.max(1));
        if let Ok(scene) = load_bytes(&bytes) {
            prop_assert!(scene.triangles.iter().all(|t| t.positions.iter().chain(&t.normals).all(|v| v.is_finite())));
            prop_assert!(!scene.cameras.is_empty());
            let _ = (scene.check_renderable(), scene.describe().to_string(), caustica::bvh::Bvh::build(&scene));
        }
    }

    /// The same for the bytes of the buffers.
    #[test]
    fn damaged_data_never_panic(bytes in prop::collection::vec(any::<u8>(), 44)) {
        let mut gltf = triangle();
        gltf["buffers"][0]["uri"] = data_uri(&bytes).into();
        if let Ok(scene) = load(&gltf) {
            prop_assert!(scene.triangles.iter().all(|t| t.positions.iter().chain(&t.normals).all(|v| v.is_finite())));
        }
    }
}
