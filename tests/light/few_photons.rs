//! Estimates of few photons against closed forms, whatever the sampler and the kernel.
//!
//! | light on a floor | closed form | negative control |
//! |---|---|---|
//! | of a point light | I cos θ / d² | the raw estimate of 10 photons of Sobol numbers |
//! | of its image in a mirror above, by the caustic map | the same from the image | without the mirror |
//! | after several bounces in a closed sphere | the series of bounces | one bounce less |

use std::f64::consts::PI;

use caustica::{
    density::DensityKernel,
    scene::{Scene, Surface},
    settings::{EstimateSettings, Mode, Sampler, Settings},
};
use glam::{Vec3, vec3};
use support::*;

const ALBEDO: f32 = 0.5;
/// Pixels along a side of the pictures.
const SIZE: u32 = 32;

/// A floor of 6 m, a lamp of 10 W/sr a metre above it, and a camera that sees its middle.
fn floor() -> Scene {
    let mut scene = scene(&[diffuse(ALBEDO), Surface::Mirror { tint: Vec3::ONE }]);
    add_quad(&mut scene, vec3(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::Z * -6.0, 0);
    scene.lights.push(point_light(vec3(0.0, 1.0, 0.0), 10.0));
    scene.cameras.push(camera(vec3(0.0, 0.8, 0.01), vec3(0.0, 0.0, 0.01), 80.0));
    scene
}

/// Mean radiance of the floor over the picture for lamps of 10 W/sr at those heights above it.
fn right(scene: &Scene, size: u32, heights: &[f64]) -> f64 {
    let camera = &scene.cameras[0];
    let half = (80.0_f64.to_radians() / 2.0).tan() * f64::from(camera.position.y);
    // Points within a pixel in both directions.
    let cells = 4 * size;
    let at = |i: u32| (2.0 * (f64::from(i) + 0.5) / f64::from(cells) - 1.0) * half;
    let mut sum = 0.0;
    for (x, z) in (0..cells).flat_map(|x| (0..cells).map(move |z| (x, z))) {
        let [x, z] = [at(x), at(z) + f64::from(camera.position.z)];
        let from = |h: &f64| 10.0 * h / (x * x + z * z + h * h).powf(1.5);
        sum += heights.iter().map(from).sum::<f64>() * f64::from(ALBEDO) / PI;
    }
    sum / f64::from(cells * cells)
}

fn asked(sampler: Sampler) -> Settings {
    settings(Mode::Photons, 100_000, SIZE).with(|s| {
        s.photons.sampler = sampler;
        s.picture.spp = 2;
    })
}

fn estimate(kernel: DensityKernel, neighbors: u32) -> EstimateSettings {
    EstimateSettings { kernel, neighbors, ..EstimateSettings::default() }
}

fn constant(neighbors: u32) -> EstimateSettings {
    estimate(DensityKernel::Constant, neighbors)
}

#[test]
fn few_photons_are_as_bright_as_many() {
    let scene = floor();
    let right = right(&scene, SIZE, &[1.0]);
    let others = [(DensityKernel::Cone, 3), (DensityKernel::Gaussian, 20), (DensityKernel::Silverman, 5)];
    let corrected = [1, 3, 10, 30, 100].map(constant).into_iter().chain(others.map(|(kernel, k)| estimate(kernel, k)));
    let mut estimates: Vec<_> = corrected.collect();
    estimates.push(EstimateSettings { raw: true, ..constant(10) });
    let found = Estimate::of_pictures(2, &scene, &asked(Sampler::Sobol), &estimates);
    let (raw, found) = found.split_last().expect("the raw estimate");
    for (EstimateSettings { kernel, neighbors: k, .. }, Estimate { mean, .. }) in estimates.iter().zip(found) {
        assert!(within(*mean, right, 0.01), "{kernel:?}, k = {k}: {mean:.4}, right {right:.4}");
    }
    let random = Estimate::of_pictures(8, &scene, &asked(Sampler::Random), &[constant(3)])[0];
    assert!(random.z(right) < 4.0 && random.error < 0.01 * right, "random: {random:?}, right {right:.4}");
    let raw = raw.mean;
    assert!(!within(raw, right, 0.02), "control: the raw estimate of 10 photons: {raw:.4}, right {right:.4}");
}

#[test]
fn few_photons_of_a_caustic_are_as_bright_as_many() {
    let mut scene = floor();
    let alone = Estimate::of_pictures(2, &scene, &asked(Sampler::Sobol), &[constant(10)])[0].mean;
    // Two metres above the floor; it faces down. The image of the lamp lies three metres above.
    add_quad(&mut scene, vec3(-6.0, 2.0, -6.0), Vec3::X * 12.0, Vec3::Z * 12.0, 1);
    let right = right(&scene, SIZE, &[1.0, 3.0]);
    let settings = asked(Sampler::Sobol).with(|s| s.photons.max_bounces = 1);
    let counts = [1, 3, 10, 30];
    for (k, found) in counts.into_iter().zip(Estimate::of_pictures(2, &scene, &settings, &counts.map(constant))) {
        let found = found.mean;
        assert!(within(found, right, 0.01), "k = {k}: {found:.4}, right {right:.4}");
    }
    assert!(!within(alone, right, 0.05), "control: without the mirror {alone:.4}, right {right:.4}");
}

#[test]
fn few_photons_of_several_bounces_are_as_bright_as_many() {
    let mut scene = scene(&[diffuse(0.6)]);
    scene.spheres.push(sphere(Vec3::ZERO, 2.0, 0));
    scene.lights.push(point_light(Vec3::ZERO, 5.0));
    scene.cameras.push(camera(vec3(0.5, 0.0, 0.0), vec3(-1.0, 0.2, 0.3), 100.0));
    let bounces = |count: i32| 0.6 / PI * 5.0 / 4.0 * (1.0 - 0.6_f64.powi(count)) / 0.4;
    let settings = asked(Sampler::Sobol).with(|s| s.photons.max_bounces = 3);
    let counts = [1, 3, 10, 30];
    for (k, found) in counts.into_iter().zip(Estimate::of_pictures(3, &scene, &settings, &counts.map(constant))) {
        let found = found.mean;
        assert!(within(found, bounces(3), 0.01), "k = {k}: {found:.4}, right {:.4}", bounces(3));
        assert!(!within(found, bounces(2), 0.05), "control: k = {k}: a bounce less: {:.4}", bounces(2));
    }
}
