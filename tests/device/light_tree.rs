//! Lights are chosen by the trees over them with the probability that is told.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | choice | lights are as frequent as their probability says (chi-square), and it is the same both ways | probabilities for another point |
//! | microfacets | the same for rough lobes | probabilities for another viewer |
//! | highlight | the one of many lamps that narrow microfacets mirror is chosen often | wide ones |
//! | curved lamps | triangles of balls and tubes are chosen about in proportion to what they give | all alike |
//! | contribution | a light that can light a point has a probability above 0 there | probabilities for the opposite normal |

use std::f64::consts::PI;

use caustica::{
    layout,
    scene::{Light, LightKind, Scene, Triangle},
    settings::LightSampling,
    upload::SceneBuffers,
};
use glam::{DVec3, Vec3, vec3};
use support::{meshes::Mesh, photons::Random, *};

use super::{
    chi_square::{SAMPLES, deviate},
    light_sampling::{sky, upload},
    probe::{Probe, Row},
};

fn direction(random: &mut Random) -> Vec3 {
    let mut axis = || random.unit() - 0.5;
    vec3(axis(), axis(), axis()).normalize_or(Vec3::Y)
}

/// Points, spots of all widths, suns, triangles that shine on one side or both, spheres and a sky,
/// of powers over three decades.
fn many_lights() -> Scene {
    let mut random = Random(3);
    let mut scene = scene(&[diffuse(0.5)]);
    add_quad(&mut scene, vec3(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::NEG_Z * 18.0, 0);
    let position =
        |random: &mut Random| vec3(9.0 * random.unit() - 4.5, 3.0 * random.unit() - 0.5, 9.0 * random.unit() - 4.5);
    for i in 0..60 {
        let kind = match i % 3 {
            0 => LightKind::Point,
            1 => LightKind::Spot { inner: 0.0, outer: 0.02 + 1.5 * random.unit().powi(2) },
            _ => LightKind::Spot { inner: 0.4 * random.unit(), outer: 0.41 + random.unit() },
        };
        let light = point_light(position(&mut random), 10.0_f32.powf(3.0 * random.unit() - 2.0));
        scene.lights.push(Light { kind, direction: direction(&mut random), ..light });
    }
    for _ in 0..3 {
        let light = Light { kind: LightKind::Directional, ..point_light(Vec3::ZERO, 0.2 * random.unit()) };
        scene.lights.push(Light { direction: direction(&mut random), ..light });
    }
    for both in [false, true] {
        scene.materials.push(emissive(if both { "both" } else { "front" }, 0.0, 5.0, both));
        for i in 0..120 {
            let side = if i == 0 { 3.0 } else { 0.02 + 0.4 * random.unit().powi(3) };
            let (corner, a, b) = (position(&mut random), direction(&mut random), direction(&mut random));
            let positions = [corner, corner + side * a, corner + side * b];
            scene.triangles.push(Triangle::new(positions, [a.cross(b).normalize(); 3], 1 + u32::from(both)));
        }
    }
    scene.spheres.extend((0..5).map(|_| sphere(position(&mut random), 0.05 + 0.2 * random.unit(), 1)));
    scene.environment = Some(sky(3.0));
    scene
}

/// A way to choose: by irradiance at a surface of a normal, or by what microfacets show.
const BY_IRRADIANCE: &str = "probe_light_tree";
const BY_LOBES: &str = "probe_shown_lights";

fn run(probe: &str, buffers: &SceneBuffers, rows: &[Row]) -> Vec<[f32; 4]> {
    Probe::of_scene(probe, buffers, &buffers.lights.photons).run(rows)
}

/// Probability of each light at a point.
fn told(probe: &str, buffers: &SceneBuffers, point: Vec3, facing: Vec3) -> Vec<f64> {
    let count = buffers.lights.table.lights.len();
    let row = |i: usize| [point.extend(0.5).to_array(), facing.extend(1.0 + i as f32).to_array()];
    let rows = (0..count).map(row).collect::<Vec<_>>();
    run(probe, buffers, &rows).iter().map(|[_, _, told, _]| f64::from(*told)).collect()
}

/// Choices at a point are as frequent as told, unlike what is told of another one.
fn check_choice(probe: &str, buffers: &SceneBuffers, at: (Vec3, Vec3), other: (Vec3, Vec3)) {
    let count = buffers.lights.table.lights.len();
    let mut random = Random(11);
    let row =
        |random: &mut Random| [at.0.extend(random.unit()).to_array(), at.1.extend(random.unit() * 0.999).to_array()];
    let drawn = run(probe, buffers, &(0..SAMPLES).map(|_| row(&mut random)).collect::<Vec<_>>());
    // The last cell: a node that might have had light for the point has none below.
    let mut counts = vec![0.0; count + 1];
    for [light, probability, told, _] in &drawn {
        if *probability == 0.0 {
            counts[count] += 1.0;
            continue;
        }
        assert!((probability / told - 1.0).abs() < 1e-4, "light {light}: {probability} and {told}");
        counts[*light as usize] += 1.0;
    }
    let with_none = |(point, facing): (Vec3, Vec3)| {
        let mut told = told(probe, buffers, point, facing);
        let sum: f64 = told.iter().sum();
        assert!(sum > 0.5 && sum < 1.0001, "the probabilities sum to {sum}");
        told.push((1.0 - sum).max(0.0));
        told
    };
    let found = deviate(&counts, &with_none(at));
    assert!(found.fits(), "at {at:?}: {found:?}");
    let other = deviate(&counts, &with_none(other));
    assert!(!other.fits(), "control: probabilities of another: {other:?}");
}

#[test]
fn lights_are_chosen_with_the_probability_that_is_told() {
    let buffers = upload(&many_lights(), LightSampling::Power);
    let away = vec3(0.4, 0.3, -0.2);
    for (point, normal) in [(Vec3::ZERO, Vec3::Y), (vec3(3.0, 0.2, -2.0), Vec3::ZERO), (vec3(-40.0, 9.0, 7.0), Vec3::X)]
    {
        let other = point + away * (1.0 + 0.1 * point.length());
        check_choice(BY_IRRADIANCE, &buffers, (point, normal), (other, normal));
    }
}

#[test]
fn lights_of_microfacets_are_chosen_with_the_probability_that_is_told() {
    let buffers = upload(&many_lights(), LightSampling::Power);
    let viewers = [(Vec3::ZERO, vec3(0.6, 0.7, 0.1)), (vec3(3.0, 0.2, -2.0), vec3(-0.9, 0.1, 0.3)), (Vec3::X, Vec3::Y)];
    for ((point, wo), width) in viewers.into_iter().zip([0.3, 0.05, 0.8]) {
        let wo = width * wo.normalize();
        check_choice(BY_LOBES, &buffers, (point, wo), (point, width * vec3(-wo.x, wo.y, 0.5).normalize()));
    }
}

#[test]
fn the_lamp_that_microfacets_mirror_is_chosen_often() {
    let mut scene = scene(&[diffuse(0.5)]);
    scene.materials.push(emissive("lamp", 0.0, 4.0, false));
    let at = |i: i32| vec3(0.5 * (i % 7 - 3) as f32, 2.0, 0.5 * (i / 7 - 3) as f32);
    scene.spheres.extend((0..49).map(|i| sphere(at(i), 0.03, 1)));
    let buffers = upload(&scene, LightSampling::Power);
    let mirrored = buffers.lights.table.lights.iter().position(|light| Vec3::from_array(light.position) == at(12));
    let mirrored = mirrored.expect("lamp");
    let wo = (at(12) * vec3(-1.0, 1.0, -1.0)).normalize();
    let chosen = |width: f32| told(BY_LOBES, &buffers, Vec3::ZERO, width * wo)[mirrored];
    assert!(chosen(0.05) > 0.2, "{}", chosen(0.05));
    assert!(chosen(1.0) < 0.05, "control: {}", chosen(1.0));
}

/// Variance of what a triangle gives by its middle over its probability, in units of the squared
/// mean; and the same if all are chosen alike.
fn variances(lamp: &Mesh, point: Vec3, normal: Vec3) -> [f64; 2] {
    let mut scene = scene(&[diffuse(0.5)]);
    scene.materials.push(emissive("lamp", 0.0, 1.0, false));
    for corners in &lamp.triangles {
        let [a, b, c] = corners.map(|i| lamp.positions[i as usize]);
        scene.triangles.push(Triangle::new([a, b, c], [(b - a).cross(c - a).normalize(); 3], 1));
    }
    let buffers = upload(&scene, LightSampling::Power);
    let gives = |light: &layout::Light| {
        let [p, e1, e2] = [light.position, light.e1, light.e2].map(|v| Vec3::from_array(v).as_dvec3());
        let to = p + (e1 + e2) / 3.0 - point.as_dvec3();
        let cosines = (-to.dot(e1.cross(e2))).max(0.0) * to.dot(normal.as_dvec3()).max(0.0);
        cosines / to.length_squared().powi(2)
    };
    let given: Vec<f64> = buffers.lights.table.lights.iter().map(gives).collect();
    let told = told(BY_IRRADIANCE, &buffers, point, normal);
    let sum: f64 = given.iter().sum();
    let of = |probability: &dyn Fn(usize) -> f64| {
        let square = |(i, x): (usize, &f64)| if *x > 0.0 { x * x / probability(i) } else { 0.0 };
        given.iter().enumerate().map(square).sum::<f64>() / (sum * sum) - 1.0
    };
    [of(&|i| told[i]), of(&|_| 1.0 / given.len() as f64)]
}

#[test]
fn parts_of_curved_lamps_are_chosen_by_what_they_give() {
    let ball = Mesh::ball(Vec3::ZERO, 0.08, 32);
    let tube = Mesh::lathe(Vec3::ZERO, &[(0.02, -0.6), (0.02, -0.2), (0.02, 0.2), (0.02, 0.6)], 16);
    for (lamp, most) in [(ball, 0.08), (tube, 0.12)] {
        for (point, normal) in [(vec3(2.0, -1.0, 0.5), Vec3::Y), (vec3(-0.9, 0.4, 1.0), vec3(0.8, 0.0, -0.6))] {
            let [by_tree, alike] = variances(&lamp, point, normal);
            assert!(by_tree < most, "from {point}: {by_tree}");
            assert!(alike > 5.0 * most, "control, from {point}: {alike}");
        }
    }
}

/// Points of a light from which it shines, each with the direction that it faces (0: all).
fn points_of(light: &layout::Light) -> Vec<DVec3> {
    let [p, e1, e2] = [light.position, light.e1, light.e2].map(|v| Vec3::from_array(v).as_dvec3());
    match light.kind {
        layout::TRIANGLE_LIGHT => {
            let inside = |u: f64, v: f64| p + u * e1 + v * e2;
            vec![inside(0.01, 0.01), inside(0.98, 0.01), inside(0.01, 0.98), inside(0.33, 0.33)]
        }
        layout::SPHERE_LIGHT => {
            [DVec3::X, DVec3::Y, DVec3::Z].iter().flat_map(|d| [p + *d * e1.x, p - *d * e1.x]).collect()
        }
        _ => vec![p],
    }
}

/// Whether light from one of its points reaches a surface, which nothing hides.
fn lights_up(light: &layout::Light, point: DVec3, normal: DVec3) -> bool {
    let [p, axis, e2] = [light.position, light.e1, light.e2].map(|v| Vec3::from_array(v).as_dvec3());
    let above = |to_light: DVec3| normal == DVec3::ZERO || to_light.normalize().dot(normal) > 1e-3;
    match light.kind {
        layout::DIRECTIONAL_LIGHT => above(-axis),
        layout::ENVIRONMENT_LIGHT => true,
        _ => points_of(light).into_iter().any(|end| {
            let away = (point - end).normalize();
            let shines = match light.kind {
                layout::SPOT_LIGHT => 1.0 - away.dot(axis) < e2.x * 0.999,
                layout::TRIANGLE_LIGHT => {
                    let cosine = axis.cross(e2).normalize().dot(away);
                    cosine > 1e-3 || (f64::from(light.solid_angle) > 1.5 * PI && cosine < -1e-3)
                }
                layout::SPHERE_LIGHT => (end - p).dot(away) > 0.0,
                _ => true,
            };
            shines && above(end - point)
        }),
    }
}

#[test]
fn no_light_that_can_light_a_point_is_left_out() {
    let buffers = upload(&many_lights(), LightSampling::Power);
    let lights = &buffers.lights.table.lights;
    let mut random = Random(21);
    let (mut lit, mut dark, mut wrong) = (0, 0, 0);
    for i in 0..300 {
        let reach = if i % 3 == 0 { 30.0 } else { 5.0 };
        let point = reach * (2.0 * vec3(random.unit(), 0.4 * random.unit(), random.unit()) - vec3(1.0, 0.2, 1.0));
        let normal = if i % 4 == 0 { Vec3::ZERO } else { direction(&mut random) };
        let (here, opposite) =
            (told(BY_IRRADIANCE, &buffers, point, normal), told(BY_IRRADIANCE, &buffers, point, -normal));
        for (index, light) in lights.iter().enumerate() {
            if lights_up(light, point.as_dvec3(), normal.as_dvec3()) {
                lit += 1;
                wrong += u32::from(opposite[index] == 0.0);
                assert!(here[index] > 0.0, "light {index} {light:?} at {point}, normal {normal}");
            } else {
                dark += u32::from(here[index] == 0.0);
            }
        }
    }
    assert!(lit > 10_000 && dark > 10_000, "{lit} light a point, {dark} that do not are known to");
    assert!(wrong > lit / 10, "control: for the opposite normal {wrong} of {lit} are left out");
}
