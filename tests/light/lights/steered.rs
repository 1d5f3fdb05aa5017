//! Photons where the cameras see them: the choice of lights, and of the photons that are stored.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | rooms | of twelve rooms of which the camera sees one, its photons have a fraction of the squared error of unaimed ones, and their mean | unaimed emission; a lamp fewer |
//! | wide ground | sun and lamp in a house on a wide ground give the sum of both | one of them alone |
//! | keyhole | the light of a bright lamp that comes through a small hole is all there | the hole is shut |
//! | behind | a bright lamp behind the camera is not forgotten, nor is the light of a far room in the sum | the lamp is off |
//! | whole | a scene that is seen whole has the photons of one that nobody looks at | the same in a long house |

use caustica::{
    layout::Photon,
    scene::{Camera, Light, LightKind, Scene},
    settings::{Emission, Mode, Quality},
};
use glam::{Vec3, vec3};
use support::*;

use super::{flux, traced};

/// Side of a room, and its height.
const SIDE: f32 = 3.0;
const HEIGHT: f32 = 2.5;
/// Patches along a side of the floor.
const PATCHES: usize = 4;

/// Rooms in a row, each with a lamp of that intensity, between walls that leave a door of `door`
/// metres. The camera sees the first.
fn rooms(lamps: &[f32], door: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.6)]);
    add_box(&mut scene, Vec3::ZERO, vec3(lamps.len() as f32 * SIDE, HEIGHT, SIDE), 0);
    for (i, &intensity) in (0..).zip(lamps) {
        let x = i as f32 * SIDE;
        if i > 0 {
            let (before, after) = (0.5 * (SIDE - door), 0.5 * (SIDE + door));
            add_box(&mut scene, vec3(x - 0.05, 0.0, 0.0), vec3(x + 0.05, HEIGHT, before), 0);
            add_box(&mut scene, vec3(x - 0.05, 0.0, after), vec3(x + 0.05, HEIGHT, SIDE), 0);
        }
        if intensity > 0.0 {
            scene.lights.push(point_light(vec3(x + 0.5 * SIDE, 2.2, 0.4 * SIDE), intensity));
        }
    }
    scene.cameras = vec![view()];
    scene
}

/// From a corner of the first room, away from the others.
fn view() -> Camera {
    camera(vec3(2.6, 1.6, 2.6), vec3(0.6, 0.6, 0.6), 60.0)
}

/// Flux in the patches of the floor of the first room, W.
fn patches(photons: &[Photon], emitted: u64) -> Vec<f64> {
    let of = |patch: usize| {
        let (column, row) = (patch % PATCHES, patch / PATCHES);
        let at = |x: f32| (x / SIDE * PATCHES as f32) as usize;
        let here = photons.iter().filter(|p| {
            let [x, y, z] = p.position;
            y.abs() < 1e-3 && x < SIDE && (at(x), at(z)) == (column, row)
        });
        flux(here, emitted)
    };
    (0..PATCHES * PATCHES).map(of).collect()
}

fn lit(scene: &Scene, emission: Emission, photons: u32, seed: u32) -> (Vec<f64>, Vec<Photon>, u64) {
    let settings = settings(Mode::IndirectPhotons, photons, 1).with(|s| {
        s.photons.emission = emission;
        s.photons.final_gather = 1;
        s.photons.seed = seed;
    });
    let map = traced(scene, &settings).maps.global;
    let photons = map.read(gpu()).expect("photons read back");
    (patches(&photons, map.emitted), photons, map.emitted)
}

/// Mean squared relative error of the patches.
fn squared_error(scene: &Scene, emission: Emission, right: &[f64]) -> f64 {
    const SEEDS: u32 = 8;
    let of_seed = |seed| {
        let (found, ..) = lit(scene, emission, 5000, seed);
        found.iter().zip(right).map(|(a, b)| (a / b - 1.0).powi(2)).sum::<f64>() / right.len() as f64
    };
    (0..SEEDS).map(of_seed).sum::<f64>() / f64::from(SEEDS)
}

#[test]
fn the_photons_of_a_house_lie_in_the_room_that_is_seen() {
    let house = rooms(&[5.0; 12], 0.8);
    let sum = |scene: &Scene, emission, photons: u32| -> f64 {
        (10..14).flat_map(|seed| lit(scene, emission, photons, seed).0).sum::<f64>() / 4.0
    };
    let (right, ..) = lit(&house, Emission::Unaimed, 400_000, 100);
    let [unaimed, aimed] = [Emission::Unaimed, Emission::Aimed].map(|emission| squared_error(&house, emission, &right));
    println!("squared error of the seen room: aimed {aimed}, unaimed {unaimed}");
    assert!(aimed < 0.35 * unaimed, "{aimed} of {unaimed}");
    let all: f64 = right.iter().sum();
    let found = sum(&house, Emission::Aimed, 50_000);
    assert!(within(found, all, 0.03), "{found} W instead of {all} W");
    let mut lamps = [5.0; 12];
    lamps[1] = 0.0;
    let fewer = sum(&rooms(&lamps, 0.8), Emission::Aimed, 50_000);
    assert!(!within(fewer, all, 0.03), "control: a lamp fewer is not seen: {fewer} W instead of {all} W");
    // All that is stored stands for all the light of the house.
    let total = |emission| {
        let (_, photons, emitted) = lit(&house, emission, 100_000, 7);
        flux(&photons, emitted)
    };
    let [all, right] = [Emission::Aimed, Emission::Unaimed].map(total);
    assert!(within(all, right, 0.03), "{all} W instead of {right} W");
}

#[test]
fn a_lamp_in_a_house_on_a_wide_ground_is_not_lost_beside_the_sun() {
    // One room of 4 m with a window, on a ground of 1 km, where the sun has ten thousand times the
    // power of the lamp. Little of it comes in.
    let mean_of = |sun: f32, lamp: f32| {
        let mut scene = scene(&[diffuse(0.6)]);
        add_quad(&mut scene, vec3(-500.0, -0.01, 500.0), Vec3::X * 1000.0, Vec3::NEG_Z * 1000.0, 0);
        let wall = |scene: &mut Scene, low: Vec3, high: Vec3| add_box(scene, low, high, 0);
        wall(&mut scene, vec3(-2.1, 0.0, -2.1), vec3(2.1, 2.5, -2.0));
        wall(&mut scene, vec3(-2.1, 0.0, 2.0), vec3(2.1, 2.5, 2.1));
        wall(&mut scene, vec3(-2.1, 0.0, -2.0), vec3(-2.0, 2.5, 2.0));
        wall(&mut scene, vec3(2.0, 0.0, -2.0), vec3(2.1, 1.0, 2.0));
        wall(&mut scene, vec3(2.0, 2.0, -2.0), vec3(2.1, 2.5, 2.0));
        wall(&mut scene, vec3(2.0, 1.0, -2.0), vec3(2.1, 2.0, -0.5));
        wall(&mut scene, vec3(2.0, 1.0, 0.5), vec3(2.1, 2.0, 2.0));
        wall(&mut scene, vec3(-2.1, 2.5, -2.1), vec3(2.1, 2.6, 2.1));
        let towards = vec3(-1.0, -0.8, 0.1).normalize();
        let directional = LightKind::Directional;
        scene.lights.push(Light { kind: directional, direction: towards, ..point_light(Vec3::ZERO, sun) });
        scene.lights.push(point_light(vec3(-0.5, 2.0, 0.3), lamp));
        scene.lights.retain(|light| light.intensity != Vec3::ZERO);
        scene.cameras.push(camera(vec3(1.8, 1.6, 1.8), vec3(-1.0, 0.9, -1.0), 70.0));
        let settings = Quality::Normal.settings_for((24, 24)).with(|s| {
            s.photons.mode = Mode::IndirectPhotons;
            s.picture.size = Some((24, 24));
        });
        mean(&render_scene(&scene, &settings))
    };
    let (sun, lamp, both) = (mean_of(10.0, 0.0), mean_of(0.0, 5.0), mean_of(10.0, 5.0));
    assert!(within(both, sun + lamp, 0.08), "{both} instead of {sun} + {lamp}");
    assert!(!within(both, lamp, 0.08) && !within(both, sun, 0.08), "control: {both} beside {sun} and {lamp}");
}

#[test]
fn light_through_a_keyhole_is_not_lost() {
    // A dim lamp in each room, and a bright one in the third, behind slits.
    let of = |door: f32, emission, photons: u32| {
        let scene = rooms(&[0.05, 0.05, 100.0, 0.05, 0.05, 0.05], door);
        (0..4).map(|seed| lit(&scene, emission, photons, seed).0.iter().sum::<f64>()).sum::<f64>() / 4.0
    };
    let right = of(0.3, Emission::Unaimed, 100_000);
    let found = of(0.3, Emission::Aimed, 50_000);
    assert!(within(found, right, 0.15), "{found} W instead of {right} W");
    let shut = of(0.1, Emission::Aimed, 50_000);
    assert!(!within(shut, right, 0.3), "control: {shut} W where the slits are narrower");
}

#[test]
fn a_bright_lamp_behind_the_camera_is_not_forgotten() {
    let of = |lamp: f32, emission, photons: u32| {
        let mut scene = rooms(&[0.2, 0.2, 0.2, 0.2, 0.2, 0.2], 0.8);
        // Close to the corner from which the camera looks.
        scene.lights.push(point_light(vec3(2.8, 1.7, 2.8), lamp));
        lit(&scene, emission, photons, 3).0
    };
    let right = of(50.0, Emission::Unaimed, 400_000);
    let found = of(50.0, Emission::Aimed, 50_000);
    for (a, b) in found.iter().zip(&right) {
        assert!(within(*a, *b, 0.15), "{a} W instead of {b} W");
    }
    let off = of(0.01, Emission::Aimed, 50_000);
    assert!(off[0] < 0.5 * right[0], "control: without the lamp {} W", off[0]);
}

#[test]
fn a_scene_that_is_seen_whole_has_the_same_photons_as_before() {
    let of = |lamps: &[f32], sees: bool| {
        let mut scene = rooms(lamps, 0.8);
        if !sees {
            scene.cameras.clear();
        }
        lit(&scene, Emission::Aimed, 2000, 1).1
    };
    assert_eq!(of(&[5.0], true), of(&[5.0], false));
    assert_ne!(of(&[5.0; 6], true), of(&[5.0; 6], false), "control: of a long house");
}
