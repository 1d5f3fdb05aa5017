//! Solids of glass and liquids that touch, overlap and nest, and meshes that are not clean solids.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | furnaces | nothing absorbs: in radiance 1 from all around every pixel is 1 | glass that absorbs, a path limit |
//! | plate on water, photons | three interfaces with all reflections between them | without the water |
//! | blocks | two blocks that share a face are one block | a gap between them |
//! | bubble | an ior-1 ball in glass is a cavity, in an exact sphere too | solid |
//! | a closed vessel that its liquid overlaps | that of one which it touches | a gap |
//! | slab thinner than rounding | it reflects as a slab | two of them |
//! | turned, doubled | the picture of the clean ball | another index |
//! | chains | a cut diamond loses nothing | |
//! | far away | thin glass far from the origin lets all light through | |

use caustica::{
    renderer::Render,
    scene::{Environment, Light, LightKind, Scene},
    settings::{Mode, Settings},
};
use glam::{Vec3, vec3};
use serde_json::{Value, json};
use support::{
    gltf::lambert,
    meshes::{Mesh, file_of, glass_of, scene_of},
    *,
};

const SIZE: u32 = 24;

fn quick() -> Settings {
    settings(Mode::DirectRays, 1000, SIZE).with(|s| s.picture.spp = 2)
}

/// The scene in radiance 1 from all around, seen from `eye`.
fn in_furnace(mut scene: Scene, eye: Vec3) -> Render {
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    scene.cameras = vec![camera(eye, Vec3::ZERO, 40.0)];
    render_scene(&scene, &quick())
}

/// Pixels that are not 1 within 0.5 %.
fn wrong(render: &Render) -> usize {
    render.frame.radiance().iter().filter(|pixel| pixel.iter().any(|x| (x - 1.0).abs() > 0.005)).count()
}

fn assert_white(name: &str, meshes: &[(Mesh, usize)], materials: &[Value]) -> Scene {
    let backwards: Vec<_> = meshes.iter().rev().cloned().collect();
    for meshes in [meshes, &backwards] {
        let scene = scene_of(meshes, materials);
        for eye in [vec3(0.0, 1.2, 4.0), vec3(2.5, -2.0, -2.5)] {
            assert_eq!(wrong(&in_furnace(scene.clone(), eye)), 0, "{name} from {eye}");
        }
    }
    scene_of(meshes, materials)
}

/// A tumbler, and what fills it up to a distance from its wall and bottom.
fn tumbler() -> Mesh {
    let profile = [(0.0, -1.0), (0.8, -1.0), (0.8, 1.0), (0.7, 1.0), (0.7, -0.9), (0.0, -0.9)];
    Mesh::lathe(Vec3::ZERO, &profile, 24)
}

fn drink(gap: f32, segments: u32) -> Mesh {
    let (radius, bottom) = (0.7 - gap, -0.9 + gap);
    Mesh::lathe(Vec3::ZERO, &[(0.0, bottom), (radius, bottom), (radius, 0.4), (0.0, 0.4)], segments)
}

#[test]
fn solids_that_touch_overlap_and_nest_are_white_in_a_furnace() {
    let glasses: Vec<Value> = [1.5, 1.33, 1.31, 1.6].map(glass_of).to_vec();
    let ice = Mesh::block(vec3(-0.3, 0.2, -0.3), vec3(0.3, 0.6, 0.3));
    let straw = Mesh::lathe(vec3(0.2, 0.0, 0.1), &[(0.0, -0.85), (0.05, -0.85), (0.05, 1.5), (0.0, 1.5)], 8);
    assert_white("tumbler of water", &[(tumbler(), 0), (drink(0.0, 24), 1)], &glasses);
    let overlapping = [(tumbler(), 0), (drink(-0.05, 40), 1), (ice, 2), (straw, 3)];
    assert_white("drink with ice and straw", &overlapping, &glasses);
    let blocks = |shift: f32| {
        let other = Mesh::block(vec3(0.0, -0.5 + shift, -0.5), vec3(1.0, 0.5 + shift, 0.5 + shift));
        [Mesh::block(vec3(-1.0, -0.5, -0.5), vec3(0.0, 0.5, 0.5)), other]
    };
    let [a, b] = blocks(0.0);
    assert_white("two blocks", &[(a, 0), (b, 0)], &glasses);
    let [a, b] = blocks(0.2);
    assert_white("doublet", &[(a, 0), (b, 3)], &glasses);
    let mut random = photons::Random(7);
    let beads: Vec<_> = (0..50).map(|i| (Mesh::ball(random.vector() * 0.9, 0.3, 12), i % 4)).collect();
    assert_white("50 beads", &beads, &glasses);
    let shells: Vec<_> = (0..12).map(|i| (Mesh::ball(Vec3::ZERO, 1.2 - 0.09 * i as f32, 24), i % 4)).collect();
    assert_white("12 shells", &shells, &glasses);
    // Control: a pixel that sees glass which absorbs is not white.
    let mut dark = glass_of(1.5);
    dark["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.9, 0.9, 0.9, 1]);
    assert!(wrong(&in_furnace(scene_of(&[(tumbler(), 0)], &[dark]), vec3(0.0, 1.2, 4.0))) > 100);
}

#[test]
fn meshes_that_are_no_clean_solids_are_named_and_never_too_bright() {
    let glasses = [glass_of(1.5)];
    let ball = Mesh::ball(Vec3::ZERO, 1.0, 24);
    let mut holed = ball.clone();
    holed.triangles.remove(100);
    let bowl: Vec<(f32, f32)> = (0..=12)
        .map(|k| k as f32 * std::f32::consts::PI / 24.0)
        .map(|a| (a.sin() * f32::from(a > 0.0), -a.cos()))
        .collect();
    let cross = Mesh::block(vec3(-1.0, -0.2, -0.2), vec3(1.0, 0.2, 0.2))
        .with(&Mesh::block(vec3(-0.2, -1.0, -0.2), vec3(0.2, 1.0, 0.2)));
    // A lathe whose outline runs through itself.
    let outline = [(0.0, -0.8), (1.0, -0.8), (0.3, 0.5), (0.9, 0.5), (0.4, -0.6), (0.0, 0.6)];
    let bow_tie = Mesh::lathe(Vec3::ZERO, &outline, 12);
    let rimmed =
        [(0.0, -0.5), (0.5, -0.5), (0.5, -2e-7), (1.2, -2e-7), (1.2, 2e-7), (0.5, 2e-7), (0.5, 0.5), (0.0, 0.5)];
    for (name, mesh, said) in [
        ("open bowl", Mesh::lathe(Vec3::ZERO, &bowl, 24), "is an open sheet, taken for a thin pane"),
        ("doubled", ball.clone().with(&ball.clone().turned()), "has doubled faces, which count once"),
        ("inside out", ball.clone().turned(), "is wound inside out and was turned"),
        ("hole", holed, "has holes, but is taken for a solid"),
        ("parts that cross", cross, ""),
        ("crossing itself", bow_tie, "crosses itself"),
        ("hollow", ball.clone().with(&Mesh::ball(Vec3::ZERO, 0.6, 24).turned()), ""),
        ("clean", ball.clone(), ""),
        ("thin", Mesh::block(vec3(-1.0, -1.0, -1e-4), vec3(1.0, 1.0, 1e-4)), ""),
        (
            "thinner than rounding",
            Mesh::block(vec3(-1.0, -1.0, -2e-7), vec3(1.0, 1.0, 2e-7)),
            "is thinner than rounding",
        ),
        ("with a rim thinner than rounding", Mesh::lathe(Vec3::ZERO, &rimmed, 12), ""),
        ("divided", divided(1), "has faces inside that divide it"),
        ("divided twice", divided(2), "has faces inside that divide it"),
    ] {
        let scene = assert_white(name, &[(mesh, 0)], &glasses);
        let about: Vec<_> = scene.warnings.iter().filter(|line| line.contains("its glass")).collect();
        assert_eq!(about.len(), usize::from(!said.is_empty()), "{name}: {about:?}");
        assert!(about.iter().all(|line| line.contains(said) && line.contains("part 0")), "{name}: {about:?}");
    }
}

/// A block of 2 x 1 x 1, in it so many faces from edge to edge.
fn divided(dividers: u32) -> Mesh {
    let at = |i: u32| -1.0 + 2.0 * i as f32 / (dividers + 1) as f32;
    let mut whole = Mesh::default();
    for i in 0..=dividers {
        let mut cell = Mesh::block(vec3(at(i), -0.5, -0.5), vec3(at(i + 1), 0.5, 0.5));
        if i > 0 {
            // The cell before has that face.
            cell.triangles.drain(..2);
        }
        whole = whole.with(&cell);
    }
    whole
}

/// The pixels of a picture over a horizon.
fn over_horizon(scene: &Scene, spp: u32) -> Vec<[f32; 3]> {
    let mut scene = scene.clone();
    let pixels = [[[0.2; 3]; 4], [[1.0; 3]; 4]].concat();
    scene.environment = Some(Environment { width: 4, height: 2, pixels, ..Environment::uniform(Vec3::ONE) });
    scene.cameras = vec![camera(vec3(0.0, 0.6, 4.0), Vec3::ZERO, 40.0)];
    render_scene(&scene, &quick().with(|s| s.picture.spp = spp)).frame.radiance().to_vec()
}

/// Largest difference between pixels of two pictures over a horizon.
fn difference(a: &Scene, b: &Scene) -> f32 {
    let pairs = over_horizon(a, 2).into_iter().zip(over_horizon(b, 2));
    pairs.flat_map(|(a, b)| [0, 1, 2].map(|i| (a[i] - b[i]).abs())).fold(0.0, f32::max)
}

#[test]
fn unclean_solids_look_as_the_clean_one() {
    let glasses = [1.5, 1.0, 1.6].map(glass_of);
    let ball = Mesh::ball(Vec3::ZERO, 1.0, 24);
    let small = Mesh::ball(vec3(0.2, 0.0, 0.0), 0.5, 24);
    let of = |meshes: &[(Mesh, usize)]| scene_of(meshes, &glasses);
    let clean = of(&[(ball.clone(), 0)]);
    assert!(difference(&clean, &of(&[(ball.clone().turned(), 0)])) < 1e-3, "turned");
    assert!(difference(&clean, &of(&[(ball.clone(), 0), (small.clone(), 0)])) < 1e-3, "the same glass in it");
    let bubble = of(&[(ball.clone(), 0), (small.clone(), 1)]);
    assert!(difference(&clean, &bubble) > 0.1, "control: a bubble is seen");
    let cavity = of(&[(ball.clone().with(&small.clone().turned()), 0)]);
    let apart = of(&[(ball.clone(), 0), (small.clone().turned(), 2)]);
    for (name, other) in [("cavity of the mesh", &cavity), ("cavity as a mesh of its own", &apart)] {
        assert!(difference(&bubble, other) < 1e-3, "{name}");
    }
    let block = of(&[(Mesh::block(vec3(-1.0, -0.5, -0.5), vec3(1.0, 0.5, 0.5)), 0)]);
    for dividers in [1, 2] {
        assert!(difference(&block, &of(&[(divided(dividers), 0)])) < 1e-3, "{dividers} dividers");
    }
    let mut open = divided(1);
    open.triangles.drain(4..6);
    assert!(difference(&block, &of(&[(open, 0)])) > 0.1, "control: a side is missing");
    // The same in an exact sphere.
    let in_sphere = |mesh: Mesh, material: usize| {
        let mut file = file_of(&[(mesh, material)], &glasses);
        let shapes = json!({ "shapes": [{ "type": "sphere", "sphere": { "radius": 1.0 } }] });
        file["extensions"] = json!({ "KHR_implicit_shapes": shapes });
        file["extensionsUsed"].as_array_mut().expect("a list").push(json!("KHR_implicit_shapes"));
        let shape = json!({ "KHR_implicit_shapes": { "shape": 0 } });
        file["nodes"].as_array_mut().expect("a list").push(json!({ "extensions": shape, "extras": { "material": 0 } }));
        file["scenes"][0]["nodes"] = json!([0, 1]);
        gltf::loaded(&file)
    };
    let bubble = in_sphere(small.clone(), 1);
    assert!(difference(&bubble, &in_sphere(small.clone().turned(), 0)) < 1e-3, "cavity of a sphere");
    assert!(difference(&bubble, &in_sphere(small.clone(), 0)) > 0.1, "control: the same glass in a sphere");
    assert!(difference(&clean, &of(&[(ball, 2)])) > 0.05, "control: another index");
}

#[test]
fn what_fills_a_closed_vessel_may_reach_into_its_wall() {
    let glasses = [1.5, 1.33].map(glass_of);
    let ball = |radius: f32| Mesh::ball(Vec3::ZERO, radius, 24);
    let filled = |radius: f32| scene_of(&[(ball(1.0).with(&ball(0.7).turned()), 0), (ball(radius), 1)], &glasses);
    let right = over_horizon(&filled(0.7), 16);
    let mean_difference = |scene: &Scene| {
        let pairs = over_horizon(scene, 16).into_iter().zip(&right).map(|(a, b)| (a[1] - b[1]).abs());
        pairs.sum::<f32>() / right.len() as f32
    };
    let (found, control) = (mean_difference(&filled(0.7001)), mean_difference(&filled(0.6)));
    assert!(found < 0.1 * control, "the liquid reaches into the wall: {found}, control with a gap: {control}");
}

#[test]
fn slabs_thinner_than_rounding_reflect_as_slabs() {
    let lamp = json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1], "roughnessFactor": 1, "metallicFactor": 0 },
        "emissiveFactor": [1, 1, 1],
    });
    let behind = Mesh {
        positions: vec![vec3(-2.0, -2.0, -1.0), vec3(2.0, -2.0, -1.0), vec3(2.0, 2.0, -1.0), vec3(-2.0, 2.0, -1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let slab = |z: f32, half: f32| Mesh::block(vec3(-2.0, -2.0, z - half), vec3(2.0, 2.0, z + half));
    let seen = |glass: &[Mesh]| {
        let mut meshes = vec![(behind.clone(), 0)];
        meshes.extend(glass.iter().map(|mesh| (mesh.clone(), 1)));
        let mut scene = scene_of(&meshes, &[lamp.clone(), glass_of(1.5)]);
        let at = |z: f32| vec3(0.0, 0.0, z) - scene.center.as_vec3();
        scene.cameras = vec![camera(at(3.0), at(0.0), 5.0)];
        mean(&render_scene(&scene, &quick().with(|s| s.picture.spp = 64)))
    };
    // With all reflections between both faces.
    let right = transmittance(&[1.0, 1.5, 1.0], 1.0);
    for half in [2e-3, 1e-6, 5e-7, 1e-7] {
        let found = seen(&[slab(0.0, half)]);
        assert!(within(found, right, 0.01), "{half}: {found} instead of {right}");
    }
    let two = seen(&[slab(0.0, 1e-7), slab(0.5, 1e-7)]);
    assert!(!within(two, right, 0.05), "control: two slabs: {two}");
}

/// Transmittance of a stack of plane interfaces with all reflections between them, for intensities,
/// from the indices of its layers and the cosine of incidence in the first one.
fn transmittance(indices: &[f64], cosine: f64) -> f64 {
    let sine = (1.0 - cosine * cosine).sqrt() * indices[0];
    let inner = |n: f64| (1.0 - (sine / n).powi(2)).sqrt();
    // Two layers of reflectance R and transmittance T join to T₁ T₂ / (1 − R₁ R₂).
    let join = |(r1, t1): (f64, f64), (r2, t2): (f64, f64)| {
        let between = 1.0 - r1 * r2;
        (r1 + t1 * t1 * r2 / between, t1 * t2 / between)
    };
    let faces = indices.windows(2).map(|pair| {
        let (a, b) = (pair[0], pair[1]);
        let (ci, ct) = (inner(a), inner(b));
        let (s, p) = ((a * ci - b * ct) / (a * ci + b * ct), (b * ci - a * ct) / (b * ci + a * ct));
        let r = 0.5 * (s * s + p * p);
        (r, 1.0 - r)
    });
    faces.reduce(join).expect("an interface").1
}

#[test]
fn photons_through_a_plate_on_water_follow_the_closed_form() {
    // A floor under water, with a plate of glass that lies on the water; sunlight at an angle.
    let floor_under = |water: f32, plate: f32, degrees: f64| {
        let floor = Mesh {
            positions: vec![vec3(-4.0, -1.0, 4.0), vec3(4.0, -1.0, 4.0), vec3(4.0, -1.0, -4.0), vec3(-4.0, -1.0, -4.0)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let (low, high) = (vec3(-3.0, -1.0, -3.0), vec3(3.0, 0.0, 3.0));
        let cover = Mesh::lathe(Vec3::ZERO, &[(0.0, 0.0), (4.0, 0.0), (4.0, 0.2), (0.0, 0.2)], 7);
        let materials = [lambert([0.5; 3]), glass_of(water), glass_of(plate)];
        let mut scene = scene_of(&[(floor, 0), (Mesh::block(low, high), 1), (cover, 2)], &materials);
        let angle = degrees.to_radians() as f32;
        scene.lights = vec![Light {
            kind: LightKind::Directional,
            direction: vec3(angle.sin(), -angle.cos(), 0.0),
            ..point_light(Vec3::ZERO, std::f32::consts::PI)
        }];
        scene.cameras = vec![camera(vec3(0.0, -0.5, 0.001), vec3(0.0, -1.0, 0.0), 60.0)];
        let settings = settings(Mode::DirectPhotons, 300_000, 16).with(|s| {
            s.estimate.neighbors = 200;
            // Few paths miss the glass, and end out of sight.
            s.photons.global = 1000;
            s.estimate.max_radius = Some(1.0);
        });
        // A camera in the water sees the radiance of the floor itself.
        mean(&render_scene(&scene, &settings))
    };
    for (water, plate, degrees) in [(1.33, 1.5, 50.0), (1.2, 1.7, 30.0)] {
        let angle: f64 = f64::to_radians(degrees);
        let of = |indices: &[f64]| 0.5 * angle.cos() * transmittance(indices, angle.cos());
        let right = of(&[1.0, plate, water]);
        let found = floor_under(water as f32, plate as f32, degrees);
        assert!(within(found, right, 0.01), "{found} instead of {right}");
        assert!(!within(of(&[1.0, plate, 1.0, water]), right, 0.01), "control: air between them");
    }
}

#[test]
fn chains_of_total_reflection_end_by_no_limit() {
    let cut = |segments| {
        Mesh::lathe(Vec3::ZERO, &[(0.0, -0.8), (1.0, 0.0), (1.0, 0.05), (0.55, 0.35), (0.0, 0.35)], segments)
    };
    for (ior, segments) in [(2.417, 8), (1.77, 11)] {
        let scene = scene_of(&[(cut(segments), 0)], &[glass_of(ior)]);
        let render = in_furnace(scene, vec3(0.0, 3.0, 2.0));
        assert_eq!(wrong(&render), 0, "index {ior}");
        assert!(render.stats.lost_camera_paths < 1.0, "{} paths are lost", render.stats.lost_camera_paths);
    }
    // A chamber of perfect mirrors lets no path out, which is said.
    let mirror = json!({ "pbrMetallicRoughness": { "metallicFactor": 1, "roughnessFactor": 0 } });
    let mut chamber = scene_of(&[(Mesh::block(Vec3::splat(-1.0), Vec3::splat(1.0)), 0)], &[mirror]);
    chamber.environment = Some(Environment::uniform(Vec3::ONE));
    chamber.cameras = vec![camera(vec3(0.3, 0.2, 0.5), Vec3::ZERO, 40.0)];
    let warnings = render_scene(&chamber, &quick()).stats.warnings;
    assert!(warnings.iter().any(|line| line.starts_with("100.00 % of the camera's paths")), "{warnings:?}");
}

#[test]
fn thin_glass_far_from_the_origin_is_no_thicker_than_it_is() {
    for (thickness, distance) in [(4e-3_f32, 3000.0_f32), (1e-4, 100.0), (1e-2, 20_000.0)] {
        let at = vec3(distance, 0.0, -distance);
        let pane = Mesh::block(at + vec3(-2.0, -2.0, 0.0), at + vec3(2.0, 2.0, thickness));
        let anchor = Mesh::block(-at - Vec3::splat(0.1), -at + Vec3::splat(0.1));
        let mut scene = scene_of(&[(pane, 0), (anchor, 1)], &[glass_of(1.5), lambert([0.5; 3])]);
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        let center = scene.center.as_vec3();
        scene.cameras = vec![camera(at - center + vec3(1.0, 0.5, 3.0), at - center, 30.0)];
        assert_eq!(wrong(&render_scene(&scene, &quick())), 0, "{thickness} m thick at {distance} m");
    }
}

#[test]
fn more_solids_in_one_place_than_are_told_apart_are_counted() {
    let counted = |count: usize| {
        let glasses: Vec<Value> = (0..count).map(|i| glass_of(1.2 + 0.1 * i as f32)).collect();
        let meshes: Vec<_> = (0..count).map(|i| (Mesh::block(Vec3::splat(-1.0), Vec3::splat(1.0)), i)).collect();
        in_furnace(scene_of(&meshes, &glasses), vec3(0.4, 1.2, 4.0)).stats
    };
    let (five, seven) = (counted(5), counted(7));
    assert_eq!(five.media_overflows, 0);
    assert!(seven.media_overflows > 100, "{} of seven solids", seven.media_overflows);
    assert!(
        seven.warnings.iter().any(|line| line.contains("surfaces of glass lay in one place")),
        "{:?}",
        seven.warnings
    );
}

#[test]
fn priority_decides_which_solid_fills_the_space() {
    // A large ball of the index of air and a small one of glass in it: the large one hides it.
    let of = |priority: i32| {
        let mut air = glass_of(1.0);
        air["extras"] = json!({ "caustica": { "priority": priority } });
        let meshes = [(Mesh::ball(Vec3::ZERO, 1.2, 24), 0), (Mesh::ball(Vec3::ZERO, 1.0, 24), 1)];
        scene_of(&meshes, &[air, glass_of(1.5)])
    };
    let nothing = scene_of(&[(Mesh::ball(Vec3::ZERO, 1.2, 24), 0)], &[glass_of(1.0)]);
    assert!(difference(&of(1), &nothing) < 1e-3);
    assert!(difference(&of(0), &nothing) > 0.1, "control: the smaller one fills it");
    let mut file = file_of(&[(Mesh::ball(Vec3::ZERO, 1.0, 8), 0)], &[glass_of(1.5)]);
    file["materials"][0]["extras"] = json!({ "caustica": { "priority": "high" } });
    let message = gltf::message(gltf::load(&file));
    assert_eq!(message, "materials[0].extras.caustica.priority: \"high\" is not an integer of 32 bits");
}
