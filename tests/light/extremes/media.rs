//! What paths start in.

use std::f64::consts::PI;

use caustica::{
    bvh::Bvh,
    scene::{Environment, Material, Scene, Surface},
    settings::{Mode, Settings},
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};

use support::*;

use super::{flux, traced};

/// Water in a shell of flint glass: indices and radii, metres; and how far from the middle paths start.
const WATER: f64 = 1.33;
const FLINT: f64 = 1.7;
const BOUNDS: [f32; 2] = [1.0, 1.05];
const ASIDE: f32 = 0.9;

fn ball_in_shell() -> Scene {
    let of = |ior: f64| Surface::Glass { ior: ior as f32, tint: Vec3::ONE };
    let mut scene = scene(&[of(FLINT), of(WATER), diffuse(0.0)]);
    scene.spheres.push(sphere(Vec3::ZERO, BOUNDS[1], 0));
    scene.spheres.push(sphere(Vec3::ZERO, BOUNDS[0], 1));
    scene
}

/// Sine of the largest angle to the radius at which a ray that starts in the water, `ASIDE` from the middle, gets out. By Bouguer's
/// invariant n r sin θ is the same in all layers; a ray gets out where it is below n r outside of each.
fn critical_sine() -> f64 {
    f64::from(BOUNDS[1]) / (WATER * f64::from(ASIDE))
}

/// The same for a path that takes the water for air: refracted from 1.33 into 1 at its border, it meets the outer one as from flint.
fn wrong_critical_sine() -> f64 {
    f64::from(BOUNDS[1]) / FLINT / (WATER * f64::from(ASIDE))
}

#[test]
fn a_camera_in_nested_glass_sees_as_from_inside() {
    const SIZE: usize = 24;
    let mut scene = ball_in_shell();
    scene.environment = Some(Environment::uniform(Vec3::splat(2.0)));
    let view = camera(vec3(ASIDE, 0.0, 0.0), vec3(ASIDE, 0.0, -1.0), 100.0);
    let half = 50.0_f32.to_radians().tan();
    scene.cameras.push(view.clone());
    let render = render_scene(&scene, &settings(Mode::DirectRays, 1000, SIZE as u32));
    // In a uniform field radiance over n² is the same everywhere: all that is not trapped brings n² L.
    let (inside, outside) = (WATER * WATER * 2.0, 0.0);
    let (mut bright, mut dark) = (0, 0);
    for (i, pixel) in render.frame.radiance.iter().enumerate() {
        let at = |i: usize| (2.0 * (i as f32 + 0.5) / SIZE as f32 - 1.0) * half;
        let direction = (view.forward + at(i % SIZE) * view.right - at(i / SIZE) * view.up).normalize();
        let sine = f64::from(direction.cross(Vec3::X).length());
        // At the border itself most is reflected, and the bounce limit takes it.
        if (sine - critical_sine()).abs() > 0.02 {
            let gets_out = sine < critical_sine();
            let right = if gets_out { inside } else { outside };
            assert!((f64::from(pixel[0]) - right).abs() < 1e-3 * inside, "pixel {i}: {} instead of {right}", pixel[0]);
            if gets_out { bright += 1 } else { dark += 1 }
        }
    }
    assert!(bright > 100 && dark > 50, "{bright} bright pixels, {dark} dark ones");
    let wrong = (WATER * FLINT).powi(2) * 2.0;
    assert!(
        !within(wrong, inside, 0.5) && wrong_critical_sine() < 0.6 * critical_sine(),
        "control: air gives the same"
    );
}

#[test]
fn a_light_in_nested_glass_sends_out_what_is_not_trapped() {
    let mut scene = ball_in_shell();
    add_box(&mut scene, Vec3::splat(-3.0), Vec3::splat(3.0), 2);
    scene.lights.push(point_light(vec3(ASIDE, 0.0, 0.0), 1.0));
    let settings = settings(Mode::IndirectPhotons, 20_000, 8).with(|s| {
        s.photons.max_bounces = 40;
        s.photons.max_paths = Some(20_000);
    });
    let traced = traced(&scene, &settings);
    assert_eq!((traced.non_finite, traced.unfinished), (0, 0));
    let power = 4.0 * PI;
    let leaving = |critical: f64| power * (1.0 - (1.0 - critical * critical).sqrt());
    let flux = flux(&traced.caustic);
    assert!(within(flux, leaving(critical_sine()), 0.04), "{flux} W instead of {}", leaving(critical_sine()));
    assert!(!within(flux, leaving(wrong_critical_sine()), 0.5), "control: as from air");
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
    // On the outside of the box's left face, a triangle's own rounding away from it: glass behind it, air before it.
    add_quad(&mut scene, vec3(-1.0, -0.2, -0.2), Vec3::Z * 0.4, Vec3::Y * 0.4, panel);
    scene.lights.push(point_light(vec3(0.4, 0.3, 0.0), 1.0));
    let buffers = SceneBuffers::new(gpu(), &scene, &Bvh::build(&scene), &Settings::default()).expect("the scene fits");
    let lights = &buffers.lights.table.lights;
    let found: Vec<_> = lights.iter().map(|light| (light.media, light.back_media)).collect();
    let (none, water, glow) = ([0; 4], [1, 2, 0, 0], [1, glowing + 1, 0, 0]);
    let glass = [1, 0, 0, 0];
    // The point light, the bulbs, the panel's two triangles, and glass that shines both ways; a bulb's inside is never left.
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
    let of = |mode| mean(&render_scene(&scene, &settings(mode, 10_000, 6).with(|s| s.photons.max_bounces = 12)));
    let (hybrid, photons) = (of(Mode::Hybrid), of(Mode::Photons));
    assert!(within(photons, hybrid, 0.05), "{photons} by photons, {hybrid} with rays");
    assert!(!within(photons, 0.5 * hybrid, 0.3) && hybrid > 0.1, "control");
}

#[test]
fn rays_of_final_gathering_start_in_what_is_around_them() {
    // A floor in a block of water in one of flint, in a room that is lit beside them: light comes in over the walls.
    let of = |ior: f64| Surface::Glass { ior: ior as f32, tint: Vec3::ONE };
    let mut scene = scene(&[of(FLINT), of(WATER), diffuse(0.8)]);
    add_box(&mut scene, Vec3::splat(-0.6), Vec3::splat(0.6), 0);
    add_box(&mut scene, Vec3::splat(-0.5), Vec3::splat(0.5), 1);
    add_box(&mut scene, Vec3::splat(-2.0), Vec3::splat(2.0), 2);
    add_quad(&mut scene, vec3(-0.4, -0.4, 0.4), vec3(0.8, 0.0, 0.0), vec3(0.0, 0.0, -0.8), 2);
    scene.lights.push(point_light(vec3(1.5, 0.0, 0.0), 10.0));
    scene.cameras.push(camera(vec3(0.0, 0.4, 0.001), vec3(0.0, -0.4, 0.0), 40.0));
    let of = |final_gather: u32| {
        let settings = settings(Mode::IndirectPhotons, 20_000, 6).with(|s| s.photons.final_gather = final_gather);
        mean(&render_scene(&scene, &settings))
    };
    let (estimated, gathered) = (of(0), of(32));
    assert!(within(gathered, estimated, 0.1), "{gathered} by final gathering, {estimated} without");
    assert!(!within(gathered, estimated / (FLINT * FLINT), 0.5), "control: as if the rays left from water into air");
}
