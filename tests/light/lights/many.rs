//! Many lights, of which direct light chooses.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | points, spots | 2,000 of them give the sum of I a(θ)² cos θ/d² | every third one left out |
//! | suns | 40 of them give the sum of E cos θ | every third one left out |
//! | few | 16 have no noise | 17 have |
//! | metal | 16 light rough metal as their sum, without noise | 17 do with noise; one left out |
//! | bulbs | rough metal shows 60 bulbs at few samples with little noise, and with the mean of many | a trace of sheen, with which bulbs are chosen by irradiance |
//! | parts | a lamp in 800 pieces lights diffuse and rough surfaces like one | some pieces left out |
//! | agreement | photons and rays have the same mean under many lights of all kinds | without the second bounce |
//! | dark | a million lights of no power, and one of infinite or undefined position, change nothing | the position in order |

use std::time::Instant;

use caustica::{
    bvh::Bvh,
    renderer::Render,
    scene::{Environment, Light, LightKind, Material, Scene, Surface},
    settings::{LightSettings, Mode},
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};

use support::{photons::Random, *};

use super::{closed_forms::irradiance_at, floor, spot};

/// A floor under `count` lights made by `light` from a position above it and a direction downwards.
fn hall(count: usize, light: impl Fn(&mut Random, Vec3, Vec3) -> Light) -> Scene {
    let mut random = Random(8);
    let mut scene = floor(8.0);
    for _ in 0..count {
        let mut across = || 12.0 * random.unit() - 6.0;
        let position = vec3(across(), 0.3 * across().abs() + 0.2, across());
        let down = vec3(across(), -6.0, across()).normalize();
        scene.lights.push(light(&mut random, position, down));
    }
    scene
}

/// Irradiance of an unhidden surface that faces up.
fn sum_over(lights: &[Light], point: Vec3) -> f64 {
    let of = |light: &Light| {
        let to_light = (light.position - point).as_dvec3();
        let wi = to_light.normalize();
        let intensity = f64::from(light.intensity.x);
        match light.kind {
            LightKind::Directional => intensity * f64::from(-light.direction.y).max(0.0),
            LightKind::Point => intensity * wi.y.max(0.0) / to_light.length_squared(),
            LightKind::Spot { inner, outer } => {
                let [full, none] = [inner, outer].map(|angle| f64::from(angle).cos());
                let t = ((-wi.dot(light.direction.as_dvec3()) - none) / (full - none)).clamp(0.0, 1.0);
                intensity * t * t * wi.y.max(0.0) / to_light.length_squared()
            }
        }
    };
    lights.iter().map(of).sum()
}

fn check_sum(scene: &Scene) {
    let mut fewer = scene.clone();
    let mut index = 0;
    fewer.lights.retain(|_| {
        index += 1;
        index % 3 != 0
    });
    for point in [vec3(0.1, 0.0, 0.2), vec3(4.0, 0.0, -3.0)] {
        // From below the lamps, so that none is before the camera.
        let measured = |scene: &Scene| irradiance_at(scene, point + vec3(0.05, 0.1, 0.01), point, 256);
        let right = sum_over(&scene.lights, point);
        assert!(within(measured(scene), right, 0.01), "{} instead of {right} at {point}", measured(scene));
        let left_out = measured(&fewer);
        assert!(!within(left_out, right, 0.01), "control: {left_out} with fewer lights at {point}");
    }
}

#[test]
fn two_thousand_points_and_spots_light_as_their_sum() {
    check_sum(&hall(2000, |random, position, _| point_light(position, 0.01 + random.unit().powi(8))));
    check_sum(&hall(2000, |random, position, down| spot(position, down, 0.1 + random.unit().powi(4), 0.1, 0.7)));
}

#[test]
fn many_suns_light_as_their_sum() {
    check_sum(&hall(40, |random, position, direction| {
        let kind = LightKind::Directional;
        Light { kind, direction, ..point_light(position, 0.1 + random.unit().powi(4)) }
    }));
}

#[test]
fn sixteen_lights_have_no_noise() {
    let spread = |count: usize| {
        let mut scene = hall(count, |_, position, _| point_light(position, 1.0));
        scene.cameras = vec![camera(vec3(0.15, 0.1, 0.21), vec3(0.1, 0.0, 0.2), 0.02)];
        let render = render_scene(&scene, &settings(Mode::DirectRays, 1, 8));
        let values = || render.frame.radiance().iter().map(|pixel| pixel[0]);
        let (least, most) = (values().fold(f32::MAX, f32::min), values().fold(0.0, f32::max));
        (most - least) / most
    };
    assert!(spread(16) < 1e-3, "{}", spread(16));
    assert!(spread(17) > 1e-3, "control: {}", spread(17));
}

#[test]
fn sixteen_lights_on_rough_metal_have_no_noise() {
    let metal = Surface::Layered { base: Vec3::splat(0.8), metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
    let seen = |lights: &[Light]| {
        let mut scene = floor(2.0);
        scene.materials[0] = Material { surface: metal, roughness: 0.2, ..scene.materials[0].clone() };
        scene.lights = lights.to_vec();
        scene.cameras = vec![camera(vec3(0.0, 0.9, 1.9), vec3(0.0, 0.0, 0.3), 30.0)];
        let render = render_scene(&scene, &settings(Mode::DirectRays, 1, 16));
        render.frame.radiance().iter().map(|pixel| f64::from(pixel[0])).collect::<Vec<_>>()
    };
    let lights = hall(17, |random, position, _| point_light(position, 0.1 + 5.0 * random.unit().powi(4))).lights;
    // One light needs no choice.
    let alone: Vec<_> = lights.iter().map(|light| seen(std::slice::from_ref(light))).collect();
    let furthest = |picture: &[f64], count: usize| {
        let right = |i: usize| alone[..count].iter().map(|one| one[i]).sum::<f64>();
        (0..picture.len()).map(|i| (picture[i] / right(i) - 1.0).abs()).fold(0.0, f64::max)
    };
    assert!(furthest(&seen(&lights[..16]), 16) < 1e-3, "{}", furthest(&seen(&lights[..16]), 16));
    assert!(furthest(&seen(&lights), 17) > 0.1, "control: {}", furthest(&seen(&lights), 17));
    assert!(furthest(&seen(&lights[1..16]), 16) > 1e-3, "control: one left out");
}

#[test]
fn rough_metal_shows_many_bulbs_with_little_noise() {
    let metal = Surface::Layered { base: Vec3::splat(0.8), metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
    let mut scene = floor(2.0);
    scene.materials[0] = Material { surface: metal, roughness: 0.4, ..scene.materials[0].clone() };
    scene.materials.push(emissive("bulb", 0.0, 400.0, false));
    let at = |i: i32| vec3(0.4 * (i % 10 - 5) as f32 + 0.2, 0.7, 0.5 * (i / 10 - 3) as f32 + 0.1);
    scene.spheres.extend((0..60).map(|i| sphere(at(i), 0.02, 1)));
    scene.cameras = vec![camera(vec3(0.0, 0.5, 1.9), vec3(0.0, 0.0, 0.3), 30.0)];
    let seen = |scene: &Scene, spp: u32| {
        let few = settings(Mode::DirectRays, 1, 32).with(|s| (s.picture.spp, s.picture.max_spp) = (spp, None));
        render_scene(scene, &few)
    };
    let right = seen(&scene, 256);
    // The sum of squared differences over that of squares.
    let noise = |found: &Render| {
        let pairs = || found.frame.radiance().iter().zip(right.frame.radiance());
        let sum = |of: &dyn Fn(f32, f32) -> f32| pairs().map(|(a, b)| f64::from(of(a[0], b[0]))).sum::<f64>();
        sum(&|a, b| (a - b).powi(2)) / sum(&|_, b| b * b)
    };
    let found = seen(&scene, 4);
    assert!(within(mean(&found), mean(&right), 0.02), "{} instead of {}", mean(&found), mean(&right));
    scene.materials[0].sheen_color = Vec3::splat(1e-4);
    scene.materials[0].sheen_roughness = 0.5;
    let control = seen(&scene, 4);
    assert!(noise(&found) < 0.5 * noise(&control), "{}, and {} by irradiance", noise(&found), noise(&control));
}

/// A surface under a lamp of `side` x `side` squares, all but each `gap`-th of them.
fn under_a_lamp((surface, roughness): (Surface, f32), side: u32, gap: u32) -> Scene {
    let mut scene = floor(2.0);
    scene.materials[0] = Material { surface, roughness, ..scene.materials[0].clone() };
    scene.materials.push(emissive("lamp", 0.0, 4.0, false));
    let step = 1.6 / side as f32;
    for i in (0..side * side).filter(|i| (i + 1) % gap != 0) {
        let corner = vec3(step * (i % side) as f32 - 0.8, 1.2, step * (i / side) as f32 - 0.8);
        add_quad(&mut scene, corner, Vec3::X * step, Vec3::Z * step, 1);
    }
    scene.cameras = vec![camera(vec3(0.0, 0.9, 1.9), vec3(0.0, 0.0, 0.3), 30.0)];
    scene
}

#[test]
fn a_lamp_in_pieces_lights_like_one() {
    let metal = Surface::Layered { base: Vec3::splat(0.8), metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
    for (name, surface, roughness) in
        [("diffuse", diffuse(0.5), 1.0), ("rough metal", metal, 0.6), ("sharper metal", metal, 0.2)]
    {
        let seen = |side, gap| {
            let settings = settings(Mode::DirectRays, 1, 48).with(|s| {
                s.picture.spp = 8;
                s.picture.light_samples = 8;
            });
            mean(&render_scene(&under_a_lamp((surface, roughness), side, gap), &settings))
        };
        let (whole, pieces, fewer) = (seen(1, u32::MAX), seen(20, u32::MAX), seen(20, 20));
        assert!(within(pieces, whole, 0.01), "{name}: {pieces} in pieces, {whole} as one");
        assert!(!within(fewer, whole, 0.01), "control, {name}: {fewer} without some, {whole} as one");
    }
}

#[test]
fn photons_and_rays_agree_under_many_lights() {
    let mut random = Random(5);
    let mut scene = hall(40, |random, position, _| point_light(position + Vec3::Y, 0.1 + random.unit().powi(4)));
    scene.lights.extend(hall(30, |_, position, down| spot(position + Vec3::Y, down, 1.0, 0.2, 0.5)).lights);
    scene.materials.push(emissive("lamps", 0.2, 20.0, true));
    for _ in 0..300 {
        let corner = vec3(10.0 * random.unit() - 5.0, 1.5 + 2.0 * random.unit(), 10.0 * random.unit() - 5.0);
        add_quad(&mut scene, corner, vec3(0.05, 0.02, 0.0), vec3(0.0, 0.02, 0.05) * (0.2 + random.unit()), 1);
    }
    scene.environment = Some(Environment::uniform(Vec3::splat(0.1)));
    add_box(&mut scene, vec3(-1.0, 0.0, -1.5), vec3(1.0, 0.8, -0.5), 0);
    scene.cameras = vec![camera(vec3(0.0, 1.2, 3.0), vec3(0.0, 0.0, 0.0), 50.0)];
    let seen = |mode, bounces| {
        let settings = settings(mode, 150_000, 40).with(|s| {
            s.photons.max_bounces = bounces;
            // The second bounce is a twentieth of the light and needs few photons.
            s.photons.max_paths = Some(600_000);
            s.picture.spp = 6;
        });
        mean(&render_scene(&scene, &settings))
    };
    let (rays, photons) = (seen(Mode::Hybrid, 6), seen(Mode::Photons, 6));
    assert!(within(photons, rays, 0.02), "{rays} by rays, {photons} by photons");
    let once = seen(Mode::Photons, 1);
    assert!(!within(once, rays, 0.02), "control: {once} without the second bounce");
}

#[test]
fn a_million_dark_lights_change_nothing() {
    let lit = hall(30, |_, position, _| point_light(position, 1.0));
    let mut dark = lit.clone();
    dark.lights.extend((0..1_000_000).map(|i| point_light(Vec3::splat(i as f32), 0.0)));
    let upload = |scene: &Scene| {
        let start = Instant::now();
        let buffers = SceneBuffers::new(gpu(), scene, &Bvh::build(scene), &LightSettings::default()).expect("fits");
        (buffers.lights.table.trees.nodes.clone(), start.elapsed().as_secs_f64())
    };
    let ((nodes, _), (among_dark, seconds)) = (upload(&lit), upload(&dark));
    assert_eq!(nodes, among_dark);
    assert!(seconds < 30.0, "{seconds} s");
    // A light without a position is never chosen.
    let mut nowhere = lit.clone();
    nowhere.lights.push(point_light(vec3(f32::NAN, 1.0, 0.0), 1.0));
    nowhere.lights.push(point_light(vec3(0.0, f32::INFINITY, 0.0), 1.0));
    let nodes_of = |scene: &Scene| upload(scene).0.len();
    assert_eq!(nodes_of(&nowhere), nodes.len());
    nowhere.lights[30].position = Vec3::Y;
    assert_eq!(nodes_of(&nowhere), nodes.len() + 2, "control");
}
