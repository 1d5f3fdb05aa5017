//! Light through glass against Snell and Fresnel.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | ball in glass | the radiance of a diffuse ball inside a glass ball, by photons alone | in denser glass |
//! | slab, camera | a ray through a slab is shifted by d sin(i) (1 − cos i / (n cos t)) | no glass |
//! | slab, photons | a slab transmits the fraction 1 − 2F/(1 + F) of the incident flux | as of the pane |
//! | pane | the same reflectance for a thin pane | a denser one |
//! | air bubble | an ior-1 sphere in glass deflects like a hole | solid glass |

use std::f64::consts::PI;

use caustica::{
    scene::{Scene, Surface},
    settings::Mode,
};
use glam::{Vec3, vec3};
use support::*;

/// Fresnel reflectance of unpolarised light from outside glass of index `n`, at the cosine of
/// incidence.
fn fresnel(cos_i: f64, n: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (n * n)).sqrt();
    let (s, p) = ((cos_i - n * cos_t) / (cos_i + n * cos_t), (n * cos_i - cos_t) / (n * cos_i + cos_t));
    (s * s + p * p) / 2.0
}

/// A floor that is black for x < 0 and white for x > 0, below a slab if there is one.
fn edge_scene(slab: Option<Surface>) -> Scene {
    let mut scene = scene(&[diffuse(0.0), diffuse(1.0), slab.unwrap_or(glass())]);
    add_quad(&mut scene, vec3(-9.0, 0.0, 9.0), vec3(9.0, 0.0, 0.0), vec3(0.0, 0.0, -18.0), 0);
    add_quad(&mut scene, vec3(0.0, 0.0, 9.0), vec3(9.0, 0.0, 0.0), vec3(0.0, 0.0, -18.0), 1);
    if slab.is_some() {
        add_box(&mut scene, vec3(-8.0, 1.0, -8.0), vec3(8.0, 2.0, 8.0), 2);
    }
    scene.lights.push(point_light(vec3(0.0, 0.5, 0.0), 1.0));
    scene
}

/// Height, as a fraction of the picture, of the black part below the edge in the middle column.
fn edge_height(scene: &Scene) -> f64 {
    let settings = settings(Mode::DirectRays, 1000, 128).with(|s| s.picture.spp = 16);
    let frame = render_scene(scene, &settings).frame;
    let column: Vec<f32> = frame.radiance().iter().skip(64).step_by(128).map(|p| p[0]).collect();
    // The white part has a radiance of about 1. Stray reflections in the glass brighten the black
    // part a little.
    let dark = 0.2;
    column.iter().filter(|p| **p < dark).count() as f64 / 128.0
}

#[test]
fn a_slab_shifts_the_view_as_snell_says() {
    let eye = vec3(-4.0, 4.0, 0.0);
    let edge_seen = |slab: Option<Surface>, x: f64| {
        let mut scene = edge_scene(slab);
        scene.cameras.push(camera(eye, vec3(x as f32, 0.0, 0.0), 6.0));
        edge_height(&scene)
    };
    let clear = edge_seen(None, 0.0);
    assert!((clear - 0.5).abs() < 0.02, "without glass the edge is at {clear}");
    // Through a slab of thickness 1 a ray falls short of its aim by tan i − tan t: aim that much
    // beyond the edge.
    let mut aim = 0.0_f64;
    for _ in 0..50 {
        let tan_i = (4.0 + aim) / 4.0;
        let sin_t = tan_i / (1.0 + tan_i * tan_i).sqrt() / 1.5;
        aim = tan_i - sin_t / (1.0 - sin_t * sin_t).sqrt();
    }
    let moved = edge_seen(Some(glass()), aim);
    assert!((moved - 0.5).abs() < 0.03, "aimed {aim} m beyond the edge, the camera sees it at {moved}");
    let control = edge_seen(Some(glass()), 0.0);
    assert!((control - 0.5).abs() > 0.1, "control: the slab does not shift the view");
}

/// A light above a slab or pane above a floor; photons that reach the floor near the axis, W/m².
fn irradiance_below(cover: Option<Surface>) -> f64 {
    let mut scene = scene(&[diffuse(1.0), cover.unwrap_or(diffuse(0.0))]);
    add_quad(&mut scene, vec3(-2.0, 0.0, 2.0), vec3(4.0, 0.0, 0.0), vec3(0.0, 0.0, -4.0), 0);
    match cover {
        Some(Surface::Pane { .. }) => {
            add_quad(&mut scene, vec3(-2.0, 0.5, 2.0), vec3(4.0, 0.0, 0.0), vec3(0.0, 0.0, -4.0), 1);
        }
        Some(_) => add_box(&mut scene, vec3(-2.0, 0.5, -2.0), vec3(2.0, 0.51, 2.0), 1),
        None => {}
    }
    scene.lights.push(point_light(vec3(0.0, 5.0, 0.0), 1.0));
    // Below the cover, so that the camera's own path stays clear.
    scene.cameras.push(camera(vec3(0.0, 0.4, 0.001), Vec3::ZERO, 100.0));
    let settings = settings(Mode::DirectPhotons, 80_000, 8).with(|s| s.estimate.neighbors = 300);
    mean(&render_scene(&scene, &settings)) * PI
}

#[test]
fn slab_and_pane_pass_what_fresnel_leaves() {
    let clear = irradiance_below(None);
    assert!(within(clear, 1.0 / 25.0, 0.04), "without a cover: {clear} W/m²");
    let f = fresnel(1.0, 1.5);
    let right = 1.0 - 2.0 * f / (1.0 + f);
    let [slab, pane] = [|ior| Surface::Glass { ior, tint: Vec3::ONE }, |ior| Surface::Pane { ior, tint: Vec3::ONE }];
    for cover in [slab(1.5), pane(1.5)] {
        let passed = irradiance_below(Some(cover)) / clear;
        assert!(within(passed, right, 0.03), "{cover:?} passes {passed} instead of {right}");
    }
    let denser = irradiance_below(Some(pane(1.8))) / clear;
    assert!(!within(denser, right, 0.03), "control: a denser pane passes {denser} too");
}

#[test]
fn a_ball_in_glass_has_the_radiance_of_its_photons() {
    // A small diffuse ball of radius b in the centre of a glass ball of radius R; light and camera
    // at distance D.
    let (b, big, distance) = (0.3_f32, 1.0_f32, 4.0_f32);
    let measured = |ior: f32| {
        let mut scene = scene(&[diffuse(0.5), Surface::Glass { ior, tint: Vec3::ONE }]);
        scene.spheres.push(sphere(Vec3::ZERO, big, 1));
        scene.spheres.push(sphere(Vec3::ZERO, b, 0));
        scene.lights.push(point_light(vec3(0.0, 0.0, distance), 1000.0));
        scene.cameras.push(camera(vec3(0.0, 0.0, distance), Vec3::ZERO, 2.0));
        let settings = settings(Mode::DirectPhotons, 20_000, 16).with(|s| {
            s.estimate.neighbors = 100;
            s.photons.max_bounces = 2;
            s.photons.max_paths = Some(20_000_000);
        });
        mean(&render_scene(&scene, &settings))
    };
    // Paraxial optics on the axis: a ray that meets the glass at height h is inclined by h/R · (1 −
    // 1/n) − h/(g n) behind it, g = D − R being the distance from the light, and meets the ball's
    // pole at depth R − b.
    let (n, gap, depth) = (1.5_f64, f64::from(distance - big), f64::from(big - b));
    let squeeze = 1.0 - depth * ((n - 1.0) / (n * f64::from(big)) - 1.0 / (gap * n));
    let irradiance = 1000.0 / gap.powi(2) * (1.0 - fresnel(1.0, n)) / squeeze.powi(2);
    // Seen from outside: L = ρ/π · E · (1 − F) / n², the factor between radiance in glass and in
    // air.
    let right = 0.5 / PI * irradiance * (1.0 - fresnel(1.0, n)) / (n * n);
    assert!(within(measured(1.5), right, 0.05), "{} instead of {right}", measured(1.5));
    assert!(!within(measured(1.7), right, 0.05), "control: {} in denser glass", measured(1.7));
}

#[test]
fn an_air_bubble_is_a_closed_surface_of_ior_one() {
    // A camera looks straight down, 0.4 m beside the axis of a ball in a slab, at a floor that is
    // white on its side of the axis and black on the other.
    let through = |ior: f32| {
        let mut scene = scene(&[diffuse(0.0), diffuse(1.0), glass(), Surface::Glass { ior, tint: Vec3::ONE }]);
        add_quad(&mut scene, vec3(-9.0, 0.0, 9.0), vec3(9.0, 0.0, 0.0), vec3(0.0, 0.0, -18.0), 0);
        add_quad(&mut scene, vec3(0.0, 0.0, 9.0), vec3(9.0, 0.0, 0.0), vec3(0.0, 0.0, -18.0), 1);
        add_box(&mut scene, vec3(-8.0, 1.0, -8.0), vec3(8.0, 5.0, 8.0), 2);
        scene.spheres.push(sphere(vec3(0.0, 3.0, 0.0), 1.5, 3));
        scene.lights.push(point_light(vec3(0.0, 0.5, 0.0), 1.0));
        scene.cameras.push(camera(vec3(0.4, 8.0, 0.001), vec3(0.4, 0.0, 0.0), 1.0));
        let settings = settings(Mode::DirectRays, 1000, 8).with(|s| s.picture.spp = 16);
        mean(&render_scene(&scene, &settings))
    };
    // A bubble refracts the view away from the axis, and a ball of the slab's own index does not
    // change it: both see white, farther from the light and nearer to it. A denser ball inverts the
    // view: black, but for stray reflections.
    let (bubble, same, denser) = (through(1.0), through(1.5), through(3.0));
    assert!(bubble > 0.001 && bubble < 0.5 * same, "bubble {bubble}, same index {same}");
    assert!(denser < 0.1 * same, "control: a denser ball gives {denser}, the same index {same}");
}
