//! Rays that need more loops than an invocation has.
//!
//! | test | right | negative control |
//! |---|---|---|
//! | pictures | the same bits, whether rays need one dispatch or many | rays that are given up |
//! | crowds | no ray is given up in 9,000 sheets, behind which a wall is seen | one dispatch alone |

use caustica::{
    gpu::Gpu,
    progress::Silent,
    renderer::render,
    scene::{LoadOptions, Scene},
    settings::Mode,
};
use glam::{Vec3, vec3};
use serde_json::json;
use support::{
    gltf::{lambert, push, read_with},
    meshes::{Mesh, file_of, glass_of, scene_of},
    *,
};

/// Glass, rough metal, matt balls that are one shared mesh, and a lamp, in a box.
fn scene_of_all() -> Scene {
    let metal = json!({ "pbrMetallicRoughness": { "roughnessFactor": 0.3, "baseColorFactor": [0.9, 0.7, 0.5, 1] } });
    let lamp = json!({ "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] }, "emissiveFactor": [1, 1, 1] });
    let ball = |x: f32, y: f32, z: f32| Mesh::ball(vec3(x, y, z), 0.3, 24);
    let meshes = [
        (Mesh::block(Vec3::splat(-1.0), Vec3::ONE).turned(), 0),
        (ball(-0.4, -0.6, -0.2), 1),
        (ball(0.4, -0.6, 0.2), 2),
        (Mesh::block(vec3(-0.3, 0.97, -0.3), vec3(0.3, 0.99, 0.3)), 3),
        (ball(0.0, 0.2, -0.5), 0),
    ];
    let mut file = file_of(&meshes, &[lambert([0.7; 3]), glass_of(1.5), metal, lamp]);
    let node = push(&mut file, "nodes", json!({ "mesh": 4, "translation": [0.5, 0.2, 0.1] }));
    file["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
    let mut scene = read_with(&file, &LoadOptions { share_from: 0, ..LoadOptions::default() }).expect("a scene");
    assert_eq!(scene.instances.len(), 2, "the balls share a mesh");
    scene.cameras = vec![camera(vec3(0.0, 0.0, 0.95), Vec3::ZERO, 80.0)];
    scene.lights.push(point_light(vec3(-0.5, 0.5, 0.1), 0.3));
    scene
}

#[test]
fn rays_of_many_dispatches_find_the_same() {
    let scene = scene_of_all();
    let short = Gpu::open(std::env::var("CAUSTICA_DEVICE").ok().as_deref()).expect("tests need an adapter");
    let short = short.with_trace_budget(16);
    for mode in [Mode::Hybrid, Mode::Photons] {
        let settings = settings(mode, 500, 8).with(|s| s.estimate.raw = true);
        let whole = render_scene(&scene, &settings);
        let in_parts = render(&short, &scene, &settings, &Silent).expect("the scene renders");
        assert_eq!(in_parts.stats.unfinished_rays, 0);
        assert_eq!(in_parts.stats.rays, whole.stats.rays);
        assert_eq!(in_parts.frame, whole.frame, "{mode:?}");
    }
}

/// A wall behind as many sheets of next to nothing.
fn sheets(count: u32) -> Scene {
    let far = |z: f32| [(-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)].map(|(x, y)| vec3(x, y, z));
    let flat = |planes: &mut dyn Iterator<Item = f32>| {
        let positions: Vec<Vec3> = planes.flat_map(far).collect();
        let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Mesh { positions, triangles }
    };
    let film = json!({ "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 1e-7] }, "alphaMode": "BLEND" });
    let wall = (flat(&mut std::iter::once(-1.5)), 0);
    let before = (count > 0).then(|| (flat(&mut (0..count).map(|i| -1e-4 * i as f32)), 1));
    let meshes: Vec<(Mesh, usize)> = std::iter::once(wall).chain(before).collect();
    let mut scene = scene_of(&meshes, &[lambert([0.7; 3]), film]);
    let middle = scene.center.as_vec3();
    scene.cameras = vec![camera(Vec3::Z - middle, Vec3::ZERO - middle, 40.0)];
    scene.lights.push(point_light(vec3(0.2, 0.3, 1.0) - middle, 10.0));
    scene
}

#[test]
fn no_ray_is_given_up_in_a_crowd() {
    let settings = settings(Mode::DirectRays, 1, 2);
    let scene = sheets(9000);
    let crowd = render_scene(&scene, &settings);
    assert_eq!(crowd.stats.unfinished_rays, 0);
    // All sheets together take a thousandth of the light.
    let right = mean(&render_scene(&sheets(0), &settings));
    assert!(within(mean(&crowd), right, 2e-3), "{} behind the sheets, {right} without", mean(&crowd));
    let through = [(Vec3::Z - scene.center.as_vec3(), Vec3::NEG_Z)];
    let once = rays::trace(&scene, &[("TRACE_BUDGET", 8000.0)], &through).0.unfinished;
    assert_eq!(once, 1, "control: one dispatch is not enough");
}
