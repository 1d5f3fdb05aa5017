//! Benchmark: direct light of few and many lights, as seconds and as error.
//!
//! `cargo bench --bench lights`. The first table has point lights over a floor, the picture's mean
//! against the closed form at the same points. The second has emissive triangles of powers over
//! five decades among blocks, the relMSE of each picture against one of the same camera rays with
//! 64 times the light samples. The third has the time to build the trees.

use std::time::Instant;

use caustica::{
    bvh::Bvh,
    image::difference::rel_mse,
    progress::Silent,
    renderer::{Render, render},
    scene::{Light, LightKind, Scene, Triangle},
    settings::{LightSettings, Mode, Settings},
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};
use support::{add_box, add_quad, camera, diffuse, emissive, gpu, photons::Random, point_light, scene};

/// Half of the width of the floor, metres.
const HALF: f32 = 20.0;
const SIZE: u32 = 128;
const RUNS: usize = 3;
/// Decades over which the radiance of emissive triangles is spread, and values that it has.
const DECADES: u32 = 5;
const STEPS: u32 = 20;

fn main() {
    println!("{} ({})", gpu().name, gpu().driver);
    println!("{:>14} {:>10} {:>14} {:>12}", "point lights", "seconds", "mean / sum", "relMSE");
    for count in [16, 20, 2000] {
        let scene = under_points(count);
        let (seconds, picture) = timed(&scene, 4);
        let right = sums(&scene);
        let mean = |pixels: &[[f32; 3]]| pixels.iter().map(|p| f64::from(p[0])).sum::<f64>();
        let ratio = mean(picture.frame.radiance()) / mean(&right);
        println!("{count:>14} {seconds:>10.3} {ratio:>14.4} {:>12.6}", rel_mse(picture.frame.radiance(), &right, None));
    }
    println!("{:>14} {:>10} {:>14} {:>12}", "triangles", "samples", "seconds", "relMSE");
    for count in [600, 10_000] {
        let scene = among_triangles(count);
        let reference = timed(&scene, 256).1;
        for samples in [1, 4, 16] {
            let (seconds, picture) = timed(&scene, samples);
            let error = rel_mse(picture.frame.radiance(), reference.frame.radiance(), None);
            println!("{count:>14} {samples:>10} {seconds:>14.3} {error:>12.6}");
        }
    }
    println!("{:>14} {:>10}", "lights", "upload, s");
    for count in [1000, 100_000, 1_000_000] {
        println!("{count:>14} {:>10.3}", upload_seconds(&under_points(count)));
    }
}

/// Least seconds of direct light of several renders, and the picture.
fn timed(scene: &Scene, light_samples: u32) -> (f64, Render) {
    let settings = Settings::default().with(|s| {
        s.photons.mode = Mode::DirectRays;
        s.picture.size = Some((SIZE, SIZE));
        s.picture.spp = 4;
        s.picture.light_samples = light_samples;
    });
    let once = || render(gpu(), scene, &settings, &Silent).expect("the scene renders");
    let runs = if light_samples > 16 { 1 } else { RUNS };
    let renders: Vec<Render> = (0..runs).map(|_| once()).collect();
    let seconds = renders.iter().map(|render| render.stats.seconds.direct).fold(f64::INFINITY, f64::min);
    (seconds, renders.into_iter().last().expect("a render"))
}

fn upload_seconds(scene: &Scene) -> f64 {
    let bvh = Bvh::build(scene);
    let start = Instant::now();
    let buffers = SceneBuffers::new(gpu(), scene, &bvh, &LightSettings::default()).expect("the scene fits");
    assert!(buffers.lights.table.is_sampled());
    start.elapsed().as_secs_f64()
}

fn yard() -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    add_quad(&mut scene, vec3(-HALF, 0.0, HALF), Vec3::X * 2.0 * HALF, Vec3::NEG_Z * 2.0 * HALF, 0);
    scene
}

/// A floor seen straight from above, through no pixel filter wider than a pixel, under lights of
/// equal intensity.
fn under_points(count: usize) -> Scene {
    let (mut scene, mut random) = (yard(), Random(5));
    let across = |random: &mut Random| HALF * (2.0 * random.unit() - 1.0);
    for _ in 0..count {
        let position = vec3(across(&mut random), 1.0 + random.unit(), across(&mut random));
        scene.lights.push(point_light(position, 100.0 / count as f32));
    }
    scene.cameras = vec![camera(vec3(0.0, 60.0, 0.0), Vec3::ZERO, 30.0)];
    scene
}

/// The radiance of each pixel's middle under the sum of all lights.
fn sums(scene: &Scene) -> Vec<[f32; 3]> {
    let view = &scene.cameras[0];
    let radiance = |x: u32, y: u32| {
        let at = |i: u32| (2.0 * (i as f32 + 0.5) / SIZE as f32 - 1.0) * 15.0_f32.to_radians().tan() * 60.0;
        let point = at(x) * view.right - at(y) * view.up;
        let of = |light: &Light| {
            assert_eq!(light.kind, LightKind::Point);
            let to = (light.position - point).as_dvec3();
            f64::from(light.intensity.x) * to.y / to.length().powi(3)
        };
        [(scene.lights.iter().map(of).sum::<f64>() * 0.5 / std::f64::consts::PI) as f32; 3]
    };
    (0..SIZE * SIZE).map(|i| radiance(i % SIZE, i / SIZE)).collect()
}

/// Blocks on a floor, and triangles that face all ways above them.
fn among_triangles(count: usize) -> Scene {
    let (mut scene, mut random) = (yard(), Random(6));
    let across = |random: &mut Random, half: f32| half * (2.0 * random.unit() - 1.0);
    for _ in 0..30 {
        let corner = vec3(across(&mut random, 15.0), 0.0, across(&mut random, 15.0));
        add_box(&mut scene, corner, corner + 0.8, 0);
    }
    for step in 0..STEPS {
        let weaker = 10.0_f32.powf(-((step * DECADES) as f32 / STEPS as f32));
        scene.materials.push(emissive("", 0.0, 2000.0 * weaker, false));
    }
    let side = 0.3 * (600.0 / count as f32).sqrt();
    for i in 0..count {
        let corner = vec3(across(&mut random, HALF), 0.9 + 2.0 * random.unit(), across(&mut random, HALF));
        let mut edge = || side * Vec3::from([0; 3].map(|_| random.unit() - 0.5)).normalize();
        let (a, b) = (edge(), edge());
        let positions = [corner, corner + a, corner + b];
        scene.triangles.push(Triangle::new(positions, [a.cross(b).normalize(); 3], 1 + i as u32 % STEPS));
    }
    scene.cameras = vec![camera(vec3(0.0, 14.0, 22.0), Vec3::ZERO, 46.0)];
    scene
}
