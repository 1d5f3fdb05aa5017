//! Media in which paths start.

use std::f64::consts::PI;

use caustica::{
    bvh::Bvh,
    scene::{Environment, Material, Scene, Surface},
    settings::{LightSettings, Mode},
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};

use support::*;

use super::{flux, traced};

/// Water in a shell of flint glass: indices and radii, metres; and the distance of the paths'
/// origin from the centre.
const WATER: f64 = 1.33;
const FLINT: f64 = 1.7;
const BOUNDS: [f32; 2] = [1.0, 1.05];
const ASIDE: f32 = 0.9;

fn ball_in_shell(water: f64) -> Scene {
    let of = |ior: f64| Surface::Glass { ior: ior as f32, tint: Vec3::ONE };
    let mut scene = scene(&[of(FLINT), of(water), diffuse(0.0)]);
    scene.spheres.push(sphere(Vec3::ZERO, BOUNDS[1], 0));
    scene.spheres.push(sphere(Vec3::ZERO, BOUNDS[0], 1));
    scene
}

/// Sine of the largest angle to the radius at which a ray that starts in the water, `ASIDE` from
/// the centre, leaves. By Bouguer's invariant n r sin θ is the same in all layers; a ray leaves if
/// it is below n r outside of each.
fn critical_sine() -> f64 {
    f64::from(BOUNDS[1]) / (WATER * f64::from(ASIDE))
}

#[test]
fn a_camera_in_nested_glass_sees_as_from_inside() {
    let [bright, dark, wrong] = bright_dark_and_wrong_pixels(WATER);
    assert!(bright > 100 && dark > 50, "{bright} bright pixels, {dark} dark ones");
    assert_eq!(wrong, 0);
    let [.., wrong] = bright_dark_and_wrong_pixels(1.5);
    assert!(wrong > 100, "control: of glass of 1.5 only {wrong} pixels are wrong");
}

/// Numbers of bright, of dark and of wrong pixels: the view from inside of a ball of this glass,
/// against the closed form for water.
fn bright_dark_and_wrong_pixels(ior: f64) -> [usize; 3] {
    const SIZE: usize = 24;
    let mut scene = ball_in_shell(ior);
    scene.environment = Some(Environment::uniform(Vec3::splat(2.0)));
    let view = camera(vec3(ASIDE, 0.0, 0.0), vec3(ASIDE, 0.0, -1.0), 100.0);
    let half = 50.0_f32.to_radians().tan();
    scene.cameras.push(view.clone());
    let render = render_scene(&scene, &settings(Mode::DirectRays, 1000, SIZE as u32));
    // In a uniform field radiance over n² is the same everywhere: each direction that is not
    // trapped has the radiance n² L.
    let (inside, outside) = (WATER * WATER * 2.0, 0.0);
    let (mut bright, mut dark, mut wrong) = (0, 0, 0);
    for (i, pixel) in render.frame.radiance().iter().enumerate() {
        let at = |i: usize| (2.0 * (i as f32 + 0.5) / SIZE as f32 - 1.0) * half;
        let direction = (view.forward + at(i % SIZE) * view.right - at(i / SIZE) * view.up).normalize();
        let sine = f64::from(direction.cross(Vec3::X).length());
        // Near the critical angle most light is reflected until the bounce limit ends it.
        if (sine - critical_sine()).abs() > 0.02 {
            let gets_out = sine < critical_sine();
            let right = if gets_out { inside } else { outside };
            wrong += usize::from((f64::from(pixel[0]) - right).abs() > 1e-3 * inside);
            if gets_out { bright += 1 } else { dark += 1 }
        }
    }
    [bright, dark, wrong]
}

#[test]
fn a_light_in_nested_glass_sends_out_what_is_not_trapped() {
    let leaving = |aside: f32| {
        let mut scene = ball_in_shell(WATER);
        add_box(&mut scene, Vec3::splat(-3.0), Vec3::splat(3.0), 2);
        scene.lights.push(point_light(vec3(aside, 0.0, 0.0), 1.0));
        let settings = settings(Mode::IndirectPhotons, 20_000, 8).with(|s| {
            s.photons.max_bounces = 40;
            // A path that is trapped takes hundreds of rays.
            s.photons.max_paths = Some(5000);
        });
        let traced = traced(&scene, &settings);
        assert_eq!((traced.non_finite, traced.unfinished), (0, 0));
        flux(&traced.maps.caustic)
    };
    let right = 4.0 * PI * (1.0 - (1.0 - critical_sine().powi(2)).sqrt());
    assert!(within(leaving(ASIDE), right, 0.04), "{} W instead of {right}", leaving(ASIDE));
    assert!(!within(leaving(0.87), right, 0.04), "control: 3 cm nearer to the middle {} W leave", leaving(0.87));
}

#[test]
fn emitters_start_in_what_is_around_them() {
    let of = |ior| Surface::Glass { ior, tint: Vec3::ONE };
    let mut scene = scene(&[of(1.5), of(1.3)]);
    let glowing = Material { surface: of(1.4), ..emissive("glowing glass", 0.0, 1.0, true) };
    scene.materials.extend([emissive("bulb", 0.0, 1.0, false), emissive("panel", 0.0, 1.0, true), glowing]);
    let (bulb, panel, glowing) = (2, 3, 4);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.spheres.push(sphere(vec3(0.4, 0.0, 0.0), 0.5, 1));
    scene.spheres.push(sphere(vec3(0.4, 0.0, 0.0), 0.1, bulb));
    scene.spheres.push(sphere(vec3(5.0, 0.0, 0.0), 0.1, bulb));
    scene.spheres.push(sphere(vec3(-0.6, 0.0, 0.0), 0.2, glowing));
    // On the outside of the box's left face, one rounding error away from it: glass behind it, air
    // before it.
    add_quad(&mut scene, vec3(-1.0, -0.2, -0.2), Vec3::Z * 0.4, Vec3::Y * 0.4, panel);
    scene.lights.push(point_light(vec3(0.4, 0.3, 0.0), 1.0));
    let buffers =
        SceneBuffers::new(gpu(), &scene, &Bvh::build(&scene), &LightSettings::default()).expect("the scene fits");
    let lights = &buffers.lights.table.lights;
    let found: Vec<_> = lights.iter().map(|light| (light.media, light.back_media)).collect();
    // Slots by size: glowing glass, ball, box.
    let (none, water, glow, glass) = ([0; 4], [6, 0, 0, 0], [5, 0, 0, 0], [4, 0, 0, 0]);
    // The point light, the bulbs, the panel's two triangles, and glass that emits on both sides. No
    // path leaves from a bulb's inside.
    let fronts: Vec<_> = found.iter().map(|(front, _)| *front).collect();
    assert_eq!(fronts, [water, water, none, none, none, glass]);
    let backs: Vec<_> = found[3..].iter().map(|(_, back)| *back).collect();
    assert_eq!(backs, [glass, glass, glow]);
}

#[test]
fn what_lies_in_the_same_glass_is_lit_by_rays_and_photons_alike() {
    let mut scene = scene(&[diffuse(0.5), glass()]);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 1);
    add_quad(&mut scene, vec3(-0.8, -0.5, 0.8), vec3(1.6, 0.0, 0.0), vec3(0.0, 0.0, -1.6), 0);
    scene.lights.push(point_light(vec3(0.0, 0.3, 0.0), 1.0));
    scene.cameras.push(camera(vec3(0.0, 0.6, 0.001), vec3(0.0, -0.5, 0.0), 30.0));
    let of = |scene: &Scene, mode| {
        mean(&render_scene(scene, &settings(mode, 10_000, 6).with(|s| s.photons.max_bounces = 12)))
    };
    let (hybrid, photons) = (of(&scene, Mode::Hybrid), of(&scene, Mode::Photons));
    assert!(within(photons, hybrid, 0.05), "{photons} by photons, {hybrid} with rays");
    scene.lights[0].intensity *= 0.5;
    assert!(!within(of(&scene, Mode::Photons), hybrid, 0.05), "control: half the light passes");
}

#[test]
fn rays_of_final_gathering_start_in_what_is_around_them() {
    // A floor in a block of water inside a block of flint, in a room with a light beside them:
    // light reaches it by way of the walls.
    let of = |ior: f64| Surface::Glass { ior: ior as f32, tint: Vec3::ONE };
    let mut scene = scene(&[of(FLINT), of(WATER), diffuse(0.8)]);
    add_box(&mut scene, Vec3::splat(-0.6), Vec3::splat(0.6), 0);
    add_box(&mut scene, Vec3::splat(-0.5), Vec3::splat(0.5), 1);
    add_box(&mut scene, Vec3::splat(-2.0), Vec3::splat(2.0), 2);
    add_quad(&mut scene, vec3(-0.4, -0.4, 0.4), vec3(0.8, 0.0, 0.0), vec3(0.0, 0.0, -0.8), 2);
    scene.lights.push(point_light(vec3(1.5, 0.0, 0.0), 10.0));
    scene.cameras.push(camera(vec3(0.0, 0.4, 0.001), vec3(0.0, -0.4, 0.0), 40.0));
    let of = |scene: &Scene, final_gather: u32| {
        let settings = settings(Mode::IndirectPhotons, 100_000, 6).with(|s| {
            s.photons.final_gather = final_gather;
            s.photons.caustic = 10_000;
        });
        mean(&render_scene(scene, &settings))
    };
    let (estimated, gathered) = (of(&scene, 0), of(&scene, 32));
    assert!(within(gathered, estimated, 0.1), "{gathered} by final gathering, {estimated} without");
    scene.lights[0].intensity *= 0.5;
    assert!(!within(of(&scene, 32), estimated, 0.1), "control: half the light passes");
}
