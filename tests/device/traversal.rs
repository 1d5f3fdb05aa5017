//! The traversal on the device finds the hits of brute force, in trees that need a short stack and
//! in trees that need a long one.

use caustica::{
    bvh::Bvh,
    scene::{Instance, Scene, SharedMesh, Sphere, Triangle},
    settings::LightSettings,
    upload::SceneBuffers,
};
use glam::{DVec3, Mat3, Vec3};
use support::*;

use super::probe::{Probe, Row};

const RAYS: usize = 4096;
/// Maximum number of [`RAYS`] that rounding may decide: rays that graze an outline, or hit two
/// surfaces at equal distances.
const UNSURE: usize = 2;

/// Uniform numbers in 0..1 (PCG hash, Jarzynski and Olano 2020).
struct Random(u32);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        (((word >> 22) ^ word) >> 8) as f32 / (1 << 24) as f32
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

/// Shapes of one size at random positions in a cube about `middle`.
fn shapes(triangles: usize, spheres: usize, size: f32, middle: Vec3) -> Scene {
    let mut random = Random(11);
    let mut scene = scene(&[diffuse(0.5)]);
    for _ in 0..triangles {
        let at = middle + random.point();
        let positions = [at, at + random.point() * size, at + random.point() * size];
        scene.triangles.push(Triangle::new(positions, [Vec3::X; 3], 0));
    }
    for _ in 0..spheres {
        let sphere =
            Sphere { center: middle + random.point(), radius: (random.next() + 0.1) * size, material: 0, object: 0 };
        scene.spheres.push(sphere);
    }
    scene
}

/// Rays from random origins around the cube in all directions, some along the axes.
fn rays(middle: Vec3) -> Vec<Row> {
    let mut random = Random(5);
    let mut ray = |i: usize| {
        let origin = middle + random.point() * 1.5;
        let along = if i.is_multiple_of(16) { Vec3::AXES[i / 16 % 3] } else { random.point().normalize() };
        let direction = if i.is_multiple_of(32) { -along } else { along };
        [origin.extend(0.0).to_array(), direction.extend(0.0).to_array()]
    };
    (0..RAYS).map(&mut ray).collect()
}

/// Distance of the nearest hit of each ray on the device; infinite if there is none.
fn on_device(scene: &Scene, bvh: &Bvh, rays: &[Row]) -> Vec<f64> {
    let buffers = SceneBuffers::new(gpu(), scene, bvh, &LightSettings::default()).expect("the scene fits");
    let found = Probe::of_scene("trace_rays", &buffers, &buffers.lights.photons).run(rays);
    found.into_iter().map(|[t, .., primitive]| if primitive < 0.0 { f64::INFINITY } else { t.into() }).collect()
}

/// The same by testing everything in f64.
fn by_brute_force(scene: &Scene, ray: &Row) -> f64 {
    let [o, d] = ray.map(|[x, y, z, _]| Vec3::new(x, y, z).as_dvec3());
    let triangles = scene.triangles.iter().filter_map(|t| hit_triangle(t.positions.map(Vec3::as_dvec3), o, d));
    let spheres = scene.spheres.iter().filter_map(|s| hit_sphere(s.center.as_dvec3(), f64::from(s.radius), o, d));
    triangles.chain(spheres).fold(f64::INFINITY, f64::min)
}

/// Möller and Trumbore 1997.
fn hit_triangle([a, b, c]: [DVec3; 3], o: DVec3, d: DVec3) -> Option<f64> {
    let (e1, e2, s) = (b - a, c - a, o - a);
    let p = d.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let (u, q) = (s.dot(p) * inverse, s.cross(e1));
    let (v, t) = (d.dot(q) * inverse, e2.dot(q) * inverse);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

fn hit_sphere(center: DVec3, radius: f64, o: DVec3, d: DVec3) -> Option<f64> {
    let s = o - center;
    let b = s.dot(d);
    let root = (b * b - s.length_squared() + radius * radius).sqrt();
    [-b - root, -b + root].into_iter().find(|t| *t > 0.0)
}

/// Rays whose hits on the device and by brute force differ by more than rounding.
fn mismatches(scene: &Scene, bvh: &Bvh, middle: Vec3) -> usize {
    let rays = rays(middle);
    let found = on_device(scene, bvh, &rays);
    let copies = with_copies(scene);
    let expected: Vec<f64> = rays.iter().map(|ray| by_brute_force(&copies, ray)).collect();
    let hits = expected.iter().filter(|t| t.is_finite()).count();
    let few = scene.triangles.len() + scene.spheres.len() < 2;
    assert!(few || hits > RAYS / 50, "the rays must hit something: {hits}");
    // Rounding of the corners' coordinates, and of the distance itself.
    let slack = 1e-4 + 1e-5 * f64::from(middle.length());
    let alike = |a: f64, b: f64| a == b || (a - b).abs() <= slack * (1.0 + b);
    found.iter().zip(&expected).filter(|(a, b)| !alike(**a, **b)).count()
}

#[test]
fn finds_what_brute_force_finds() {
    let far = Vec3::new(300.0, -200.0, 1000.0);
    let (mut short, mut long) = (0, 0);
    for (triangles, spheres, size, middle) in [
        (0, 0, 1.0, Vec3::ZERO),
        (1, 0, 2.0, Vec3::ZERO),
        (0, 1, 1.0, Vec3::ZERO),
        (2, 0, 2.0, Vec3::ZERO),
        (5, 3, 1.0, Vec3::ZERO),
        (40, 0, 0.5, Vec3::ZERO),
        (3000, 200, 0.1, Vec3::ZERO),
        (20_000, 0, 0.03, Vec3::ZERO),
        (3000, 0, 0.1, far),
    ] {
        let scene = shapes(triangles, spheres, size, middle);
        let bvh = Bvh::build(&scene);
        if bvh.max_stack_depth() <= 16 {
            short += 1
        } else {
            long += 1
        }
        let wrong = mismatches(&scene, &bvh, middle);
        assert!(wrong <= UNSURE, "{wrong} rays of {triangles} triangles, {spheres} spheres about {middle}");
    }
    // Boxes of zero extent along y.
    let mut flat = shapes(400, 0, 0.4, Vec3::ZERO);
    flat.triangles.iter_mut().flat_map(|t| &mut t.positions).for_each(|p| p.y = 0.25);
    assert!(mismatches(&flat, &Bvh::build(&flat), Vec3::ZERO) <= UNSURE, "in a plane");
    assert!(short > 0 && long > 0, "stacks of several sizes are tested: {short}, {long}");
}

/// Meshes at random places, some stretched; between single shapes.
#[test]
fn finds_what_brute_force_finds_in_instances() {
    for (triangles, instances, middle) in
        [(1, 1, Vec3::ZERO), (20, 120, Vec3::ZERO), (250, 20, Vec3::ZERO), (40, 40, Vec3::new(200.0, -100.0, 500.0))]
    {
        let mut scene = shapes(300, 30, 0.1, middle);
        let mesh = |triangles| SharedMesh { triangles: shapes(triangles, 0, 0.5, Vec3::ZERO).triangles };
        scene.meshes = vec![mesh(triangles), mesh(2 * triangles + 1)];
        let mut random = Random(3);
        scene.instances = (0..instances)
            .map(|i| {
                let axis = |axis: Vec3| 0.1 * (axis + 0.6 * random.point());
                let [x, y, z] = Vec3::AXES.map(axis);
                let linear = Mat3::from_cols(x, y, z);
                let linear = if linear.determinant() < 0.0 { -linear } else { linear };
                Instance { mesh: i % 2, object: 0, linear, offset: middle + random.point() }
            })
            .collect();
        let bvh = Bvh::build(&scene);
        let wrong = mismatches(&scene, &bvh, middle);
        assert!(wrong <= UNSURE, "{wrong} rays of {instances} instances of {triangles} triangles about {middle}");
        // Control: instances 1 cm aside.
        scene.instances.iter_mut().for_each(|instance| instance.offset += 0.01);
        assert!(instances == 1 || mismatches(&scene, &bvh, middle) > 10 * UNSURE);
    }
}

/// Controls: a box that is too small, and shapes that the tree does not hold.
#[test]
fn what_the_tree_lacks_is_missed() {
    let scene = shapes(3000, 200, 0.1, Vec3::ZERO);
    let mut bvh = Bvh::build(&scene);
    // The first child's box gets zero extent along one axis.
    bvh.nodes[0].high[0] = (bvh.nodes[0].high[0] & !0xff) | (bvh.nodes[0].low[0] & 0xff);
    assert!(mismatches(&scene, &bvh, Vec3::ZERO) > 10 * UNSURE);
    let scene = shapes(40, 0, 0.5, Vec3::ZERO);
    let mut fewer = scene.clone();
    fewer.triangles.truncate(30);
    assert!(mismatches(&scene, &Bvh::build(&fewer), Vec3::ZERO) > 10 * UNSURE);
}
