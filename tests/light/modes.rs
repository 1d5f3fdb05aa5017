//! The five modes add up, and agree where they should.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | sum | mode 0 = mode 2 + mode 4, to rounding | mode 3 in place of 4 |
//! | limit | means of modes 0 and 1 agree at 4 sigma over seeds | mode 1 without the weakest lamp, 1 % of the light |
//! | smooth ball | modes 0 and 1 agree on a coarse smooth-shaded ball | flat-shaded ball |
//! | final gathering | the same mean as without, whether emission is aimed or not | one lamp fewer; another mode |
//! | irradiance cells | final gathering makes the picture of an estimate at each end of a ray | wide cells |
//! | full map | a map full at 1 % of the paths gives the same mean | one lamp fewer |

use caustica::{
    image::difference::rel_mse,
    progress::Silent,
    renderer::{Render, render},
    scene::{Scene, Triangle},
    settings::{Emission, LightSampling, Mode, Sampler},
};
use glam::{Vec3, vec3};
use support::*;

/// A closed room with a glass and a diffuse ball and three unequal lights.
fn room() -> Scene {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    add_box(&mut scene, vec3(-1.0, 0.0, -1.0), vec3(1.0, 2.0, 3.0), 0);
    scene.spheres.push(sphere(vec3(0.45, 0.4, 0.2), 0.4, 1));
    scene.spheres.push(sphere(vec3(-0.45, 0.4, -0.2), 0.4, 0));
    scene.lights.push(point_light(vec3(0.0, 1.7, 0.0), 5.0));
    scene.lights.push(point_light(vec3(-0.8, 1.2, 0.5), 0.5));
    scene.lights.push(point_light(vec3(0.7, 1.0, 1.0), 0.05));
    scene.cameras.push(camera(vec3(0.0, 1.0, 2.9), vec3(0.0, 0.8, 0.0), 60.0));
    scene
}

/// The room without one of its lamps.
fn without_lamp(lamp: usize) -> Scene {
    let mut scene = room();
    scene.lights.remove(lamp);
    scene
}

/// Largest difference of two pictures' channels, as a fraction of the mean.
fn largest_difference(render: &Render, sum: &[[f32; 3]]) -> f64 {
    let scale = mean(render);
    let difference =
        render.frame.radiance().iter().flatten().zip(sum.iter().flatten()).map(|(a, b)| f64::from((a - b).abs()));
    difference.fold(0.0, f64::max) / scale
}

#[test]
fn hybrid_is_direct_rays_plus_indirect_photons() {
    let scene = room();
    let [hybrid, direct, indirect, other] =
        [Mode::Hybrid, Mode::DirectRays, Mode::IndirectPhotons, Mode::DirectPhotons]
            .map(|mode| render_scene(&scene, &settings(mode, 20_000, 48)));
    let sum = |a: &Render, b: &Render| -> Vec<[f32; 3]> {
        let add = |(a, b): (&[f32; 3], &[f32; 3])| (Vec3::from(*a) + Vec3::from(*b)).to_array();
        a.frame.radiance().iter().zip(b.frame.radiance()).map(add).collect()
    };
    let right = largest_difference(&hybrid, &sum(&direct, &indirect));
    let wrong = largest_difference(&hybrid, &sum(&direct, &other));
    assert!(right < 1e-4, "modes 2 and 4 differ from mode 0 by {right} of the mean");
    assert!(wrong > 1e-2, "control: mode 3 in place of mode 4 differs by only {wrong}");
}

#[test]
fn final_gathering_has_the_mean_of_the_estimate() {
    let scene = room();
    let settings = settings(Mode::Hybrid, 50_000, 24).with(|s| {
        s.photons.max_bounces = 0;
        // Unaimed, each takes dozens of paths.
        s.photons.caustic = 8000;
        s.picture.spp = 1;
    });
    let plain = mean(&render_scene(&scene, &settings));
    let gathered = |scene: &Scene, emission| {
        let gathers = settings.clone().with(|s| {
            s.photons.final_gather = 32;
            s.photons.emission = emission;
        });
        mean(&render_scene(scene, &gathers))
    };
    for emission in [Emission::Aimed, Emission::Unaimed] {
        let found = gathered(&scene, emission);
        assert!(within(found, plain, 0.015), "{emission:?}: {found} instead of {plain}");
    }
    let darker = gathered(&without_lamp(1), Emission::Aimed);
    assert!(!within(darker, plain, 0.015), "control: {darker} without the second lamp");
    for mode in [Mode::Photons, Mode::DirectPhotons, Mode::DirectRays] {
        let wrong = settings.clone().with(|s| {
            s.photons.mode = mode;
            s.photons.final_gather = 1;
        });
        let refused = render(gpu(), &scene, &wrong, &Silent).map(drop).expect_err("the mode has no final gathering");
        assert!(refused.to_string().contains("photons.final_gather"), "{refused}");
    }
}

#[test]
fn irradiance_kept_in_cells_makes_the_picture_of_an_estimate_at_each_end() {
    let picture = |cells: f32| {
        let settings = settings(Mode::Hybrid, 50_000, 24).with(|s| {
            s.photons.final_gather = 8;
            s.estimate.irradiance_cells = cells;
        });
        render_scene(&room(), &settings).frame.radiance().to_vec()
    };
    let (full, kept, coarse) = (picture(0.0), picture(0.5), picture(2.0));
    let mean = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|c| f64::from(*c)).sum::<f64>();
    let ratio = mean(&kept) / mean(&full);
    assert!((ratio - 1.0).abs() < 0.002, "the mean is {ratio} of that of all estimates");
    let (error, control) = (rel_mse(&kept, &full, None), rel_mse(&coarse, &full, None));
    assert!(error < 5e-4, "cells add an error of {error}");
    assert!(error > 0.0, "control: nothing is kept");
    assert!(control > 2.0 * error, "control: wide cells add {control}, narrow ones {error}");
}

#[test]
fn hybrid_and_photons_agree_in_the_limit() {
    const SEEDS: u32 = 4;
    // Independent photons. Estimates over photons of a Sobol sequence are up to 1/(2k) darker.
    let picture = |scene: &Scene, mode, seed| {
        let settings = settings(mode, 50_000, 32).with(|s| {
            s.photons.seed = seed;
            s.photons.sampler = Sampler::Random;
        });
        mean(&render_scene(scene, &settings))
    };
    let hybrid: Vec<f64> = (0..SEEDS).map(|seed| picture(&room(), Mode::Hybrid, seed)).collect();
    // Both modes trace the same paths, so that most of their noise is the same.
    let ratio =
        |scene: &Scene| Estimate::over_seeds(SEEDS, |seed| picture(scene, Mode::Photons, seed) / hybrid[seed as usize]);
    let same = ratio(&room());
    assert!(same.z(1.0) < 4.0, "mode 1 over mode 0: {same:?}");
    let darker = ratio(&without_lamp(2));
    assert!(darker.z(1.0) > 4.0, "control: without the weakest lamp, mode 1 over mode 0: {darker:?}");
}

/// A coarse ball; `smooth`: with the normals of the sphere at its corners.
fn coarse_ball(smooth: bool) -> Scene {
    let mut scene = scene(&[diffuse(0.7)]);
    let (rows, columns) = (5, 8);
    let corner = |row: i32, column: i32| {
        let theta = std::f32::consts::PI * row as f32 / rows as f32;
        let phi = std::f32::consts::TAU * column as f32 / columns as f32;
        vec3(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos())
    };
    for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
        let [a, b, c, d] =
            [corner(row, column), corner(row + 1, column), corner(row + 1, column + 1), corner(row, column + 1)];
        for positions in [[a, b, c], [a, c, d]] {
            let normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]);
            if normal.length() > 1e-6 {
                let normals = if smooth { positions } else { [normal.normalize(); 3] };
                scene.triangles.push(Triangle::new(positions, normals, 0));
            }
        }
    }
    scene.lights.push(point_light(vec3(1.5, 2.0, 2.5), 10.0));
    scene.cameras.push(camera(vec3(0.0, 0.0, 4.0), Vec3::ZERO, 32.0));
    scene
}

#[test]
fn modes_agree_on_a_smooth_shaded_ball() {
    let picture = |mode, smooth| {
        let settings = settings(mode, 100_000, 40).with(|s| s.estimate.neighbors = 150);
        render_scene(&coarse_ball(smooth), &settings)
    };
    // Means over blocks of 4 x 4 pixels reduce noise. Pixels at the shadow's edge are left out:
    // there the disc of the estimate extends beyond the lit surface.
    let blocks = |render: &Render| -> Vec<f64> {
        let block = |b: usize| {
            let pixels = (0..16).map(|i| ((b / 10) * 4 + i / 4) * 40 + (b % 10) * 4 + i % 4);
            pixels.map(|p| f64::from(render.frame.radiance()[p][0])).sum::<f64>() / 16.0
        };
        (0..100).map(block).collect()
    };
    let rms = |a: &Render, b: &Render| {
        let pairs: Vec<_> = blocks(a).into_iter().zip(blocks(b)).filter(|(x, y)| x.min(*y) > 0.1).collect();
        assert!(pairs.len() > 15, "too few blocks are lit");
        (pairs.iter().map(|(x, y)| ((x - y) / x).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt()
    };
    let rays = picture(Mode::DirectRays, true);
    let (right, wrong) =
        (rms(&rays, &picture(Mode::DirectPhotons, true)), rms(&rays, &picture(Mode::DirectPhotons, false)));
    assert!(right < 0.6 * wrong, "smooth photons differ from smooth rays by {right}, flat photons by {wrong}");
    let (a, b) = (mean(&rays), mean(&picture(Mode::DirectPhotons, true)));
    assert!(within(b, a, 0.03), "mean {b} by photons, {a} by rays");
}

#[test]
fn a_full_map_is_normalised_by_its_own_paths() {
    let scene = room();
    for light_sampling in [LightSampling::Power, LightSampling::Uniform] {
        let small = settings(Mode::Photons, 1, 32).with(|s| {
            s.photons.global = 5_000;
            s.photons.caustic = 100_000;
            s.photons.max_paths = Some(500_000);
            s.estimate.neighbors = 50;
            s.lights.sampling = light_sampling;
            // With few photons, sharing of estimates loses 2 % of the light of so small a picture.
            s.estimate.share_reach = 0.0;
        });
        let full = render_scene(&scene, &small);
        let open = render_scene(&scene, &small.clone().with(|s| s.photons.global = 250_000));
        let (global, caustic) = (full.stats.photons.global, full.stats.photons.caustic);
        assert!(global.stored > 4_900, "the global map holds only {} photons", global.stored);
        assert!(caustic.emitted > 20 * global.emitted, "the global map was full after {} paths", global.emitted);
        let (a, b) = (mean(&full), mean(&open));
        assert!(within(a, b, 0.03), "{light_sampling:?}: mean {a} with a full map, {b} with an open one");
        let darker = mean(&render_scene(&without_lamp(1), &small));
        assert!(!within(darker, b, 0.03), "control: {light_sampling:?}: {darker} without the second lamp");
    }
}
