//! Benchmark: incoherent rays. Traversal in a kernel that does nothing else, against the BVH2 of
//! obvhs with rayon on the same cores.
//!
//! `cargo bench --bench rays`. Both sides read rays from memory and write the nearest hit of each.
//! Rays start at random points in a room, in random directions. The geometry is a closed box that
//! contains a wavy height field.

use std::time::Instant;

use caustica::{
    bvh::Bvh,
    gpu::{
        Gpu,
        shaders::{Binding, BindingKind, Shader},
    },
    scene::{Material, Scene, Surface, Triangle},
    settings::LightSettings,
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};
use obvhs::{BvhBuildParams, bvh2::builder::build_bvh2_from_tris, ray};
use rayon::prelude::*;

const PROBES: &[Shader] = &include!(concat!(env!("OUT_DIR"), "/probe_table.rs"));
const RAYS: usize = 1 << 20;
/// Origin and direction.
type Ray = [[f32; 4]; 2];
const RUNS: usize = 3;

fn main() {
    let gpu = Gpu::open(std::env::var("CAUSTICA_DEVICE").ok().as_deref()).expect("benches need an adapter");
    println!("{} ({}), {} CPU threads, {RAYS} incoherent rays", gpu.name, gpu.driver, rayon::current_num_threads());
    println!("{:>10} {:>14} {:>14} {:>8}", "triangles", "caustica/s", "obvhs BVH2/s", "ratio");
    for side in [10, 100, 500, 708] {
        compare(&gpu, &room(side));
    }
}

fn compare(gpu: &Gpu, scene: &Scene) {
    let rays = rays();
    let native = native_seconds(scene, &rays);
    let ours = kernel_seconds(gpu, scene, &rays);
    let (a, b) = (RAYS as f64 / ours, RAYS as f64 / native);
    println!("{:>10} {a:>14.0} {b:>14.0} {:>8.2}", scene.triangles.len(), a / b);
}

/// Best time over several runs over all rays, after a warm-up run.
fn kernel_seconds(gpu: &Gpu, scene: &Scene, rays: &[Ray]) -> f64 {
    let buffers = SceneBuffers::new(gpu, scene, &Bvh::build(scene), &LightSettings::default()).expect("the scene fits");
    let shader = PROBES.iter().find(|shader| shader.stem == "trace_rays").expect("the probe");
    let kernel = buffers.kernel_of(gpu, shader, &[]);
    let count = rays.len() as u64;
    let rays = gpu.storage_with("rays", rays).expect("fits");
    let hits = gpu.storage::<[f32; 4]>("hits", count).expect("fits");
    let bindings = kernel.bind(gpu, &buffers.with(&[("inputs", &rays), ("outputs", &hits)]));
    best_of(|| {
        let mut encoder = gpu.encoder();
        kernel.dispatch(&mut encoder, &bindings, count);
        gpu.submit(encoder);
        gpu.wait().expect("the kernel runs");
    })
}

fn native_seconds(scene: &Scene, rays: &[Ray]) -> f64 {
    let triangle = |t: &Triangle| obvhs::triangle::Triangle {
        v0: t.positions[0].into(),
        v1: t.positions[1].into(),
        v2: t.positions[2].into(),
    };
    let triangles: Vec<_> = scene.triangles.iter().map(triangle).collect();
    let bvh = build_bvh2_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Default::default());
    let ordered: Vec<_> = bvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
    let nearest = |ray: &Ray| {
        let mut hit = ray::RayHit::none();
        let [origin, direction] = ray.map(|[x, y, z, _]| vec3(x, y, z));
        let ray = ray::Ray::new_inf(origin.into(), direction.into());
        bvh.ray_traverse(ray, &mut hit, |ray, i| ordered[i].intersect(ray));
        hit
    };
    let mut hits = vec![ray::RayHit::none(); rays.len()];
    let seconds = best_of(|| {
        rays.par_chunks(4096).zip(hits.par_chunks_mut(4096)).for_each(|(rays, hits)| {
            rays.iter().zip(hits).for_each(|(ray, hit)| *hit = nearest(ray));
        });
    });
    assert!(hits.iter().any(|hit| hit.t.is_finite()), "rays in a closed room hit something");
    seconds
}

fn best_of(mut work: impl FnMut()) -> f64 {
    work();
    let time = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..RUNS).map(|_| time(&mut work)).fold(f64::INFINITY, f64::min)
}

/// Random origins and directions from hashed ray indices.
fn rays() -> Vec<Ray> {
    let unit = |i: u32, salt: u32| {
        let mut h = i.wrapping_mul(0x9e37_79b9) ^ salt.wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
        h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
        ((h ^ (h >> 16)) >> 8) as f32 / (1 << 24) as f32
    };
    let ray = |i: u32| {
        let origin = vec3(unit(i, 1), 0.3 + 0.7 * unit(i, 2), unit(i, 3)) * 1.98 - vec3(0.99, 0.0, 0.99);
        let (z, phi) = (1.0 - 2.0 * unit(i, 4), std::f32::consts::TAU * unit(i, 5));
        let r = (1.0 - z * z).max(0.0).sqrt();
        [origin.extend(0.0).to_array(), [r * phi.cos(), z, r * phi.sin(), 0.0]]
    };
    (0..RAYS as u32).map(ray).collect()
}

/// Closed room whose floor is a height field of `side` x `side` quads.
fn room(side: i32) -> Scene {
    let surface = Surface::Diffuse { albedo: Vec3::splat(0.5) };
    let mut scene = Scene { materials: vec![Material::new("", surface)], ..Scene::default() };
    let mut quad = |corners: [Vec3; 4]| {
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            let positions = [corners[a], corners[b], corners[c]];
            let normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalize();
            scene.triangles.push(Triangle::new(positions, [normal; 3], 0));
        }
    };
    let at = |i: i32, j: i32| {
        let (x, z) = (2.0 * i as f32 / side as f32 - 1.0, 2.0 * j as f32 / side as f32 - 1.0);
        vec3(x, 0.15 * (7.0 * x).sin() * (5.0 * z).cos(), z)
    };
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        quad([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
    }
    let c = |x: f32, y: f32, z: f32| vec3(x, if y < 0.0 { -0.2 } else { 2.0 }, z);
    quad([c(-1., 1., -1.), c(1., 1., -1.), c(1., 1., 1.), c(-1., 1., 1.)]);
    quad([c(-1., -1., -1.), c(1., -1., -1.), c(1., 1., -1.), c(-1., 1., -1.)]);
    quad([c(-1., -1., 1.), c(-1., 1., 1.), c(1., 1., 1.), c(1., -1., 1.)]);
    quad([c(-1., -1., -1.), c(-1., 1., -1.), c(-1., 1., 1.), c(-1., -1., 1.)]);
    quad([c(1., -1., -1.), c(1., -1., 1.), c(1., 1., 1.), c(1., 1., -1.)]);
    scene
}
