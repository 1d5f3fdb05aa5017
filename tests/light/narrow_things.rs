//! Indirect light on things that are narrower than the disc of an estimate, in a room of 2 m.
//!
//! | things | right | negative control |
//! |---|---|---|
//! | rods of 4 and 2 cm, a grate | a path tracer outside of the crate, 400 paths a pixel of 60 bounces | the raw estimate |
//! | wires of 6 mm, leaves of 8 mm | final gathering, whose rays mostly end on walls | the raw estimate |
//! | a folded sheet and a torus, 10,000 to 1,000,000 photons | each other | light a tenth stronger |

use std::f32::consts::TAU;

use caustica::{
    renderer::Render,
    scene::{Projection, Scene, Triangle},
    settings::{Mode, Settings},
};
use glam::{Vec3, vec3};
use support::{photons::Random, *};

/// A closed room with a lamp, seen from above.
fn room(half_view: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.7)]);
    scene.materials[0].double_sided = true;
    add_box(&mut scene, Vec3::ONE, Vec3::NEG_ONE, 0);
    scene.lights.push(point_light(vec3(0.1, 0.8, 0.1), 3.0));
    let mut above = camera(vec3(0.0, 0.3, 0.0), Vec3::ZERO, 60.0);
    (above.right, above.up) = (Vec3::X, Vec3::NEG_Z);
    above.projection = Projection::Orthographic { ymag: half_view };
    scene.cameras.push(above);
    scene
}

/// Surface over a grid of `u` and `v` from 0 to 1, which yields positions and normals.
fn add_grid(scene: &mut Scene, (nu, nv): (u32, u32), at: impl Fn(f32, f32) -> (Vec3, Vec3)) {
    for i in 0..nu {
        for j in 0..nv {
            let corner = |di, dj| at((i + di) as f32 / nu as f32, (j + dj) as f32 / nv as f32);
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            for [p, q, r] in [[a, b, c], [a, c, d]] {
                let (positions, normals) = ([p.0, q.0, r.0], [p.1, q.1, r.1]);
                scene.triangles.push(Triangle::new(positions, normals, 0));
            }
        }
    }
}

/// Rods of twelve sides, 1.8 m long, side by side.
fn rods(radius: f32, count: u32, half_view: f32) -> Scene {
    let mut scene = room(half_view);
    for i in 0..count {
        let x = -0.81 + 1.62 * i as f32 / (count - 1) as f32;
        add_grid(&mut scene, (12, 1), |u, v| {
            let normal = vec3((TAU * u).cos(), (TAU * u).sin(), 0.0);
            (vec3(x, 0.0, 0.9 - 1.8 * v) + radius * normal, normal)
        });
    }
    scene
}

/// Bars of 1 cm with gaps of 2 cm.
fn grate() -> Scene {
    let mut scene = room(0.2);
    for i in 0..45 {
        let x = -0.675 + 0.03 * i as f32;
        add_box(&mut scene, vec3(x - 0.005, -0.02, -0.7), vec3(x + 0.005, 0.0, 0.7), 0);
    }
    scene
}

/// Square leaves of 8 mm, turned at random.
fn leaves() -> Scene {
    let mut scene = room(0.12);
    let mut random = Random(4);
    for _ in 0..4000 {
        let center = (random.vector() - 0.5) * vec3(1.4, 0.2, 1.4);
        let (a, b) = random.direction().any_orthonormal_pair();
        add_quad(&mut scene, center - 0.004 * (a + b), 0.008 * a, 0.008 * b, 0);
    }
    scene
}

fn bent_sheet() -> Scene {
    let mut scene = room(0.8);
    add_grid(&mut scene, (14, 1), |u, v| {
        let fold = if ((14.0 * u).round() as u32).is_multiple_of(2) { 0.0 } else { 0.05 };
        (vec3(-0.7 + 1.4 * u, fold, 0.7 - 1.4 * v), Vec3::Y)
    });
    for triangle in &mut scene.triangles {
        let [a, b, c] = triangle.positions;
        triangle.normals = [(b - a).cross(c - a).normalize(); 3];
    }
    scene
}

fn torus() -> Scene {
    let mut scene = room(0.8);
    add_grid(&mut scene, (96, 24), |u, v| {
        let around = vec3((TAU * u).cos(), 0.0, (TAU * u).sin());
        let normal = (TAU * v).cos() * around - (TAU * v).sin() * Vec3::Y;
        (0.6 * around + 0.04 * normal, normal)
    });
    scene
}

fn asked(photons: u32) -> Settings {
    Settings::default().with(|s| {
        s.photons.mode = Mode::Hybrid;
        s.photons.global = photons;
        s.picture.size = Some((64, 64));
    })
}

/// Pixels on the things, above the floor by more than half a metre.
fn on_things(render: &Render) -> Vec<f64> {
    let pixels = render.frame.radiance().iter().zip(render.frame.depth());
    pixels.filter(|(_, depth)| **depth < 0.5).map(|(rgb, _)| f64::from(rgb[1])).collect()
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn greatest_of(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// Mean and greatest of the pixels on the things, over some seeds.
fn found(scene: &Scene, settings: &Settings, seeds: u32) -> (f64, f64) {
    let (pixels, _) = found_and_raw(scene, settings, seeds, 0);
    (mean_of(&pixels.concat()), greatest_of(&pixels.concat()))
}

/// Whether the mean over the seeds is within 3 % of what is right, and two standard errors.
fn is_about(pixels_of_seeds: &[Vec<f64>], right: f64) -> bool {
    let means: Vec<f64> = pixels_of_seeds.iter().map(|pixels| mean_of(pixels)).collect();
    let Estimate { mean, error } = Estimate::of(&means);
    println!("{mean:.4} ± {error:.4}, right {right:.4}");
    (mean - right).abs() < 0.03 * right + 2.0 * error && error < 0.03 * right
}

/// Pixels on the things for each of some seeds, and by the raw estimate of the same photons over
/// the first of them.
fn found_and_raw(scene: &Scene, settings: &Settings, seeds: u32, raw_seeds: u32) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (mut found, mut raw) = (Vec::new(), Vec::new());
    for seed in 0..seeds {
        let settings = settings.clone().with(|s| s.photons.seed = seed);
        let estimates = [settings.estimate.clone(), settings.clone().with(|s| s.estimate.raw = true).estimate];
        let renders = render_estimates(scene, &settings, &estimates[..1 + usize::from(seed < raw_seeds)]);
        found.push(on_things(&renders[0]));
        raw.extend(renders[1..].iter().flat_map(on_things));
    }
    (found, raw)
}

#[test]
fn rods_and_bars_have_the_light_of_a_path_tracer() {
    // Mean, and greatest pixel of the path tracer.
    let table = [
        ("rods of 4 cm", rods(0.02, 10, 0.8), 1.558, 2.44),
        ("rods of 2 cm", rods(0.01, 10, 0.3), 2.005, 2.45),
        ("grate", grate(), 2.216, 2.57),
    ];
    for (name, things, right, greatest) in table {
        let (pixels, raw) = found_and_raw(&things, &asked(200_000), 4, 1);
        assert!(is_about(&pixels, right), "{name}, right {right}");
        let (most, raw) = (greatest_of(&pixels.concat()), mean_of(&raw));
        assert!(most < 1.7 * greatest, "{name}: a pixel of {most:.2}");
        assert!(!within(raw, right, 0.1), "control: {name}: raw {raw:.3}, right {right}");
    }
}

#[test]
fn few_photons_on_rods_are_no_sparks() {
    let settings = asked(50_000).with(|s| {
        s.photons.mode = Mode::IndirectPhotons;
        s.photons.final_gather = 0;
        s.estimate.neighbors = 20;
        s.estimate.share_reach = 0.0;
        s.picture.size = Some((96, 96));
    });
    let (mean, most) = found(&rods(0.012, 10, 0.8), &settings, 3);
    assert!(mean > 0.0 && most < 30.0 * mean, "a pixel of {most}, the mean is {mean}");
}

#[test]
fn wires_and_leaves_have_the_light_that_final_gathering_finds() {
    for (name, things) in [("wires", rods(0.003, 20, 0.12)), ("leaves", leaves())] {
        let right = found(&things, &asked(200_000).with(|s| s.photons.final_gather = 12), 1);
        let (pixels, raw) = found_and_raw(&things, &asked(200_000), 4, 2);
        let pixels = pixels.concat();
        let (mean, most, raw) = (mean_of(&pixels), greatest_of(&pixels), mean_of(&raw));
        assert!(within(mean, right.0, 0.06), "{name}: {mean:.3}, right {:.3}", right.0);
        assert!(most < 3.0 * right.1, "{name}: a pixel of {most:.2}, right at most {:.2}", right.1);
        assert!(!within(raw, right.0, 0.06), "control: {name}: raw {raw:.3}, right {:.3}", right.0);
    }
}

#[test]
fn bent_things_are_as_bright_with_few_photons_as_with_many() {
    for (name, mut things) in [("folded sheet", bent_sheet()), ("torus", torus())] {
        let (right, _) = found(&things, &asked(500_000), 1);
        for (photons, seeds) in [(10_000, 4), (200_000, 2)] {
            let (pixels, _) = found_and_raw(&things, &asked(photons), seeds, 0);
            assert!(is_about(&pixels, right), "{name}, {photons} photons, right {right:.3}");
        }
        things.lights[0].intensity *= 1.1;
        let (brighter, _) = found(&things, &asked(200_000), 1);
        assert!(!within(brighter, right, 0.03), "control: {name}: light a tenth stronger passes");
    }
}
