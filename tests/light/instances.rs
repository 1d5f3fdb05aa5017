//! Meshes that instances share: the pictures of scenes in which every copy has its own triangles.
//!
//! | test | right | negative control |
//! |---|---|---|
//! | pictures | those of the same file with copies of their own | one instance 5 mm aside |
//! | materials | the same for textures, normal maps, masks, mirrors | as above |
//! | far away | the scene near the origin | |
//! | contacts | squares in the plane of a floor: those just above it | below it |

use std::f32::consts::PI;

use caustica::{
    scene::{LoadOptions, Scene},
    settings::{Mode, Settings},
};
use glam::{Mat4, Quat, Vec3, vec3};
use serde_json::{Value, json};
use support::{
    gltf::{add_accessor, data_uri, floats, lambert, push, read_with},
    meshes::{Mesh, file_of, glass_of},
    *,
};

/// A knobbly thing of about 500 triangles that stands on the ground.
fn knob() -> Mesh {
    let ring = |k: u32| {
        let height = k as f32 / 16.0;
        (0.3 * (PI * height).sin() * (1.0 + 0.3 * (9.0 * height).cos()), height)
    };
    let inner: Vec<(f32, f32)> = (1..16).map(ring).collect();
    Mesh::lathe(Vec3::ZERO, &[&[(0.0, 0.0)], &inner[..], &[(0.0, 1.0)]].concat(), 16)
}

/// Places of the copies: turned, scaled, mirrored and sheared.
fn places() -> Vec<Mat4> {
    let place = |i: u32| {
        let at = vec3((i % 5) as f32 - 2.0, 0.0, (i / 5) as f32 - 2.0);
        let turned = Mat4::from_rotation_translation(Quat::from_rotation_y(0.7 * i as f32), at);
        let mut own = Mat4::from_scale(Vec3::splat(0.6 + 0.02 * i as f32));
        match i % 4 {
            1 => own = Mat4::from_scale(vec3(-0.7, 0.8, 0.6)),
            2 => own.y_axis.x = 0.4,
            _ => {}
        }
        turned * own
    };
    (0..25).map(place).collect()
}

/// The same up to rounding: how far copies in these differ tells what rounding does to a picture.
fn nudged() -> Vec<Mat4> {
    places().iter().map(|place| Mat4::from_scale(Vec3::splat(1.0 + 3e-7)) * *place).collect()
}

/// A floor, a lamp, and a node for each of the places of a mesh.
fn file(mesh: Mesh, material: Value, places: &[Mat4]) -> Value {
    let lamp = json!({ "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] }, "emissiveFactor": [1, 1, 1] });
    let floor = Mesh::block(vec3(-3.0, -0.5, -3.0), vec3(3.0, 0.0, 3.0));
    let above = Mesh::block(vec3(-1.0, 4.0, -1.0), vec3(1.0, 4.2, 1.0));
    let materials = [material, lambert([0.6; 3]), lamp];
    let mut file = file_of(&[(floor, 1), (above, 2), (mesh, 0)], &materials);
    let shown = file["nodes"].as_array_mut().expect("a list").pop().expect("the mesh");
    file["scenes"][0]["nodes"].as_array_mut().expect("a list").pop();
    for place in places {
        let node = push(&mut file, "nodes", json!({ "mesh": shown["mesh"], "matrix": place.to_cols_array() }));
        file["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
    }
    file
}

/// The scene with instances, and with copies.
fn both(file: &Value) -> [Scene; 2] {
    [0, usize::MAX].map(|share_from| {
        let mut scene = read_with(file, &LoadOptions { share_from, ..LoadOptions::default() }).expect("a scene");
        let middle = scene.center.as_vec3();
        scene.cameras = vec![camera(vec3(1.5, 3.5, 4.0) - middle, vec3(0.0, 0.2, 0.0) - middle, 60.0)];
        scene
    })
}

fn picture(scene: &Scene, mode: Mode) -> Vec<f64> {
    let settings: Settings = settings(mode, 30_000, 48);
    let render = render_scene(scene, &settings);
    assert_eq!(render.stats.unfinished_rays, 0);
    render.frame.radiance().iter().flatten().map(|x| f64::from(*x)).collect()
}

/// Mean squared relative difference of two pictures.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2) / (b * b + 0.01)).sum::<f64>() / a.len() as f64
}

#[test]
fn instances_give_the_picture_of_copies() {
    let file_at = |places: &[Mat4]| file(knob(), lambert([0.7, 0.4, 0.2]), places);
    let [shared, copied] = both(&file_at(&places()));
    assert_eq!((shared.instances.len(), shared.meshes.len()), (25, 2), "one of them mirrored");
    assert_eq!((copied.instances.len(), copied.meshes.len()), (0, 0));
    assert_eq!(shared.triangle_count(), copied.triangles.len());
    let mut moved = places();
    moved[12] = Mat4::from_translation(vec3(0.005, 0.0, 0.0)) * moved[12];
    let [aside, _] = both(&file_at(&moved));
    let [_, nudged] = both(&file_at(&nudged()));
    for mode in [Mode::DirectRays, Mode::Hybrid] {
        let right = picture(&copied, mode);
        let [found, rounding, control] =
            [&shared, &nudged, &aside].map(|scene| difference(&picture(scene, mode), &right));
        let few = 1e-10 + 3.0 * rounding;
        assert!(found < few, "{mode:?}: {found:e}, of rounding {rounding:e}");
        assert!(mode != Mode::DirectRays || control > 1e-6, "control: {control:e}");
    }
}

/// Gives the mesh texture coordinates, and its material textures with holes and a normal map.
fn textured(file: &mut Value, mirror: bool) {
    let primitive = &mut file["meshes"][2]["primitives"][0];
    let positions = primitive["attributes"]["POSITION"].as_u64().expect("an index") as usize;
    let count = file["accessors"][positions]["count"].as_u64().expect("a count") as usize;
    let uvs: Vec<f32> = (0..count).flat_map(|i| [(i % 16) as f32 / 16.0, (i / 16) as f32 / 16.0]).collect();
    let uvs = add_accessor(file, &floats(&uvs), 5126, count, "VEC2");
    file["meshes"][2]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    let picture = |texel: fn(u32, u32) -> [u8; 4]| {
        let image = image::RgbaImage::from_fn(8, 8, |x, y| image::Rgba(texel(x, y)));
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).expect("a picture");
        let uri = format!("data:image/png;base64,{}", data_uri(bytes.get_ref()).rsplit(',').next().expect("the data"));
        json!({ "uri": uri })
    };
    let color = picture(|x, y| [30 * x as u8, 200, 30 * y as u8, if (x + y) % 3 == 0 { 0 } else { 255 }]);
    let normal = picture(|x, y| [100 + 7 * x as u8, 100 + 8 * y as u8, 220, 255]);
    file["images"] = json!([color, normal]);
    file["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
    let metallic = u32::from(mirror);
    file["materials"][0] = json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicFactor": metallic, "roughnessFactor": 0.3 },
        "normalTexture": { "index": 1 }, "alphaMode": "MASK", "doubleSided": true,
    });
}

#[test]
fn textures_normal_maps_and_masks_lie_on_instances_as_on_copies() {
    for mirror in [false, true] {
        let picture_of = |of: fn(&mut Scene)| {
            let mut file = file(knob(), lambert([0.5; 3]), &places());
            textured(&mut file, mirror);
            both(&file).map(|mut scene| {
                of(&mut scene);
                picture(&scene, Mode::DirectRays)
            })
        };
        let [shared, copied] = picture_of(|_| {});
        // Tangents are rounded to 16 bits before they are moved, not afterwards.
        let found = difference(&shared, &copied);
        assert!(found < 1e-5, "metal {mirror}: {found:e}");
        // Control: tangents that are turned.
        let [turned, _] = picture_of(|scene| {
            scene.attributes.iter_mut().flat_map(|a| &mut a.tangents).for_each(|t| *t = -*t);
        });
        let control = difference(&turned, &copied);
        assert!(control > 1e-5, "control: {control:e}");
    }
}

/// Instances of a square in the plane of a floor are seen as a whole; with holes before without,
/// smaller before larger.
#[test]
fn instances_lie_in_the_plane_of_others() {
    let square = || Mesh {
        positions: [vec3(0.0, 0.0, 0.0), Vec3::Z, vec3(1.0, 0.0, 1.0), Vec3::X].to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let places: Vec<Mat4> = (0..16)
        .map(|i| {
            let turn = Quat::from_rotation_y(0.3 + i as f32);
            Mat4::from_rotation_translation(turn, vec3((i % 4) as f32 * 1.3 - 2.0, 0.0, (i / 4) as f32 * 1.3 - 2.0))
        })
        .collect();
    let lit = |height: f32| {
        let lifted: Vec<Mat4> = places.iter().map(|m| Mat4::from_translation(Vec3::Y * height) * *m).collect();
        both(&file(square(), lambert([0.1, 0.3, 0.9]), &lifted)).map(|scene| picture(&scene, Mode::DirectRays))
    };
    let ([shared, copied], [above, _]) = (lit(0.0), lit(1e-4));
    assert!(difference(&copied, &above) < 1e-6, "copies: {:e}", difference(&copied, &above));
    assert!(difference(&shared, &above) < 1e-6, "instances: {:e}", difference(&shared, &above));
    let [_, below] = lit(-1e-3);
    assert!(difference(&below, &above) > 1e-3, "control: below the floor they are not seen");
}

/// A place far from the origin, and coordinates of a mesh that lie far from its own.
#[test]
fn instances_far_away_have_no_gaps() {
    let far = vec3(3000.0, 0.0, -2000.0);
    let mesh = Mesh { positions: knob().positions.iter().map(|p| *p + far).collect(), ..knob() };
    let placed: Vec<Mat4> = places().iter().map(|m| *m * Mat4::from_translation(-far)).collect();
    let [near, _] = both(&file(knob(), lambert([0.7; 3]), &places()));
    let [shared, copied] = both(&file(mesh, lambert([0.7; 3]), &placed));
    let right = picture(&near, Mode::DirectRays);
    // Rounding of the file's own numbers: a tenth of a millimetre.
    for (name, scene) in [("instances", shared), ("copies", copied)] {
        let found = difference(&picture(&scene, Mode::DirectRays), &right);
        assert!(found < 3e-4, "{name}: {found:e}");
    }
}

#[test]
fn flat_and_stretched_copies_are_held_for_themselves() {
    let mut all = places();
    all[3] *= Mat4::from_scale(vec3(1.0, 0.0, 1.0));
    all[4] *= Mat4::from_scale(vec3(1.0, 1e-6, 1.0));
    all.push(all[7]);
    let [shared, copied] = both(&file(knob(), lambert([0.7; 3]), &all));
    assert_eq!(shared.instances.len(), 23, "two of 26 for themselves, one is there twice");
    assert_eq!(shared.triangle_count(), copied.triangle_count());
    assert_eq!(shared.warnings, copied.warnings);
    assert!(shared.warnings.iter().any(|w| w.starts_with("1 copies of meshes")), "{:?}", shared.warnings);
}

#[test]
fn lamps_and_glass_are_not_shared() {
    let lamp = json!({ "emissiveFactor": [1, 1, 1] });
    for material in [lamp, glass_of(1.5)] {
        let [shared, _] = both(&file(knob(), material, &places()));
        assert_eq!((shared.instances.len(), shared.meshes.len()), (0, 0));
    }
    let few = file(knob(), lambert([0.7; 3]), &places());
    assert_eq!(read_with(&few, &LoadOptions::default()).expect("a scene").instances.len(), 0, "control: a small scene");
}
