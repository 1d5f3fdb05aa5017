//! Sampling of lights follows the densities: chi-square at a significance of 1e-4, with fixed
//! seeds.
//!
//! | test | density | negative control |
//! |---|---|---|
//! | choice | of photon paths by power | uniform over the lights |
//! | surface | 1/area, of a triangle and a sphere | a corner moved; a sphere moved |
//! | profile | the cosine on one side and on both; a spot's falloff, soft and hard | another inner cone; the other number of sides |
//! | environment | by cells, and by the density told | another map |

use std::f64::consts::{PI, TAU};

use caustica::{
    bvh::Bvh,
    scene::{Environment, Light, LightKind, Scene},
    settings::{LightSampling, Settings},
    upload::{SceneBuffers, light_buffers::ChoiceBuffer},
};
use glam::{Vec3, vec3};
use support::*;

use super::{
    chi_square::{Directions, SAMPLES, deviate, height_and_azimuth, of_unit_square},
    probe::{Probe, Row, rows},
};
pub fn upload(scene: &Scene, sampling: LightSampling) -> SceneBuffers {
    let settings = Settings::default().with(|s| s.lights.sampling = sampling);
    SceneBuffers::new(gpu(), scene, &Bvh::build(scene), &settings.lights).expect("the scene fits")
}

/// Rows of a probe over the scene, its lights chosen by power.
pub fn probe(stem: &str, scene: &Scene, rows: &[Row]) -> Vec<[f32; 4]> {
    let buffers = upload(scene, LightSampling::Power);
    Probe::of_scene(stem, &buffers, &buffers.lights.photons).run(rows)
}

/// An emissive triangle and an emissive sphere, apart from each other.
fn shapes(corner: Vec3, center: Vec3, double_sided: bool) -> Scene {
    let mut scene = scene(&[]);
    scene.materials.push(emissive("lamp", 0.0, 2.0, double_sided));
    let positions = [vec3(1.0, 2.0, 0.0), vec3(2.0, 2.5, 0.3), corner];
    scene.triangles.push(caustica::scene::Triangle::new(positions, [Vec3::Y; 3], 0));
    scene.spheres.push(sphere(center, 0.5, 0));
    scene
}

const CORNER: Vec3 = vec3(1.2, 2.2, 1.5);
const CENTER: Vec3 = vec3(-2.0, 1.0, 0.5);

#[test]
fn lights_are_chosen_by_power() {
    let mut scene = shapes(CORNER, CENTER, false);
    let intensities = [1.0, 2.0, 0.0, 0.5, 4.0];
    scene.lights = intensities.map(|intensity| point_light(Vec3::Y, intensity)).into();
    let area = 0.5 * (vec3(2.0, 2.5, 0.3) - vec3(1.0, 2.0, 0.0)).cross(CORNER - vec3(1.0, 2.0, 0.0)).length();
    let surfaces = [f64::from(area) * TAU, 4.0 * PI * 0.25 * TAU];
    let chosen = |buffers: &SceneBuffers, choices: &ChoiceBuffer, powers: &[f64; 7]| {
        let drawn = Probe::of_scene("probe_light_choice", buffers, choices).run(&rows(SAMPLES, [7.0, 0.0, 0.0, 0.0]));
        let total: f64 = powers.iter().sum();
        let mut counts = [0.0; 7];
        drawn.iter().for_each(|[light, ..]| counts[*light as usize] += 1.0);
        let told =
            drawn.iter().all(|[light, told, ..]| within(f64::from(*told), powers[*light as usize] / total, 1e-5));
        (deviate(&counts, &powers.map(|power| power / total)), told)
    };
    let buffers = upload(&scene, LightSampling::Power);
    let mut powers = [0.0; 7];
    intensities.iter().zip(&mut powers).for_each(|(intensity, power)| *power = 4.0 * PI * f64::from(*intensity));
    powers[5..].copy_from_slice(&surfaces);
    let (photons, told) = chosen(&buffers, &buffers.lights.photons, &powers);
    assert!(photons.fits(), "{photons:?}");
    assert!(told, "the probabilities that come with the lights are others");
    let alike = upload(&scene, LightSampling::Uniform);
    let (alike, told) = chosen(&alike, &alike.lights.photons, &powers);
    assert!(!alike.fits() && !told, "control: every light alike: {alike:?}");
}

#[test]
fn surfaces_are_sampled_by_area() {
    let drawn = |scene: &Scene, light: f32| probe("probe_light_surface", scene, &rows(SAMPLES, [light, 0.0, 0.0, 0.0]));
    // (β + γ)² and γ/(β + γ) of the barycentric coordinates are uniform.
    let on_triangle = |points: Vec<[f32; 4]>| {
        let [a, b, c] = [vec3(1.0, 2.0, 0.0), vec3(2.0, 2.5, 0.3), CORNER].map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a);
        of_unit_square(points.iter().map(|p| {
            let p = Vec3::from_slice(p).as_dvec3() - a;
            let [beta, gamma] = [p.cross(c - a), (b - a).cross(p)].map(|v| v.dot(normal) / normal.length_squared());
            [(beta + gamma).powi(2), gamma / (beta + gamma).max(1e-12)]
        }))
    };
    let on_sphere = |points: Vec<[f32; 4]>| {
        let from_center = |p: &[f32; 4]| (Vec3::from_slice(p) - CENTER).extend(0.0).to_array();
        of_unit_square(points.iter().map(|p| {
            let [height, azimuth] = height_and_azimuth(from_center(p), Vec3::Z);
            [height / 2.0, azimuth]
        }))
    };
    let (here, moved) = (shapes(CORNER, CENTER, false), shapes(CORNER * 1.03, CENTER + vec3(0.01, 0.0, 0.02), false));
    let (triangle, ball) = (on_triangle(drawn(&here, 0.0)), on_sphere(drawn(&here, 1.0)));
    assert!(triangle.fits() && ball.fits(), "triangle {triangle:?}, sphere {ball:?}");
    let (triangle, ball) = (on_triangle(drawn(&moved, 0.0)), on_sphere(drawn(&moved, 1.0)));
    assert!(!triangle.fits() && !ball.fits(), "control: triangle {triangle:?}, sphere {ball:?}");
}

#[test]
fn surfaces_send_by_the_cosine() {
    let normal = vec3(0.48, -0.6, 0.64);
    let drawn = |both: bool| {
        let scene = shapes(CORNER, CENTER, both);
        probe("probe_light_profile", &scene, &rows(SAMPLES, normal.extend(0.0).to_array()))
    };
    let test = |directions: &[[f32; 4]], both: bool| {
        of_unit_square(directions.iter().map(|d| {
            let [height, azimuth] = height_and_azimuth(*d, normal);
            let sine2 = height * (2.0 - height);
            let fraction = if height < 1.0 { sine2 } else { 2.0 - sine2 };
            [if both { 0.5 * fraction } else { fraction }, azimuth]
        }))
    };
    for both in [false, true] {
        let directions = drawn(both);
        let found = test(&directions, both);
        assert!(found.fits(), "both sides {both}: {found:?}");
        let other = test(&drawn(!both), both);
        assert!(!other.fits(), "control: both sides {}: {other:?}", !both);
        let off = |d: &[f32; 4]| (d[3] - Vec3::from_slice(d).dot(normal).abs()).abs();
        assert!(directions.iter().all(|d| off(d) < 1e-5), "the profile is the cosine");
    }
}

/// Squared falloff between the cones of a spot at the height 1 − cos θ, and its integral from 0 to
/// there.
fn falloff(inner: f64, outer: f64, height: f64) -> (f64, f64) {
    let edge = 1.0 - outer.cos();
    let width = (inner.cos() - outer.cos()).max(1e-12);
    let rest = |height: f64| {
        let t = ((edge - height) / width).clamp(0.0, 1.0);
        // Integral beyond the height: linear within the inner cone, a cubic between the cones.
        width * t.powi(3) / 3.0 + (edge - width - height).max(0.0)
    };
    (((edge - height) / width).clamp(0.0, 1.0).powi(2), rest(0.0) - rest(height))
}

#[test]
fn spots_send_by_their_falloff() {
    let axis = vec3(0.48, -0.6, 0.64);
    let drawn = |inner: f32, outer: f32| {
        let mut scene = shapes(CORNER, CENTER, false);
        let kind = LightKind::Spot { inner, outer };
        scene.lights.push(Light { kind, direction: axis, ..point_light(Vec3::ZERO, 1.0) });
        probe("probe_light_profile", &scene, &rows(SAMPLES, axis.extend(0.0).to_array()))
    };
    for (inner, outer) in [(0.0_f32, 0.5_f32), (0.3, 0.6), (0.6, 0.6), (0.1, 1.5), (0.02, 0.03), (0.0, 0.004)] {
        let of = |height: f64| falloff(inner.into(), outer.into(), height);
        let whole = of(1.0 - f64::from(outer).cos()).1;
        let test = |directions: &[[f32; 4]]| {
            of_unit_square(directions.iter().map(|d| {
                let [height, azimuth] = height_and_azimuth(*d, axis);
                [of(height).1 / whole, azimuth]
            }))
        };
        let directions = drawn(inner, outer);
        let found = test(&directions);
        assert!(found.fits(), "from {inner} to {outer}: {found:?}");
        let other = test(&drawn(0.5 * (inner + outer) - 0.1 * inner, 1.02 * outer));
        assert!(!other.fits(), "control: from {inner} to {outer}, another spot: {other:?}");
        // An edge without falloff lies somewhere within the rounding of directions.
        let edge = 1.0 - f64::from(outer).cos();
        let heights = directions.iter().map(|d| (f64::from(d[3]), height_and_azimuth(*d, axis)[0]));
        let apart = heights.filter(|(_, height)| inner < outer || (height - edge).abs() > 1e-6);
        let worst = apart.map(|(profile, height)| (profile - of(height).0).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-3, "the profile from {inner} to {outer} is off by {worst}");
    }
}

/// A map of varied pixels, some black and one bright.
pub fn sky(bright: f32) -> Environment {
    let (width, height) = (16, 8);
    let mut random = photons::Random(9);
    let mut pixels: Vec<[f32; 3]> = (0..width * height).map(|_| [random.unit().powi(2), 0.3, random.unit()]).collect();
    pixels[40..50].fill([0.0; 3]);
    pixels[37] = [bright; 3];
    Environment { width, height, pixels, rotation: 0.7, ..Environment::uniform(Vec3::ZERO) }
}

fn under(environment: Environment) -> Scene {
    Scene { environment: Some(environment), ..shapes(CORNER, CENTER, false) }
}

/// Probability of each cell of a map, `rows + 1` rows of `columns`: mean of its corners times its
/// solid angle, normalized.
fn cell_probabilities(map: &Environment) -> Vec<f64> {
    let (columns, rows) = (map.width as usize, map.height as usize);
    let at = |x: usize, y: usize| map.pixels[y * columns + x % columns].iter().map(|c| f64::from(*c)).sum::<f64>();
    let edge = |row: usize| (PI * (row as f64 - 0.5).clamp(0.0, rows as f64) / rows as f64).cos();
    let weight = |i: usize| {
        let (x, row) = (i % columns, i / columns);
        let (above, below) = (row.max(1) - 1, row.min(rows - 1));
        (at(x, above) + at(x + 1, above) + at(x, below) + at(x + 1, below)) * (edge(row) - edge(row + 1))
    };
    let weights: Vec<f64> = (0..columns * (rows + 1)).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

/// The cell of such a map that a direction lies in.
fn cell_of(map: &Environment, direction: &[f32; 4]) -> usize {
    let d = Vec3::from_slice(direction).as_dvec3();
    let (s, c) = f64::from(map.rotation).sin_cos();
    let u = 0.5 + (c * d.z + s * d.x).atan2(c * d.x - s * d.z) / TAU;
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    let column = (u * f64::from(map.width) - 0.5).floor() as i64;
    let row = (v * f64::from(map.height) + 0.5) as usize;
    row * map.width as usize + column.rem_euclid(map.width.into()) as usize
}

#[test]
fn environments_are_sampled_by_their_light() {
    let samples = rows(2 * SAMPLES, [0.0; 4]);
    let drawn = |bright| probe("probe_environment", &under(sky(bright)), &samples);
    let (directions, other) = (drawn(30.0), drawn(33.0));
    let map = sky(30.0);
    let of_cells = |directions: &[[f32; 4]]| {
        let mut counts = vec![0.0; 16 * 9];
        directions.iter().for_each(|d| counts[cell_of(&map, d)] += 1.0);
        deviate(&counts, &cell_probabilities(&map))
    };
    let (found, wrong) = (of_cells(&directions), of_cells(&other));
    assert!(found.fits(), "cells: {found:?}");
    assert!(!wrong.fits(), "control: cells of a map with a brighter pixel: {wrong:?}");
    // Directions at a finer resolution than the cells, against the density that other passes
    // evaluate.
    let grid = Directions { rows: 24, columns: 48 };
    let points: Vec<Row> = grid.midpoints(8).iter().map(|d| [d.as_vec3().extend(0.0).to_array(), [0.0; 4]]).collect();
    let densities = probe("probe_environment_pdf", &under(sky(30.0)), &points);
    let probabilities = grid.probabilities(&densities.iter().map(|d| f64::from(d[0])).collect::<Vec<_>>());
    let whole: f64 = probabilities.iter().sum();
    assert!((whole - 1.0).abs() < 2e-3, "the density integrates to {whole}");
    let [found, wrong] = [directions, other].map(|drawn| deviate(&grid.counts(drawn), &probabilities));
    assert!(found.fits(), "directions: {found:?}");
    assert!(!wrong.fits(), "control: directions in a map with a brighter pixel: {wrong:?}");
}
