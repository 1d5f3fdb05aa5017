//! Multiple importance sampling: where several techniques can draw a direction, each evaluates the
//! density of the others. Lamps are plain ones, and ones whose texture cuts them into parts.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | emission | photon paths follow the balance heuristic over overlapping targets | a smaller target |
//! | emitters | directions follow the density that `arriving_at` returns | lamps chosen for another normal |
//! | strips | light from strips nearby has little noise, on diffuse surfaces and in narrow lobes | even points of the strip, by area or by solid angle |
//! | weights | of a direction to a lamp and one by the cosine sum to one | densities for another normal |

use std::f64::consts::PI;

use caustica::{
    emitters::targets::{Target, specular_targets},
    scene::{Attributes, Image, Scene, Texture, Wrap},
    settings::LightSampling,
};
use glam::{DVec3, Vec2, Vec3, vec2, vec3};
use support::*;

use super::{
    chi_square::{Directions, SAMPLES, deviate},
    light_sampling::{probe, sky, upload},
    probe::{Probe, Row, rows},
};

/// A point light at the origin and two glass balls of which it sees one behind the other's edge.
fn aimed(radius: f32) -> Scene {
    let mut scene = scene(&[glass()]);
    scene.spheres.push(sphere(vec3(0.5, 3.0, 1.0), 1.0, 0));
    scene.spheres.push(sphere(vec3(3.0, 7.0, 4.0), radius, 0));
    scene.lights.push(point_light(Vec3::ZERO, 1.0));
    scene
}

#[test]
fn aimed_emission_follows_the_balance_of_its_targets() {
    let drawn = |radius: f32| {
        let scene = aimed(radius);
        let targets = specular_targets(&scene);
        assert_eq!(targets.len(), 2);
        (probe("probe_emission", &scene, &rows(SAMPLES, [0.0, 0.0, 3.0, 0.0])), targets)
    };
    let grid = Directions { rows: 24, columns: 48 };
    // Of unlike sizes, a half of the paths is shared out whatever the size; no camera sees which
    // ball matters more.
    for (radius, smaller, by_size) in [(1.5, 1.4, 1.0), (4.5, 4.35, 0.5)] {
        let (directions, targets) = drawn(radius);
        let angle = |target: &Target| target.solid_angle(Vec3::ZERO).expect("from outside");
        let sum: f64 = targets.iter().map(angle).sum();
        let density = |d: DVec3| {
            let passes = |center: DVec3, radius: f64| d.cross(center).length() <= radius && d.dot(center) > 0.0;
            let met = targets.iter().filter(|t| passes(t.center.as_dvec3(), t.radius.into()));
            met.map(|target| by_size / sum + 0.5 * (1.0 - by_size) / angle(target)).sum::<f64>()
        };
        let densities: Vec<f64> = grid.midpoints(60).into_iter().map(density).collect();
        let test = |directions: &[[f32; 4]]| {
            deviate(&grid.counts(directions.iter().copied()), &grid.probabilities(&densities))
        };
        let found = test(&directions);
        assert!(found.fits(), "{radius}: {found:?}");
        let other = test(&drawn(smaller).0);
        assert!(!other.fits(), "control: {radius}: a smaller target: {other:?}");
        // Flux is intensity over density.
        let worst = directions.iter().map(|d| {
            let density = density(Vec3::from_slice(d).as_dvec3().normalize());
            (f64::from(d[3]) * density - 1.0).abs()
        });
        let wrong = worst.filter(|off| *off > 1e-3).count();
        assert!(wrong < SAMPLES / 1000, "{radius}: {wrong} paths have another flux than their density says");
    }
}

/// Lamps and a sky around the origin. No lamp hides another.
fn plain_lamps() -> Scene {
    let mut scene = scene(&[]);
    scene.materials.extend([emissive("panel", 0.0, 3.0, true), emissive("bulb", 0.0, 5.0, false)]);
    add_quad(&mut scene, vec3(-0.8, 1.5, -0.7), vec3(1.0, 0.3, 0.0), vec3(0.1, 0.0, 1.2), 0);
    scene.spheres.push(sphere(vec3(2.0, 0.8, 0.4), 0.6, 1));
    scene.environment = Some(sky(10.0));
    scene
}

/// The same with a texture on the panel, varied by more than a hundred times and black in places.
fn textured_lamps() -> Scene {
    let mut scene = plain_lamps();
    let mut random = photons::Random(5);
    let texel = |i: u32| {
        let bright = if i % 64 < 40 && i < 64 * 50 { (255.0 * random.unit().powi(2)) as u8 } else { 0 };
        [bright, bright / 2, 40.min(bright), 255]
    };
    let texels = (0..64 * 64).map(texel).collect();
    scene.images.push(Image { name: String::new(), width: 64, height: 64, texels });
    scene.materials[0].textures.emission = Some(Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        is_linear: true,
        is_mipmapped: false,
        uv_set: 1,
        transform: Texture::IDENTITY,
    });
    let corners = [[vec2(0.0, 0.0), vec2(0.9, 0.1), vec2(1.0, 1.0)], [vec2(0.0, 0.0), vec2(1.0, 1.0), vec2(0.1, 0.9)]];
    for (triangle, uvs) in scene.triangles.iter_mut().zip(corners) {
        scene.attributes.push(Attributes { uvs: [[Vec2::ZERO; 3], uvs], ..Attributes::default() });
        triangle.attributes = scene.attributes.len() as u32;
    }
    scene
}

/// Lamps, and their number: two triangles, or 256 parts of each, a sphere and the sky.
struct Lamps {
    scene: Scene,
    count: usize,
}

fn lamps() -> [Lamps; 2] {
    [Lamps { scene: plain_lamps(), count: 4 }, Lamps { scene: textured_lamps(), count: 514 }]
}

/// Normal of the lit surface, and another one, for which other lamps are chosen.
const NORMAL: Vec3 = vec3(0.6, 0.8, 0.0);
const OTHER: Vec3 = vec3(-0.6, 0.64, -0.48);

/// Directions to the lamps for a surface of the normal `drawn_for`, with two densities: as sampled
/// (negative where hidden), and as evaluated for a ray that hits the lamp, for the normal
/// `met_for`.
fn drawn_and_met(lamps: &Lamps, samples: &[Row], drawn_for: Vec3, met_for: Vec3) -> Vec<([f32; 4], f32)> {
    drawn_and_met_with(&[], lamps, samples, drawn_for, met_for)
}

/// The same with values of constants of the probes.
fn drawn_and_met_with(
    constants: &[(&str, f64)],
    lamps: &Lamps,
    samples: &[Row],
    drawn_for: Vec3,
    met_for: Vec3,
) -> Vec<([f32; 4], f32)> {
    let buffers = upload(&lamps.scene, LightSampling::Power);
    assert_eq!(buffers.lights.table.lights.len(), lamps.count);
    let scene = (&buffers, &buffers.lights.photons);
    let run = |stem: &str, rows: &[Row]| Probe::with_constants(stem, constants, scene).run(rows);
    let of = |a: [f32; 4], first: f32, normal: Vec3| [a, [first, normal.x, normal.y, normal.z]];
    let samples: Vec<Row> = samples.iter().map(|row| of(row[0], row[1][0], drawn_for)).collect();
    let drawn = run("probe_emitter", &samples);
    let met = run("probe_emitter_pdf", &drawn.iter().map(|d| of(*d, 0.0, met_for)).collect::<Vec<_>>());
    drawn.into_iter().zip(met).map(|(drawn, met)| (drawn, met[0])).collect()
}

fn lamp_samples() -> Vec<Row> {
    let more = rows(2 * SAMPLES, [0.0; 4]);
    let fifth = more[SAMPLES..].iter().map(|row| row[0][0]);
    more[..SAMPLES].iter().zip(fifth).map(|(row, fifth)| [row[0], [fifth, 0.0, 0.0, 0.0]]).collect()
}

#[test]
fn emitters_are_sampled_with_the_density_that_is_told() {
    lamps().iter().for_each(check_density);
}

fn check_density(lamps: &Lamps) {
    let visible = |normal| {
        let all = drawn_and_met(lamps, &lamp_samples(), normal, NORMAL);
        all.into_iter().filter(|(d, _)| d[3] > 0.0).map(|(d, _)| d).collect::<Vec<_>>()
    };
    let grid = Directions { rows: 16, columns: 32 };
    let normal = [0.0, NORMAL.x, NORMAL.y, NORMAL.z];
    let points = grid.midpoints(32).into_iter().map(|d| [d.as_vec3().extend(0.0).to_array(), normal]);
    let densities = probe("probe_emitter_pdf", &lamps.scene, &points.collect::<Vec<_>>());
    let mut probabilities = grid.probabilities(&densities.iter().map(|d| f64::from(d[0])).collect::<Vec<_>>());
    // Samples of the sky behind a lamp are hidden.
    let seen: f64 = probabilities.iter().sum();
    probabilities.iter_mut().for_each(|p| *p /= seen);
    let drawn = visible(NORMAL);
    let fraction = drawn.len() as f64 / SAMPLES as f64;
    assert!(
        (fraction - seen).abs() < 4.0 * (seen * (1.0 - seen) / SAMPLES as f64).sqrt() + 1e-3,
        "{fraction} instead of {seen}"
    );
    let test = |drawn: Vec<[f32; 4]>| deviate(&grid.counts(drawn), &probabilities);
    let found = test(drawn);
    assert!(found.fits(), "{found:?}");
    let other = test(visible(OTHER));
    assert!(!other.fits(), "control: lamps chosen for another normal: {other:?}");
}

#[test]
fn strips_nearby_light_a_surface_with_little_noise() {
    // 3 m long and 1 cm wide, 30 cm above.
    let (height, half, from, width) = (0.3, 1.5, 0.02, 0.01);
    let mut scene = scene(&[]);
    scene.materials.push(emissive("strip", 0.0, 1.0, false));
    add_quad(&mut scene, vec3(-half, height, from), 2.0 * half * Vec3::X, width * Vec3::Z, 0);
    let drawn = drawn_and_met(&Lamps { scene, count: 2 }, &lamp_samples(), Vec3::Y, Vec3::Y);
    assert!(drawn.iter().all(|(d, met)| within((*met).into(), d[3].into(), 0.01)), "both ways have one density");
    // Mean and relative variance of the light that each sample gives.
    let of = |light: &[f64]| {
        let mean = |power: i32| light.iter().map(|x| x.powi(power)).sum::<f64>() / light.len() as f64;
        (mean(1), mean(2) / mean(1).powi(2) - 1.0)
    };
    let by_area = |i: u32| {
        let x = f64::from(2.0 * half) * ((f64::from(i) + 0.5) / 1e5 - 0.5);
        let (h, z) = (f64::from(height), f64::from(from + 0.5 * width));
        f64::from(2.0 * half * width) * h * h / (x * x + h * h + z * z).powi(2)
    };
    let (found, noise) = of(&drawn.iter().map(|(d, _)| f64::from(d[1] / d[3])).collect::<Vec<_>>());
    let (right, control) = of(&(0..100_000).map(by_area).collect::<Vec<_>>());
    assert!(within(found, right, 0.005), "{found} instead of {right}");
    assert!(noise < 0.1 && control > 2.5, "{noise}, and {control} of even points of the strip");
}

#[test]
fn strips_in_narrow_lobes_have_little_noise() {
    // 3 m long and 1 cm wide, 1 m above; the viewer of `probe_emitter`, and the floor's lobe.
    let (height, half, from, width, alpha) = (1.0, 1.5, -0.8, 0.01, 0.08_f64);
    let view = DVec3::new(-0.6, 0.64, 0.48);
    // Microfacets of GGX (Walter et al. 2007, equation 33) that send light from there to the
    // viewer.
    let shown = |d: DVec3| {
        let cosine = (view + d.normalize()).normalize().y;
        alpha.powi(2) / (1.0 - cosine.powi(2) + (alpha * cosine).powi(2)).powi(2)
    };
    let strip = |turned: bool| {
        let mut scene = scene(&[]);
        scene.materials.push(emissive("strip", 0.0, 1.0, false));
        let corner = vec3(-half, height, from);
        let (along, across) = (2.0 * half * Vec3::X, width * Vec3::Z);
        // Cut by its other diagonal, and with the corners of its triangles in another order.
        match turned {
            false => add_quad(&mut scene, corner, along, across, 0),
            true => add_quad(&mut scene, corner + along, across, -along, 0),
        }
        Lamps { scene, count: 2 }
    };
    let light = |slices: f64, turned: bool| {
        let constants = [("PROBED_ALPHA", alpha), ("LIGHT_SLICES", slices)];
        let drawn = drawn_and_met_with(&constants, &strip(turned), &lamp_samples(), Vec3::Y, Vec3::Y);
        let differ = drawn.iter().filter(|(d, met)| !within((*met).into(), d[3].into(), 0.01)).count();
        assert!(differ < SAMPLES / 500, "{differ} directions have another density where a ray meets the strip");
        let of = |(d, _): &([f32; 4], f32)| shown(Vec3::from_slice(d).as_dvec3()) / f64::from(d[3]);
        let all: Vec<f64> = drawn.iter().map(of).collect();
        let mean = |power: i32| all.iter().map(|x| x.powi(power)).sum::<f64>() / all.len() as f64;
        (mean(1), mean(2) / mean(1).powi(2) - 1.0)
    };
    let by_area = |i: u32| {
        let x = f64::from(2.0 * half) * ((f64::from(i) + 0.5) / 1e5 - 0.5);
        let to = DVec3::new(x, height.into(), f64::from(from + 0.5 * width));
        shown(to) * f64::from(2.0 * half * width * height) / to.length().powi(3)
    };
    let right = (0..100_000).map(by_area).sum::<f64>() / 1e5;
    let (_, control) = light(0.0, false);
    for turned in [false, true] {
        let (found, noise) = light(16.0, turned);
        assert!(within(found, right, 0.01), "{found} instead of {right}");
        assert!(noise < 0.2 * control, "{noise}, and {control} of points of even solid angle");
    }
}

/// Weights of directions drawn with the first density, where another technique draws them with the
/// second.
fn weights(densities: &[[f32; 2]]) -> Vec<f64> {
    let rows: Vec<Row> = densities.iter().map(|[p, q]| [[*p, *q, 0.0, 0.0], [0.0; 4]]).collect();
    let found = Probe::new("probe_power_weight").run(&rows);
    found.iter().zip(densities).map(|(found, [p, _])| f64::from(found[0]) * f64::from(*p)).collect()
}

#[test]
fn the_power_heuristic_follows_its_formula() {
    let densities = [[1.0, 0.0], [1.0, 1.0], [0.5, 2.0], [3.0, 0.7], [1e-20, 1e18], [1e18, 1e-20], [1e-30, 0.0]];
    for ([p, q], found) in densities.iter().zip(weights(&densities)) {
        let (p, q) = (f64::from(*p), f64::from(*q));
        let right = 1.0 / (1.0 + (q / p).powi(2));
        assert!((found - right).abs() < 1e-5, "{p} and {q}: {found} instead of {right}");
    }
    let balance = 0.5 / 2.5;
    assert!((weights(&[[0.5, 2.0]])[0] - balance).abs() > 0.1, "control: the balance heuristic");
}

#[test]
fn weights_of_both_ways_to_an_emitter_sum_to_one() {
    lamps().iter().for_each(check_weights);
}

fn check_weights(lamps: &Lamps) {
    let samples = lamp_samples();
    let pairs = drawn_and_met(lamps, &samples, NORMAL, NORMAL);
    let other = drawn_and_met(lamps, &samples, NORMAL, OTHER);
    // Densities of the same direction: of light sampling as drawn, of light sampling as evaluated
    // for a cosine sample, and of cosine sampling.
    let sums = |met: &dyn Fn(usize) -> Option<f32>| {
        let densities = |(i, (drawn, _)): (usize, &([f32; 4], f32))| {
            let (cosine, p, met) = (drawn[1] / PI as f32, drawn[3], met(i)?);
            (p > 0.0 && cosine > 0.0).then_some([[p, cosine], [cosine, met]])
        };
        let both: Vec<[[f32; 2]; 2]> = pairs.iter().enumerate().filter_map(densities).collect();
        weights(&both.concat()).chunks(2).map(|pair| pair[0] + pair[1]).collect::<Vec<f64>>()
    };
    let wrong = |sums: &[f64]| sums.iter().filter(|sum| (*sum - 1.0).abs() > 2e-3).count();
    let right = sums(&|i| Some(pairs[i].1));
    assert!(right.len() > SAMPLES / 4, "{} directions are visible", right.len());
    // Directions at an emitter's edge may hit a neighbouring surface.
    assert!(wrong(&right) < right.len() / 500, "{} of {} pairs of weights", wrong(&right), right.len());
    let mixed = sums(&|i| Some(other[i].1));
    assert!(wrong(&mixed) > mixed.len() / 2 && mixed.len() > 1000, "control: {} of {}", wrong(&mixed), mixed.len());
}
