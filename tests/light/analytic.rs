//! Scenes with a closed-form solution.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | closed sphere | L = ρ/π · I/R² · (1 − ρ^B)/(1 − ρ), at 4 sigma over seeds | traced with B − 1 |
//! | final gathering | the same series with one bounce more | traced with B − 1 |
//! | closed box | stored flux = Φ (1 − ρ^B)/(1 − ρ) | traced with B − 1 |
//! | bounce limit | stored flux · (1 − ρ) + lost flux = Φ | without the lost flux |
//! | white paint | stored flux = Φ / (1 − ρ), the light that a low limit takes is told | the default limit |
//! | inverse-square law | L = ρ/π · I/d² | another distance |
//! | thin wall | black behind | lit in front |

use std::f64::consts::PI;

use caustica::{
    bvh::Bvh,
    layout::Photon,
    passes::{PhotonTracer, TracedPhotons},
    progress::Silent,
    scene::Scene,
    settings::{EstimateSettings, Mode, Sampler, Settings},
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};
use support::*;

const ALBEDO: f64 = 0.6;
const BOUNCES: u32 = 3;

/// Sum of the powers of ρ over B bounces.
fn series(albedo: f64, bounces: u32) -> f64 {
    (1.0 - albedo.powi(bounces as i32)) / (1.0 - albedo)
}

/// A sphere around its light and camera, and the radiance of its direct light.
fn closed_sphere() -> (Scene, f64) {
    let (radius, intensity) = (2.0, 5.0);
    let mut scene = scene(&[diffuse(ALBEDO as f32)]);
    scene.spheres.push(sphere(Vec3::ZERO, radius, 0));
    scene.lights.push(point_light(Vec3::ZERO, intensity));
    scene.cameras.push(camera(vec3(0.5, 0.0, 0.0), vec3(-1.0, 0.2, 0.3), 100.0));
    let direct = ALBEDO / PI * f64::from(intensity) / f64::from(radius * radius);
    (scene, direct)
}

#[test]
fn closed_sphere_has_the_radiance_of_the_series() {
    let (scene, direct) = closed_sphere();
    let right = direct * series(ALBEDO, BOUNCES);
    for mode in [Mode::Photons, Mode::Hybrid] {
        // Over 10 neighbours and over 100.
        let estimates = |sampler, max_bounces| {
            let settings = settings(mode, 40_000, 32).with(|s| {
                s.photons.max_bounces = max_bounces;
                s.photons.sampler = sampler;
            });
            let of = [10, 100].map(|neighbors| EstimateSettings { neighbors, ..settings.estimate.clone() });
            Estimate::of_pictures(6, &scene, &settings, &of)
        };
        let short = estimates(Sampler::Random, BOUNCES - 1)[0];
        assert!(short.z(right) > 4.0, "control: {mode:?}: {short:?} with a bounce less");
        let (independent, spread) = (estimates(Sampler::Random, BOUNCES), estimates(Sampler::Sobol, BOUNCES));
        for (i, neighbors) in [10, 100].into_iter().enumerate() {
            // Independent photons. Photons of a Sobol sequence keep a distance from each other,
            // which makes the squared distance of the (k+1)-th larger by up to 1/(2k).
            let found = independent[i];
            assert!(found.z(right) < 4.0, "{mode:?}, k = {neighbors}: {found:?} instead of {right}");
            // The default sampler stays within this bias.
            let least = right * (1.0 - 0.5 / f64::from(neighbors));
            let fits = |mean: f64| mean > 0.995 * least && mean < 1.005 * right;
            let spread = spread[i].mean;
            assert!(fits(spread), "{mode:?}, k = {neighbors}: {spread} is not from {least} to {right}");
            assert!(!fits(short.mean), "control: {mode:?}, k = {neighbors}: a bounce less fits");
        }
    }
}

#[test]
fn final_gathering_adds_the_bounce_that_its_rays_make() {
    let (scene, direct) = closed_sphere();
    for (mode, first) in [(Mode::Hybrid, 0.0), (Mode::IndirectPhotons, 1.0)] {
        let settings = settings(mode, 50_000, 32).with(|s| {
            s.photons.max_bounces = BOUNCES;
            s.photons.final_gather = 8;
        });
        let measured = mean(&render_scene(&scene, &settings));
        let right = direct * (series(ALBEDO, BOUNCES + 1) - first);
        assert!(within(measured, right, 0.015), "{mode:?}: {measured} instead of {right}");
        let short = mean(&render_scene(&scene, &settings.clone().with(|s| s.photons.max_bounces = BOUNCES - 1)));
        assert!(!within(short, right, 0.015), "control: {mode:?}: {short} with a bounce less");
    }
}

/// Traces photons in mode 1 and returns them with the sum of their flux per channel, W.
fn trace_photons(scene: &Scene, settings: &Settings) -> (TracedPhotons, [f64; 3]) {
    let gpu = gpu();
    let bvh = Bvh::build(scene);
    let buffers = SceneBuffers::new(gpu, scene, &bvh, &settings.lights).expect("the scene fits");
    let tracer = PhotonTracer::new(gpu, &buffers, settings.photons.sampler);
    let traced = tracer.trace(gpu, &buffers, &settings.photons, scene.has_specular(), &Silent).expect("photons trace");
    let photons: Vec<Photon> = traced.maps.global.read(gpu).expect("photons read back");
    let sum = |c: usize| photons.iter().map(|p| f64::from(p.flux[c])).sum::<f64>() / traced.maps.global.emitted as f64;
    let flux = [0, 1, 2].map(sum);
    (traced, flux)
}

#[test]
fn closed_box_stores_the_flux_of_the_series() {
    let albedo = vec3(0.8, 0.5, 0.2);
    let mut scene = scene(&[caustica::scene::Surface::Diffuse { albedo }]);
    add_box(&mut scene, vec3(-1.0, -1.0, -1.0), vec3(1.0, 2.0, 1.5), 0);
    scene.lights.push(point_light(vec3(0.2, 0.3, -0.1), 5.0));
    let settings = settings(Mode::Photons, 300_000, 1).with(|s| s.photons.max_bounces = BOUNCES);
    let (traced, flux) = trace_photons(&scene, &settings);
    let (_, short) = trace_photons(&scene, &settings.clone().with(|s| s.photons.max_bounces = BOUNCES - 1));
    let power = 4.0 * PI * 5.0;
    for channel in 0..3 {
        let rho = f64::from(albedo[channel]);
        let right = power * series(rho, BOUNCES);
        assert!(within(flux[channel], right, 0.01), "channel {channel}: {} instead of {right}", flux[channel]);
        assert!(!within(short[channel], right, 0.01), "control: channel {channel}: {} passes", short[channel]);
    }
    // Energy balance: Σ over channels of stored · (1 − ρ) +
    // lost = Φ.
    let absorbed: f64 = (0..3).map(|c| flux[c] * (1.0 - f64::from(albedo[c]))).sum::<f64>() / 3.0;
    assert!(within(absorbed + traced.lost, power, 0.01), "{absorbed} + {} instead of {power}", traced.lost);
    assert!(!within(absorbed, power, 0.01), "control: nothing was lost to the bounce limit");
    assert_eq!((traced.unfinished, traced.media_overflows), (0, 0));
}

#[test]
fn roulette_alone_ends_paths() {
    let mut scene = scene(&[diffuse(0.9)]);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.lights.push(point_light(vec3(0.2, 0.3, -0.1), 1.0));
    let settings = settings(Mode::Photons, 200_000, 1).with(|s| s.photons.max_bounces = 0);
    let (traced, flux) = trace_photons(&scene, &settings);
    let right = 4.0 * PI / (1.0 - 0.9);
    assert!(within(flux[0], right, 0.02), "{} instead of {right}", flux[0]);
    assert_eq!(traced.lost, 0.0);
    let (_, limited) = trace_photons(&scene, &settings.clone().with(|s| s.photons.max_bounces = 20));
    assert!(!within(limited[0], right, 0.02), "control: {} with at most 20 bounces", limited[0]);
    // The default limit is one that no paint notices; one that takes light is told.
    let (_, default) =
        trace_photons(&scene, &settings.with(|s| s.photons.max_bounces = Settings::default().photons.max_bounces));
    assert!(within(default[0], right, 0.02), "{} instead of {right} by default", default[0]);
}

#[test]
fn light_that_the_limit_of_bounces_takes_is_told() {
    let mut scene = scene(&[diffuse(0.9)]);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.lights.push(point_light(vec3(0.2, 0.3, -0.1), 1.0));
    scene.cameras.push(camera(Vec3::ZERO, Vec3::X, 60.0));
    let told = |bounces| {
        let settings = settings(Mode::Photons, 20_000, 8).with(|s| s.photons.max_bounces = bounces);
        render_scene(&scene, &settings).stats.warnings
    };
    let lines = told(20);
    // 0.9^20 = 0.122.
    assert!(
        lines.len() == 1 && lines[0].starts_with("12 % of the light met more than 20 diffuse surfaces"),
        "{lines:?}"
    );
    assert_eq!(told(Settings::default().photons.max_bounces), [""; 0], "control");
}

/// A floor at height 0 under a light, seen from above over a small field.
fn floor_under_light(height: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    add_quad(&mut scene, vec3(-10.0, 0.0, 10.0), vec3(20.0, 0.0, 0.0), vec3(0.0, 0.0, -20.0), 0);
    scene.lights.push(point_light(vec3(0.0, height, 0.0), 7.0));
    scene.cameras.push(camera(vec3(0.0, 5.0, 0.001), Vec3::ZERO, 1.0));
    scene
}

#[test]
fn light_falls_with_the_square_of_the_distance() {
    const SEEDS: u32 = 2;
    for (mode, tolerance) in [(Mode::DirectRays, 0.005), (Mode::DirectPhotons, 0.03)] {
        let measured = |height| {
            let one = |seed| {
                let settings = settings(mode, 100_000, 16).with(|s| {
                    s.estimate.neighbors = 125;
                    s.photons.seed = seed;
                });
                mean(&render_scene(&floor_under_light(height), &settings))
            };
            (0..SEEDS).map(one).sum::<f64>() / f64::from(SEEDS)
        };
        let right = |height: f64| 0.5 / PI * 7.0 / (height * height);
        let (near, far) = (measured(1.0), measured(2.0));
        assert!(within(near, right(1.0), tolerance), "{mode:?} at 1 m: {near} instead of {}", right(1.0));
        assert!(within(far, right(2.0), tolerance), "{mode:?} at 2 m: {far} instead of {}", right(2.0));
        assert!(!within(far, right(1.9), tolerance) && !within(near, right(2.0), tolerance), "control: {mode:?}");
    }
}

#[test]
fn a_thin_wall_is_black_behind() {
    let wall = |eye: f32| {
        let mut scene = scene(&[diffuse(0.5)]);
        add_quad(&mut scene, vec3(-1.0, -1.0, 0.0), vec3(2.0, 0.0, 0.0), vec3(0.0, 2.0, 0.0), 0);
        scene.lights.push(point_light(vec3(0.0, 0.0, 1.0), 5.0));
        scene.cameras.push(camera(vec3(0.0, 0.0, eye), Vec3::ZERO, 30.0));
        scene
    };
    for mode in [Mode::DirectRays, Mode::Photons] {
        let settings = settings(mode, 20_000, 16);
        assert_eq!(mean(&render_scene(&wall(-2.0), &settings)), 0.0, "{mode:?}: light came through the wall");
        assert!(mean(&render_scene(&wall(2.0), &settings)) > 0.1, "{mode:?}: control, the lit side is dark");
    }
}
