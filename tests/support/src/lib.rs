//! Code that several test programs, benchmarks or fuzz targets share: scenes built in code, and the
//! devices of a test program.

pub mod any_environment;
pub mod any_scene;
pub mod gltf;
pub mod make_scenes;
pub mod meshes;
pub mod photons;
pub mod rays;
pub mod surfaces;

use std::sync::{
    OnceLock,
    atomic::{AtomicUsize, Ordering},
};

use caustica::{
    gpu::Gpu,
    progress::Silent,
    renderer::{Render, Session, render},
    scene::{Camera, Instance, Light, LightKind, Material, Projection, Scene, Sphere, Surface, Triangle},
    settings::{EstimateSettings, Mode, Settings},
};
use glam::Vec3;

/// The devices of this test process, each with the number of tests that have it. The driver
/// compiles kernels in the queue of a device: with two of them one works meanwhile.
static GPUS: [(OnceLock<Gpu>, AtomicUsize); 2] = [const { (OnceLock::new(), AtomicUsize::new(0)) }; 2];

/// A test's hold on one of [`GPUS`], from its first call of [`gpu`] to its end.
struct Hold(usize);

impl Drop for Hold {
    fn drop(&mut self) {
        GPUS[self.0].1.fetch_sub(1, Ordering::Relaxed);
    }
}

thread_local! {
    static HOLD: Hold = {
        let freest = (0..GPUS.len()).min_by_key(|i| GPUS[*i].1.load(Ordering::Relaxed)).unwrap_or(0);
        GPUS[freest].1.fetch_add(1, Ordering::Relaxed);
        Hold(freest)
    };
}

/// The device of this test; no adapter is a failure.
pub fn gpu() -> &'static Gpu {
    let open = || Gpu::open(std::env::var("CAUSTICA_DEVICE").ok().as_deref()).expect("tests need an adapter");
    HOLD.with(|hold| GPUS[hold.0].0.get_or_init(open))
}

pub fn diffuse(albedo: f32) -> Surface {
    Surface::Diffuse { albedo: Vec3::splat(albedo) }
}

pub fn glass() -> Surface {
    Surface::Glass { ior: 1.5, tint: Vec3::ONE }
}

pub fn scene(surfaces: &[Surface]) -> Scene {
    let materials = surfaces.iter().map(|&surface| Material::new("", surface)).collect();
    Scene { materials, ..Scene::default() }
}

pub fn point_light(position: Vec3, intensity: f32) -> Light {
    Light {
        name: String::new(),
        group: None,
        kind: LightKind::Point,
        position,
        direction: Vec3::NEG_Z,
        intensity: Vec3::splat(intensity),
    }
}

/// An emissive diffuse material.
pub fn emissive(name: &str, albedo: f32, emission: f32, double_sided: bool) -> Material {
    Material { emission: Vec3::splat(emission), double_sided, ..Material::new(name, diffuse(albedo)) }
}

/// A camera at `position` that looks at `target`; full vertical angle in degrees.
pub fn camera(position: Vec3, target: Vec3, degrees: f32) -> Camera {
    let forward = (target - position).normalize();
    let helper = if forward.y.abs() > 0.9 { Vec3::X } else { Vec3::Y };
    let right = forward.cross(helper).normalize();
    let projection = Projection::Perspective { yfov: degrees.to_radians() };
    Camera {
        name: String::new(),
        position,
        right,
        up: right.cross(forward),
        forward,
        projection,
        aspect: Some(1.0),
        near: 0.0,
        far: f32::INFINITY,
        keeps_width: false,
    }
}

pub fn sphere(center: Vec3, radius: f32, material: u32) -> Sphere {
    Sphere { center, radius, material, object: 0 }
}

/// The parallelogram `corner, corner + a, corner + a + b, corner + b`; its normal is along a × b.
pub fn add_quad(scene: &mut Scene, corner: Vec3, a: Vec3, b: Vec3, material: u32) {
    let normals = [a.cross(b).normalize(); 3];
    for positions in [[corner, corner + a, corner + a + b], [corner, corner + a + b, corner + b]] {
        scene.triangles.push(Triangle::new(positions, normals, material));
    }
}

/// The scene with triangles for each of its instances.
pub fn with_copies(scene: &Scene) -> Scene {
    let of_instance = |instance: &Instance| {
        let to_normal = instance.linear.inverse().transpose();
        let copy = |triangle: &Triangle| Triangle {
            positions: triangle.positions.map(|position| instance.position(position)),
            normals: triangle.normals.map(|normal| (to_normal * normal).normalize_or_zero()),
            object: instance.object,
            ..*triangle
        };
        scene.meshes[instance.mesh as usize].triangles.iter().map(copy).collect::<Vec<_>>()
    };
    let all = scene.triangles.iter().copied().chain(scene.instances.iter().flat_map(of_instance));
    Scene { triangles: all.collect(), instances: Vec::new(), meshes: Vec::new(), ..scene.clone() }
}

/// An axis-aligned box of six quads with outward normals.
pub fn add_box(scene: &mut Scene, min: Vec3, max: Vec3, material: u32) {
    let size = max - min;
    let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
    add_quad(scene, min, y, x, material);
    add_quad(scene, min, x, z, material);
    add_quad(scene, min, z, y, material);
    add_quad(scene, max, -y, -z, material);
    add_quad(scene, max, -z, -x, material);
    add_quad(scene, max, -x, -y, material);
}

/// A room from −1 to 1 along each axis with a hole from 0.1 to 0.7 m along y and from −0.5 to 0.1
/// along z in the wall at x = 1, and a camera at its wall at x = −1 that sees all others.
pub fn room_with_window(albedo: f32) -> Scene {
    let mut room = scene(&[diffuse(albedo)]);
    add_box(&mut room, Vec3::NEG_ONE, Vec3::ONE, 0);
    room.triangles.retain(|triangle| triangle.positions.iter().any(|p| p.x < 1.0));
    for (y, z) in
        [([-1.0, 0.1], [-1.0, 1.0]), ([0.7, 1.0], [-1.0, 1.0]), ([0.1, 0.7], [-1.0, -0.5]), ([0.1, 0.7], [0.1, 1.0])]
    {
        add_quad(&mut room, Vec3::new(1.0, y[0], z[0]), (y[1] - y[0]) * Vec3::Y, (z[1] - z[0]) * Vec3::Z, 0);
    }
    room.cameras.push(camera(Vec3::new(-0.95, 0.2, 0.1), Vec3::new(0.0, 0.0, 0.0), 100.0));
    room
}

/// Small, quick settings.
pub fn settings(mode: Mode, photons: u32, size: u32) -> Settings {
    Settings::default().with(|s| {
        s.photons.mode = mode;
        s.photons.global = photons;
        s.photons.caustic = photons;
        s.picture.size = Some((size, size));
        s.picture.spp = 1;
    })
}

pub fn render_scene(scene: &Scene, settings: &Settings) -> Render {
    render(gpu(), scene, settings, &Silent).expect("the scene renders")
}

/// Renders of the same photons, one for each estimate; of the bits of [`render_scene`].
pub fn render_estimates(scene: &Scene, settings: &Settings, estimates: &[EstimateSettings]) -> Vec<Render> {
    let session = Session::open(gpu(), scene, &settings.lights, &Silent).expect("the scene fits");
    let maps = session.photon_maps(&settings.photons, &Silent).expect("photons");
    let picture = |estimate| session.picture(&maps, estimate, &settings.picture, &Silent).expect("a picture");
    estimates.iter().map(picture).collect()
}

/// Means of the blocks of a square picture of that many pixels along a side of one.
pub fn blocks(picture: &[[f32; 3]], of: usize) -> Vec<[f32; 3]> {
    let side = picture.len().isqrt();
    let mut sums = vec![[0.0; 3]; (side / of).pow(2)];
    for (i, pixel) in picture.iter().enumerate() {
        let block = &mut sums[i / side / of * (side / of) + i % side / of];
        for (sum, value) in block.iter_mut().zip(pixel) {
            *sum += value / of.pow(2) as f32;
        }
    }
    sums
}

/// Mean of all pixels and channels.
pub fn mean(render: &Render) -> f64 {
    let sum: f64 = render.frame.radiance().iter().flatten().map(|&x| f64::from(x)).sum();
    sum / (3 * render.frame.radiance().len()) as f64
}

/// Mean of independent numbers, and its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

impl Estimate {
    /// Estimate over the seeds 0..`seeds`.
    pub fn over_seeds(seeds: u32, of_seed: impl Fn(u32) -> f64) -> Self {
        Self::of(&(0..seeds).map(of_seed).collect::<Vec<_>>())
    }

    /// Estimate of the mean of what the values are drawn from.
    pub fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self { mean, error: (squares / (count * (count - 1.0))).sqrt() }
    }

    /// Estimates over the seeds 0..`seeds` of the means of pictures. Those of one seed share
    /// photons.
    pub fn of_pictures(seeds: u32, scene: &Scene, settings: &Settings, estimates: &[EstimateSettings]) -> Vec<Self> {
        let of_seed = |seed| {
            render_estimates(scene, &settings.clone().with(|s| s.photons.seed = seed), estimates)
                .iter()
                .map(mean)
                .collect()
        };
        let means: Vec<Vec<f64>> = (0..seeds).map(of_seed).collect();
        (0..estimates.len()).map(|i| Self::of(&means.iter().map(|of_seed| of_seed[i]).collect::<Vec<_>>())).collect()
    }

    /// Distance from the expected value, in standard errors.
    pub fn z(&self, expected: f64) -> f64 {
        (self.mean - expected).abs() / self.error
    }
}

/// Whether the relative error of `value` is less than `fraction`.
pub fn within(value: f64, expected: f64, fraction: f64) -> bool {
    (value - expected).abs() < fraction * expected.abs()
}
