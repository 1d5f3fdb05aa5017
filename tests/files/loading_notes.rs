//! Notes on what a file says in vain, and the refusal of what has two meanings.

use serde_json::{Value, json};
use support::gltf::{load, loaded, message, push, triangle};

#[test]
fn matrices_are_affine_and_stand_alone() {
    let with = |node: Value| {
        let mut gltf = triangle();
        gltf["nodes"][0] = node;
        gltf
    };
    let by_columns = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 2, 0, 1, 1];
    let by_rows = [1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1];
    let moved = loaded(&with(json!({ "mesh": 0, "translation": [2, 0, 1] })));
    let plain = loaded(&with(json!({ "mesh": 0, "matrix": by_columns })));
    assert_eq!((&plain.triangles, &plain.warnings), (&moved.triangles, &vec![]));
    assert_eq!(
        message(load(&with(json!({ "mesh": 0, "matrix": by_rows })))),
        "nodes[0].matrix: its last row is 2 0 1 1, not 0 0 0 1: glTF has matrices column by column"
    );
    let mut rounded = by_columns.map(f64::from);
    rounded[15] = 0.999_999;
    assert_eq!(loaded(&with(json!({ "mesh": 0, "matrix": rounded }))).warnings, [""; 0]);
    for member in
        [json!({ "translation": [5, 0, 0] }), json!({ "scale": [2, 2, 2] }), json!({ "rotation": [0, 0, 0, 1] })]
    {
        let mut both = with(json!({ "mesh": 0, "matrix": by_columns }));
        both["nodes"][0].as_object_mut().expect("a node").extend(member.as_object().expect("a member").clone());
        let both = loaded(&both);
        let said = r#"node "node 0": its matrix is read, not the translation, rotation or scale beside it"#;
        assert_eq!((both.triangles, both.warnings), (plain.triangles.clone(), vec![said.to_owned()]));
    }
}

#[test]
fn cameras_of_one_name_are_told_of() {
    let warnings = |name: &str| {
        let mut gltf = triangle();
        let node = push(&mut gltf, "nodes", json!({ "name": name, "translation": [0, 0, 4], "camera": 0 }));
        push(&mut gltf["scenes"][0], "nodes", node.into());
        let scene = loaded(&gltf);
        assert_eq!(scene.camera_number(Some("view")).expect("it is found"), 0);
        scene.warnings
    };
    assert_eq!(warnings("view"), [r#"camera "view": others have this name too; it chooses the first, an index any"#]);
    assert_eq!(warnings("other"), [""; 0]);
}

#[test]
fn a_lamp_that_its_factor_puts_out_is_told_of() {
    let warnings = |factor: Option<[f64; 3]>, texture: bool, strength: Option<f64>| {
        let mut gltf = triangle();
        let material = &mut gltf["materials"][0];
        if let Some(factor) = factor {
            material["emissiveFactor"] = json!(factor);
        }
        if texture {
            material["emissiveTexture"] = json!({ "index": 0 });
        }
        if let Some(strength) = strength {
            material["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
        }
        gltf["textures"] = json!([{}]);
        gltf["extensionsUsed"].as_array_mut().expect("a list").push("KHR_materials_emissive_strength".into());
        let lines = loaded(&gltf).warnings;
        lines.into_iter().filter(|line| line.contains("emissiveFactor")).collect::<Vec<_>>()
    };
    let said = |what: &str| {
        [format!(r#"material "paint": its emissiveFactor is 0, so that its emissive {what} gives no light"#)]
    };
    for factor in [None, Some([0.0; 3])] {
        assert_eq!(warnings(factor, true, None), said("texture"));
        assert_eq!(warnings(factor, true, Some(2.0)), said("texture"));
        assert_eq!(warnings(factor, false, Some(2.0)), said("strength"));
        // Nothing is meant to shine.
        for strength in [None, Some(0.0), Some(1.0)] {
            assert_eq!(warnings(factor, false, strength), [""; 0]);
        }
    }
    assert_eq!(warnings(Some([0.0, 0.1, 0.0]), true, Some(2.0)), [""; 0]);
}

#[test]
fn unknown_keys_of_extras_are_told_of() {
    let own = |values: Value| json!({ "caustica": values, "other": 1 });
    let with = |material: Value, node: Value, light: Value, mesh: Value| {
        let mut gltf = triangle();
        gltf["materials"][0]["extras"] = own(material);
        gltf["nodes"][1]["extras"] = own(node);
        gltf["extensions"]["KHR_lights_punctual"]["lights"][0]["extras"] = own(light);
        gltf["meshes"][0]["extras"] = own(mesh);
        loaded(&gltf).warnings
    };
    let (group, both) = (json!({ "group": "a" }), json!({ "group": "a", "priority": 1 }));
    assert_eq!(with(both.clone(), group.clone(), group.clone(), json!({})), [""; 0]);
    let misspelt = json!({ "group": "a", "prority": 1 });
    let said = |kind: &str, key: &str| format!("{kind}: {key:?} in its extras.caustica is not read");
    assert_eq!(
        with(misspelt.clone(), both, misspelt, json!(3)),
        [
            said("material \"paint\"", "prority"),
            said("node \"lamp\"", "priority"),
            "mesh \"mesh 0\": its extras.caustica is not an object, and not read".to_owned(),
            said("light \"light 0\"", "prority"),
        ]
    );
}
