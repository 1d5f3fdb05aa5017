//! Open sheets of glass that end at opaque surfaces: water of a pool, and panes in frames.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | pool | the picture of a block of water in it, seen from above and from below, and with a lamp in it | a thin pane on the pool |
//! | frames | a window, a table and a skylight are thin panes | the water of a pool is none |

use caustica::{
    scene::{Environment, Scene},
    settings::Mode,
};
use glam::{Vec3, vec3};
use serde_json::{Value, json};
use support::{
    gltf::{lambert, loaded, push},
    meshes::{Mesh, file_of, glass_of, scene_of},
    *,
};

/// A pool with walls 0.3 m thick, its floor 0.9 m below its rim.
fn pool() -> Mesh {
    let wall = |a: [f32; 3], b: [f32; 3]| Mesh::block(Vec3::from(a), Vec3::from(b));
    wall([-1.5, -1.2, -1.3], [1.5, -0.9, 1.3])
        .with(&wall([-1.5, -0.9, -1.3], [-1.2, 0.0, 1.3]))
        .with(&wall([1.2, -0.9, -1.3], [1.5, 0.0, 1.3]))
        .with(&wall([-1.2, -0.9, -1.3], [1.2, 0.0, -1.0]))
        .with(&wall([-1.2, -0.9, 1.0], [1.2, 0.0, 1.3]))
}

/// A level sheet.
fn sheet(x: f32, y: f32, z: f32) -> Mesh {
    let positions = [(-x, z), (x, z), (x, -z), (-x, -z)].map(|(x, z)| vec3(x, y, z)).to_vec();
    Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

/// The light of the sky, or of a lamp in the water, above the pool or in it.
fn seen(water: &Mesh, material: Value, eye: Vec3, lamp: bool) -> (f64, Vec<String>) {
    let mut scene = scene_of(&[(pool(), 0), (water.clone(), 1)], &[lambert([0.6; 3]), material]);
    let at = |point: Vec3| point - scene.center.as_vec3();
    scene.environment = (!lamp).then(|| Environment::uniform(Vec3::ONE));
    scene.lights = if lamp { vec![point_light(at(vec3(0.3, -0.6, -0.2)), 2.0)] } else { Vec::new() };
    scene.cameras = vec![camera(at(eye), at(vec3(0.0, -0.9, -0.3)), 40.0)];
    let settings = settings(Mode::Hybrid, 30_000, 16).with(|s| s.photons.final_gather = 8);
    (mean(&render_scene(&scene, &settings)), scene.warnings)
}

#[test]
fn the_water_of_a_pool_fills_it() {
    let block = Mesh::block(vec3(-1.2, -0.9, -1.0), vec3(1.2, -0.25, 1.0));
    let covers = [
        (sheet(1.2, -0.25, 1.0), "the face of a solid that fills what lies behind"),
        (sheet(1.4, -0.25, 1.15), "the face of a solid that fills what lies behind"),
        (sheet(1.2, -0.25, 1.0).turned(), "faces what lies before it and was turned"),
    ];
    for (eye, lamp) in [(vec3(0.0, 1.3, 1.6), false), (vec3(0.2, -0.5, 0.8), false), (vec3(0.0, 1.3, 1.6), true)] {
        let (right, _) = seen(&block, glass_of(1.33), eye, lamp);
        let is_first = eye.y > 0.0 && !lamp;
        for (cover, said) in &covers[..if is_first { 3 } else { 1 }] {
            let (found, warnings) = seen(cover, glass_of(1.33), eye, lamp);
            assert!(within(found, right, 0.02), "{found} instead of {right} from {eye}, lamp {lamp}");
            assert!(warnings.iter().any(|line| line.contains(said)), "{warnings:?}");
        }
        let mut thin = glass_of(1.33);
        thin["extensions"].as_object_mut().expect("an object").remove("KHR_materials_volume");
        let (pane, _) = seen(&covers[0].0, thin, eye, lamp);
        assert!(!within(pane, right, 0.05), "control: a thin pane: {pane}, {right} from {eye}, lamp {lamp}");
    }
}

/// A closed room with a hole in its ceiling, and a frame of 1 m by 1 m in its middle.
fn room() -> Mesh {
    let wall = |a: [f32; 3], b: [f32; 3]| Mesh::block(Vec3::from(a), Vec3::from(b));
    let ceiling = wall([-2.0, 2.4, -2.0], [2.0, 2.5, -0.5])
        .with(&wall([-2.0, 2.4, 0.5], [2.0, 2.5, 2.0]))
        .with(&wall([-2.0, 2.4, -0.5], [-0.5, 2.5, 0.5]))
        .with(&wall([0.5, 2.4, -0.5], [2.0, 2.5, 0.5]));
    let walls = wall([-2.1, -0.1, -2.1], [2.1, 0.0, 2.1])
        .with(&wall([-2.1, 0.0, -2.1], [-2.0, 2.5, 2.1]))
        .with(&wall([2.0, 0.0, -2.1], [2.1, 2.5, 2.1]))
        .with(&wall([-2.0, 0.0, -2.1], [2.0, 2.5, -2.0]))
        .with(&wall([-2.0, 0.0, 2.0], [2.0, 2.5, 2.1]));
    let frame = wall([-0.55, 0.7, -0.55], [-0.5, 0.76, 0.55])
        .with(&wall([0.5, 0.7, -0.55], [0.55, 0.76, 0.55]))
        .with(&wall([-0.5, 0.7, -0.55], [0.5, 0.76, -0.5]))
        .with(&wall([-0.5, 0.7, 0.5], [0.5, 0.76, 0.55]));
    walls.with(&ceiling).with(&frame)
}

/// The scene with a camera at half the height of the room, or above it.
fn in_room(glass: &Mesh, ior: f32, height: f32) -> Scene {
    let mut file = file_of(&[(room(), 0), (glass.clone(), 1)], &[lambert([0.6; 3]), glass_of(ior)]);
    let lens = json!({ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.01 } });
    file["cameras"] = json!([lens]);
    let node = push(&mut file, "nodes", json!({ "camera": 0, "translation": [0.0, height, 1.5] }));
    file["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
    loaded(&file)
}

#[test]
fn panes_in_frames_are_thin() {
    let upright =
        |mesh: Mesh| Mesh { positions: mesh.positions.iter().map(|p| vec3(p.x, 0.73 + p.z, 0.0)).collect(), ..mesh };
    let is_pane = |scene: &Scene| scene.warnings.iter().any(|line| line.contains("taken for a thin pane"));
    let (table, skylight) = (sheet(0.5, 0.73, 0.5), sheet(0.5, 2.45, 0.5));
    assert!(is_pane(&in_room(&table, 1.5, 1.2)), "a table");
    assert!(is_pane(&in_room(&skylight, 1.5, 1.2)), "a skylight");
    assert!(is_pane(&in_room(&upright(sheet(0.5, 0.0, 0.5)), 1.5, 1.2)), "a window");
    // Controls: what closes the room from above is the face of what fills it, unless a camera looks
    // at glass from below.
    assert!(!is_pane(&in_room(&skylight, 1.5, 4.0)), "control: seen from above");
    assert!(!is_pane(&in_room(&skylight, 1.33, 1.2)), "control: water seen from below");
}
