//! Tests: the tree holds every primitive once, in boxes that contain it, and traversal finds the
//! hits of brute force.

use std::sync::Mutex;

use glam::Vec3;

use super::{
    Bvh, BvhChild, MAX_LEAF, WIDTH,
    binary::build_binary,
    build::bounds,
    convert::MAX_HEIGHT,
    parallel::{Curve, LARGE, part},
    widen::widen,
};
use crate::error::Error;
use crate::layout::{BVH_STACK, BvhNode, Primitive, SPHERE_BIT};
use crate::progress::{Progress, Stage};
use crate::scene::{Bounds, Scene, Sphere, Triangle};

/// Random numbers in [0, 1) (PCG hash, Jarzynski and Olano 2020).
struct Random(u32);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        ((word >> 22) ^ word) as f32 / u32::MAX as f32
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

fn triangle(positions: [Vec3; 3]) -> Triangle {
    let mut triangle = Triangle::new(positions, [Vec3::ZERO; 3], 0);
    triangle.normals = [triangle.geometric_normal(); 3];
    triangle
}

fn random_scene(triangles: usize, spheres: usize, size: f32, seed: u32) -> Scene {
    let mut random = Random(seed);
    let mut scene = Scene::default();
    for _ in 0..triangles {
        let at = random.point();
        scene.triangles.push(triangle([at, at + random.point() * size, at + random.point() * size]));
    }
    for _ in 0..spheres {
        scene.spheres.push(Sphere {
            center: random.point(),
            radius: (random.next() + 0.1) * size,
            material: 0,
            object: 0,
        });
    }
    scene
}

/// Distance of the nearest hit beyond 0 with one primitive (Möller and Trumbore 1997).
fn intersect(p: &Primitive, o: Vec3, d: Vec3) -> Option<f32> {
    let [v0, e1, e2] = [p.v0, p.e1, p.e2].map(Vec3::from_array);
    if p.material & SPHERE_BIT != 0 {
        let (oc, r) = (o - v0, e1.x);
        let (b, c) = (oc.dot(d), oc.length_squared() - r * r);
        let root = (b * b - c).max(0.0).sqrt();
        let t = if -b - root > 0.0 { -b - root } else { -b + root };
        return (b * b >= c && t > 0.0).then_some(t);
    }
    let h = d.cross(e2);
    let inverse = 1.0 / e1.dot(h);
    let s = o - v0;
    let (u, q) = (s.dot(h) * inverse, s.cross(e1));
    let (v, t) = (d.dot(q) * inverse, e2.dot(q) * inverse);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

fn brute_force(bvh: &Bvh, o: Vec3, d: Vec3) -> Option<(f32, u32)> {
    let hits = bvh.primitives.iter().filter_map(|p| Some((intersect(p, o, d)?, p.id)));
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

fn enters(bounds: Bounds, o: Vec3, d: Vec3, t_max: f32) -> bool {
    let (a, b) = ((bounds.min - o) / d, (bounds.max - o) / d);
    let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element().min(t_max));
    near <= far * (1.0 + 4.0 * f32::EPSILON)
}

fn traverse(bvh: &Bvh, o: Vec3, d: Vec3) -> Option<(f32, u32)> {
    let mut nearest: Option<(f32, u32)> = None;
    let mut open = vec![0_u32];
    while let Some(node) = open.pop() {
        for BvhChild { bounds, first, count } in bvh.nodes[node as usize].children() {
            let t_max = nearest.map_or(f32::INFINITY, |hit| hit.0);
            if !enters(bounds, o, d, t_max) {
                continue;
            }
            if count == 0 {
                open.push(first);
                continue;
            }
            for p in &bvh.primitives[first as usize..(first + count) as usize] {
                if let Some(t) = intersect(p, o, d).filter(|t| nearest.is_none_or(|hit| *t < hit.0)) {
                    nearest = Some((t, p.id));
                }
            }
        }
    }
    nearest
}

/// Number of rays, of `count`, whose nearest hit differs from brute force.
fn mismatches(bvh: &Bvh, count: usize) -> usize {
    let mut random = Random(7);
    let mut rays = (0..count).map(|_| (random.point() * 1.5, random.point().normalize()));
    let mut hits = 0;
    let wrong = rays
        .by_ref()
        .filter(|(o, d)| {
            let expected = brute_force(bvh, *o, *d);
            hits += usize::from(expected.is_some());
            traverse(bvh, *o, *d).map(|hit| hit.0) != expected.map(|hit| hit.0)
        })
        .count();
    assert!(hits > count / 50, "the rays must hit something: {hits} of {count}");
    wrong
}

/// Describes a structural fault of the tree, if there is one.
fn fault(bvh: &Bvh) -> Option<String> {
    let mut seen = vec![0; bvh.primitives.len()];
    // Computes the box of the primitives below each node, children before parents.
    let mut held = vec![Bounds::EMPTY; bvh.nodes.len()];
    for (i, node) in bvh.nodes.iter().enumerate().rev() {
        let count = node.children().count();
        if !(2..=WIDTH).contains(&count) {
            return Some(format!("node {i} has {count} children"));
        }
        for BvhChild { bounds: outer, first, count } in node.children() {
            let inner = if count == 0 {
                if first as usize <= i {
                    return Some(format!("child {first} of node {i} comes before it"));
                }
                held[first as usize]
            } else {
                let range = first as usize..(first + count) as usize;
                seen[range.clone()].iter_mut().for_each(|n| *n += 1);
                bvh.primitives[range].iter().map(bounds).fold(Bounds::EMPTY, Bounds::union)
            };
            if count > MAX_LEAF || outer.union(inner) != outer {
                return Some(format!("a child of node {i} holds {count} or leaves its box"));
            }
            held[i] = held[i].union(inner);
        }
    }
    let mut ids: Vec<u32> = bvh.primitives.iter().map(|p| p.id).collect();
    ids.sort_unstable();
    ids.dedup();
    if seen.iter().any(|n| *n != 1) || (ids.len() != bvh.primitives.len() && bvh.primitives.len() > 2) {
        return Some("a primitive is not in exactly one leaf".to_owned());
    }
    (bvh.max_stack_depth() > BVH_STACK).then(|| format!("stack depth {}", bvh.max_stack_depth()))
}

#[test]
fn holds_every_primitive_and_agrees_with_brute_force() {
    for (triangles, spheres, size) in
        [(0, 0, 1.0), (1, 0, 1.0), (0, 1, 1.0), (2, 0, 1.0), (3, 1, 1.0), (5, 0, 1.0), (40, 9, 0.5), (3000, 200, 0.1)]
    {
        let bvh = Bvh::build(&random_scene(triangles, spheres, size, 1));
        assert_eq!(fault(&bvh), None, "{triangles} triangles, {spheres} spheres");
        assert_eq!(bvh.primitives.len(), (triangles + spheres).max(2));
        assert_eq!(bvh.normals.len(), bvh.primitives.len());
        if triangles + spheres > 3 {
            assert_eq!(mismatches(&bvh, 2000), 0, "{triangles} triangles, {spheres} spheres");
        }
    }
}

/// Largest excess of the first child's box over the given box on any side, in units of that axis,
/// and the unit. `None` if the box does not contain the given one. The second child spans the node,
/// from `low` over `extent`.
fn looseness(node: &BvhNode, given: Bounds) -> Option<f32> {
    let child = node.children().next().expect("it has two");
    let holds = child.bounds.union(given) == child.bounds;
    let unit = f32::from_bits((node.grid[3] & 0xff) << 23);
    let beyond = (given.min.x - child.bounds.min.x).max(child.bounds.max.x - given.max.x);
    // Coordinates there are no denser than one ulp.
    let ulp = f32::EPSILON * given.max.abs().max(given.min.abs()).x;
    holds.then_some((beyond - ulp).max(0.0) / unit.max(f32::MIN_POSITIVE))
}

/// Long thin triangles through the origin.
fn needles(count: usize) -> Scene {
    let mut random = Random(11);
    let mut scene = Scene::default();
    for _ in 0..count {
        let along = random.point().normalize();
        let aside = along.cross(random.point()).normalize() * 0.001;
        scene.triangles.push(triangle([along, aside - along, -aside - along]));
    }
    scene
}

#[test]
fn crossing_needles_are_split_and_all_found() {
    let scene = needles(6000);
    let bvh = Bvh::build(&scene);
    assert!(bvh.primitives.len() > 10 * scene.triangles.len(), "{} pieces", bvh.primitives.len());
    let mut ids: Vec<u32> = bvh.primitives.iter().map(|p| p.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), scene.triangles.len());
    assert_eq!(mismatches(&bvh, 300), 0);
    let mut on_a_floor = scene.clone();
    on_a_floor.triangles.push(triangle([Vec3::new(-99.0, -1.0, -99.0), Vec3::new(99.0, -1.0, -99.0), Vec3::NEG_Y]));
    let with_floor = Bvh::build(&on_a_floor).primitives.len();
    assert!(with_floor > 10 * scene.triangles.len(), "{with_floor} pieces on a large floor");
    let few = Bvh::build(&needles(100));
    assert_eq!(few.primitives.len(), 100, "control: where little crosses nothing is split");
}

#[test]
fn quantized_boxes_are_tight_and_conservative() {
    let along_x = |low: f32, high: f32| Bounds { min: Vec3::new(low, 0.0, 0.0), max: Vec3::new(high, 1.0, 1.0) };
    let mut random = Random(3);
    for corner in [0.0, 1.0, -1.0, 1e6, -1e6, 1e18] {
        for extent in [0.0, 1e-40, 1e-20, 1e-6, 1.0, 3.0, 1e6, 1e18] {
            for _ in 0..50 {
                let (a, b) = (random.next(), random.next());
                let all = along_x(corner, corner + extent);
                let given = along_x(corner + a.min(b) * extent, corner + a.max(b) * extent);
                let node = BvhNode::new(&[given, all], &[1, 1], 0, 0);
                let what = format!("{given:?} in {all:?}");
                assert!(looseness(&node, given).is_some_and(|units| units <= 1.0), "{what}");
                // Eight bits suffice for the units, and at least half of the range is used.
                let reach = (all.max.x - corner) / f32::from_bits((node.grid[3] & 0xff) << 23).max(f32::MIN_POSITIVE);
                let counts = (127.0..=255.0).contains(&reach) || extent < 1e-36 || extent < corner.abs() * 1e-4;
                assert!(counts, "{reach} units in {what}");
            }
        }
    }
    // Control: a lower bound one unit higher excludes part of the given box.
    let (given, all) = (along_x(0.3, 0.6), along_x(0.0, 1.0));
    let node = BvhNode::new(&[given, all], &[1, 1], 0, 0);
    let higher = BvhNode { low: [node.low[0] + 1, node.low[1], node.low[2], node.low[3]], ..node };
    assert!(looseness(&node, given).is_some() && looseness(&higher, given).is_none());
}

/// Control: a shrunken box and a duplicate primitive are found.
#[test]
fn a_shrunken_box_is_found() {
    let mut bvh = Bvh::build(&random_scene(3000, 200, 0.1, 1));
    let whole = bvh.clone();
    // Collapses the box of the first child to its lower corner on all axes.
    for axis in 0..3 {
        bvh.nodes[0].high[axis] = (bvh.nodes[0].high[axis] & !0xff) | (bvh.nodes[0].low[axis] & 0xff);
    }
    assert!(fault(&bvh).is_some());
    assert!(mismatches(&bvh, 2000) > 0);
    let mut twice = whole;
    twice.primitives[0] = twice.primitives[1];
    assert!(fault(&twice).is_some());
}

/// Triangles that grow by a factor from one corner: the area heuristic splits off one at each
/// level.
#[test]
fn deferred_children_fit_on_the_stack() {
    let mut scene = Scene::default();
    for i in 0..4000 {
        let s = 1.02_f32.powi(i - 2000);
        scene.triangles.push(triangle([Vec3::ZERO, Vec3::new(s, 0.0, s), Vec3::new(0.0, s, s)]));
    }
    let boxes: Vec<Bounds> = Bvh::build(&scene).primitives.iter().map(bounds).collect();
    let deep = build_binary(&boxes, boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union), MAX_LEAF);
    assert!(
        super::convert::height(&deep) > super::convert::MAX_HEIGHT as usize,
        "the scene must need the limit: {}",
        super::convert::height(&deep)
    );
    let bvh = Bvh::build(&scene);
    assert_eq!(fault(&bvh), None);
    assert_eq!(mismatches(&bvh, 300), 0);
}

#[test]
fn same_tree_on_any_number_of_threads() {
    // Duplicate triangles give the sorts equal keys.
    let mut scene = random_scene(30_000, 0, 0.01, 3);
    scene.triangles.extend_from_within(..);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| Bvh::build(&scene))
    };
    let (one, four) = (on(1), on(4));
    assert_eq!(one.nodes, four.nodes);
    assert_eq!(one.primitives, four.primitives);
    assert!(scene.triangles.len() < LARGE);
    // Control: another scene gives another tree.
    scene.triangles[0].positions[0].x += 1.0;
    assert_ne!(one.nodes, Bvh::build(&scene).nodes);
}

/// A wavy ground of `side` x `side` quads, and walls around it.
fn ground(side: i32) -> Scene {
    let mut scene = Scene::default();
    let at = |i: i32, j: i32| {
        let [x, z] = [i, j].map(|k| 2.0 * k as f32 / side as f32 - 1.0);
        Vec3::new(x, 0.15 * (7.0 * x).sin() * (5.0 * z).cos() + 0.02 * (61.0 * x * z).sin(), z)
    };
    let mut quad = |corners: [Vec3; 4]| {
        let [a, b, c, d] = corners;
        scene.triangles.extend([triangle([a, b, c]), triangle([a, c, d])]);
    };
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        quad([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
    }
    let c = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    quad([c(-1., 2., -1.), c(1., 2., -1.), c(1., 2., 1.), c(-1., 2., 1.)]);
    quad([c(-1., -1., -1.), c(1., -1., -1.), c(1., 2., -1.), c(-1., 2., -1.)]);
    quad([c(-1., -1., 1.), c(-1., 2., 1.), c(1., 2., 1.), c(1., -1., 1.)]);
    quad([c(-1., -1., -1.), c(-1., 2., -1.), c(-1., 2., 1.), c(-1., -1., 1.)]);
    scene
}

/// Expected cost of a ray (MacDonald and Booth 1990), in primitive tests, of which a node costs
/// one and a half.
fn cost(nodes: &[BvhNode]) -> f64 {
    let root = nodes[0].children().fold(Bounds::EMPTY, |all, child| all.union(child.bounds));
    let each = |child: &BvhChild| if child.count > 0 { f64::from(child.count) } else { 1.5 };
    let of = |child: BvhChild| f64::from(child.bounds.half_area()) * each(&child);
    nodes.iter().flat_map(BvhNode::children).map(of).sum::<f64>() / f64::from(root.half_area())
}

#[test]
fn trees_in_parts_are_whole_and_as_good() {
    let mut scenes = [ground(240), random_scene(110_000, 20_000, 0.01, 9)];
    // Equal triangles, and one that is larger than all others.
    scenes[1].triangles.extend_from_within(..2000);
    scenes[1].triangles.push(triangle([Vec3::splat(-1.0), Vec3::ONE, Vec3::new(1.0, -1.0, 0.5)]));
    for scene in scenes {
        let bvh = Bvh::build(&scene);
        assert!(bvh.primitives.len() >= LARGE);
        assert_eq!(fault(&bvh), None);
        assert_eq!(mismatches(&bvh, 100), 0);
        let boxes: Vec<Bounds> =
            (scene.triangles.iter().map(Bounds::from)).chain(scene.spheres.iter().map(Bounds::from)).collect();
        let ratio = cost(&bvh.nodes) / cost(&widen(&part(&boxes, MAX_HEIGHT, Curve::Whole), MAX_HEIGHT).0);
        println!("{ratio:.4} of the cost of a tree without parts");
        assert!(ratio < 1.03, "{ratio} of the cost of a tree without parts");
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let other = pool.install(|| Bvh::build(&scene));
            assert!(other.nodes == bvh.nodes && other.primitives == bvh.primitives, "{threads} threads");
        }
    }
}

/// Keeps the reports, and stops the work after so many.
struct StopsAfter(usize, Mutex<Vec<(u64, u64)>>);

impl Progress for StopsAfter {
    fn report(&self, stage: Stage, done: u64, total: u64) {
        assert_eq!(stage, Stage::Bvh);
        self.1.lock().expect("no panic").push((done, total));
    }

    fn stop_requested(&self) -> bool {
        self.1.lock().expect("no panic").len() >= self.0
    }
}

#[test]
fn a_large_tree_tells_its_progress_and_can_be_stopped() {
    let scene = random_scene(LARGE + 5, 0, 0.01, 11);
    let primitives = LARGE as u64 + 5;
    let patient = StopsAfter(usize::MAX, Mutex::default());
    Bvh::build_watched(&scene, &patient).expect("nothing stops this");
    let mut told = patient.1.into_inner().expect("no panic");
    told.sort_unstable();
    assert!(told.len() > 16 && told.iter().all(|(_, total)| *total == primitives), "{told:?}");
    assert_eq!(told.last(), Some(&(primitives, primitives)));
    // On many threads all parts may have begun before two are done.
    let impatient = StopsAfter(2, Mutex::default());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
    assert!(matches!(pool.install(|| Bvh::build_watched(&scene, &impatient)), Err(Error::Stopped)));
    let stopped = impatient.1.into_inner().expect("no panic").len();
    assert!(stopped < told.len(), "{stopped} of {} parts", told.len());
}

#[test]
fn flat_and_smooth_triangles_are_distinguished() {
    let mut scene = random_scene(1, 1, 1.0, 5);
    assert_eq!(Bvh::build(&scene).normals.iter().map(|n| n.attributes & 1).sum::<u32>(), 1);
    scene.triangles[0].normals[1] = (scene.triangles[0].normals[1] + Vec3::splat(0.01)).normalize();
    assert_eq!(Bvh::build(&scene).normals.iter().map(|n| n.attributes & 1).sum::<u32>(), 0);
}
