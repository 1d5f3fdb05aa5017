//! Wide coats whose light the rays of final gathering of their point bring.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | light | coats of two widths show what rays of their own find, also along the surface and at a foot | no coat |
//! | noise | a dark wall under a coat shows a small spot of light with a small part of the noise | rays of its own |
//! | mirrors | a coat shows a lamp that it sees in a mirror alone | no mirror |

use caustica::{
    renderer::Render,
    scene::{Light, LightKind, Material, Scene, Surface},
    settings::{Mode, Settings},
};
use glam::{Vec3, vec3};
use support::*;

const SIDE: u32 = 64;

fn coated(base: f32, roughness: f32, specular: f32) -> Material {
    let surface =
        Surface::Layered { base: Vec3::splat(base), metallic: 0.0, f0: Vec3::splat(0.04 * specular), specular };
    Material { roughness, metallic: 0.0, ..Material::new("coat", surface) }
}

/// A room of 2 m with a dark floor and a block on it, both under a coat, before a wall with a spot
/// of light of so many degrees.
fn room(coat: Material, degrees: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.4)]);
    scene.materials.push(coat);
    add_box(&mut scene, Vec3::ONE, Vec3::NEG_ONE, 0);
    add_quad(&mut scene, vec3(-0.99, -0.99, 0.99), 1.98 * Vec3::X, -1.98 * Vec3::Z, 1);
    add_box(&mut scene, vec3(-0.5, -0.99, -0.5), vec3(-0.1, -0.5, -0.1), 1);
    scene.lights.push(Light {
        kind: LightKind::Spot { inner: 0.8 * degrees.to_radians(), outer: degrees.to_radians() },
        direction: Vec3::NEG_Z,
        intensity: Vec3::splat(20.0),
        ..point_light(vec3(0.2, 0.1, 0.5), 1.0)
    });
    scene.cameras.push(camera(vec3(0.0, -0.5, 0.95), vec3(0.0, -0.8, -0.5), 60.0));
    scene
}

/// Coats whose light is gathered between `spacing` pixels, or, with 0, found by rays of their own.
fn sampled(spacing: u32, spp: u32) -> Settings {
    settings(Mode::Hybrid, 30_000, SIDE).with(|s| {
        s.photons.final_gather = 32;
        s.estimate.neighbors = 50;
        s.estimate.irradiance_cells = 1.0;
        s.estimate.gather_spacing = spacing;
        s.picture.spp = spp;
        s.picture.max_spp = None;
    })
}

/// Green light of the lower three eighths of the picture, where the floor is, by blocks of so many
/// pixels along each side.
fn floor(render: &Render, side: usize) -> Vec<f64> {
    let all = blocks(render.frame.radiance(), side);
    all[all.len() * 5 / 8..].iter().map(|[_, g, _]| f64::from(*g)).collect()
}

/// Root mean square of the difference of two floors, in units of the right one's.
fn difference(found: &Render, right: &Render, side: usize) -> f64 {
    let (found, right) = (floor(found, side), floor(right, side));
    let squares = found.iter().zip(&right).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    (squares / right.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// Mean of the floor.
fn mean_floor(render: &Render) -> f64 {
    let all = floor(render, 1);
    all.iter().sum::<f64>() / all.len() as f64
}

#[test]
fn wide_coats_show_what_rays_of_their_own_find() {
    for roughness in [0.5, 0.9] {
        let scene = room(coated(0.02, roughness, 1.0), 20.0);
        let right = render_scene(&scene, &sampled(0, 32));
        // The filter's own blur is for pictures of more pixels.
        let found = render_scene(&scene, &sampled(2, 16).with(|s| s.estimate.gather_radius = 2.0));
        let wrong = difference(&found, &right, 8);
        assert!(wrong < 0.1, "roughness {roughness}: blocks differ by {wrong}");
        let means = [&found, &right].map(mean_floor);
        assert!(within(means[0], means[1], 0.02), "{} instead of {}", means[0], means[1]);
        let bare = render_scene(&room(coated(0.02, roughness, 0.0), 20.0), &sampled(2, 16));
        assert!(difference(&bare, &right, 8) > 0.3, "control: without its coat the floor is darker");
    }
}

#[test]
fn wide_coats_show_small_bright_places_without_noise() {
    let scene = room(coated(0.02, 0.8, 1.0), 4.0);
    let right = render_scene(&scene, &sampled(0, 64));
    let [found, control] = [2, 0].map(|spacing| difference(&render_scene(&scene, &sampled(spacing, 4)), &right, 1));
    assert!(found < 0.4 * control, "{found}, and {control} by rays of their own");
}

#[test]
fn wide_coats_show_lamps_in_mirrors() {
    // The lamp shines to one side, where the mirror stands.
    let lit = |surface: Surface| {
        let mut scene = room(coated(0.0, 0.6, 1.0), 20.0);
        scene.lights.clear();
        scene.materials.push(Material::new("mirror", surface));
        scene.materials.push(emissive("lamp", 0.0, 30.0, false));
        add_quad(&mut scene, vec3(0.98, -0.9, -0.9), 1.8 * Vec3::Y, 1.8 * Vec3::Z, 2);
        add_quad(&mut scene, vec3(0.3, -0.2, -0.6), 0.4 * Vec3::Y, 0.4 * Vec3::Z, 3);
        scene
    };
    let scene = lit(Surface::Mirror { tint: Vec3::ONE });
    let right = render_scene(&scene, &sampled(0, 32));
    let found = render_scene(&scene, &sampled(2, 32));
    let means = [&found, &right].map(mean_floor);
    assert!(within(means[0], means[1], 0.02), "{} instead of {}", means[0], means[1]);
    let dull = render_scene(&lit(diffuse(0.0)), &sampled(2, 16));
    let dull = mean_floor(&dull);
    assert!(dull < 0.8 * means[1], "control: {dull} without a mirror, {} with it", means[1]);
}
