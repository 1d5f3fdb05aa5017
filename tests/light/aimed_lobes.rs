//! Rough lobes that see a small bright place, or a lamp in glass: a part of their rays is aimed at
//! it.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | noise | a wall of rough metal shows a spot of light on the floor with little noise, and with the mean of many samples | without final gathering, nothing is aimed |
//! | narrow | a narrow lobe finds the spot by itself, and loses few of its samples | the rough wall |
//! | reflectors | a rough coat shows a lamp in a metal reflector with little noise, and with the mean of many samples | without final gathering, nothing is aimed |
//! | lamps | rough metal shows lamps in glass of the index of air with the light of bare ones and little noise, in mirrors as well | a plate of the same glass, which no lamp is in |

use caustica::{
    renderer::Render,
    scene::{Light, LightKind, Material, Scene, Surface, Triangle},
    settings::{Mode, Settings},
};
use glam::{Vec3, vec3};
use support::*;

const SIDE: u32 = 32;

/// A room of 2 m with a spot of light of 36 cm on the floor, and a wall of metal opposite the
/// camera.
fn room(roughness: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.3)]);
    add_box(&mut scene, Vec3::ONE, Vec3::NEG_ONE, 0);
    let surface = Surface::Layered { base: Vec3::splat(0.9), metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
    scene.materials.push(Material { roughness, metallic: 1.0, ..Material::new("metal", surface) });
    add_quad(&mut scene, vec3(-0.99, -0.99, -0.95), 1.98 * Vec3::X, 1.98 * Vec3::Y, 1);
    scene.lights.push(Light {
        kind: LightKind::Spot { inner: 0.08, outer: 0.1 },
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(300.0),
        ..point_light(vec3(0.1, 0.9, -0.2), 1.0)
    });
    scene.cameras.push(camera(vec3(0.0, 0.1, 0.95), vec3(0.0, 0.0, -0.95), 45.0));
    scene
}

/// Few samples, with final gathering or by the photons around each point.
fn sampled(rays: u32, spp: u32) -> Settings {
    settings(Mode::Hybrid, 30_000, SIDE).with(|s| {
        s.photons.final_gather = rays;
        s.estimate.neighbors = 50;
        s.estimate.irradiance_cells = 1.0;
        s.estimate.gather_spacing = if rays > 0 { 2 } else { 0 };
        s.picture.spp = spp;
        s.picture.max_spp = None;
    })
}

/// Sum of squared differences over that of squares.
fn error(found: &Render, right: &Render) -> f64 {
    let pairs = || found.frame.radiance().iter().flatten().zip(right.frame.radiance().iter().flatten());
    let sum = |of: &dyn Fn(f32, f32) -> f32| pairs().map(|(a, b)| f64::from(of(*a, *b))).sum::<f64>();
    sum(&|a, b| (a - b).powi(2)) / sum(&|_, b| b * b)
}

#[test]
fn rough_metal_shows_a_small_spot_of_light_without_noise() {
    let scene = room(0.7);
    let right = render_scene(&scene, &sampled(0, 256));
    let (aimed, plain) = (render_scene(&scene, &sampled(16, 4)), render_scene(&scene, &sampled(0, 4)));
    let (found, control) = (error(&aimed, &right), error(&plain, &right));
    assert!(found < 0.25 * control, "{found}, and {control} where nothing is aimed");
    let many = render_scene(&scene, &sampled(16, 64));
    assert!(within(mean(&many), mean(&right), 0.01), "{} instead of {}", mean(&many), mean(&right));
}

#[test]
fn narrow_lobes_keep_their_samples() {
    let scene = room(0.15);
    let right = render_scene(&scene, &sampled(0, 256));
    let (aimed, plain) = (render_scene(&scene, &sampled(16, 4)), render_scene(&scene, &sampled(0, 4)));
    let (found, control) = (error(&aimed, &right), error(&plain, &right));
    assert!(found < 1.2 * control && found > 0.3 * control, "{found}, and {control} where nothing is aimed");
}

/// A room of 2 m with a dark wall under a rough coat, and a small lamp in a square reflector of
/// metal, a pyramid that opens to the wall.
fn before_reflector() -> Scene {
    let layered = |name, metallic, base, roughness| {
        let surface = Surface::Layered { base: Vec3::splat(base), metallic, f0: Vec3::splat(0.04), specular: 1.0 };
        Material { roughness, metallic, ..Material::new(name, surface) }
    };
    let mut scene = scene(&[diffuse(0.5)]);
    scene.materials.extend([
        layered("wall", 0.0, 0.1, 0.7),
        layered("reflector", 1.0, 0.9, 0.25),
        emissive("lamp", 0.0, 500.0, false),
    ]);
    add_box(&mut scene, Vec3::ONE, Vec3::NEG_ONE, 0);
    add_quad(&mut scene, vec3(-0.99, -0.99, -0.95), 1.98 * Vec3::X, 1.98 * Vec3::Y, 1);
    let (apex, depth, half) = (vec3(0.1, 0.2, 0.2), 0.15, 0.12);
    for (a, b) in [(vec3(-1.0, -1.0, 0.0), vec3(1.0, -1.0, 0.0)), (vec3(1.0, -1.0, 0.0), vec3(1.0, 1.0, 0.0))] {
        for sign in [1.0, -1.0] {
            let rim = |corner: Vec3| apex + sign * half * corner - depth * Vec3::Z;
            let corners = [apex, rim(a), rim(b)];
            let normal = (corners[1] - apex).cross(corners[2] - apex).normalize();
            scene.triangles.push(Triangle::new(corners, [normal; 3], 2));
        }
    }
    scene.spheres.push(sphere(apex - 0.08 * Vec3::Z, 0.01, 3));
    scene.cameras.push(camera(vec3(0.0, 0.1, 0.95), vec3(0.0, 0.0, -0.95), 45.0));
    scene
}

#[test]
fn rough_coats_show_lamps_in_reflectors_without_noise() {
    let scene = before_reflector();
    let right = render_scene(&scene, &sampled(0, 512));
    let (aimed, plain) = (render_scene(&scene, &sampled(16, 8)), render_scene(&scene, &sampled(0, 8)));
    let (found, control) = (error(&aimed, &right), error(&plain, &right));
    assert!(found < 0.3 * control, "{found}, and {control} where nothing is aimed");
    // Coats that are seen blurred are 1 to 2 % darker with final gathering.
    let many = render_scene(&scene, &sampled(16, 64));
    assert!(within(mean(&many), mean(&right), 0.03), "{} instead of {}", mean(&many), mean(&right));
}

/// A floor of rough metal under two small lamps, with glass of the index of air about each or
/// between both and the floor, which is seen at once or by a mirror.
fn under_lamps(cover: Option<(Vec3, Vec3)>, by_mirror: bool) -> Scene {
    let surface = Surface::Layered { base: Vec3::splat(0.9), metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
    let mut scene = scene(&[Surface::Glass { ior: 1.0001, tint: Vec3::ONE }, Surface::Mirror { tint: Vec3::ONE }]);
    scene.materials.push(Material { roughness: 0.4, metallic: 1.0, ..Material::new("metal", surface) });
    scene.materials.push(emissive("lamp", 0.0, 1000.0, false));
    add_quad(&mut scene, vec3(-1.0, 0.0, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z, 2);
    for x in [-0.4, 0.3] {
        let at = vec3(x, 0.6, -0.1);
        scene.spheres.push(sphere(at, 0.01, 3));
        if let Some((min, max)) = cover {
            add_box(&mut scene, at + min, at + max, 0);
        }
    }
    let mut eye = vec3(0.0, 0.5, 1.2);
    if by_mirror {
        add_quad(&mut scene, vec3(-2.0, -2.0, 1.3), 4.0 * Vec3::Y, 4.0 * Vec3::X, 1);
        eye = vec3(0.0, 0.5, 1.25);
    }
    let ahead = if by_mirror { vec3(0.0, 0.0, 2.6) } else { Vec3::ZERO };
    scene.cameras.push(camera(eye, ahead, 40.0));
    scene
}

#[test]
fn rough_metal_shows_lamps_in_glass_without_noise() {
    let seen = |cover, by_mirror, spp| {
        let settings = settings(Mode::DirectRays, 1000, 24).with(|s| (s.picture.spp, s.picture.max_spp) = (spp, None));
        render_scene(&under_lamps(cover, by_mirror), &settings)
    };
    let about = Some((Vec3::splat(-0.05), Vec3::splat(0.05)));
    let below = Some((vec3(-0.2, -0.5, -0.4), vec3(0.2, -0.1, 0.4)));
    for by_mirror in [false, true] {
        let right = seen(None, by_mirror, 256);
        let many = seen(about, by_mirror, 256);
        assert!(within(mean(&many), mean(&right), 0.02), "{} instead of {}", mean(&many), mean(&right));
        let (found, control) = (error(&seen(about, by_mirror, 16), &right), error(&seen(below, by_mirror, 16), &right));
        assert!(found < 0.01 * control, "{found}, and {control} where no lamp is in the glass");
    }
}
