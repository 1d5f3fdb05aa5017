//! Benchmark: copies of a pot of 4,000 triangles, held once and held for themselves.
//!
//! `cargo bench --bench instances`. Each row is a scene of pots on a floor under a lamp, turned,
//! mirrored and sheared. Columns: triangles that are seen and that are held; memory of the device;
//! seconds for the tree, for photons, and for the picture; relMSE of the picture against that of
//! the copies. The last row has pots whose coordinates are those of the copies up to rounding: it
//! tells how much of the difference is rounding.

use std::f32::consts::PI;

use caustica::{
    image::difference::rel_mse,
    progress::Silent,
    renderer::{Render, render},
    scene::{Instance, Scene, SharedMesh, Triangle},
    settings::{Mode, Settings},
};
use glam::{Mat3, Quat, Vec3, vec3};
use support::{add_quad, camera, diffuse, emissive, gpu, meshes::Mesh, scene, with_copies};

const RINGS: u32 = 50;
const SEGMENTS: u32 = 41;

fn main() {
    println!("{} ({})", gpu().name, gpu().driver);
    println!(
        "{:>10} {:>6} {:>10} {:>10} {:>8} {:>8} {:>8} {:>8} {:>10}",
        "", "pots", "triangles", "held", "MiB", "tree", "photons", "picture", "relMSE"
    );
    for pots in [400, 1900] {
        let shared = pots_on_a_floor(pots, 1.0);
        let right = row("copies", pots, &with_copies(&shared), None);
        row("instances", pots, &shared, Some(&right));
        if pots == 400 {
            row("rounding", pots, &with_copies(&pots_on_a_floor(pots, 1.0 + 3e-7)), Some(&right));
        }
    }
}

fn row(name: &str, pots: u32, scene: &Scene, right: Option<&Render>) -> Render {
    let settings = Settings::default().with(|s| {
        s.photons.mode = Mode::Hybrid;
        s.picture.size = Some((128, 128));
    });
    let made = render(gpu(), scene, &settings, &Silent).expect("the scene renders");
    let seconds = &made.stats.seconds;
    let held = scene.describe().stored_triangles;
    let error = right.map(|right| rel_mse(made.frame.radiance(), right.frame.radiance(), None));
    println!(
        "{name:>10} {pots:>6} {:>10} {held:>10} {:>8} {:>8.2} {:>8.2} {:>8.2} {:>10}",
        scene.triangle_count(),
        made.stats.peak_device_bytes >> 20,
        seconds.bvh,
        seconds.photons,
        seconds.camera + seconds.direct + seconds.gather,
        error.map_or(String::new(), |error| format!("{error:.1e}"))
    );
    made
}

/// A pot of 4,000 triangles with a lid, 1 m high.
fn pot() -> SharedMesh {
    let ring = |k: u32| {
        let height = k as f32 / RINGS as f32;
        (0.35 * (PI * height).sin().powf(0.6) + 0.03 * (12.0 * height).sin().max(0.0), height)
    };
    let inner: Vec<(f32, f32)> = (1..RINGS).map(ring).collect();
    let mesh = Mesh::lathe(Vec3::ZERO, &[&[(0.0, 0.0)], &inner[..], &[(0.0, 1.0)]].concat(), SEGMENTS);
    let triangle = |corners: &[u32; 3]| {
        let positions = corners.map(|corner| mesh.positions[corner as usize]);
        let flat = Triangle::new(positions, [Vec3::Y; 3], 0).geometric_normal();
        Triangle::new(positions, [flat; 3], 0)
    };
    SharedMesh { triangles: mesh.triangles.iter().map(triangle).collect() }
}

/// Pots in rows on a floor, their size multiplied by `factor`.
fn pots_on_a_floor(pots: u32, factor: f32) -> Scene {
    let side = f64::from(pots).sqrt().ceil() as u32;
    let half = 0.6 * side as f32;
    let mut scene = scene(&[diffuse(0.6), diffuse(0.5)]);
    scene.materials.push(emissive("lamp", 0.0, 10.0, false));
    add_quad(&mut scene, vec3(-half, 0.0, -half), Vec3::Z * 2.0 * half, Vec3::X * 2.0 * half, 1);
    add_quad(&mut scene, vec3(-0.3 * half, half, -0.3 * half), Vec3::X * 0.6 * half, Vec3::Z * 0.6 * half, 2);
    let mesh = pot();
    let mirrored = |t: &Triangle| {
        let flip = vec3(-1.0, 1.0, 1.0);
        let [a, b, c] = t.positions.map(|p| flip * p);
        Triangle::new([a, c, b], t.normals.map(|n| flip * n), t.material)
    };
    scene.meshes = vec![mesh.clone(), SharedMesh { triangles: mesh.triangles.iter().map(mirrored).collect() }];
    let instance = |i: u32| {
        let at = vec3((i % side) as f32, 0.0, (i / side) as f32) * 1.2 - vec3(half, 0.0, half) + vec3(0.6, 0.0, 0.6);
        let mut own = Mat3::from_diagonal(Vec3::splat(0.6 + 0.4 * (0.618 * i as f32).fract()));
        if i % 3 == 1 {
            own.y_axis.x = 0.2;
        }
        let linear = Mat3::from_quat(Quat::from_rotation_y(0.9 * i as f32)) * own;
        Instance { mesh: u32::from(i % 4 == 2), object: 0, linear: factor * linear, offset: factor * at }
    };
    scene.instances = (0..pots).map(instance).collect();
    scene.cameras = vec![camera(vec3(0.0, 0.5 * half, 1.1 * half), vec3(0.0, 0.0, 0.2 * half), 50.0)];
    scene
}
