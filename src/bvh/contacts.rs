//! Contacts: surfaces that lie in each other, of which a ray meets all at once.
//!
//! Candidates are surfaces that bound solids, scatter specularly or emit light, with whatever lies
//! in their plane. The kernels compare distances of these alone with a tolerance, so that nothing
//! else loses precision.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::{Bvh, FILLER, build::bounds};
use crate::{
    layout::{Primitive, SPHERE_BIT},
    scene::{Bounds, Scene, Surface},
};

/// Distance below which two surfaces are one, over their largest coordinate: 2^-21, four steps of
/// 32-bit numbers.
const TOLERANCE: f64 = 1.0 / (1 << 21) as f64;
/// Largest sine of the angle between the planes of two surfaces that are one.
const MAX_SINE: f64 = 1e-3;
/// Part of the size of the smaller triangle by which two must overlap.
const MIN_OVERLAP: f64 = 1e-4;

/// Whether each primitive of the hierarchy is in contact with another one.
#[must_use]
pub fn contacts(scene: &Scene, bvh: &Bvh) -> Vec<bool> {
    let is_candidate: Vec<bool> = scene
        .materials
        .iter()
        .map(|material| !matches!(material.surface, Surface::Diffuse { .. }) || material.emission != Vec3::ZERO)
        .collect();
    let candidate = |p: &Primitive| p.id != FILLER && is_candidate[(p.material & !SPHERE_BIT) as usize];
    let pairs: Vec<(u32, u32)> = (0..bvh.primitives.len() as u32)
        .into_par_iter()
        .filter(|i| candidate(&bvh.primitives[*i as usize]))
        .flat_map_iter(|i| touching(bvh, i).into_iter().map(move |j| (i, j)))
        .collect();
    let mut found = vec![false; bvh.primitives.len()];
    for (i, j) in pairs {
        (found[i as usize], found[j as usize]) = (true, true);
    }
    found
}

/// Primitives that lie in the surface of primitive `i`.
fn touching(bvh: &Bvh, i: u32) -> Vec<u32> {
    let primitive = &bvh.primitives[i as usize];
    let own = bounds(primitive);
    let largest = |bounds: &Bounds| f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
    let (mut found, mut waiting) = (Vec::new(), vec![0]);
    while let Some(node) = waiting.pop() {
        for child in bvh.nodes[node as usize].children() {
            let slack = Vec3::splat((2.0 * TOLERANCE * largest(&own).max(largest(&child.bounds))) as f32);
            if !((own.min - slack).cmple(child.bounds.max).all() && (child.bounds.min - slack).cmple(own.max).all()) {
                continue;
            }
            if child.count == 0 {
                waiting.push(child.first);
            }
            let inside = child.first..child.first + child.count;
            found.extend(inside.filter(|j| *j != i && coincide(primitive, &bvh.primitives[*j as usize])));
        }
    }
    found
}

/// Largest coordinate that a primitive is computed from, metres.
fn reach(primitive: &Primitive) -> f64 {
    let [v0, e1, e2] =
        [primitive.v0, primitive.e1, primitive.e2].map(|v| f64::from(Vec3::from_array(v).abs().max_element()));
    v0.max(e1).max(e2)
}

/// Whether two primitives lie in each other, over more than an edge.
fn coincide(a: &Primitive, b: &Primitive) -> bool {
    if b.id == FILLER || b.id == a.id || (a.material ^ b.material) & SPHERE_BIT != 0 {
        return false;
    }
    let tolerance = reach(a).max(reach(b)) * TOLERANCE;
    let [a0, b0] = [a, b].map(|p| Vec3::from_array(p.v0).as_dvec3());
    if a.material & SPHERE_BIT != 0 {
        let radii = [a, b].map(|p| f64::from(p.e1[0]));
        return a0.distance(b0) <= tolerance && (radii[0] - radii[1]).abs() <= tolerance;
    }
    let [ca, cb] = [a, b].map(corners);
    let [na, nb] = [ca, cb].map(|[p, q, r]| (q - p).cross(r - p).normalize_or_zero());
    if na.cross(nb).length() > MAX_SINE || na == DVec3::ZERO || nb == DVec3::ZERO {
        return false;
    }
    // In the plane of the first, up to the tolerance where they overlap.
    let tangent = na.any_orthonormal_vector();
    let flat = |corner: DVec3| DVec2::new((corner - a0).dot(tangent), (corner - a0).dot(na.cross(tangent)));
    let overlap = clipped(&ca.map(flat), &cb.map(flat));
    let size = area(&ca.map(flat)).abs().min(area(&cb.map(flat)).abs());
    let height = |p: DVec2| {
        let on_a = a0 + p.x * tangent + p.y * na.cross(tangent);
        ((on_a - b0).dot(nb) / na.dot(nb)).abs()
    };
    area(&overlap).abs() > MIN_OVERLAP * size && overlap.iter().all(|p| height(*p) <= tolerance)
}

fn corners(primitive: &Primitive) -> [DVec3; 3] {
    let [v0, e1, e2] = [primitive.v0, primitive.e1, primitive.e2].map(|v| Vec3::from_array(v).as_dvec3());
    [v0, v0 + e1, v0 + e2]
}

/// The part of one triangle that lies in another one, corner by corner (Sutherland and Hodgman
/// 1974).
fn clipped(subject: &[DVec2; 3], clip: &[DVec2; 3]) -> Vec<DVec2> {
    let turn = area(clip).signum();
    let mut polygon = subject.to_vec();
    for edge in 0..3 {
        let (from, to) = (clip[edge], clip[(edge + 1) % 3]);
        let side = |p: DVec2| turn * (to - from).perp_dot(p - from);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, &p) in polygon.iter().enumerate() {
            let q = polygon[(i + 1) % polygon.len()];
            let (here, next) = (side(p), side(q));
            if here >= 0.0 {
                kept.push(p);
            }
            if (here >= 0.0) != (next >= 0.0) {
                kept.push(p.lerp(q, here / (here - next)));
            }
        }
        polygon = kept;
    }
    polygon
}

/// Signed area of a polygon.
fn area(polygon: &[DVec2]) -> f64 {
    let edges = (0..polygon.len()).map(|i| polygon[i].perp_dot(polygon[(i + 1) % polygon.len()]));
    0.5 * edges.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;
    use crate::scene::{Material, Sphere, Triangle};

    /// Contacts of triangles and spheres, in the order of the scene; material 0 is glass, 1
    /// diffuse.
    fn found(triangles: &[([Vec3; 3], u32)], spheres: &[(f32, u32)]) -> Vec<bool> {
        let surfaces = [Surface::Glass { ior: 1.5, tint: Vec3::ONE }, Surface::Diffuse { albedo: Vec3::ONE }];
        let material = |surface| Material::new("", surface);
        let triangle = |(positions, material): &([Vec3; 3], u32)| Triangle::new(*positions, [Vec3::Y; 3], *material);
        let sphere = |(radius, material): &(f32, u32)| Sphere {
            center: Vec3::ONE,
            radius: *radius,
            material: *material,
            object: 0,
        };
        let scene = Scene {
            materials: surfaces.map(material).to_vec(),
            triangles: triangles.iter().map(triangle).collect(),
            spheres: spheres.iter().map(sphere).collect(),
            ..Scene::default()
        };
        let bvh = Bvh::build(&scene);
        let marks = contacts(&scene, &bvh);
        let mut by_id = vec![false; triangles.len() + spheres.len()];
        bvh.primitives.iter().zip(marks).filter(|(p, _)| p.id != FILLER).for_each(|(p, m)| by_id[p.id as usize] = m);
        by_id
    }

    fn flat(x: f32, y: f32, size: f32) -> [Vec3; 3] {
        [vec3(x, y, 0.0), vec3(x, y, size), vec3(x + size, y, 0.0)]
    }

    #[test]
    fn surfaces_in_one_plane_are_found_and_neighbours_are_not() {
        let floor = (flat(-5.0, 0.0, 20.0), 1);
        assert_eq!(found(&[(flat(0.0, 0.0, 1.0), 0), floor], &[]), [true, true]);
        assert_eq!(found(&[(flat(0.0, 1e-6, 1.0), 0), floor], &[]), [true, true], "up to rounding");
        assert_eq!(found(&[(flat(0.0, 1e-3, 1.0), 0), floor], &[]), [false, false], "control: a millimetre above");
        assert_eq!(found(&[(flat(0.0, 0.0, 1.0), 1), floor], &[]), [false, false], "control: both diffuse");
        // Halves of a rectangle share an edge alone.
        let other = [vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 1.0)];
        assert_eq!(found(&[(flat(0.0, 0.0, 1.0), 0), (other, 0)], &[]), [false, false]);
        assert_eq!(found(&[(flat(0.0, 0.0, 1.0), 0), (flat(0.2, 0.0, 0.3), 0)], &[]), [true, true]);
    }

    #[test]
    fn equal_spheres_are_in_contact() {
        assert_eq!(found(&[], &[(1.0, 0), (1.0, 0), (1.1, 0)]), [true, true, false]);
    }
}
