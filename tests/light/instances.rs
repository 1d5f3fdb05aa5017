//! Meshes that instances share: the pictures of scenes in which every copy has its own triangles.
//!
//! | test | right | negative control |
//! |---|---|---|
//! | pictures | those of the same file with copies of their own | one instance 5 mm aside |
//! | materials | the same for textures, normal maps, masks, mirrors | as above |
//! | contacts | a floor of instances in the plane of a larger one | a floor 1 mm below |

use std::f32::consts::PI;

use caustica::{
    scene::{LoadOptions, Scene},
    settings::{Mode, Settings},
};
use glam::{Mat4, Quat, Vec3, vec3};
use serde_json::{Value, json};
use support::{
    gltf::{lambert, push, read_with},
    meshes::{Mesh, file_of},
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
    let settings: Settings = settings(mode, 30_000, 64);
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
    for mode in [Mode::DirectRays, Mode::Hybrid, Mode::Photons] {
        let right = picture(&copied, mode);
        let (found, control) = (picture(&shared, mode), picture(&aside, mode));
        let (found, control) = (difference(&found, &right), difference(&control, &right));
        println!("{mode:?} {found:e} {control:e}");
    }
}
