//! Photons of every kind of light.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | agreement | modes 0 and 1 have the same mean under every kind of light | without the second bounce |
//! | sum | mode 0 = mode 2 + mode 4 where surfaces and the sky are seen | mode 3 in place of 4 |
//! | many | 10,000 emissive triangles light like the ball that they form | a ball 3 % larger |
//! | shares | photons go to lights by power, in turn, or as weights ask | the shares of another rule |
//! | seen | the front of an emitter is seen, straight and in a mirror | its back, and mode 4 |

use std::f64::consts::PI;

use caustica::{
    Error,
    progress::Silent,
    renderer::{Render, render},
    scene::{Environment, Light, LightKind, Material, Scene, Surface, Triangle},
    settings::{LightSampling, Mode},
};
use glam::{Vec3, vec3};

use support::*;

use super::{direct_flux, floor, flux, spot, traced};

/// A floor with a block and a glass ball, seen away from its edges.
fn yard() -> Scene {
    let mut scene = floor(2.0);
    scene.materials.push(Material { surface: glass(), ..scene.materials[0].clone() });
    add_box(&mut scene, vec3(-0.8, 0.0, -0.5), vec3(-0.3, 0.6, 0.0), 0);
    scene.spheres.push(sphere(vec3(0.4, 0.35, 0.1), 0.3, 1));
    scene.cameras.push(camera(vec3(0.0, 3.0, 1.5), vec3(0.0, 0.0, 0.0), 40.0));
    scene
}

/// The yard under each kind of light.
fn lit_yards() -> Vec<(&'static str, Scene)> {
    let lit = |change: &dyn Fn(&mut Scene)| {
        let mut scene = yard();
        change(&mut scene);
        scene
    };
    let direction = vec3(0.3, -2.0, 0.5).normalize();
    let sun = Light { kind: LightKind::Directional, direction, ..point_light(Vec3::ZERO, 3.0) };
    let lamp = |scene: &mut Scene, double_sided| {
        scene.materials.push(emissive("lamp", 0.4, 2.0, double_sided));
        // The double-sided emitter shines down from its back.
        let (a, b) = (vec3(0.9, 0.3, 0.0), vec3(0.0, 0.4, 0.9));
        let (a, b) = if double_sided { (b, a) } else { (a, b) };
        add_quad(scene, vec3(-1.3, 0.9, -1.0), a, b, 2);
    };
    vec![
        ("spot", lit(&|s| s.lights.push(spot(vec3(0.6, 3.5, 0.5), vec3(-0.6, -3.5, -0.3), 9.0, 0.2, 0.4)))),
        ("directional", lit(&|s| s.lights.push(sun.clone()))),
        ("surface", lit(&|s| lamp(s, false))),
        ("double-sided surface", lit(&|s| lamp(s, true))),
        (
            "sphere",
            lit(&|s| {
                s.materials.push(emissive("bulb", 0.4, 2.0, false));
                s.spheres.push(sphere(vec3(-0.1, 0.8, 0.3), 0.2, 2));
            }),
        ),
        (
            "environment",
            lit(&|s| {
                let mut pixels = vec![[0.2; 3]; 16 * 8];
                pixels[16 + 3] = [30.0; 3];
                let map = Environment { width: 16, height: 8, pixels, ..Environment::uniform(Vec3::ZERO) };
                s.environment = Some(map);
            }),
        ),
    ]
}

#[test]
fn photons_agree_with_rays_under_every_kind_of_light() {
    for (name, scene) in lit_yards() {
        let picture = |mode, max_bounces| {
            let settings = settings(mode, 80_000, 32).with(|s| {
                s.photons.caustic = 20_000;
                s.estimate.neighbors = 25;
                s.picture.light_samples = 8;
                s.photons.max_bounces = max_bounces;
            });
            mean(&render_scene(&scene, &settings.clone().with(|s| s.photons.max_paths = Some(300_000))))
        };
        let (rays, photons) = (picture(Mode::Hybrid, 0), picture(Mode::Photons, 0));
        assert!(within(photons, rays, 0.02), "{name}: mode 1 has mean {photons}, mode 0 has {rays}");
        let short = picture(Mode::DirectRays, 0);
        assert!(!within(short, rays, 0.02), "control: {name}: {short} of direct light alone");
    }
}

#[test]
fn hybrid_is_direct_rays_plus_indirect_photons_where_lights_are_seen() {
    let mut scene = yard();
    scene.materials.push(emissive("lamp", 0.4, 2.0, true));
    add_quad(&mut scene, vec3(-0.2, 0.6, -0.5), vec3(0.6, 0.2, 0.0), vec3(0.0, 0.4, 0.4), 2);
    scene.environment = Some(Environment::uniform(vec3(0.2, 0.3, 0.5)));
    scene.cameras[0] = camera(vec3(0.0, 1.0, 3.0), vec3(0.0, 0.5, 0.0), 60.0);
    let pictures = [Mode::Hybrid, Mode::DirectRays, Mode::IndirectPhotons, Mode::DirectPhotons].map(|mode| {
        // Little light is indirect: the map of such photons does not fill.
        let settings = settings(mode, 10_000, 32).with(|s| s.photons.max_paths = Some(100_000));
        render_scene(&scene, &settings)
    });
    let [hybrid, direct, indirect, other] = &pictures;
    let largest = |a: &Render, b: &Render| {
        let sum = a.frame.radiance().iter().flatten().zip(b.frame.radiance().iter().flatten()).map(|(a, b)| a + b);
        hybrid.frame.radiance().iter().flatten().zip(sum).map(|(h, s)| f64::from((h - s).abs())).fold(0.0, f64::max)
    };
    let (right, wrong) = (largest(direct, indirect), largest(direct, other));
    assert!(right < 1e-4 * mean(hybrid), "modes 2 and 4 differ from mode 0 by {right}");
    assert!(wrong > 0.1 * mean(hybrid), "control: mode 3 in place of mode 4 differs by only {wrong}");
}

/// A ball of 100 x 51 quads with the emissive material 1, its corners on the sphere.
fn add_shining_ball(scene: &mut Scene, center: Vec3, radius: f32) {
    let corner = |row: usize, column: usize| {
        let (theta, phi) = (row as f32 / 51.0 * std::f32::consts::PI, column as f32 / 100.0 * std::f32::consts::TAU);
        vec3(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos())
    };
    for (row, column) in (0..51).flat_map(|row| (0..100).map(move |column| (row, column))) {
        let [a, b, c, d] =
            [(row, column), (row + 1, column), (row + 1, column + 1), (row, column + 1)].map(|(r, c)| corner(r, c));
        // Next to the poles the quads are triangles.
        let halves = match row {
            0 => vec![[a, b, c]],
            50 => vec![[a, b, d]],
            _ => vec![[a, b, c], [a, c, d]],
        };
        for normals in halves {
            let positions = normals.map(|n| center + radius * n);
            scene.triangles.push(Triangle::new(positions, normals, 1));
        }
    }
}

#[test]
fn ten_thousand_emissive_triangles_light_as_the_ball_they_make() {
    let under = |radius: f32| {
        let mut many = floor(3.0);
        many.materials.push(emissive("ball", 0.0, 2.0, false));
        add_shining_ball(&mut many, vec3(0.0, 2.0, 0.0), radius);
        assert!(many.triangles.len() > 10_000);
        many.cameras.push(camera(vec3(1.0, 0.5, 0.3), vec3(1.0, 0.0, 0.2), 0.1));
        many
    };
    let settings = settings(Mode::DirectRays, 1, 16).with(|s| s.picture.light_samples = 64);
    let measured = |radius| mean(&render_scene(&under(radius), &settings)) * PI / 0.5;
    let d2 = 1.0_f64 + 4.0 + 0.04;
    let right = PI * 2.0 * 0.64 / d2 * 2.0 / d2.sqrt();
    assert!(within(measured(0.8), right, 0.015), "{} instead of {right}", measured(0.8));
    assert!(!within(measured(0.824), right, 0.015), "control: a ball 3 % larger passes");
    let flux = |radius| {
        let mut many = under(radius);
        many.spheres.push(sphere(Vec3::ZERO, 50.0, 0));
        direct_flux(&many, 40_000)
    };
    let power = PI * 2.0 * 4.0 * PI * 0.64;
    assert!(within(flux(0.8), power, 0.005), "photons: {} W instead of {power} W", flux(0.8));
    assert!(!within(flux(0.824), power, 0.005), "control: photons of a ball 3 % larger pass");
}

#[test]
fn photons_go_to_lights_as_asked() {
    // In a closed ball each path from each light leaves one photon.
    let mut scene = scene(&[diffuse(0.5)]);
    scene.spheres.push(sphere(Vec3::ZERO, 3.0, 0));
    scene.materials.extend([emissive("panel", 0.5, 1.0, false), emissive("dark", 0.5, 0.0, false)]);
    add_quad(&mut scene, vec3(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, 1);
    add_quad(&mut scene, vec3(-0.5, 2.0, -0.5), Vec3::X, Vec3::Z, 2);
    scene.lights.push(Light { name: "lamp".into(), ..point_light(vec3(0.0, -1.0, 0.0), 0.75) });
    scene.cameras.push(camera(Vec3::ZERO, Vec3::Y, 50.0));
    let run = |light_sampling, weights: &[(&str, f64)]| {
        let light_photons = weights.iter().map(|(name, weight)| ((*name).to_owned(), *weight)).collect();
        let settings = settings(Mode::DirectPhotons, 40_000, 8).with(|s| {
            s.lights.sampling = light_sampling;
            s.lights.photon_weights = light_photons;
            s.estimate.neighbors = 10;
        });
        render(gpu(), &scene, &settings, &Silent)
    };
    let stats = run(LightSampling::Power, &[]).expect("the scene renders").stats.photons;
    let named: Vec<_> = stats.lights.iter().map(|l| (l.name.as_str(), l.kind.as_str())).collect();
    assert_eq!(named, [("lamp", "point"), ("panel", "surface")]);
    assert_eq!(stats.lights.iter().map(|l| l.photons).sum::<u64>(), stats.global.stored);
    assert!(
        within(stats.lights[0].power[0], 3.0 * PI, 1e-6) && within(stats.lights[1].power[2], PI, 1e-6),
        "{stats:?}"
    );
    let share = |light_sampling, weights: &[(&str, f64)]| {
        let lights = run(light_sampling, weights).expect("the scene renders").stats.photons.lights;
        lights[0].photons as f64 / (lights[0].photons + lights[1].photons) as f64
    };
    let mut before = 0.0;
    for (light_sampling, weights, right) in [
        (LightSampling::Power, &[][..], 0.75),
        (LightSampling::Uniform, &[], 0.5),
        (LightSampling::Power, &[("panel", 6.0)], 1.0 / 3.0),
        (LightSampling::Uniform, &[("lamp", 0.25)], 0.2),
    ] {
        let measured = share(light_sampling, weights);
        assert!(within(measured, right, 0.03), "{light_sampling:?} {weights:?}: {measured} instead of {right}");
        assert!(!within(before, right, 0.03), "control: {light_sampling:?} {weights:?}: the rule before passes");
        before = measured;
    }
    // With paths assigned to the lights in turn, each of two unequal lights at the centre still
    // emits as much up as down.
    let uppers = |apart: Vec3| {
        let mut pair = scene.clone();
        pair.lights = [(apart, 1.0), (-apart, 0.1)].map(|(at, intensity)| point_light(at, intensity)).into();
        pair.triangles.clear();
        let in_turn = settings(Mode::DirectPhotons, 40_000, 8).with(|s| s.lights.sampling = LightSampling::Uniform);
        let map = traced(&pair, &in_turn).maps.global;
        let photons = map.read(gpu()).expect("photons read back");
        [0, 1, 2].map(|axis| flux(photons.iter().filter(|p| p.position[axis] > 0.0), map.emitted))
    };
    let half = |upper: &f64| within(*upper, 2.0 * PI * 1.1, 0.02);
    let (centred, apart) = (uppers(Vec3::ZERO), uppers(Vec3::splat(0.2)));
    assert!(centred.iter().all(half), "{centred:?} W above the middle of each axis");
    assert!(!apart.iter().any(half), "control: one light above, one below: {apart:?} W");
    // Weights change the noise, not the mean.
    let mean_of = |weights: &[(&str, f64)]| mean(&run(LightSampling::Power, weights).expect("the scene renders"));
    let (plain, weighted) = (mean_of(&[]), mean_of(&[("panel", 6.0)]));
    assert!(within(weighted, plain, 0.05), "mean {weighted} with other shares, {plain} without");
    let error = run(LightSampling::Power, &[("moon", 2.0)]).expect_err("there is no moon");
    let Error::Setting { name, problem, .. } = &error else { panic!("{error}") };
    assert!(*name == "lights.photon_weights" && problem.contains("\"lamp\", \"panel\""), "{error}");
}

#[test]
fn the_front_of_an_emitter_is_seen() {
    // The lamp faces +Z, towards a mirror.
    let (front, back, mirror) = (vec3(0.0, 0.0, 3.0), vec3(0.0, 0.0, -3.0), vec3(0.0, 0.0, 9.0));
    let radiance = |mode: Mode, eye: Vec3, target: Vec3, double_sided: bool| {
        let mut scene = scene(&[Surface::Mirror { tint: Vec3::splat(0.5) }]);
        scene.materials.push(emissive("lamp", 0.0, 2.0, double_sided));
        add_quad(&mut scene, vec3(-1.0, -1.2, 0.0), vec3(2.0, 0.0, 0.0), vec3(0.0, 2.0, 0.0), 1);
        add_quad(&mut scene, vec3(-9.0, -9.5, 9.0), vec3(18.0, 0.0, 0.0), vec3(0.0, 18.0, 0.0), 0);
        scene.cameras.push(camera(eye, target, 1.0));
        mean(&render_scene(&scene, &settings(mode, 100, 8)))
    };
    for mode in [Mode::DirectRays, Mode::Photons] {
        assert!(within(radiance(mode, front, Vec3::ZERO, false), 2.0, 1e-4), "{mode:?}: straight");
        assert!(within(radiance(mode, front, mirror, false), 1.0, 1e-4), "{mode:?}: in the mirror");
        assert!(within(radiance(mode, back, Vec3::ZERO, true), 2.0, 1e-4), "{mode:?}: a double-sided one from behind");
        assert_eq!(radiance(mode, back, Vec3::ZERO, false), 0.0, "{mode:?}: control: from behind");
    }
    assert_eq!(radiance(Mode::IndirectPhotons, front, Vec3::ZERO, false), 0.0, "mode 4 shows no lights");
}
