//! Surfaces on which the disc of an estimate is cut or bent, lit by one point light, so that the
//! irradiance is I cos θ / d². The test of the estimate and the benchmark that prints its errors
//! share them.

use caustica::{
    bvh::Bvh,
    gpu::Gpu,
    layout::VisiblePoint,
    passes::{
        Gather, GatherOptions, GatherSettings, MapKernels, PhotonMap, PhotonTracer, estimate::gather::gathered_buffer,
    },
    progress::Silent,
    scene::{Camera, Light, LightKind, Material, Projection, Scene, Sphere, Surface, Triangle},
    settings::{Mode, Settings},
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};

use crate::photons::Random;

/// A surface, and the query points on it.
pub struct Case {
    pub name: &'static str,
    pub scene: Scene,
    pub photons: u32,
    pub neighbors: u32,
    pub points: Vec<VisiblePoint>,
    /// Irradiance at each, W/m².
    pub expected: Vec<f64>,
    /// Scale of relative errors, W/m²: the mean of `expected`, or of the lit side of a wall.
    pub scale: f64,
}

/// The four estimates: name, and options of the gather.
pub fn ways() -> [(&'static str, GatherOptions); 4] {
    let flat = GatherOptions::flat();
    [
        ("raw", GatherOptions::default()),
        ("rejection only", GatherOptions { corrects: false, ..flat }),
        ("correction only", GatherOptions { rejects: false, ..flat }),
        ("both", flat),
    ]
}

/// All surfaces, with `count` points each.
pub fn cases(count: usize) -> Vec<Case> {
    let mut random = Random(21);
    vec![
        corner(&mut random, count),
        edge(&mut random, count),
        wall(&mut random, count, true),
        wall(&mut random, count, false),
        spheres(&mut random, count),
    ]
}

/// Irradiance estimates at the points by each method over the same photons, with one map per seed.
/// Returns the mean over the seeds.
pub fn estimates(gpu: &Gpu, case: &Case, seeds: u32) -> [Vec<f64>; 4] {
    let mut sums = ways().map(|_| vec![0.0; case.points.len()]);
    for seed in 0..seeds {
        let settings = Settings::default().with(|s| {
            s.photons.mode = Mode::Photons;
            s.photons.global = case.photons;
            s.photons.max_bounces = 1;
            s.estimate.neighbors = case.neighbors;
            s.photons.seed = seed;
        });
        let buffers = SceneBuffers::new(gpu, &case.scene, &Bvh::build(&case.scene), &settings.lights).expect("it fits");
        let tracer = PhotonTracer::new(gpu, &buffers, settings.photons.sampler);
        let traced = tracer.trace(gpu, &buffers, &settings.photons, false, &Silent).expect("photons").maps.global;
        let kernels = MapKernels::new(gpu);
        let map = PhotonMap::build(gpu, &kernels, traced.photons, traced.stored as u32, traced.emitted).expect("a map");
        let count = case.points.len() as u32;
        let points = gpu.storage_with("points", &case.points).expect("it fits");
        for ((_, options), sums) in ways().into_iter().zip(&mut sums) {
            let mut gather = Gather::over(gpu, &buffers, options);
            let gathered = gathered_buffer(gpu, count).expect("it fits");
            let radiance = gpu.storage::<[f32; 4]>("radiance", count.into()).expect("it fits");
            let asked = GatherSettings::from(&settings.estimate);
            gather.run(gpu, &map, &points, count, &asked, (&radiance, &gathered), &Silent).expect("a gather");
            let found: Vec<[f32; 4]> = gpu.read(&radiance, 0, count.into()).expect("results");
            sums.iter_mut().zip(found).for_each(|(sum, r)| *sum += f64::from(r[0]) / f64::from(seeds));
        }
    }
    sums
}

/// Mean over the points of estimate minus truth, relative to the scale.
pub fn bias(case: &Case, estimates: &[f64]) -> f64 {
    let sum: f64 = estimates.iter().zip(&case.expected).map(|(a, b)| a - b).sum();
    sum / estimates.len() as f64 / case.scale
}

fn room(light: Vec3) -> Scene {
    let material = Material::new("", Surface::Diffuse { albedo: Vec3::splat(0.5) });
    Scene {
        materials: vec![material],
        lights: vec![Light {
            name: String::new(),
            group: None,
            kind: LightKind::Point,
            position: light,
            direction: Vec3::NEG_Z,
            intensity: Vec3::splat(10.0),
        }],
        cameras: vec![Camera {
            name: String::new(),
            position: Vec3::Y,
            right: Vec3::X,
            up: Vec3::Y,
            forward: Vec3::NEG_Z,
            projection: Projection::Perspective { yfov: 1.0 },
            aspect: None,
            near: 0.0,
            far: f32::INFINITY,
            keeps_width: false,
        }],
        ..Scene::default()
    }
}

fn quad(scene: &mut Scene, corner: Vec3, a: Vec3, b: Vec3) {
    let normals = [a.cross(b).normalize(); 3];
    for positions in [[corner, corner + a, corner + a + b], [corner, corner + a + b, corner + b]] {
        scene.triangles.push(Triangle::new(positions, normals, 0));
    }
}

fn floor(scene: &mut Scene, height: f32, half: f32) {
    quad(scene, vec3(-half, height, half), vec3(2.0 * half, 0.0, 0.0), vec3(0.0, 0.0, -2.0 * half));
}

fn at(position: Vec3, normal: Vec3) -> VisiblePoint {
    VisiblePoint {
        position: position.into(),
        next_map: 1,
        weight: [1.0; 3],
        offset: 4e-6,
        ng: normal.into(),
        ns: normal.into(),
        ..VisiblePoint::default()
    }
}

/// I cos θ / d² of the scene's light.
fn irradiance(scene: &Scene, point: &VisiblePoint) -> f64 {
    let way = (scene.lights[0].position - Vec3::from(point.position)).as_dvec3();
    let cosine = way.normalize().dot(Vec3::from(point.ng).as_dvec3());
    f64::from(scene.lights[0].intensity.x) * cosine / way.length_squared()
}

fn case(name: &'static str, scene: Scene, (photons, neighbors): (u32, u32), points: Vec<VisiblePoint>) -> Case {
    let expected: Vec<f64> = points.iter().map(|p| irradiance(&scene, p)).collect();
    let scale = expected.iter().sum::<f64>() / expected.len() as f64;
    Case { name, scene, photons, neighbors, points, expected, scale }
}

/// The floor of a closed box along a wall, from a corner on.
fn corner(random: &mut Random, count: usize) -> Case {
    let mut scene = room(vec3(-0.7, 1.5, -0.6));
    let (x, y, z) = (Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0);
    let (low, high) = (vec3(-1.0, 0.0, -1.0), vec3(1.0, 2.0, 1.0));
    for (corner, a, b) in [(low, x, z), (low, y, x), (low, z, y), (high, -x, -z), (high, -y, -x), (high, -z, -y)] {
        quad(&mut scene, corner, a, b);
    }
    let point = |random: &mut Random| {
        let (near, along) = (0.04 * random.unit(), random.unit());
        at(vec3(-1.0 + near, 0.0, -1.0 + along), Vec3::Y)
    };
    let points = (0..count).map(|_| point(random)).collect();
    case("box corner", scene, (150_000, 150), points)
}

/// The top of a table along its edges, the floor far below.
fn edge(random: &mut Random, count: usize) -> Case {
    let mut scene = room(vec3(0.4, 1.8, 0.0));
    floor(&mut scene, 0.0, 2.0);
    floor(&mut scene, 0.8, 0.4);
    let point = |random: &mut Random| {
        let (in_, along) = (0.03 * random.unit(), 0.8 * random.unit() - 0.4);
        at(vec3(0.4 - in_, 0.8, along), Vec3::Y)
    };
    let points = (0..count).map(|_| point(random)).collect();
    case("table edge", scene, (40_000, 60), points)
}

/// The floor at the foot of a thin wall that keeps the light from one side.
fn wall(random: &mut Random, count: usize, lit: bool) -> Case {
    let mut scene = room(vec3(-0.1, 0.8, 0.0));
    floor(&mut scene, 0.0, 1.0);
    quad(&mut scene, vec3(0.0, 0.0, -1.5), vec3(0.0, 2.0, 0.0), vec3(0.0, 0.0, 3.0));
    let point =
        |random: &mut Random, side: f32| at(vec3(side * 0.05 * random.unit(), 0.0, random.unit() - 0.5), Vec3::Y);
    let bright = (0..count).map(|_| point(random, -1.0)).collect();
    let bright = case("lit side of a thin wall", scene, (40_000, 60), bright);
    if lit {
        return bright;
    }
    let points = (0..count).map(|_| point(random, 1.0)).collect();
    Case { name: "dark side of a thin wall", points, expected: vec![0.0; count], ..bright }
}

/// Spheres smaller than the radius of the estimate, a floor below them.
fn spheres(random: &mut Random, count: usize) -> Case {
    const RADIUS: f32 = 0.04;
    let mut scene = room(vec3(0.0, 2.0, 0.0));
    floor(&mut scene, 0.0, 1.0);
    let spots = (0..25).map(|i| vec3(0.35 * ((i % 5) as f32 - 2.0), 0.3, 0.35 * ((i / 5) as f32 - 2.0)));
    scene.spheres = spots.map(|center| Sphere { center, radius: RADIUS, material: 0, object: 0 }).collect();
    let mut points = Vec::new();
    while points.len() < count {
        let sphere = scene.spheres[points.len() % 25];
        let normal = random.direction();
        let position = sphere.center + RADIUS * normal;
        if (scene.lights[0].position - position).normalize().dot(normal) > 0.7 {
            points.push(at(position, normal));
        }
    }
    case("small spheres", scene, (60_000, 400), points)
}
