//! Views in files: hidden nodes, clipping planes, mirrored cameras, dark lights.

use std::path::Path;

use caustica::scene::{Camera, Environment};
use glam::Vec3;
use serde_json::{Value, json};
use support::gltf::{loaded, message, triangle};

#[test]
fn a_light_of_nothing_is_no_reason_for_a_sky() {
    let said = |gltf: &Value| {
        let mut scene = loaded(gltf);
        scene.add_default_light();
        assert_eq!((scene.lights.len(), scene.has_emission()), (0, false));
        assert!(scene.check_renderable().is_ok());
        (scene.environment.map(|environment| environment.name), scene.warnings)
    };
    let off = || "all lights are off: the picture is black".to_owned();
    for dark in [json!({ "type": "spot", "intensity": 0 }), json!({ "type": "point", "color": [0, 0, 0] })] {
        let mut gltf = triangle();
        gltf["extensions"]["KHR_lights_punctual"]["lights"][0] = dark;
        // Nothing depends on where it is.
        gltf["nodes"][1]["scale"] = json!([0, 0, 0]);
        assert_eq!(said(&gltf), (None, vec![r#"light "lamp" has no intensity: it gives no light"#.to_owned(), off()]));
    }
    // Of many one line is said.
    for (count, lines) in [(8, 8), (9, 1)] {
        let mut gltf = triangle();
        let dark = json!({ "type": "point", "intensity": 0 });
        gltf["extensions"]["KHR_lights_punctual"]["lights"] = json!(vec![dark; count]);
        let node = |i| json!({ "name": format!("lamp {i}"), "extensions": { "KHR_lights_punctual": { "light": i } } });
        let nodes: Vec<Value> = (0..count).map(node).collect();
        gltf["scenes"][0]["nodes"] = (0..count + 3).filter(|i| *i != 1).collect();
        gltf["nodes"].as_array_mut().expect("a list").extend(nodes);
        let (_, warnings) = said(&gltf);
        let mut first = r#"light "lamp 0" has no intensity: it gives no light"#.to_owned();
        first += if count == lines { "" } else { " (and 8 others)" };
        assert_eq!((warnings.len(), &warnings[0]), (lines + 1, &first), "{warnings:?}");
    }
    let mut gltf = triangle();
    gltf["scenes"][0]["nodes"] = json!([0, 2]);
    gltf["materials"][0]["emissiveFactor"] = json!([1, 0.5, 0]);
    gltf["materials"][0]["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": 0 });
    assert_eq!(said(&gltf), (None, vec![r#"material "paint": emissive strength 0 gives no light"#.to_owned(), off()]));
    // Controls: a factor of 0, which many exporters write, names no light, nor does a material that
    // nothing has, nor a light that no node has.
    let sky = (Some("default sky".to_owned()), vec!["no light: lit by a uniform sky of radiance 1".to_owned()]);
    gltf["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = 0.into();
    let lamp = gltf["materials"][0].clone();
    gltf["materials"][0]["emissiveFactor"] = json!([0, 0, 0]);
    gltf["materials"].as_array_mut().expect("a list").push(lamp);
    assert_eq!(said(&gltf), sky);
}

#[test]
fn hidden_nodes_and_all_below_them_are_not_there() {
    let hide = |gltf: &mut Value, node: usize, visible: Value| {
        gltf["nodes"][node]["extensions"]["KHR_node_visibility"] = json!({ "visible": visible });
    };
    let counts = |gltf: &Value| {
        let scene = loaded(gltf);
        (scene.triangles.len(), scene.spheres.len(), scene.lights.len(), scene.cameras[0].name.clone())
    };
    let mut gltf = triangle();
    gltf["extensionsUsed"].as_array_mut().expect("a list").push("KHR_node_visibility".into());
    gltf["extensionsRequired"] = json!(["KHR_node_visibility"]);
    gltf["extensions"]["KHR_implicit_shapes"] = json!({ "shapes": [{ "type": "sphere", "sphere": { "radius": 1 } }] });
    let ball = json!({ "extensions": { "KHR_implicit_shapes": { "shape": 0 } }, "extras": { "material": 0 } });
    let grid = json!({ "mesh": 0, "translation": [0, 0, -1], "children": [3, 1] });
    gltf["nodes"].as_array_mut().expect("a list").extend([ball, grid, json!({ "name": "group", "children": [4] })]);
    gltf["scenes"][0]["nodes"] = json!([0, 2, 5]);
    let view = || "view".to_owned();
    let all = loaded(&gltf);
    assert_eq!((counts(&gltf), all.warnings), ((2, 1, 1, view()), vec![]));
    hide(&mut gltf, 5, true.into());
    assert_eq!(counts(&gltf), (2, 1, 1, view()), "visible as by default");
    hide(&mut gltf, 3, false.into());
    assert_eq!(counts(&gltf), (2, 0, 1, view()));
    // The group with all below it, whatever these say of themselves; no light is left.
    hide(&mut gltf, 5, false.into());
    hide(&mut gltf, 3, true.into());
    let mut scene = loaded(&gltf);
    assert_eq!(counts(&gltf), (1, 0, 0, view()));
    scene.add_default_light();
    assert_eq!(
        scene.warnings,
        [
            "nodes that the file hides (KHR_node_visibility) are left out: 4",
            "no light: lit by a uniform sky of radiance 1"
        ]
    );
    // A hidden camera takes pictures; what is left of the scene is centred.
    hide(&mut gltf, 2, false.into());
    assert_eq!(counts(&gltf), (1, 0, 0, view()));
    hide(&mut gltf, 0, false.into());
    assert!(message(loaded(&gltf).check_renderable().map(|()| loaded(&gltf))).starts_with("scene: nothing to draw"));
    gltf["nodes"][5]["extensions"] = json!({});
    assert_eq!(counts(&gltf), (1, 1, 1, view()), "control: shown again");
}

#[test]
fn a_negative_magnification_mirrors() {
    let camera = |xmag: f32, ymag: f32| {
        let mut gltf = triangle();
        let view = json!({ "xmag": xmag, "ymag": ymag, "znear": 0, "zfar": 9 });
        gltf["cameras"][0] = json!({ "type": "orthographic", "orthographic": view });
        let mut scene = loaded(&gltf);
        (scene.cameras.remove(0), scene.warnings)
    };
    let said = |ways: &str| vec![format!("camera \"view\": a negative magnification mirrors the picture, {ways}")];
    let (plain, notes) = camera(3.0, 2.0);
    assert_eq!((plain.right, plain.up, notes), (Vec3::X, Vec3::Y, vec![]));
    for (xmag, ymag, right, up, ways) in [
        (-3.0, 2.0, -Vec3::X, Vec3::Y, "left to right"),
        (3.0, -2.0, Vec3::X, -Vec3::Y, "upside down"),
        (-3.0, -2.0, -Vec3::X, -Vec3::Y, "left to right and upside down"),
    ] {
        let (mirrored, notes) = camera(xmag, ymag);
        assert_eq!(mirrored, Camera { right, up, ..plain.clone() });
        assert_eq!(notes, said(ways));
    }
}

#[test]
fn clipping_planes_are_read() {
    let clipped = |kind: &str, view: Value| {
        let mut gltf = triangle();
        gltf["cameras"][0] = json!({ "type": kind, kind: view });
        let scene = loaded(&gltf);
        ((scene.cameras[0].near, scene.cameras[0].far), scene.warnings)
    };
    let perspective = |planes: Value| {
        let mut view = planes;
        view["yfov"] = json!(0.6);
        clipped("perspective", view)
    };
    let orthographic =
        |znear: f32, zfar: f32| clipped("orthographic", json!({ "xmag": 1, "ymag": 1, "znear": znear, "zfar": zfar }));
    let endless = f32::INFINITY;
    assert_eq!(perspective(json!({ "znear": 0.5 })), ((0.5, endless), vec![]));
    assert_eq!(perspective(json!({ "znear": 0.5, "zfar": 4 })), ((0.5, 4.0), vec![]));
    // The triangle lies 3 m before the camera.
    let said = r#"camera "view": sees to zfar, 2 m; the scene reaches to 3 m"#.to_owned();
    assert_eq!(perspective(json!({ "znear": 0.5, "zfar": 2 })), ((0.5, 2.0), vec![said]));
    assert_eq!(perspective(json!({ "znear": 0 })), ((0.0, endless), vec![]));
    assert_eq!(perspective(json!({ "znear": -2 })), ((0.0, endless), vec![]), "nothing lies behind the eye");
    assert_eq!(orthographic(0.0, 9.0), ((0.0, 9.0), vec![]));
    assert_eq!(orthographic(-3.0, 9.0), ((-3.0, 9.0), vec![]));
    for ((planes, notes), far, near) in
        [(perspective(json!({ "znear": 10, "zfar": 1 })), 1, 10), (orthographic(2.0, 2.0), 2, 2)]
    {
        assert_eq!(planes, (0.0, endless));
        let said = format!("camera \"view\": zfar {far} is not beyond znear {near}: nothing is clipped");
        assert_eq!(notes, [said]);
    }
}

#[test]
fn environments_may_be_held_in_any_of_eight_orders() {
    // Four columns and three rows, each pixel of its own colour.
    let pixel = |x: u8, y: u8| [40 * (x + 1), 60 * (y + 1), 200, 129];
    let read = |sizes: &str, order: &[(u8, u8)]| {
        let pixels: Vec<u8> = order.iter().flat_map(|(x, y)| pixel(*x, *y)).collect();
        let bytes = [format!("#?RADIANCE\n\n{sizes}\n").as_bytes(), &pixels].concat();
        Environment::from_bytes(&bytes, Path::new("sky.hdr"), 1.0, 0.0).unwrap_or_else(|error| panic!("{error}"))
    };
    let order = |count: u8, backward: bool| (0..count).map(move |i| if backward { count - 1 - i } else { i });
    let from_left: Vec<(u8, u8)> = (0..12).map(|i| (i % 4, i / 4)).collect();
    let usual = read("-Y 3 +X 4", &from_left);
    assert_eq!((usual.width, usual.height), (4, 3));
    for (from_right, from_bottom) in [(false, false), (false, true), (true, false), (true, true)] {
        let (x, y) = (if from_right { "-X 4" } else { "+X 4" }, if from_bottom { "+Y 3" } else { "-Y 3" });
        let rows: Vec<_> = order(3, from_bottom).flat_map(|y| order(4, from_right).map(move |x| (x, y))).collect();
        let columns: Vec<_> = order(4, from_right).flat_map(|x| order(3, from_bottom).map(move |y| (x, y))).collect();
        for (sizes, order) in [(format!("{y} {x}"), &rows), (format!("{x} {y}"), &columns)] {
            let turned = read(&sizes, order);
            assert_eq!((turned.width, turned.height, &turned.pixels), (4, 3, &usual.pixels), "{sizes}");
            let control = read("-Y 3 +X 4", order);
            assert_eq!(control.pixels == usual.pixels, sizes == "-Y 3 +X 4", "control: {sizes}");
        }
    }
}
