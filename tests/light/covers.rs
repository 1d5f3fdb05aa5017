//! Open sheets of glass that end at opaque surfaces: water of a pool, and panes in frames.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | pool | the picture of a block of water in it, seen from above and from below, and with a lamp in it | a thin pane on the pool |
//! | opaque parts | the picture of the same glass with a face of its own there, from outside and inside, and with lamps | a thin pane |
//! | bubble | the same bubble in a block of water | none, and a solid one |
//! | copies of a basin | what it holds is the same solid, however many share its mesh | a basin that is too wide |
//! | frames | a window, a table and a skylight are thin panes | the water of a pool is none |

use caustica::{
    scene::{Environment, LoadOptions, Scene},
    settings::Mode,
};
use glam::{Vec3, vec3};
use serde_json::{Value, json};
use support::{
    gltf::{lambert, loaded, push, read_with},
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
    let settings = settings(Mode::Hybrid, 20_000, 12).with(|s| s.photons.final_gather = 8);
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

/// Water with waves along z in the pool: its surface, and a solid.
fn waves() -> [Mesh; 2] {
    const STEPS: u32 = 40;
    let mut solid = Mesh::default();
    for j in 0..=STEPS {
        let z = -1.0 + 2.0 * j as f32 / STEPS as f32;
        let top = -0.25 + 0.06 * (9.0 * z).sin();
        solid.positions.extend([vec3(-1.2, -0.9, z), vec3(-1.2, top, z), vec3(1.2, -0.9, z), vec3(1.2, top, z)]);
    }
    let mut surface = solid.clone();
    let quad = |mesh: &mut Mesh, [a, b, c, d]: [u32; 4]| mesh.triangles.extend([[a, b, c], [a, c, d]]);
    for i in (0..STEPS).map(|j| 4 * j) {
        let top = [i + 5, i + 7, i + 3, i + 1];
        quad(&mut surface, top);
        for face in [top, [i, i + 2, i + 6, i + 4], [i + 6, i + 2, i + 3, i + 7], [i, i + 4, i + 5, i + 1]] {
            quad(&mut solid, face);
        }
    }
    let end = 4 * STEPS;
    quad(&mut solid, [end, end + 2, end + 3, end + 1]);
    quad(&mut solid, [2, 0, 1, 3]);
    [surface, solid]
}

/// A dome, from its foot up.
fn dome() -> Vec<(f32, f32)> {
    let angle = |k: u32| k as f32 * std::f32::consts::FRAC_PI_2 / 12.0;
    (0..=12).map(|k| (if k == 12 { 0.0 } else { angle(k).cos() }, angle(k).sin())).collect()
}

#[test]
fn glass_that_an_opaque_part_closes_begins_at_its_own_front() {
    let block = Mesh::block(vec3(-0.5, 0.0, -0.5), vec3(0.5, 0.8, 0.5));
    let mut open_block = block.clone();
    // The face that looks down.
    open_block.triangles.drain(4..6);
    let [surface, water] = waves();
    let whole_dome = Mesh::lathe(Vec3::ZERO, &[vec![(0.0, 0.0)], dome()].concat(), 24);
    let base = Mesh::block(vec3(-1.1, -0.2, -1.1), vec3(1.1, 0.0, 1.1));
    let at = |x: f32, y: f32, z: f32| vec3(x, y, z);
    for (name, open, whole, part, eyes) in [
        ("dome", Mesh::lathe(Vec3::ZERO, &dome(), 24), whole_dome, base.clone(), [at(0., 0.6, 4.), at(0.1, 0.4, 0.1)]),
        ("block", open_block.clone(), block.clone(), base.clone(), [at(1.2, 1.5, 3.), at(0.1, 0.3, 0.1)]),
        ("waves", surface, water, pool(), [at(0., 0.3, 2.), at(0.2, -0.5, 0.8)]),
    ] {
        for eye in eyes {
            let picture = |glass: &Mesh| {
                let mut scene =
                    scene_of(&[(part.clone(), 0), (glass.clone(), 1)], &[lambert([0.2; 3]), glass_of(1.33)]);
                let place = |point: Vec3| point - scene.center.as_vec3();
                let cameras = vec![camera(place(eye), place(vec3(0.0, 0.0, -0.4)), 50.0)];
                (scene.environment, scene.cameras) = (Some(Environment::uniform(Vec3::ONE)), cameras);
                render_scene(&scene, &settings(Mode::DirectRays, 1000, 16)).frame.radiance().to_vec()
            };
            let (found, right) = (picture(&open), picture(&whole));
            let of = |pixels: &[[f32; 3]]| pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / pixels.len() as f64;
            assert!(within(of(&found), of(&right), 0.005), "{name} from {eye}: {} for {}", of(&found), of(&right));
            let brightest = found.iter().map(|p| p[1]).fold(0.0, f32::max);
            let sky = if eye == eyes[0] { 1.0 } else { 1.33_f32.powi(2) };
            assert!(brightest < 1.001 * sky, "{name} from {eye}: {brightest}");
        }
    }
    // Light of a lamp on the part that closes the block, seen in the glass.
    let lit = |glass: &Mesh, lamp: f32, material: Value| {
        let mut scene = scene_of(&[(base.clone(), 0), (glass.clone(), 1)], &[lambert([0.5; 3]), material]);
        let place = |point: Vec3| point - scene.center.as_vec3();
        let lights = vec![point_light(place(vec3(0.0, lamp, 0.0)), 1.0)];
        let cameras = vec![camera(place(vec3(0.0, 0.3, 0.001)), place(Vec3::ZERO), 40.0)];
        (scene.lights, scene.cameras) = (lights, cameras);
        mean(&render_scene(&scene, &settings(Mode::Hybrid, 50_000, 16).with(|s| s.photons.final_gather = 8)))
    };
    for lamp in [1.3, 0.6] {
        let (found, right) = (lit(&open_block, lamp, glass_of(1.5)), lit(&block, lamp, glass_of(1.5)));
        assert!(within(found, right, 0.03), "lamp at {lamp}: {found} instead of {right}");
        let mut thin = glass_of(1.5);
        thin["extensions"].as_object_mut().expect("an object").remove("KHR_materials_volume");
        let pane = lit(&open_block, lamp, thin);
        assert!(!within(pane, right, 0.1), "control: a thin pane, lamp at {lamp}: {pane}, {right}");
    }
}

#[test]
fn a_bubble_in_a_pool_is_empty() {
    let block = Mesh::block(vec3(-1.2, -0.9, -1.0), vec3(1.2, -0.25, 1.0));
    let ball = Mesh::ball(vec3(0.0, -0.55, -0.3), 0.25, 24);
    let picture = |water: &Mesh, inner: Option<&Mesh>, eye: Vec3| {
        let mut meshes = vec![(pool(), 0), (water.clone(), 1)];
        meshes.extend(inner.map(|inner| (inner.clone(), 1)));
        // A pool that shines is seen through water.
        let mut tiles = lambert([0.6; 3]);
        tiles["emissiveFactor"] = json!([0.2, 0.2, 0.2]);
        let mut scene = scene_of(&meshes, &[tiles, glass_of(1.33)]);
        let place = |point: Vec3| point - scene.center.as_vec3();
        let cameras = vec![camera(place(eye), place(vec3(0.0, -0.55, -0.3)), 12.0)];
        (scene.environment, scene.cameras) = (Some(Environment::uniform(Vec3::ONE)), cameras);
        let picture = render_scene(&scene, &settings(Mode::DirectRays, 1000, 16)).frame.radiance().to_vec();
        (picture, scene.warnings.iter().any(|line| line.contains("turned")))
    };
    let difference = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        a.iter().zip(b).map(|(a, b)| (a[1] - b[1]).abs()).sum::<f32>() / a.len() as f32
    };
    let cover = sheet(1.2, -0.25, 1.0);
    // From above, in the water and in the bubble.
    for eye in [vec3(0.0, 1.3, 1.6), vec3(0.2, -0.5, 0.8), vec3(0.05, -0.5, -0.2)] {
        let (right, _) = picture(&block, Some(&ball.clone().turned()), eye);
        let (found, is_turned) = picture(&cover, Some(&ball.clone().turned()), eye);
        assert!(difference(&found, &right) < 1e-3, "{} from {eye}", difference(&found, &right));
        assert!(!is_turned, "a bubble faces inwards");
        for (name, inner) in [("no bubble", None), ("a solid ball", Some(&ball))] {
            let (other, _) = picture(&cover, inner, eye);
            assert!(difference(&other, &right) > 5e-3, "control: {name} from {eye}: {}", difference(&other, &right));
        }
    }
}

#[test]
fn basins_that_share_a_mesh_hold_water() {
    // The pool three times, each a little larger, and water in the first.
    let held = |wider: f32, share_from: usize| {
        let mut file = file_of(&[(pool(), 0), (sheet(1.2, -0.25, 1.0), 1)], &[lambert([0.6; 3]), glass_of(1.33)]);
        file["nodes"][0]["scale"] = json!([wider, 1.0, wider]);
        for x in [10.0, 20.0] {
            let node =
                push(&mut file, "nodes", json!({ "mesh": 0, "translation": [x, 0.0, 0.0], "scale": [1.5, 1, 1] }));
            file["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
        }
        let scene = read_with(&file, &LoadOptions { share_from, ..LoadOptions::default() }).expect("a scene");
        assert_eq!(scene.instances.len(), if share_from == 0 { 3 } else { 0 });
        scene.warnings.iter().any(|line| line.contains("fills what lies behind"))
    };
    for share_from in [0, usize::MAX] {
        assert!(held(1.0, share_from), "from {share_from} triangles on");
        assert!(!held(1.4, share_from), "control: too wide, from {share_from} triangles on");
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
