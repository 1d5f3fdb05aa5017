//! Lights and albedos at the ends of their ranges.

use caustica::{
    renderer::Render,
    scene::{Scene, Surface},
    settings::Mode,
    stats::NonFinite,
};
use glam::{Vec3, vec3};

use support::*;

use super::{flux, is_finite, traced};

/// A room with a glass ball, a point light, and an emissive panel.
fn room(intensity: f32, radiance: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    scene.materials.push(emissive("panel", 0.0, radiance, false));
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.spheres.push(sphere(vec3(0.3, -0.5, 0.0), 0.4, 1));
    add_quad(&mut scene, vec3(-0.3, 0.9, -0.3), vec3(0.6, 0.0, 0.0), vec3(0.0, 0.0, 0.6), 2);
    scene.lights.push(point_light(vec3(-0.5, 0.2, 0.3), intensity));
    scene.cameras.push(camera(vec3(0.0, 0.0, 0.95), vec3(0.0, -0.3, 0.0), 70.0));
    scene
}

fn picture(scene: &Scene, seed: u32) -> Render {
    let settings = settings(Mode::Hybrid, 3000, 8).with(|s| {
        s.photons.seed = seed;
        s.picture.light_samples = 1;
        s.estimate.neighbors = 30;
    });
    render_scene(scene, &settings)
}

#[test]
fn what_leaves_the_range_of_numbers_is_counted_and_left_out() {
    let beyond = picture(&room(3e38, 1.0), 0);
    assert!(is_finite(&beyond), "infinity reached the film");
    let NonFinite { photons, direct, .. } = beyond.stats.non_finite;
    assert!(photons > 0 && direct > 0, "{:?}", beyond.stats.non_finite);
    let said = beyond.stats.warnings.iter().filter(|w| w.contains("infinite or undefined")).count();
    assert_eq!(said, 1, "{:?}", beyond.stats.warnings);
    // The estimate overflows where flux over area does, although the photons are finite.
    let bright = picture(&room(1e36, 1.0), 0);
    assert!(is_finite(&bright) && bright.stats.non_finite.photons == 0, "{:?}", bright.stats.non_finite);
    let ordinary = picture(&room(1.0, 1.0), 0);
    assert_eq!(ordinary.stats.non_finite, NonFinite::default(), "control");
    assert!(mean(&ordinary) > 0.01 && !ordinary.stats.warnings.iter().any(|w| w.contains("infinite")));
}

#[test]
fn the_strength_of_light_is_a_factor() {
    let one = picture(&room(1.0, 2.0), 0);
    // Powers of two near 1e-6, 1e9 and 1e30, which are exact.
    for exponent in [-20, 30, 100] {
        let factor = 2.0_f32.powi(exponent);
        let other = picture(&room(factor, 2.0 * factor), 0);
        assert_eq!(other.stats.non_finite, NonFinite::default());
        let same = |render: &Render| {
            one.frame.radiance().iter().zip(render.frame.radiance()).all(|(a, b)| a.map(|x| x * factor) == *b)
        };
        assert!(same(&other), "2^{exponent} gives another picture");
        assert!(exponent > 0 || !same(&picture(&room(factor, 2.0 * factor), 1)), "control: another seed");
    }
}

/// A closed box of this albedo with a light of 1 W/sr.
fn closed_box(albedo: f32) -> Scene {
    let mut scene = scene(&[diffuse(albedo)]);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.lights.push(point_light(vec3(0.2, 0.3, -0.1), 1.0));
    scene.cameras.push(camera(Vec3::ZERO, Vec3::X, 60.0));
    scene
}

#[test]
fn black_and_white_rooms_end() {
    let black = render_scene(&closed_box(0.0), &settings(Mode::Hybrid, 1000, 8));
    assert!(is_finite(&black) && mean(&black) == 0.0 && black.stats.non_finite == NonFinite::default());
    // Nothing is absorbed: each bounce stores the full power, and the bounce limit ends all paths.
    let power = 4.0 * std::f64::consts::PI;
    let limited = |albedo: f32, max_bounces: u32, max_paths: u64| {
        let settings = settings(Mode::Photons, 100_000, 8).with(|s| {
            s.photons.max_bounces = max_bounces;
            s.photons.max_paths = Some(max_paths);
        });
        traced(&closed_box(albedo), &settings)
    };
    let white = limited(1.0, 30, 1000);
    assert!(within(flux(&white.maps.global), 30.0 * power, 1e-4), "{} W", flux(&white.maps.global));
    assert!(within(white.lost, power, 1e-3), "{} W were lost", white.lost);
    let grey = limited(0.9, 30, 1000);
    assert!(!within(flux(&grey.maps.global), 30.0 * power, 0.3) && grey.lost < 0.2 * power, "control");
    // Without a limit `MAX_BOUNCES` ends them.
    let endless = limited(1.0, 0, 2);
    assert_eq!((endless.maps.global.stored, endless.non_finite), (2 * 4095, 0));
}

#[test]
fn tints_of_zero_end_paths_in_glass_and_mirrors() {
    for surface in [Surface::Mirror { tint: Vec3::ZERO }, Surface::Glass { ior: 1.5, tint: Vec3::ZERO }] {
        let mut scene = room(1.0, 1.0);
        scene.materials[1].surface = surface;
        let render = picture(&scene, 0);
        assert!(is_finite(&render) && render.stats.non_finite == NonFinite::default(), "{surface:?}");
    }
}
