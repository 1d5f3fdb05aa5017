//! Targets that photon paths are aimed at: spheres around clusters of mirrors and glass. No path
//! that could become a caustic is left out, and few others are traced. This is the projection map
//! of Jensen 2001, section 5.3, as bounding spheres.

use std::{
    collections::{BTreeMap, HashMap},
    f64::consts::TAU,
};

use glam::Vec3;

use crate::{
    layout::{self, MAX_TARGETS},
    scene::{Bounds, Scene, SharedMesh, instance_bounds},
};

/// A bounding sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    pub center: Vec3,
    /// Metres.
    pub radius: f32,
}

impl Target {
    /// Solid angle that the sphere subtends at `from`, sr; `None` inside of it.
    #[must_use]
    pub fn solid_angle(&self, from: Vec3) -> Option<f64> {
        let sin2 = f64::from(self.radius).powi(2) / self.center.as_dvec3().distance_squared(from.as_dvec3());
        (sin2 < 1.0).then(|| TAU * sin2 / (1.0 + (1.0 - sin2).sqrt()))
    }

    fn cross_section(&self) -> f64 {
        f64::from(self.radius).powi(2)
    }
}

/// Geometry of one specular primitive, for its bounds.
#[derive(Clone, Copy)]
pub(super) enum Item {
    Triangle([Vec3; 3]),
    Sphere(Vec3, f32),
}

impl Item {
    pub fn bounds(&self) -> Bounds {
        match *self {
            Item::Triangle([a, b, c]) => Bounds { min: a.min(b).min(c), max: a.max(b).max(c) },
            Item::Sphere(center, radius) => Bounds { min: center - radius, max: center + radius },
        }
    }

    fn middle(&self) -> Vec3 {
        let Bounds { min, max } = self.bounds();
        0.5 * (min + max)
    }

    /// Distance from `from` to the farthest point of the primitive.
    pub fn reach(&self, from: Vec3) -> f32 {
        match *self {
            Item::Triangle(corners) => corners.into_iter().map(|p| p.distance(from)).fold(0.0, f32::max),
            Item::Sphere(center, radius) => center.distance(from) + radius,
        }
    }
}

/// Greatest sum of the cross-sections of two clusters of different parts, over that of both
/// together, at which they stay apart: a small one beside a large one.
const APART: f64 = 1.1;

/// A cluster of primitives, by the connected parts that they make. `halves`: indices of its two
/// halves, if it was split.
struct Cluster {
    target: Target,
    parts: Vec<Vec<Item>>,
    halves: Option<[usize; 2]>,
    /// Greatest sum of the cross-sections of the halves at which they are kept, over its own.
    slack: f64,
}

impl Cluster {
    fn new(parts: Vec<Vec<Item>>) -> Self {
        let slack = if parts.len() > 1 { APART } else { 1.0 };
        Self { target: sphere_around(parts.iter().flatten()), parts, halves: None, slack }
    }

    fn can_be_split(&self) -> bool {
        self.parts.len() > 1 || self.parts.first().is_some_and(|items| items.len() > 1)
    }

    /// Its parts, or the primitives of its only one, on either side of the middle of the longest
    /// extent of their centres; `None` if one side is empty, as when all centres coincide.
    fn split(&mut self) -> Option<[Self; 2]> {
        let mut parts = std::mem::take(&mut self.parts);
        if parts.len() > 1 {
            match split(parts, |part| sphere_around(part).center) {
                Ok(halves) => return Some(halves.map(Self::new)),
                Err(all) => parts = all,
            }
        }
        let halves = split(parts.into_iter().flatten().collect(), Item::middle).ok()?;
        Some(halves.map(|half| Self::new(vec![half])))
    }
}

/// Sphere around all geometry.
#[must_use]
pub fn scene_target(scene: &Scene) -> Target {
    let (center, radius) = scene.bounding_sphere();
    Target { center, radius }
}

/// Spheres that together contain all specular surfaces, at most [`MAX_TARGETS`]; none if there are
/// no such surfaces.
#[must_use]
pub fn specular_targets(scene: &Scene) -> Vec<Target> {
    let casts = scene.caustic_materials();
    spheres_around(parts(scene, |material| casts[material as usize]), MAX_TARGETS)
}

/// Spheres that together contain all parts, at most so many. The largest cluster is split along its
/// longest axis until there are as many, those of several connected parts first. Then halves are
/// kept only where the sum of their cross-sections is smaller than that of the whole cluster, or
/// hardly greater where no part is in both: so a glass beside a large window has a sphere of its
/// own.
pub(super) fn spheres_around(parts: Vec<Vec<Item>>, most: u32) -> Vec<Target> {
    if parts.is_empty() {
        return Vec::new();
    }
    let mut tree = vec![Cluster::new(parts)];
    for _ in 1..most {
        let leaves = (0..tree.len()).filter(|&i| tree[i].halves.is_none() && tree[i].can_be_split());
        let several = |i: usize| tree[i].parts.len() > 1;
        let radius = |i: usize| tree[i].target.radius;
        let largest = leaves.max_by(|&a, &b| several(a).cmp(&several(b)).then(radius(a).total_cmp(&radius(b))));
        let Some(largest) = largest else { break };
        let Some(halves) = tree[largest].split() else { continue };
        tree[largest].halves = Some([tree.len(), tree.len() + 1]);
        tree.extend(halves);
    }
    best_cut(&tree, 0).1
}

/// Sum of the cross-sections of the best spheres for a cluster, over π, and the spheres.
fn best_cut(tree: &[Cluster], cluster: usize) -> (f64, Vec<Target>) {
    let whole = tree[cluster].target;
    let kept = (whole.cross_section(), vec![whole]);
    let Some([left, right]) = tree[cluster].halves else { return kept };
    let ((left, mut targets), (right, others)) = (best_cut(tree, left), best_cut(tree, right));
    if left + right >= tree[cluster].slack * kept.0 {
        return kept;
    }
    targets.extend(others);
    (left + right, targets)
}

/// Those on either side of the middle of the longest extent of their centres; all of them if one
/// side is empty.
fn split<T>(all: Vec<T>, middle: impl Fn(&T) -> Vec3) -> std::result::Result<[Vec<T>; 2], Vec<T>> {
    let box_ = Bounds::around(all.iter().map(&middle));
    let axis = (box_.max - box_.min).max_position();
    let plane = 0.5 * (box_.min[axis] + box_.max[axis]);
    let (left, right): (Vec<_>, Vec<_>) = all.into_iter().partition(|one| middle(one)[axis] < plane);
    match (left.is_empty(), right.is_empty()) {
        (false, false) => Ok([left, right]),
        (true, _) => Err(right),
        _ => Err(left),
    }
}

pub(super) fn sphere_around<'a>(items: impl IntoIterator<Item = &'a Item> + Clone) -> Target {
    let Bounds { min, max } = items.clone().into_iter().map(Item::bounds).fold(Bounds::EMPTY, Bounds::union);
    let center = 0.5 * (min + max);
    // Slightly enlarged, so that rounding leaves nothing outside.
    let radius = items.into_iter().map(|item| item.reach(center)).fold(0.0, f32::max);
    Target { center, radius: radius * 1.00001 }
}

/// The wanted primitives, by connected parts.
pub(super) fn parts(scene: &Scene, wanted: impl Fn(u32) -> bool) -> Vec<Vec<Item>> {
    let triangles = scene.triangles.iter().filter(|t| wanted(t.material));
    let spheres = scene.spheres.iter().filter(|s| wanted(s.material));
    let has = |mesh: &SharedMesh| mesh.triangles.iter().any(|t| wanted(t.material));
    let meshes: Vec<bool> = scene.meshes.iter().map(has).collect();
    // A sphere around each instance: listing all their triangles would take the memory that they
    // spare.
    let around = |bounds: Bounds| Item::Sphere(0.5 * (bounds.min + bounds.max), 0.5 * bounds.diagonal());
    let boxes = scene.instances.iter().zip(instance_bounds(&scene.meshes, &scene.instances));
    let instances = boxes.filter(|(instance, _)| meshes[instance.mesh as usize]);
    let single = spheres.map(|s| Item::Sphere(s.center, s.radius)).chain(instances.map(|(_, bounds)| around(bounds)));
    let triangles: Vec<[Vec3; 3]> = triangles.map(|t| t.positions).collect();
    connected(&triangles).into_iter().chain(single.map(|item| vec![item])).collect()
}

/// Triangles that hang together by corners in one place.
pub(super) fn connected(triangles: &[[Vec3; 3]]) -> Vec<Vec<Item>> {
    let mut corners = HashMap::<[u32; 3], usize>::new();
    // Each leads to an earlier triangle of its part, or to itself.
    let mut leads: Vec<usize> = (0..triangles.len()).collect();
    let first_of = |leads: &mut Vec<usize>, mut triangle: usize| {
        while leads[triangle] != triangle {
            leads[triangle] = leads[leads[triangle]];
            triangle = leads[triangle];
        }
        triangle
    };
    for (i, positions) in triangles.iter().enumerate() {
        for corner in positions {
            // Sums with 0 make both zeros one.
            let key = (*corner + Vec3::ZERO).to_array().map(f32::to_bits);
            let other = *corners.entry(key).or_insert(i);
            let (a, b) = (first_of(&mut leads, i), first_of(&mut leads, other));
            leads[a.max(b)] = a.min(b);
        }
    }
    let mut parts = BTreeMap::<usize, Vec<Item>>::new();
    for (i, positions) in triangles.iter().enumerate() {
        parts.entry(first_of(&mut leads, i)).or_default().push(Item::Triangle(*positions));
    }
    parts.into_values().collect()
}

/// Approximate fraction of a light's power that goes towards the targets; above 0 if any light can
/// reach them.
pub(super) fn aimed_fraction(light: &layout::Light, targets: &[Target], around: &Target) -> f64 {
    let cross_sections = targets.iter().map(|t| (t.radius / around.radius).powi(2));
    if matches!(light.kind, layout::DIRECTIONAL_LIGHT | layout::ENVIRONMENT_LIGHT) {
        return f64::from(cross_sections.sum::<f32>()).min(1.0);
    }
    let [position, e1, e2] = [light.position, light.e1, light.e2].map(Vec3::from_array);
    let (from, own) = match light.kind {
        layout::TRIANGLE_LIGHT => (position + (e1 + e2) / 3.0, f64::from(light.solid_angle)),
        layout::SPHERE_LIGHT => (position, 2.0 * TAU),
        _ => (position, f64::from(light.solid_angle)),
    };
    let seen = targets.iter().filter(|target| can_reach(light, target, from));
    seen.map(|target| target.solid_angle(from).map_or(1.0, |angle| (angle / own).min(1.0))).sum::<f64>().min(1.0)
}

/// Light emitted at `from` can reach the target.
fn can_reach(light: &layout::Light, target: &Target, from: Vec3) -> bool {
    let [axis, e2] = [light.e1, light.e2].map(Vec3::from_array);
    let to = target.center - from;
    let sine = f64::from(target.radius) / f64::from(to.length());
    match light.kind {
        layout::SPOT_LIGHT if sine < 1.0 => {
            let outer = (1.0 - f64::from(e2.x)).clamp(-1.0, 1.0).acos();
            f64::from(axis.dot(to.normalize())).clamp(-1.0, 1.0).acos() <= outer + sine.asin() + 1e-3
        }
        layout::TRIANGLE_LIGHT if f64::from(light.solid_angle) < 0.75 * TAU => {
            axis.cross(e2).normalize().dot(to) > -target.radius * 1.001
        }
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;
    use crate::scene::{Material, Sphere, Surface, Triangle};

    fn scene(centers: &[Vec3], radius: f32) -> Scene {
        let surface = Surface::Mirror { tint: Vec3::ONE };
        let material = Material::new("", surface);
        let spheres = centers.iter().map(|&center| Sphere { center, radius, material: 0, object: 0 }).collect();
        Scene { materials: vec![material], spheres, ..Scene::default() }
    }

    #[test]
    fn what_lies_apart_has_spheres_of_its_own() {
        let corners = [vec3(0.0, 0.0, 0.0), vec3(9.0, 0.0, 0.0), vec3(0.0, 0.0, 9.0), vec3(9.0, 0.0, 9.0)];
        let apart = specular_targets(&scene(&corners, 1.0));
        assert_eq!(apart.len(), 4);
        assert!(apart.iter().all(|t| (1.0..1.001).contains(&t.radius) && corners.contains(&t.center)), "{apart:?}");
        // Halves of a close pair would have larger cross-sections together.
        let close = specular_targets(&scene(&[Vec3::ZERO, vec3(0.1, 0.0, 0.0)], 1.0));
        assert_eq!(close.len(), 1);
        assert!(specular_targets(&Scene::default()).is_empty());
    }

    #[test]
    fn small_parts_beside_large_ones_have_spheres_of_their_own() {
        let mut scene = scene(&[vec3(0.0, 0.0, 0.0), vec3(0.7, 0.6, 0.0)], 1.0);
        scene.spheres[1].radius = 0.05;
        let sizes = |scene: &Scene| specular_targets(scene).iter().map(|t| t.radius).collect::<Vec<_>>();
        let found = sizes(&scene);
        assert!(found.len() == 2 && found.iter().any(|radius| (0.05..0.051).contains(radius)), "{found:?}");
        // Parts about one centre are one cluster.
        scene.spheres[1].center = Vec3::ZERO;
        assert_eq!(sizes(&scene).len(), 1);
        // A small square in the middle of a large one, of one mesh, and hanging on to it.
        let square = |corner: Vec3, side: f32| {
            let [a, b, c, d] =
                [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)].map(|(x, y)| corner + vec3(x, y, 0.0));
            [[a, b, c], [a, c, d]].map(|corners| Triangle::new(corners, [Vec3::Z; 3], 0))
        };
        scene.spheres.clear();
        scene.triangles = [square(Vec3::ZERO, 2.0), square(Vec3::splat(0.8), 0.1)].concat();
        assert_eq!(sizes(&scene).len(), 2);
        scene.triangles[2].positions[1] = Vec3::ZERO;
        assert_eq!(sizes(&scene).len(), 1);
    }

    #[test]
    fn there_are_never_too_many() {
        let line: Vec<Vec3> = (0..200).map(|i| vec3(10.0 * i as f32, 0.0, 0.0)).collect();
        let scene = scene(&line, 1.0);
        let targets = specular_targets(&scene);
        assert_eq!(targets.len(), MAX_TARGETS as usize);
        let held = |s: &Sphere| targets.iter().any(|t| t.center.distance(s.center) + s.radius <= t.radius);
        assert!(scene.spheres.iter().all(held));
    }

    #[test]
    fn solid_angles_are_those_of_spheres() {
        let target = Target { center: vec3(0.0, 0.0, 5.0), radius: 3.0 };
        let right = std::f64::consts::TAU * (1.0 - 0.8);
        assert!((target.solid_angle(Vec3::ZERO).expect("from outside") - right).abs() < 1e-12);
        assert_eq!(target.solid_angle(vec3(0.0, 2.5, 5.0)), None);
    }
}
