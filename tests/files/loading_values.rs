//! Reading of materials, lights and cameras, and the warnings about them.

use caustica::scene::{Camera, Environment, LightKind, LoadOptions, Projection};
use caustica::settings::LightUnit;
use glam::Vec3;
use serde_json::{Value, json};
use support::gltf::{loaded, message, read_with, triangle};

#[test]
fn lights_keep_their_candela_whatever_the_scale() {
    let mut gltf = triangle();
    gltf["extensions"]["KHR_lights_punctual"]["lights"][0] =
        json!({ "type": "point", "color": [1, 0.5, 0], "intensity": 683 });
    gltf["nodes"][1]["scale"] = json!([5, 5, 5]);
    let scene = loaded(&gltf);
    let light = &scene.lights[0];
    assert_eq!((light.name.as_str(), light.intensity), ("lamp", Vec3::new(683.0, 341.5, 0.0)));
    assert_eq!(light.position, Vec3::new(-0.5, -0.5, 2.0));
    assert_eq!(light.intensity_in(LightUnit::Radiometric), light.intensity);
    assert!((light.intensity_in(LightUnit::Photometric) - Vec3::new(1.0, 0.5, 0.0)).length() < 1e-6);
    assert!((light.power(1.0).x / (4.0 * std::f64::consts::PI * 683.0) - 1.0).abs() < 1e-6);
}

#[test]
fn a_light_is_called_as_its_node_or_by_its_own_name() {
    let name = |node: Option<&str>, own: Option<&str>| {
        let mut gltf = triangle();
        gltf["nodes"][1].as_object_mut().expect("a node").remove("name");
        if let Some(node) = node {
            gltf["nodes"][1]["name"] = node.into();
        }
        if let Some(own) = own {
            gltf["extensions"]["KHR_lights_punctual"]["lights"][0]["name"] = own.into();
        }
        loaded(&gltf).lights[0].name.clone()
    };
    assert_eq!(name(Some("node"), Some("own")), "node");
    assert_eq!(name(None, Some("own")), "own");
    assert_eq!(name(Some(""), Some("own")), "own");
    assert_eq!(name(None, None), "light 0");
    assert_eq!(name(Some(""), Some("")), "light 0");
}

#[test]
fn spots_and_directional_lights_shine_along_minus_z_of_their_node() {
    let light = |light: Value, change: fn(&mut Value)| {
        let mut gltf = triangle();
        gltf["extensions"]["KHR_lights_punctual"]["lights"][0] = light;
        change(&mut gltf["nodes"][1]);
        let scene = loaded(&gltf);
        (scene.lights[0].clone(), scene.warnings)
    };
    let near = |a: Vec3, b: Vec3| (a - b).length() < 1e-6;
    let untouched: fn(&mut Value) = |_| {};
    // Default angles: 0 and 45 degrees.
    for plain in [json!({ "type": "spot" }), json!({ "type": "spot", "spot": {} })] {
        let (spot, notes) = light(plain, untouched);
        assert_eq!(spot.kind, LightKind::Spot { inner: 0.0, outer: std::f32::consts::FRAC_PI_4 });
        assert_eq!((spot.direction, spot.position), (Vec3::NEG_Z, Vec3::new(-0.5, -0.5, 2.0)));
        assert_eq!(notes, [""; 0]);
    }
    let cones = json!({ "innerConeAngle": 0.5, "outerConeAngle": std::f64::consts::FRAC_PI_2 });
    let spot = json!({ "type": "spot", "spot": cones, "color": [1, 0.5, 0], "intensity": 8, "range": 3 });
    let (half, notes) = light(spot, untouched);
    assert_eq!(half.kind, LightKind::Spot { inner: 0.5, outer: std::f32::consts::FRAC_PI_2 });
    assert_eq!(half.intensity, Vec3::new(8.0, 4.0, 0.0));
    assert_eq!(notes, ["the range of lights is not read: they reach everywhere"]);
    let sharp = json!({ "type": "spot", "spot": { "innerConeAngle": 0.25, "outerConeAngle": 0.25 } });
    let (sharp, notes) = light(sharp, untouched);
    let said = r#"light "lamp": inner cone angle 0.25 is not below the outer, 0.25: an edge without falloff"#;
    assert_eq!(notes, [said]);
    assert!(matches!(sharp.kind, LightKind::Spot { inner, outer: 0.25 } if inner < 0.25 && inner > 0.2499));
    let (above, notes) =
        light(json!({ "type": "spot", "spot": { "innerConeAngle": 0.8, "outerConeAngle": 0.25 } }), untouched);
    let said = r#"light "lamp": inner cone angle 0.8 is not below the outer, 0.25: an edge without falloff"#;
    assert_eq!((above, &notes[..]), (sharp, &[said.to_owned()][..]));
    // Right angles that were rounded up.
    for angle in [1.571_f32, 1.58] {
        let (half, notes) = light(json!({ "type": "spot", "spot": { "outerConeAngle": angle } }), untouched);
        assert_eq!(half.kind, LightKind::Spot { inner: 0.0, outer: std::f32::consts::FRAC_PI_2 });
        assert_eq!(notes, [format!(r#"light "lamp": outer cone angle {angle} is read as pi/2"#)]);
    }

    // A rotation by 90° about +X takes -Z to +Y at any scale. A reflection reverses it.
    let sun = json!({ "type": "directional", "intensity": 3 });
    let turn: fn(&mut Value) = |node| node["rotation"] = json!([0.5_f64.sqrt(), 0, 0, 0.5_f64.sqrt()]);
    let scaled: fn(&mut Value) = |node| {
        node["rotation"] = json!([0.5_f64.sqrt(), 0, 0, 0.5_f64.sqrt()]);
        node["scale"] = json!([0.5, 7, 3]);
    };
    for change in [turn, scaled] {
        let (sun, notes) = light(sun.clone(), change);
        assert_eq!((sun.kind, sun.intensity, notes), (LightKind::Directional, Vec3::splat(3.0), vec![]));
        assert!(near(sun.direction, Vec3::Y) && (sun.direction.length() - 1.0).abs() < 1e-6, "{}", sun.direction);
    }
    assert!(near(light(sun.clone(), |node| node["scale"] = json!([1, 1, -2])).0.direction, Vec3::Z));
    // A directional light has no position: its node may lie at any distance.
    let far: fn(&mut Value) = |node| node["translation"] = json!([0, 1e30, 0]);
    assert_eq!(light(sun, far).0.position, Vec3::ZERO);
}

#[test]
fn emission_is_factor_times_strength() {
    let emission = |change: Value| {
        let mut gltf = triangle();
        for (key, value) in change.as_object().expect("an object") {
            gltf["materials"][0][key] = value.clone();
        }
        let mut scene = loaded(&gltf);
        (scene.materials.remove(0), scene.warnings)
    };
    let strong = json!({
        "KHR_materials_specular": { "specularFactor": 0 },
        "KHR_materials_emissive_strength": { "emissiveStrength": 100 },
    });
    let (plain, notes) = emission(json!({}));
    assert_eq!((plain.emission, plain.double_sided, notes), (Vec3::ZERO, false, vec![]));
    let (lamp, notes) = emission(json!({ "emissiveFactor": [1, 0.5, 0], "doubleSided": true }));
    assert_eq!((lamp.emission, lamp.double_sided, notes), (Vec3::new(1.0, 0.5, 0.0), true, vec![]));
    let (lamp, notes) = emission(json!({ "emissiveFactor": [1, 0.5, 0], "extensions": strong }));
    assert_eq!((lamp.emission, notes), (Vec3::new(100.0, 50.0, 0.0), vec![]));
    assert_eq!(lamp.surface, plain.surface, "it reflects as before");
}

#[test]
fn cameras_are_found_by_name_and_number_and_made_if_missing() {
    let mut gltf = triangle();
    gltf["nodes"][2]["rotation"] = json!([0, 1, 0, 0]);
    gltf["nodes"][2]["scale"] = json!([3, 2, 1]);
    let scene = loaded(&gltf);
    let camera = scene.camera(None).expect("a camera");
    assert_eq!((camera.forward, camera.up, camera.right), (Vec3::Z, Vec3::Y, -Vec3::X));
    assert_eq!(scene.camera(Some("view")).expect("by name"), scene.camera(Some("0")).expect("by number"));
    let error = scene.camera(Some("1")).expect_err("only one").to_string();
    assert_eq!(error, r#"picture.camera 1: test.gltf has the cameras 0 "view""#);

    gltf["scenes"][0]["nodes"] = json!([0, 1]);
    let scene = loaded(&gltf);
    assert_eq!(scene.warnings, ["no camera: one is made that frames the whole scene"]);
    let camera = scene.camera(None).expect("a framing camera");
    let sees = |p: Vec3, size: (u32, u32)| {
        let v = p - camera.position;
        // Half the height, and the height times the aspect ratio.
        let half = camera.half_height_at(v.dot(camera.forward), size);
        v.dot(camera.up).abs() <= half && v.dot(camera.right).abs() <= half * size.0 as f32 / size.1 as f32
    };
    let whole = |size| scene.triangles[0].positions.iter().all(|p| sees(*p, size));
    assert!([(9, 9), (16, 9), (9, 16)].into_iter().all(whole));
    assert!(!sees(Vec3::new(0.0, 3.0, 0.0), (9, 9)), "not everything is in view");
    let upright = Camera { keeps_width: false, ..camera.clone() };
    assert!(upright.half_height_at(1.0, (9, 16)) < camera.half_height_at(1.0, (9, 16)), "control");
}

#[test]
fn a_scene_without_light_gets_a_sky_and_one_with_light_keeps_it() {
    let mut gltf = triangle();
    let mut lit = loaded(&gltf);
    lit.add_default_light();
    assert_eq!((lit.environment, lit.warnings), (None, vec![]));
    gltf["scenes"][0]["nodes"] = json!([0, 2]);
    let mut dark = loaded(&gltf);
    assert!(dark.check_renderable().is_err());
    dark.add_default_light();
    assert_eq!(dark.warnings, ["no light: lit by a uniform sky of radiance 1"]);
    let sky = dark.environment.as_ref().expect("a sky");
    assert_eq!(
        (sky.name.as_str(), sky.radiance(Vec3::Y), sky.radiance(Vec3::new(-0.8, 0.6, 0.0))),
        ("default sky", Vec3::ONE, Vec3::ONE)
    );
    assert!(sky.radiance(-Vec3::Y).max_element() < 0.5, "what is white stands out from the sky");
    assert!(dark.check_renderable().is_ok());
    // An environment given by the user stays, dark or not.
    let mut asked = loaded(&gltf);
    asked.environment = Some(Environment::uniform(Vec3::ZERO));
    asked.add_default_light();
    assert!(asked.check_renderable().is_ok());
    let off = "all lights are off: the picture is black".to_owned();
    assert_eq!((asked.environment, asked.warnings), (Some(Environment::uniform(Vec3::ZERO)), vec![off]));
    gltf["materials"][0]["emissiveFactor"] = json!([0, 0, 0.5]);
    let mut glowing = loaded(&gltf);
    glowing.add_default_light();
    assert_eq!(glowing.environment, None);
}

#[test]
fn scenes_of_a_file_are_chosen_by_name_or_number() {
    let mut gltf = triangle();
    gltf["scenes"] = json!([{ "nodes": [0, 1, 2] }, { "name": "lamp only", "nodes": [1] }, { "name": "0" }, {}]);
    let scene = |wanted: &str| read_with(&gltf, &LoadOptions { scene: Some(wanted.into()), ..LoadOptions::default() });
    let counts = |wanted: &str| {
        let scene = scene(wanted).unwrap_or_else(|error| panic!("{error}"));
        (scene.triangles.len(), scene.lights.len())
    };
    assert_eq!((counts("lamp only"), counts("1")), ((0, 1), (0, 1)));
    assert_eq!(counts("0"), (0, 0), "a name goes before a number");
    assert_eq!(counts("3"), (0, 0));
    let default = read_with(&gltf, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((default.triangles.len(), default.lights.len()), (1, 1));
    // Results stored under one scene's hash must not be found under another's.
    assert_ne!(scene("1").expect("it loads").hash, default.hash);
    let expected = r#"load.scene 4: test.gltf has the scenes 0, 1 "lamp only", 2 "0", 3"#;
    assert_eq!(message(scene("4")), expected);
    gltf.as_object_mut().expect("an object").remove("scenes");
    gltf.as_object_mut().expect("an object").remove("scene");
    assert_eq!(loaded(&gltf).triangles.len(), 1, "without scenes all nodes are shown");
    let options = LoadOptions { scene: Some("0".into()), ..LoadOptions::default() };
    assert_eq!(message(read_with(&gltf, &options)), "load.scene 0: test.gltf has no scenes");
}

#[test]
fn what_the_format_allows_is_read_whatever_else_the_file_holds() {
    let mut gltf = triangle();
    gltf["extras"] = json!([1, "two", null]);
    gltf["unknown"] = json!({ "deep": [[[{}]]] });
    gltf["extensionsUsed"].as_array_mut().expect("a list").push("FAKE_thing".into());
    gltf["nodes"][0]["extensions"] = json!({ "FAKE_thing": { "x": -1 } });
    gltf["nodes"][0]["extras"] = json!("text");
    gltf["nodes"][0]["mesh"] = json!(0.0);
    gltf["accessors"][0]["count"] = json!(3.0);
    gltf["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    gltf["samplers"] = json!([{ "wrapS": 1 }]);
    gltf["images"] = json!([{ "uri": "gone.png" }]);
    gltf["materials"][0]["alphaMode"] = "FAKE".into();
    gltf["materials"][0]["extensions"]["KHR_materials_volume"] = json!({});
    gltf["animations"] = json!([{ "channels": [{ "sampler": 0, "target": { "path": "pointer" } }], "samplers": [{}] }]);
    gltf["meshes"][0]["primitives"][0]["attributes"]["_OWN"] = 0.into();
    gltf["meshes"][0]["primitives"][0]["attributes"]["FAKE"] = 0.into();
    gltf["bufferViews"][0]["target"] = 7.into();
    let scene = loaded(&gltf);
    assert_eq!(scene.triangles, loaded(&triangle()).triangles);
    assert_eq!(
        scene.warnings,
        [
            "extension FAKE_thing is not read",
            "animations are not read: nodes stand as in the file",
            r#"material "paint": its alphaMode is not one of glTF's: it is opaque"#,
        ]
    );
    gltf["materials"][0]["extensions"]["FAKE_paint"] = json!({});
    assert_eq!(loaded(&gltf).warnings[1], "extension FAKE_paint is not read", "though it is not listed");
    gltf["materials"][0]["extensions"].as_object_mut().expect("an object").remove("FAKE_paint");
    gltf["extensionsRequired"] = json!(["FAKE_thing"]);
    let ignoring = |name: &str| {
        let options = LoadOptions { ignore_required: vec![name.into()], ..LoadOptions::default() };
        read_with(&gltf, &options)
    };
    let refused = "extensionsRequired[0]: FAKE_thing is not supported; `load.ignore_required` FAKE_thing reads the file without it";
    assert_eq!(message(ignoring("FAKE_other")), refused);
    let read = ignoring("FAKE_thing").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(read.warnings[0], "extension FAKE_thing is required, but not read");
    assert_eq!(read.triangles, scene.triangles);
}

#[test]
fn orthographic_cameras_keep_their_height_and_aspect() {
    let mut gltf = triangle();
    gltf["cameras"][0] =
        json!({ "type": "orthographic", "orthographic": { "xmag": 3, "ymag": 2, "znear": 0, "zfar": 9 } });
    // A camera ignores its node's scale (glTF 2.0, 3.10.2).
    gltf["nodes"][2]["scale"] = json!([5, 5, 5]);
    let scene = loaded(&gltf);
    let camera = scene.camera(None).expect("a camera");
    assert_eq!((camera.projection, camera.aspect), (Projection::Orthographic { ymag: 2.0 }, Some(1.5)));
    assert_eq!(scene.warnings, [""; 0]);
    let info = scene.describe().to_string();
    assert!(info.contains("0  view  at 0 0 3  orthographic, ymag 2 m  aspect 1.5\n"), "{info}");
}

#[test]
fn info_reads_well() {
    let mut gltf = triangle();
    gltf["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        { "type": "point" },
        { "type": "spot", "spot": { "innerConeAngle": 0.5 } },
        { "type": "directional", "intensity": 2 },
    ]);
    for light in [1, 2] {
        let node = json!({ "extensions": { "KHR_lights_punctual": { "light": light } } });
        gltf["nodes"].as_array_mut().expect("nodes").push(node);
    }
    gltf["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4]);
    gltf["materials"][0]["emissiveFactor"] = json!([1, 0.5, 0]);
    gltf["materials"][0]["doubleSided"] = true.into();
    let scene = loaded(&gltf);
    insta::assert_snapshot!(scene.describe().to_string().replace(&scene.hash, "HASH"), @r#"
    test.gltf
      sha256     HASH
      meshes     1
      triangles  1
      spheres    0
      geometry   about 64 bytes on the device
      bounds     0 0 0 .. 1 1 0 m
      lights (3)
        0  lamp  point  at 0 0 2  12.5664 12.5664 12.5664 W
        1  light 1  spot 28.65° to 45.00°  at 0 0 0  along 0 0 -1  1.12622 1.12622 1.12622 W
        2  light 2  directional  along 0 0 -1  3.14159 3.14159 3.14159 W
      emissive materials (1)
        0  paint  1 triangle  0.5 m² on both sides  1 0.5 0 W/(m² sr)  3.14159 1.5708 0 W
      cameras (1)
        0  view  at 0 0 3  yfov 34.38°
      materials (1)
        0  paint  diffuse (0.5 0.25 0.125)
      notes (0)
    "#);
}
