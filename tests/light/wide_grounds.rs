//! Small things on wide grounds, whose coordinates round what is near.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | caustic | that of the same ball on a ground of 1 m, up to 8 km level and 120 m tilted | a ball of another index |
//! | pin spot | photons bring the irradiance of shadow rays | the raw estimate does so anyway |
//! | shadow | a leaf that hangs 1 mm above a ground of 2 km shades it | without the leaf |

use caustica::{
    scene::{Light, LightKind, Scene},
    settings::Mode,
};
use glam::{Quat, Vec3, vec3};
use support::{meshes::Mesh, *};

/// A level ground of half side `reach` about the origin.
fn ground(scene: &mut Scene, reach: f32) {
    add_quad(scene, vec3(-reach, 0.0, reach), vec3(2.0 * reach, 0.0, 0.0), vec3(0.0, 0.0, -2.0 * reach), 0);
}

fn add_mesh(scene: &mut Scene, mesh: &Mesh, material: u32) {
    let triangle = |corners: &[u32; 3]| {
        let positions = corners.map(|corner| mesh.positions[corner as usize]);
        let normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalize();
        caustica::scene::Triangle::new(positions, [normal; 3], material)
    };
    scene.triangles.extend(mesh.triangles.iter().map(triangle));
}

fn sun() -> Light {
    Light { kind: LightKind::Directional, direction: vec3(0.15, -1.0, 0.1).normalize(), ..point_light(Vec3::ZERO, 2.0) }
}

/// The light below a ball of glass in the sun, on a ground that is turned with all that is on it.
fn focus(reach: f32, ior: f32, tilt: f32) -> f64 {
    let mut scene = scene(&[diffuse(0.6), caustica::scene::Surface::Glass { ior, tint: Vec3::ONE }]);
    ground(&mut scene, reach);
    add_mesh(&mut scene, &Mesh::ball(vec3(0.0, 0.045, 0.0), 0.04, 48), 1);
    let turn = Quat::from_rotation_z(tilt) * Quat::from_rotation_x(0.7 * tilt);
    for triangle in &mut scene.triangles {
        triangle.positions = triangle.positions.map(|p| turn * p);
        triangle.normals = triangle.normals.map(|n| turn * n);
    }
    let sun = sun();
    scene.lights = vec![Light { direction: turn * sun.direction, ..sun }];
    scene.cameras = vec![camera(turn * vec3(0.1, 0.02, 0.06), turn * vec3(0.008, 0.0, 0.005), 8.0)];
    let settings = settings(Mode::Hybrid, 120_000, 16).with(|s| {
        s.photons.global = 1000;
        s.photons.final_gather = 0;
        s.estimate.neighbors = 200;
    });
    mean(&render_scene(&scene, &settings))
}

#[test]
fn a_caustic_on_a_wide_ground_is_that_on_a_small_one() {
    let small = [0.0, 0.4].map(|tilt| focus(0.5, 1.5, tilt));
    for (reach, tilt, right) in [(4000.0, 0.0, small[0]), (60.0, 0.4, small[1])] {
        let wide = focus(reach, 1.5, tilt);
        println!("{reach} m, tilted by {tilt}: {wide} instead of {right}");
        assert!(within(wide, right, 0.03), "{reach} m, tilted by {tilt}: {wide} instead of {right}");
    }
    let other = focus(4000.0, 1.6, 0.0);
    assert!(!within(other, small[0], 0.045), "control: another index: {other}");
}

#[test]
fn photons_of_a_pin_spot_lie_as_densely_as_its_light() {
    let picture = |outer: f32, mode: Mode, raw: bool| {
        let mut scene = scene(&[diffuse(0.6)]);
        ground(&mut scene, 11.0);
        scene.lights = vec![Light {
            kind: LightKind::Spot { inner: 0.6 * outer, outer },
            direction: Vec3::NEG_Y,
            ..point_light(vec3(0.0, 1.7, 0.0), 40.0)
        }];
        // Of the cone, the inner part.
        let degrees = (1.7 * 0.6 * outer).to_degrees();
        scene.cameras = vec![camera(vec3(0.0, 1.0, 1e-6), Vec3::ZERO, degrees)];
        let settings = settings(mode, 40_000, 16).with(|s| s.estimate.raw = raw);
        mean(&render_scene(&scene, &settings))
    };
    for outer in [0.02, 0.0017, 0.0004] {
        let rays = picture(outer, Mode::DirectRays, false);
        let photons = picture(outer, Mode::DirectPhotons, false);
        assert!(within(photons, rays, 0.03), "{outer} rad: {photons} by photons, {rays} by rays");
    }
    let raw = picture(0.0017, Mode::DirectPhotons, true);
    assert!(within(raw, picture(0.0017, Mode::DirectRays, false), 0.03), "control: {raw} by the raw estimate");
}

#[test]
fn a_leaf_near_a_wide_ground_shades_it() {
    let picture = |height: Option<f32>| {
        let mut scene = scene(&[diffuse(0.6)]);
        ground(&mut scene, 1000.0);
        if let Some(height) = height {
            add_quad(&mut scene, vec3(-0.05, height, 0.05), vec3(0.1, 0.0, 0.0), vec3(0.0, 0.0, -0.1), 0);
        }
        scene.lights = vec![sun()];
        scene.cameras = vec![camera(vec3(0.0, 0.0009, 0.04), vec3(0.0, 0.0, 0.036), 10.0)];
        mean(&render_scene(&scene, &settings(Mode::DirectRays, 1000, 8)))
    };
    assert_eq!(picture(Some(1e-3)), 0.0);
    assert!(picture(None) > 0.1, "control: no leaf");
}
