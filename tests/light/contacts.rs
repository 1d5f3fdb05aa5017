//! Surfaces that lie in each other, one of them a lamp, and copies in one place.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | lamp in a ceiling | irradiance below the middle of a square lamp; its own radiance is seen | a lamp behind the ceiling |
//! | back to back | each lamp is seen from its side | both face up |
//! | copies | the scene with one copy | a copy aside |

use std::f64::consts::PI;

use caustica::{
    scene::{Scene, Triangle},
    settings::{ExtraLayers, Mode},
};
use glam::{Quat, Vec3, vec3};
use serde_json::json;
use support::{
    gltf::{lambert, loaded, push, triangle},
    meshes::{Mesh, scene_of},
    *,
};

/// Part of the light of a square lamp that reaches a point below its middle: half side over
/// distance (Modest 2013, "Radiative Heat Transfer", configuration 11 of appendix D, four times).
fn form_factor(half: f64, distance: f64) -> f64 {
    let x = half / distance;
    let y = (1.0 + x * x).sqrt();
    4.0 / PI * x / y * (x / y).atan()
}

/// A floor and a ceiling, with a lamp that lies `above` the ceiling's plane; in one order or the
/// other, tilted as a whole.
fn scene_with_lamp(half: f32, distance: f32, above: f32, lamp_first: bool, tilt: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    scene.materials.push(emissive("lamp", 0.0, 10.0, false));
    let square = |half: f32, height: f32| {
        let corner = vec3(-half, height, -half);
        (corner, Vec3::X * 2.0 * half, Vec3::Z * 2.0 * half)
    };
    // Both look down; the ceiling is larger and cut elsewhere.
    let (lamp, ceiling) = (square(half, distance + above), square(3.7 * half, distance));
    let mut add = |(corner, x, z): (Vec3, Vec3, Vec3), material| add_quad(&mut scene, corner, x, z, material);
    if lamp_first {
        add(lamp, 1);
    }
    add(ceiling, 0);
    if !lamp_first {
        add(lamp, 1);
    }
    let (corner, x, z) = square(4.0 * half, 0.0);
    add_quad(&mut scene, corner, z, x, 0);
    let turn = Quat::from_euler(glam::EulerRot::XYZ, tilt, 0.7 * tilt, 0.4 * tilt);
    let turned = |t: &Triangle| Triangle {
        positions: t.positions.map(|p| turn * p),
        normals: t.normals.map(|n| turn * n),
        ..*t
    };
    scene.triangles = scene.triangles.iter().map(turned).collect();
    let eye = turn * vec3(0.0, 0.4 * distance, 0.0);
    scene.cameras =
        [vec3(0.001, 0.0, 0.0), vec3(0.001, distance, 0.0)].map(|target| camera(eye, turn * target, 4.0)).to_vec();
    scene
}

#[test]
fn a_lamp_in_the_plane_of_a_ceiling_shines_whatever_the_order() {
    for (half, distance, tilt) in [(1.5, 1.0, 0.0), (0.8, 0.7, 0.6), (0.3, 0.9, 2.0)] {
        let right = 5.0 * form_factor(f64::from(half), f64::from(distance));
        let picture = |scene: &Scene, camera: usize, mode: Mode| {
            let settings = settings(mode, 50_000, 8).with(|s| {
                s.picture.camera = Some(camera.to_string());
                s.picture.light_samples = 64;
                s.estimate.neighbors = 200;
            });
            mean(&render_scene(scene, &settings))
        };
        // The same photons leave a lamp that hangs free, below its ceiling by a tenth of a
        // millimetre.
        let alone = picture(&scene_with_lamp(half, distance, -1e-4, true, tilt), 0, Mode::DirectPhotons);
        for lamp_first in [true, false] {
            let scene = scene_with_lamp(half, distance, 0.0, lamp_first, tilt);
            let (floor, lamp) = (picture(&scene, 0, Mode::DirectRays), picture(&scene, 1, Mode::DirectRays));
            assert!(within(floor, right, 0.01), "half {half}: {floor} instead of {right}");
            assert!(within(lamp, 10.0, 1e-4), "half {half}: {lamp} is seen of the lamp");
            let photons = picture(&scene, 0, Mode::DirectPhotons);
            assert!(within(photons, alone, 1e-3), "half {half}: {photons} by photons, {alone} without the ceiling");
        }
        let hidden = scene_with_lamp(half, distance, 0.01, true, tilt);
        assert!(picture(&hidden, 0, Mode::DirectRays) < 0.01, "control: a lamp a centimetre behind the ceiling");
    }
}

#[test]
fn a_lamp_twice_in_one_place_shines_once() {
    // The second lamp is brighter, of a material and a mesh of its own, and has its corners in
    // another order.
    let lamps = |second: Option<([u32; 3], f32)>| {
        let quad = |order: [u32; 3], height: f32| Mesh {
            positions: vec![vec3(-1.0, height, -1.0), vec3(1.0, height, -1.0), vec3(0.0, height, 1.0)],
            triangles: vec![order],
        };
        let mut floor = quad([0, 2, 1], 0.0);
        floor.positions.iter_mut().for_each(|p| *p *= 5.0);
        let mut meshes = vec![(floor, 0), (quad([0, 1, 2], 1.0), 1)];
        meshes.extend(second.map(|(order, height)| (quad(order, height), 2)));
        let lamp = |emission: f32| json!({ "emissiveFactor": vec![emission; 3], "pbrMetallicRoughness": { "metallicFactor": 0 } });
        let mut scene = scene_of(&meshes, &[lambert([0.5; 3]), lamp(0.5), lamp(1.0)]);
        scene.cameras = vec![camera(vec3(0.0, 0.2, 0.001), Vec3::ZERO, 30.0)];
        scene
    };
    let once = lamps(None);
    let power = |scene: &Scene| {
        let of = |mode| mean(&render_scene(scene, &settings(mode, 20_000, 6)));
        [of(Mode::DirectRays), of(Mode::DirectPhotons)]
    };
    let right = power(&once);
    let twice = lamps(Some(([1, 2, 0], 1.0)));
    assert_eq!(power(&twice), right);
    assert!(
        twice.warnings.iter().any(|line| line.starts_with("1 emissive triangles lie in others")),
        "{:?}",
        twice.warnings
    );
    // A matrix that is rounded leaves a part of a micrometre between them.
    for height in [1.000_000_6, 0.999_999_3] {
        let near = power(&lamps(Some(([1, 2, 0], height))));
        assert!(near.iter().zip(right).all(|(a, b)| within(*a, b, 1e-4)), "at {height}: {near:?}, {right:?}");
    }
    // Overlapping in part, each shines, and it is said.
    let warned = |scene: &Scene| {
        let stats = render_scene(scene, &settings(Mode::DirectRays, 1000, 6)).stats;
        stats.warnings.iter().any(|line| line.contains("emissive surfaces lie in each other in part"))
    };
    let mut part = lamps(Some(([1, 2, 0], 1.0)));
    assert!(!warned(&part), "control: exactly in each other");
    let aside = part.triangles[1];
    let moved = |t: &Triangle| Triangle { positions: t.positions.map(|p| p + vec3(0.3, 0.0, 0.0)), material: 2, ..*t };
    part.triangles.push(moved(&aside));
    assert!(warned(&part));
    // In light groups of their own as well.
    let apart = settings(Mode::DirectRays, 1000, 6).with(|s| s.picture.layers = vec![ExtraLayers::Lights]);
    let warnings = render_scene(&part, &apart).stats.warnings;
    assert!(warnings.iter().any(|line| line.contains("emissive surfaces lie in each other in part")), "{warnings:?}");
    let apart = power(&lamps(Some(([1, 2, 0], 0.9))));
    assert!(apart[0] > 1.5 * right[0], "control: a lamp below it adds light: {apart:?}");
}

#[test]
fn lamps_back_to_back_are_seen_from_both_sides() {
    // One faces up, the other down or up as well; in one order or the other.
    let seen = |down: bool, swapped: bool, eye: f32| {
        let mut scene = scene(&[]);
        scene.materials = vec![emissive("up", 0.0, 4.0, false), emissive("other", 0.0, 7.0, false)];
        let (corner, x, z) = (vec3(-0.6, 0.3, -0.6), 1.2 * Vec3::X, 1.2 * Vec3::Z);
        let other = |scene: &mut Scene| {
            let (a, b) = if down { (x, z) } else { (z, x) };
            add_quad(scene, corner, a, b, 1);
        };
        if swapped {
            other(&mut scene);
        }
        add_quad(&mut scene, corner, z, x, 0);
        if !swapped {
            other(&mut scene);
        }
        scene.triangles.iter_mut().zip(0..).for_each(|(triangle, i)| triangle.object = i / 2);
        scene.objects = vec!["a".into(), "b".into()];
        scene.cameras = vec![camera(vec3(0.0, eye, 0.001), vec3(0.0, 0.3, 0.0), 20.0)];
        let render = render_scene(&scene, &settings(Mode::DirectRays, 1000, 6));
        (mean(&render), render.stats.warnings.iter().any(|line| line.contains("lie in each other")))
    };
    for swapped in [false, true] {
        assert_eq!(seen(true, swapped, 2.0), (4.0, false), "from above");
        assert_eq!(seen(true, swapped, -2.0), (7.0, false), "from below");
        assert_eq!(seen(false, swapped, -2.0), (0.0, true), "control: both face up");
    }
}

#[test]
fn copies_in_one_place_are_there_once() {
    let copies = |count: usize, aside: f32| {
        let mut file = triangle();
        for _ in 0..count {
            let node = push(&mut file, "nodes", json!({ "mesh": 0, "translation": [aside, 0, 0] }));
            file["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
        }
        loaded(&file)
    };
    let (one, many) = (copies(0, 0.0), copies(4000, 0.0));
    assert_eq!(one.triangles, many.triangles);
    assert_eq!(many.warnings, ["4000 copies of meshes lie exactly where others do and are not drawn"]);
    assert_eq!(copies(3, 0.5).triangles.len(), 2, "control: three copies aside are one");
    let count = |scene: &Scene| render_scene(scene, &settings(Mode::Hybrid, 1000, 8)).stats.unfinished_rays;
    assert_eq!(count(&many), 0);
}
