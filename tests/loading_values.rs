//! How materials, lights and cameras are read, and what is said about them.

mod gltf;

use caustica::scene::{Projection, Surface};
use caustica::settings::LightUnit;
use glam::Vec3;
use gltf::{lambert, loaded, triangle};
use serde_json::{Value, json};

/// The surface that a material is read as, and what is said about it.
fn read_as(material: Value) -> (Surface, Vec<String>) {
    let mut gltf = triangle();
    gltf["materials"][0] = material;
    let scene = loaded(&gltf);
    (scene.materials[0].surface, scene.warnings)
}

#[test]
fn materials_are_read_as_the_nearest_surface() {
    let quiet = |material: Value| {
        let (surface, notes) = read_as(material);
        assert_eq!(notes, [""; 0]);
        surface
    };
    assert_eq!(quiet(lambert([0.5, 0.25, 0.125])), Surface::Diffuse { albedo: Vec3::new(0.5, 0.25, 0.125) });
    let gold = json!({ "metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [1, 0.8, 0.3, 1] });
    assert_eq!(quiet(json!({ "pbrMetallicRoughness": gold })), Surface::Mirror { tint: Vec3::new(1.0, 0.8, 0.3) });
    let clear = json!({ "metallicFactor": 0, "roughnessFactor": 0 });
    let mut glass = json!({ "name": "g", "pbrMetallicRoughness": clear, "extensions": {
        "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_volume": { "thicknessFactor": 0.1 } } });
    assert_eq!(quiet(glass.clone()), Surface::Glass { ior: 1.5, tint: Vec3::ONE });
    glass["extensions"]["KHR_materials_ior"] = json!({ "ior": 1.33 });
    assert_eq!(quiet(glass.clone()), Surface::Glass { ior: 1.33, tint: Vec3::ONE });
    glass["extensions"]["KHR_materials_volume"]["thicknessFactor"] = 0.into();
    assert_eq!(quiet(glass.clone()), Surface::Pane { ior: 1.33, tint: Vec3::ONE });

    glass["pbrMetallicRoughness"]["roughnessFactor"] = 0.25.into();
    let (surface, notes) = read_as(glass.clone());
    assert_eq!(surface, Surface::Pane { ior: 1.33, tint: Vec3::ONE });
    assert_eq!(notes, [r#"material "g": roughness 0.25 is read as 0 until rough materials come"#]);
    glass["pbrMetallicRoughness"]["roughnessFactor"] = 0.01.into();
    assert_eq!(read_as(glass).1, [r#"material "g": roughness 0.01 is small enough to be perfectly smooth"#]);
    let (surface, notes) = read_as(json!({ "name": "m", "emissiveFactor": [1, 0, 0] }));
    assert_eq!(surface, Surface::Diffuse { albedo: Vec3::ONE });
    assert_eq!(
        notes,
        [
            r#"material "m" (metallic 1, roughness 1) is read as diffuse until rough materials come"#,
            r#"material "m": emission is not read yet"#
        ]
    );
    let (_, notes) =
        read_as(json!({ "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorTexture": { "index": 0 } } }));
    assert_eq!(
        notes,
        [
            "the specular coat of dielectrics is not read yet: their base colour alone is diffuse",
            "textures are not read yet: factors alone are used"
        ]
    );
}

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
    assert!((light.power(1.0).x / (4.0 * std::f32::consts::PI * 683.0) - 1.0).abs() < 1e-6);
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
    assert_eq!(error, r#"camera 1: test.gltf has the cameras 0 "view""#);

    gltf["scenes"][0]["nodes"] = json!([0, 1]);
    let scene = loaded(&gltf);
    assert_eq!(scene.warnings, ["no camera: one is made that frames the whole scene"]);
    let camera = scene.camera(None).expect("a framing camera");
    let sees = |p: Vec3| {
        let v = p - camera.position;
        let half = camera.projection.half_height_at(v.dot(camera.forward));
        v.dot(camera.up).abs().max(v.dot(camera.right).abs()) <= half
    };
    assert!(scene.triangles[0].positions.iter().all(|p| sees(*p)));
    assert!(!sees(Vec3::new(0.0, 3.0, 0.0)), "not everything is in view");
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
    insta::assert_snapshot!(loaded(&triangle()).describe().to_string().replace(&loaded(&triangle()).hash, "HASH"), @r#"
    test.gltf
      sha256     HASH
      meshes     1
      triangles  1
      spheres    0
      bounds     0 0 0 .. 1 1 0 m
      point lights (1)
        0  lamp  at 0 0 2  12.5664 12.5664 12.5664 W
      cameras (1)
        0  view  at 0 0 3  yfov 34.38°
      materials (1)
        0  paint  diffuse (0.5 0.25 0.125)
      notes (0)
    "#);
}
