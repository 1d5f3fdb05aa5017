//! Geometry on which rounding errors would show.

use caustica::{
    scene::{Light, LightKind, Scene, Surface, Triangle},
    settings::{Mode, Settings},
    stats::NonFinite,
};
use glam::{Quat, Vec3, vec3};

use support::*;

use super::is_finite;

/// Whether each ray hits something.
fn hits(scene: &Scene, asked: &[(Vec3, Vec3)]) -> Vec<bool> {
    rays::trace(scene, &[], asked).1.iter().map(|hit| hit.alpha > 0.0).collect()
}

/// A closed mesh about the origin: the grid of a cube, projected to a dented sphere. Neighbours
/// share the bits of their corners.
fn dented_sphere() -> Scene {
    const SIDE: i32 = 8;
    let mut scene = scene(&[diffuse(0.5)]);
    for face in 0..6 {
        let (axis, end) = (face / 2, if face % 2 == 0 { 0 } else { SIDE });
        let at = |i: i32, j: i32| {
            let mut lattice = [0; 3];
            (lattice[axis], lattice[(axis + 1) % 3], lattice[(axis + 2) % 3]) = (end, i, j);
            let p = Vec3::from(lattice.map(|x| (2 * x - SIDE) as f32)).normalize();
            p * (1.0 + 0.1 * (13.0 * p.x).sin() * (11.0 * p.y + 7.0 * p.z).cos())
        };
        for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))) {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                let positions = [corners[a], corners[b], corners[c]];
                scene.triangles.push(Triangle::new(positions, [Vec3::X; 3], 0));
            }
        }
    }
    scene
}

#[test]
fn no_ray_slips_between_triangles() {
    let mut scene = dented_sphere();
    let mut rays = Vec::new();
    for (i, triangle) in scene.triangles.iter().enumerate() {
        let [a, b, c] = triangle.positions;
        rays.push((Vec3::ZERO, a + b + c));
        for (from, to) in [(a, b), (b, c), (c, a)] {
            for (part, angle) in [(0.0, 0.0_f32), (0.25, 1.0), (0.5, 2.0), (0.7, 4.0)] {
                let angle = angle + i as f32;
                let origin = 0.5 * vec3(angle.cos(), (2.0 * angle).sin(), angle.sin());
                rays.extend([origin, Vec3::ZERO].map(|origin| (origin, from.lerp(to, part) - origin)));
            }
        }
    }
    let missed = |scene: &Scene| hits(scene, &rays).iter().filter(|hit| !**hit).count();
    assert_eq!(missed(&scene), 0, "of {} rays at edges and corners", rays.len());
    scene.triangles.remove(100);
    let through_hole = missed(&scene);
    assert!((1..100).contains(&through_hole), "control: {through_hole} rays leave by a missing triangle");
}

#[test]
fn a_quad_shows_no_diagonal() {
    // Rotated quads, each seen at normal incidence over a third of a millimetre around its
    // diagonal.
    let covered = |gap: f32| {
        let mut alpha = 0.0;
        for i in 1..3 {
            let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.7 * i as f32, 0.3, 1.1);
            let mut scene = scene(&[diffuse(0.5)]);
            add_quad(&mut scene, vec3(-1.0, -1.0, 0.0), vec3(2.0, 0.0, 0.0), vec3(0.0, 2.0, 0.0), 0);
            scene.triangles[1].positions.iter_mut().for_each(|p| *p += vec3(-gap, gap, 0.0));
            scene.triangles.iter_mut().for_each(|t| t.positions = t.positions.map(|p| turn * p));
            let middle = Vec3::splat(0.2 * i as f32 - 0.3).with_z(0.0);
            scene.lights.push(point_light(turn * Vec3::Z, 1.0));
            scene.cameras.push(camera(turn * (middle + Vec3::Z), turn * middle, 0.02));
            let frame = render_scene(&scene, &settings(Mode::DirectRays, 1000, 48)).frame;
            alpha += frame.alpha().iter().sum::<f32>() / (2.0 * 48.0 * 48.0);
        }
        alpha
    };
    assert_eq!(covered(0.0), 1.0, "the diagonal shows");
    assert!(covered(1e-5) < 0.98, "control: a gap does not");
}

/// A closed room with a light and a glass ball.
fn room() -> Scene {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.spheres.push(sphere(vec3(0.3, -0.5, 0.0), 0.4, 1));
    scene.lights.push(point_light(vec3(-0.5, 0.4, 0.3), 1.0));
    scene.cameras.push(camera(vec3(0.0, 0.0, 0.95), vec3(0.0, -0.3, 0.0), 70.0));
    scene
}

fn quick(mode: Mode) -> Settings {
    settings(mode, 3000, 10).with(|s| s.estimate.neighbors = 30)
}

#[test]
fn degenerate_triangles_leave_no_trace() {
    let with = |shapes: &[[Vec3; 3]], mode: Mode| {
        let mut scene = room();
        // Rotated, so that rounding leaves collinear points not quite collinear.
        let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.7, 0.3, 1.1);
        for shape in shapes {
            let positions = shape.map(|p| turn * p);
            for material in [0, 1] {
                scene.triangles.push(Triangle::new(positions, [Vec3::Y; 3], material));
            }
        }
        let render = render_scene(&scene, &quick(mode));
        assert!(is_finite(&render) && render.stats.non_finite == NonFinite::default());
        render.frame.radiance().to_vec()
    };
    let (x, y) = (Vec3::X * 0.3, Vec3::Y * 0.3);
    let degenerate = [
        [Vec3::ZERO; 3],
        [x, x, y],
        [-x, Vec3::ZERO, x],
        [x * 0.1, x * 0.3, x * 0.7],
        [-x, x, vec3(0.0, 1e-6, 0.0)],
        [Vec3::ZERO, x * 1e-12, y * 1e-12],
        [Vec3::ZERO, x * 1e-25, y * 1e-25],
    ];
    let clear = with(&[], Mode::DirectRays);
    assert!(with(&degenerate, Mode::DirectRays) == clear, "they show");
    assert!(with(&[[-x, x, y]], Mode::DirectRays) != clear, "control: a real triangle does not show");
    // Photons are aimed at all glass, also at glass without area. The photons differ, but all are
    // finite.
    with(&degenerate, Mode::IndirectPhotons);
}

#[test]
fn of_coincident_quads_always_one_is_seen() {
    // Quads in one plane around one point, each of a size and a material.
    let seen = |quads: &[(f32, u32)], eye: Vec3| {
        let mut scene = scene(&[diffuse(0.2), diffuse(0.8), Surface::Mirror { tint: Vec3::ONE }]);
        let (a, b) = (vec3(1.9, 0.2, 0.1), vec3(-0.3, 0.3, -1.8));
        for &(size, material) in quads {
            let corner = vec3(-0.9, -0.1, 0.8) + 0.5 * (1.0 - size) * (a + b);
            add_quad(&mut scene, corner, size * a, size * b, material);
        }
        scene.lights.push(point_light(vec3(0.0, 2.0, 0.0), 1.0));
        scene.cameras.push(camera(eye, vec3(-0.1, 0.15, -0.05), 20.0));
        let frame = render_scene(&scene, &settings(Mode::DirectRays, 1000, 24)).frame;
        frame.albedo().iter().map(|albedo| albedo[0]).collect::<Vec<_>>()
    };
    for eye in [vec3(0.3, 2.0, 0.4), vec3(-1.0, 1.5, 1.0), vec3(0.2, 3.0, -0.4)] {
        let all = |quads: &[(f32, u32)], right: f32| seen(quads, eye).iter().all(|albedo| *albedo == right);
        assert!(all(&[(1.0, 0), (1.0, 1)], 0.2) && all(&[(1.0, 1), (1.0, 0)], 0.8), "not the first from {eye}");
        assert!(all(&[(1.7, 0), (1.0, 1)], 0.8) && all(&[(1.0, 1), (1.7, 0)], 0.8), "not the smaller from {eye}");
        assert!(all(&[(1.7, 0), (1.0, 2)], 1.0) && all(&[(1.0, 0), (1.7, 2)], 0.2), "not the smaller from {eye}");
        assert!(all(&[(1.0, 0)], 0.2) && all(&[(1.0, 1)], 0.8) && all(&[(1.0, 2)], 1.0), "control: alone from {eye}");
    }
}

#[test]
fn of_faces_back_to_back_each_is_seen_from_its_side() {
    // A floor that looks up and one that looks down, of other sizes and materials.
    let seen = |down_first: bool, from_above: bool, down_is_double: bool| {
        let mut scene = scene(&[diffuse(0.2), diffuse(0.8)]);
        scene.materials[1].double_sided = down_is_double;
        let mut faces = [(1.3, Vec3::Z, Vec3::X, 0), (1.0, Vec3::X, Vec3::Z, 1)];
        faces.rotate_left(usize::from(down_first));
        for (size, a, b, material) in faces {
            add_quad(&mut scene, -0.5 * size * (a + b), size * a, size * b, material);
        }
        let side = if from_above { 1.0 } else { -1.0 };
        scene.lights.push(point_light(vec3(0.0, 2.0 * side, 0.0), 1.0));
        scene.cameras.push(camera(vec3(0.1, 2.0 * side, 0.3), Vec3::ZERO, 15.0));
        let frame = render_scene(&scene, &settings(Mode::DirectRays, 1000, 16)).frame;
        let albedo = frame.albedo()[0][0];
        assert!(frame.albedo().iter().all(|other| other[0] == albedo), "one is seen everywhere");
        albedo
    };
    for down_first in [false, true] {
        assert_eq!(seen(down_first, true, false), 0.2, "{down_first}: the one that looks up");
        assert_eq!(seen(down_first, false, false), 0.8, "{down_first}: the one that looks down");
        assert_eq!(seen(down_first, true, true), 0.8, "control: the smaller one has two sides");
    }
}

#[test]
fn glass_on_a_floor_does_not_leak() {
    // A block that stands on the floor: its lower face lies in the floor's plane, in other
    // triangles.
    let least = |floor: bool| {
        let mut scene = scene(&[diffuse(0.7), glass()]);
        let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, 0.2, 0.3);
        add_box(&mut scene, vec3(-0.5, 0.0, -0.5), vec3(0.5, 0.3, 0.5), 1);
        if floor {
            add_quad(&mut scene, vec3(-2.1, 0.0, 2.2), vec3(4.3, 0.0, 0.0), vec3(0.0, 0.0, -4.3), 0);
        }
        scene.triangles.iter_mut().for_each(|t| t.positions = t.positions.map(|p| turn * p));
        scene.lights.push(point_light(turn * vec3(0.3, 2.0, 0.2), 5.0));
        let view = camera(vec3(0.0, 2.0, 0.01), Vec3::ZERO, 20.0);
        let (position, forward) = (turn * view.position, turn * view.forward);
        scene.cameras.push(caustica::scene::Camera {
            position,
            forward,
            right: turn * view.right,
            up: turn * view.up,
            ..view
        });
        let render = render_scene(&scene, &quick(Mode::Photons).with(|s| s.photons.max_paths = Some(10_000)));
        assert!(is_finite(&render) && render.stats.non_finite == NonFinite::default());
        let least = render.frame.radiance().iter().map(|p| p[0]).fold(f32::INFINITY, f32::min);
        f64::from(least) / mean(&render).max(1e-9)
    };
    let lit = least(true);
    assert!(lit > 0.5, "the darkest pixel has {lit} of the mean");
    assert!(least(false) < 0.1, "control: without a floor nothing is lit");
}

#[test]
fn lights_on_surfaces_and_along_walls_are_harmless() {
    let lights = [
        point_light(vec3(0.2, -1.0, 0.1), 1.0),
        Light {
            kind: LightKind::Spot { inner: 0.3, outer: 0.6 },
            direction: Vec3::X,
            ..point_light(vec3(-1.0, 0.1, 0.2), 1.0)
        },
        Light { kind: LightKind::Directional, direction: Vec3::X, ..point_light(Vec3::ZERO, 1.0) },
        point_light(vec3(0.3, -0.1, 0.0), 1.0),
    ];
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, 0.2, 0.3);
    let settings = |mode| {
        quick(mode).with(|s| {
            s.estimate.raw = true;
            // Most paths of the light on the glass are trapped, and take hundreds of rays each.
            s.photons.caustic = 300;
        })
    };
    for light in lights {
        let mut scene = room();
        if light.kind == LightKind::Directional {
            // The walls across the light's direction would block it.
            scene.triangles.retain(|t| t.normals[0].x.abs() < 0.5);
        }
        scene.triangles.iter_mut().for_each(|t| t.positions = t.positions.map(|p| turn * p));
        scene.spheres[0].center = turn * scene.spheres[0].center;
        scene.cameras[0] = camera(turn * vec3(0.0, 0.5, 0.9), turn * vec3(0.2, -1.0, 0.1), 60.0);
        let kind = light.kind;
        scene.lights = vec![Light { position: turn * light.position, direction: turn * light.direction, ..light }];
        for mode in [Mode::DirectRays, Mode::Photons] {
            let render = render_scene(&scene, &settings(mode));
            assert!(is_finite(&render) && render.stats.non_finite == NonFinite::default(), "{kind:?} in {mode:?}");
            let most = render.frame.radiance().iter().map(|p| f64::from(p[0])).fold(0.0, f64::max);
            // Photons stored at the light's own position would give an unbounded bright spot.
            assert!(
                (mean(&render) > 1e-4 || mode == Mode::DirectRays) && most < 100.0 * mean(&render).max(1e-4),
                "{kind:?} in {mode:?}: up to {most}"
            );
        }
    }
}

/// The scaled room. Its radiance stays the same if the light's power scales with the area.
fn scaled(factor: f32, light: f32) -> Scene {
    let mut scene = room();
    scene.triangles.iter_mut().for_each(|t| t.positions = t.positions.map(|p| factor * p));
    scene.spheres.iter_mut().for_each(|s| (s.center, s.radius) = (factor * s.center, factor * s.radius));
    scene.cameras.iter_mut().for_each(|c| c.position *= factor);
    scene.lights.iter_mut().for_each(|l| (l.position, l.intensity) = (factor * l.position, light * l.intensity));
    scene
}

#[test]
fn size_does_not_matter() {
    let raw = quick(Mode::Hybrid).with(|s| s.estimate.raw = true);
    let one = render_scene(&room(), &raw).frame.radiance().to_vec();
    for exponent in [-7, 13] {
        let factor = 2.0_f32.powi(exponent);
        let other = render_scene(&scaled(factor, factor * factor), &raw).frame.radiance().to_vec();
        assert!(other == one, "another picture at 2^{exponent}");
    }
    // 7 mm and 10 km wide. The random numbers of each estimate depend on the bits of its position.
    let right = mean(&render_scene(&room(), &quick(Mode::Hybrid)));
    for factor in [0.0035, 5000.0] {
        let of = |light| render_scene(&scaled(factor, light), &quick(Mode::Hybrid));
        let other = of(factor * factor);
        assert_eq!(other.stats.non_finite, NonFinite::default());
        assert!(within(mean(&other), right, 0.02), "{} instead of {right} at {factor}", mean(&other));
    }
    assert!(!within(mean(&render_scene(&scaled(0.0035, 1.0), &raw)), right, 0.5), "control: light not scaled");
}

#[test]
fn a_thousand_kilometres_away_all_looks_the_same() {
    const FAR: f32 = 1e6;
    let near = gltf::triangle();
    let picture = |file: &serde_json::Value| {
        let mut scene = gltf::load(file).expect("the file is right");
        scene.cameras[0].aspect = Some(1.0);
        (render_scene(&scene, &settings(Mode::DirectRays, 1000, 16)).frame.radiance().to_vec(), scene)
    };
    let (right, _) = picture(&near);
    let moved = |nodes: serde_json::Value, by: [f32; 3]| {
        let mut file = near.clone();
        let list = file["nodes"].as_array_mut().expect("a list");
        list.push(serde_json::json!({ "translation": by, "children": nodes }));
        file
    };
    let mut file = moved(serde_json::json!([0, 1, 2]), [FAR, -FAR, FAR]);
    file["scenes"][0]["nodes"] = serde_json::json!([3]);
    assert!(picture(&file).0 == right, "moved by its node");
    // The vertices themselves have the resolution of f32 there: 1/16 m.
    let mut file = moved(serde_json::json!([1, 2]), [FAR, 0.0, 0.0]);
    file["scenes"][0]["nodes"] = serde_json::json!([0, 3]);
    let vertices = [[FAR, 0.0, 0.0], [FAR + 1.04, 0.0, 0.0], [FAR, 1.0, 0.0]];
    let accessor = gltf::add_accessor(&mut file, &gltf::floats(&vertices.concat()), 5126, 3, "VEC3");
    file["accessors"][accessor]["min"] = serde_json::json!([FAR, 0.0, 0.0]);
    file["accessors"][accessor]["max"] = serde_json::json!([FAR + 1.04, 1.0, 0.0]);
    file["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = accessor.into();
    let (picture, scene) = picture(&file);
    for (corner, vertex) in scene.triangles[0].positions.iter().zip(vertices) {
        assert_eq!(corner.as_dvec3() + scene.center, Vec3::from(vertex).as_dvec3());
    }
    let sum = |picture: &[[f32; 3]]| picture.iter().map(|p| f64::from(p[0])).sum::<f64>();
    assert!(within(sum(&picture), sum(&right), 0.1) && picture != right, "only the file's rounding may show");
}
