//! Lamps that are closed shells of a double-sided material.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | bulb | no photon lies inside; the picture is that of a single-sided bulb | with a triangle missing half lie inside |
//! | glass | a filament in a bulb of glass sends photons as before | |
//! | furnace | a camera inside sees L / (1 - albedo) | it is dark where only the outside shines |
//! | seen | statistics tell the share of photons that the camera sees: a roof hides one of two floors | without the roof |

use caustica::{
    image::difference::rel_mse,
    scene::{Camera, Projection, Scene},
    settings::{Mode, Settings},
};
use glam::{Vec3, vec3};
use support::{meshes::Mesh, *};

use super::{spot, traced};

const CENTER: Vec3 = vec3(0.0, 1.2, 0.0);
const RADIUS: f32 = 0.3;

/// A room with a bulb of some 500 triangles, of which the last `missing` are left out.
fn room(double_sided: bool, missing: usize) -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    add_box(&mut scene, vec3(-2.0, 0.0, -2.0), vec3(2.0, 2.5, 2.0), 0);
    scene.materials.push(emissive("bulb", 0.5, 3.0, double_sided));
    add_mesh(&mut scene, &Mesh::ball(CENTER, RADIUS, 24), missing, 1);
    scene.cameras.push(camera(vec3(1.5, 1.5, 1.8), CENTER, 60.0));
    scene
}

fn add_mesh(scene: &mut Scene, mesh: &Mesh, missing: usize, material: u32) {
    for corners in &mesh.triangles[..mesh.triangles.len() - missing] {
        let positions = corners.map(|corner| mesh.positions[corner as usize]);
        let normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalize();
        scene.triangles.push(caustica::scene::Triangle::new(positions, [normal; 3], material));
    }
}

/// Share of the photons of the global map that lie in the bulb or on its inner side.
fn share_inside(scene: &Scene, mode: Mode) -> f64 {
    let map = traced(scene, &settings(mode, 20_000, 1)).maps.global;
    let photons = map.read(gpu()).expect("photons read back");
    let is_inside = |photon: &&caustica::layout::Photon| {
        let from_center = Vec3::from(photon.position) - CENTER;
        let outward = from_center.dot(caustica::layout::from_octahedral(photon.normal));
        from_center.length() < 1.01 * RADIUS && outward < 0.0
    };
    photons.iter().filter(is_inside).count() as f64 / photons.len() as f64
}

#[test]
fn no_photon_starts_into_a_closed_bulb() {
    let shares = |mode| [room(true, 0), room(true, 1)].map(|scene| share_inside(&scene, mode));
    for mode in [Mode::Photons, Mode::Hybrid] {
        let [closed, open] = shares(mode);
        println!("{mode:?}: {:.1} % inside of an open bulb, {:.1} % of a closed one", 100.0 * open, 100.0 * closed);
        assert!(closed == 0.0, "{closed} of the photons of {mode:?} are inside");
        assert!(open > 0.3, "control: {open} with a triangle missing");
    }
    let settings = settings(Mode::Hybrid, 20_000, 32);
    let [both, single] = [true, false].map(|double_sided| render_scene(&room(double_sided, 0), &settings));
    let difference = rel_mse(both.frame.radiance(), single.frame.radiance(), None);
    assert!(difference < 1e-10, "{difference}");
    let [both, single] = [&both, &single].map(|render| render.stats.photons.lights[0].power[0]);
    assert!(within(both, 2.0 * single, 1e-6), "the power is that of both sides: {both} W, {single} W");
}

#[test]
fn a_filament_in_glass_sends_photons_to_both_sides() {
    let mut lit = room(true, 0);
    lit.triangles.truncate(12);
    lit.materials.push(caustica::scene::Material::new("glass", glass()));
    add_mesh(&mut lit, &Mesh::ball(CENTER, RADIUS, 24), 0, 2);
    add_quad(&mut lit, CENTER - 0.05, Vec3::X * 0.1, Vec3::Y * 0.1, 1);
    let map = traced(&lit, &settings(Mode::Hybrid, 20_000, 1)).maps.caustic;
    let photons = map.read(gpu()).expect("photons read back");
    let before = photons.iter().filter(|photon| photon.position[2] > CENTER.z).count();
    assert!(within(before as f64, 0.5 * photons.len() as f64, 0.05), "{before} of {}", photons.len());
}

#[test]
fn a_camera_inside_of_a_shell_sees_its_light() {
    let furnace = |double_sided: bool| {
        let mut scene = scene(&[]);
        scene.materials.push(emissive("shell", 0.5, 1.0, double_sided));
        add_mesh(&mut scene, &Mesh::block(Vec3::NEG_ONE, Vec3::ONE), 0, 0);
        scene.cameras.push(camera(vec3(0.1, 0.2, 0.3), vec3(1.0, 0.0, 0.0), 60.0));
        mean(&render_scene(&scene, &settings(Mode::Hybrid, 50_000, 16).with(|s| s.picture.light_samples = 4)))
    };
    let (inside, outside) = (furnace(true), furnace(false));
    assert!(within(inside, 2.0, 0.02), "{inside} instead of 2");
    assert!(outside == 0.0, "control: {outside} where only the outside shines");
}

#[test]
fn statistics_tell_which_photons_the_camera_sees() {
    // Two floors, each with all the light of a spot; the second may be under a roof.
    let floors = |roof: bool| {
        let mut scene = scene(&[diffuse(0.5)]);
        for x in [-3.0, 3.0] {
            add_quad(&mut scene, vec3(x - 1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::NEG_Z * 2.0, 0);
            scene.lights.push(spot(vec3(x, 1.0, 0.0), Vec3::NEG_Y, 1.0, 0.2, 0.4));
        }
        if roof {
            add_quad(&mut scene, vec3(2.0, 2.0, 1.0), Vec3::X * 2.0, Vec3::NEG_Z * 2.0, 0);
        }
        let view = camera(vec3(0.0, 9.0, 0.0), Vec3::ZERO, 40.0);
        scene.cameras.push(Camera { projection: Projection::Orthographic { ymag: 6.0 }, ..view });
        scene
    };
    let of = |roof: bool, change: fn(&mut Settings)| {
        let settings = settings(Mode::DirectPhotons, 20_000, 16).with(change);
        render_scene(&floors(roof), &settings).stats.photons.global.seen
    };
    for (roof, expected) in [(true, 0.5), (false, 1.0)] {
        let seen = of(roof, |s| s.counts_seen = true).expect("it is asked for");
        let share = seen.seen as f64 / seen.sampled as f64;
        assert!(seen.sampled > 1000 && within(share, expected, 0.02), "roof {roof}: {seen:?}");
    }
    assert_eq!(of(true, |_| ()), None, "nobody asks");
}
