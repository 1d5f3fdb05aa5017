//! Plates: solids between two parallel planes close together, as panes of windows are modelled.
//!
//! Light that goes in through one face and out through the other leaves in the direction from which
//! it came, a fraction of the thickness aside.

use std::collections::HashMap;

use glam::DVec3;

use super::solid::{COVER_BIT, NONE, SPHERE_BIT};
use crate::scene::{Bounds, CompleteTree, Material, Triangle, Visit};

/// Area of the rim of a plate over that of its faces, at most: a square is no thicker than a
/// twentieth of its side.
const RIM: f64 = 0.1;
/// Sine of the largest angle between normals of one plane, and of the vertices on it.
const PLANE: f64 = 1e-3;
/// Distance from a plane up to which vertices lie on it: over the size of the plate, and the
/// rounding of its largest coordinate.
const FLAT: f64 = 1e-5;
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;
/// Difference of the areas of the faces, at most.
const UNLIKE: f64 = 0.1;
/// Fraction of a plate above which what stands on it covers it: hardly any light passes both faces.
const COVERED: f64 = 0.5;

/// Which triangles are faces of clear plates, and whether all solids of triangles are plates.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Plates {
    /// For each triangle of the scene; empty if there is no plate.
    pub is_face: Vec<bool>,
    pub are_all: bool,
}

/// A solid that may be a plate.
struct Candidate {
    solid: u32,
    faces: Vec<u32>,
    /// The normal of its faces, and directions along them, one of them that of an edge.
    axes: [DVec3; 3],
    /// Where it begins and ends along each.
    ranges: [(f64, f64); 3],
}

/// The plates among the solids, of which `solid_of` says that of each triangle.
pub(super) fn plates(triangles: &[Triangle], solid_of: &[u32], materials: &[Material]) -> Plates {
    let is_clear: Vec<bool> =
        materials.iter().map(|material| material.is_clear() && !material.is_clear_pane()).collect();
    let mut parts: HashMap<u32, Vec<u32>> = HashMap::new();
    for (solid, i) in solid_of.iter().zip(0..triangles.len() as u32).filter(|(solid, _)| **solid != NONE) {
        parts.entry(*solid).or_default().push(i);
    }
    let mut candidates: Vec<Candidate> = parts
        .iter()
        .filter(|(solid, _)| **solid & (SPHERE_BIT | COVER_BIT) == 0)
        .filter_map(|(solid, part)| candidate(*solid, part, triangles, &is_clear))
        .collect();
    if candidates.is_empty() {
        return Plates::default();
    }
    candidates.sort_by_key(|plate| plate.solid);
    let mut solids: Vec<(u32, Bounds)> = parts.iter().map(|(solid, part)| (*solid, bounds(part, triangles))).collect();
    solids.sort_by_key(|(solid, _)| *solid);
    let tree = CompleteTree::of_boxes(&solids.iter().map(|(_, bounds)| *bounds).collect::<Vec<_>>());
    let normals: HashMap<u32, DVec3> = candidates.iter().map(|plate| (plate.solid, plate.axes[0])).collect();
    let mut found = Plates { is_face: vec![false; triangles.len()], are_all: true };
    for plate in &candidates {
        let own = bounds(&parts[&plate.solid], triangles);
        let mut is_alone = true;
        tree.visit(|visit| match visit {
            Visit::Node(_, node) => is_alone && node.touches(&own),
            Visit::Leaf(others) => {
                let others = others.iter().map(|i| solids[*i as usize]);
                is_alone &= others
                    .filter(|(solid, bounds)| *solid != plate.solid && bounds.touches(&own))
                    .all(|(solid, _)| is_clear_of(plate, &parts[&solid], triangles, normals.get(&solid)));
                is_alone
            }
        });
        if is_alone {
            plate.faces.iter().for_each(|i| found.is_face[*i as usize] = true);
        }
        found.are_all &= is_alone;
    }
    found.are_all &= candidates.len() == parts.len();
    if found.is_face.iter().any(|is_face| *is_face) { found } else { Plates::default() }
}

fn bounds(part: &[u32], triangles: &[Triangle]) -> Bounds {
    Bounds::around(part.iter().flat_map(|i| triangles[*i as usize].positions))
}

/// The plate that a solid is if nothing is in its way.
fn candidate(solid: u32, part: &[u32], triangles: &[Triangle], is_clear: &[bool]) -> Option<Candidate> {
    let of = |i: &u32| &triangles[*i as usize];
    let material = of(&part[0]).material;
    if !is_clear[material as usize] || part.iter().any(|i| of(i).material != material) {
        return None;
    }
    let largest = part.iter().max_by(|a, b| of(a).area().total_cmp(&of(b).area()))?;
    let normal = of(largest).geometric_normal().as_dvec3();
    let [p, q, r] = of(largest).positions.map(|p| p.as_dvec3());
    let edge = [q - p, r - q, p - r].into_iter().min_by(|a, b| a.length().total_cmp(&b.length()))?.normalize_or_zero();
    let axes = [normal, edge, normal.cross(edge)];
    let ranges = axes.map(|axis| range(part, triangles, axis));
    let (low, high) = ranges[0];
    let along = |i: &u32| of(i).positions.map(|p| normal.dot(p.as_dvec3()));
    let size = bounds(part, triangles);
    let farthest = size.min.abs().max(size.max.abs()).max_element();
    let slack = FLAT * f64::from((size.max - size.min).max_element()) + ROUNDING * f64::from(farthest);
    let is_face = |i: &u32, side: f64, plane: f64| {
        let flat = of(i).geometric_normal();
        let lean = flat.as_dvec3().cross(side * normal).length();
        let even = of(i).normals.iter().all(|n| f64::from(n.cross(flat).length()) < PLANE);
        flat.as_dvec3().dot(side * normal) > 0.0
            && (lean < PLANE && even)
            && along(i).iter().all(|at| (at - plane).abs() <= slack)
    };
    let face = |side: f64, plane: f64| part.iter().filter(|i| is_face(i, side, plane)).copied().collect::<Vec<_>>();
    let area = |part: &[u32]| part.iter().map(|i| of(i).area()).sum::<f64>();
    let (upper, lower) = (face(1.0, high), face(-1.0, low));
    let (a, b) = (area(&upper), area(&lower));
    let rim = area(part) - a - b;
    let is_plate = rim <= RIM * (a + b) && (a - b).abs() <= UNLIKE * a.max(b) && high - low > 4.0 * slack;
    is_plate.then(|| Candidate { solid, faces: [upper, lower].concat(), axes, ranges })
}

/// Whether another solid, of which the normal is that of a plate if it has one, leaves the light
/// that goes through a plate alone: it may end at it, stand on it or reach through it, for no ray
/// to a light passes its own surface; but a plate must not lie on it, and nothing cover most of it.
fn is_clear_of(plate: &Candidate, other: &[u32], triangles: &[Triangle], normal: Option<&DVec3>) -> bool {
    let size = |i: usize| plate.ranges[i].1 - plate.ranges[i].0;
    let overlaps: [f64; 3] = std::array::from_fn(|i| {
        let ((low, high), own) = (range(other, triangles, plate.axes[i]), plate.ranges[i]);
        (high - own.0).min(own.1 - low)
    });
    let is_apart = overlaps[0] < -0.01 * size(0) || overlaps[1..].iter().any(|overlap| *overlap <= 2.0 * size(0));
    let lies_along = normal.is_some_and(|normal| normal.cross(plate.axes[0]).length() < 0.1);
    let covered: f64 = [1, 2].map(|i| (overlaps[i] / size(i)).min(1.0)).iter().product();
    is_apart || !lies_along && covered <= COVERED
}

/// Where a solid begins and ends along a direction.
fn range(part: &[u32], triangles: &[Triangle], axis: DVec3) -> (f64, f64) {
    let positions = part.iter().flat_map(|i| triangles[*i as usize].positions);
    let along = positions.map(|p| axis.dot(p.as_dvec3()));
    along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)))
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;
    use crate::scene::Surface;

    /// The triangles of a block, of which vertices may be moved.
    fn block(min: Vec3, max: Vec3, moved: impl Fn(Vec3) -> Vec3) -> Vec<Triangle> {
        let corner = |i: usize| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { max[axis] } else { min[axis] };
            moved(vec3(pick(0), pick(1), pick(2)))
        };
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let flat = |corners: [usize; 3]| {
            let triangle = Triangle::new(corners.map(corner), [Vec3::ZERO; 3], 0);
            Triangle { normals: [triangle.geometric_normal(); 3], ..triangle }
        };
        faces.into_iter().flat_map(|[a, b, c, d]| [flat([a, b, c]), flat([a, c, d])]).collect()
    }

    /// Number of triangles that are faces of plates, of several solids.
    fn faces(solids: &[Vec<Triangle>]) -> usize {
        let solid_of: Vec<u32> = solids.iter().zip(0..).flat_map(|(solid, i)| vec![i; solid.len()]).collect();
        let glass = Material::new("glass", Surface::Glass { ior: 1.5, tint: Vec3::ONE });
        plates(&solids.concat(), &solid_of, &[glass]).is_face.iter().filter(|is_face| **is_face).count()
    }

    #[test]
    fn solids_between_two_planes_are_plates() {
        let turn = glam::Quat::from_rotation_y(0.7) * glam::Quat::from_rotation_x(0.3);
        let window =
            |z: f32, moved: &dyn Fn(Vec3) -> Vec3| block(vec3(-1.0, -0.7, z), vec3(1.0, 0.7, z + 0.006), moved);
        let as_is = |p: Vec3| p;
        assert_eq!(faces(&[window(0.0, &as_is)]), 4);
        let tilted = |p: Vec3| turn * p + vec3(30.0, 2.0, -5.0);
        assert_eq!(faces(&[window(0.0, &tilted)]), 4, "anywhere");
        let away = |p: Vec3| tilted(p) + vec3(700.0, 0.0, 900.0);
        assert_eq!(faces(&[window(0.0, &away)]), 4, "far away");
        assert_eq!(faces(&[window(0.0, &tilted), window(0.02, &tilted)]), 8, "double glazing");
        let cube = block(Vec3::ZERO, Vec3::ONE, as_is);
        assert_eq!(faces(&[cube]), 0, "a cube");
        let wedge = |p: Vec3| p + vec3(0.0, 0.0, if p.z > 0.003 { 0.003 * p.x } else { 0.0 });
        assert_eq!(faces(&[window(0.0, &wedge)]), 0, "a wedge");
        let mut rounded = window(0.0, &as_is);
        rounded.iter_mut().for_each(|t| t.normals = t.positions.map(Vec3::normalize));
        assert_eq!(faces(&[rounded]), 0, "with normals of something round");
    }

    #[test]
    fn others_may_stand_on_a_plate_but_not_cover_it() {
        let as_is = |p: Vec3| p;
        let table = block(vec3(-1.0, 0.0, -1.0), vec3(1.0, 0.02, 1.0), as_is);
        let tumbler = block(vec3(-0.1, 0.02, -0.1), vec3(0.1, 0.2, 0.1), as_is);
        assert_eq!(faces(&[table.clone(), tumbler]), 4);
        let water = block(vec3(-1.0, -0.5, -0.9), vec3(0.8, 0.0, 0.9), as_is);
        assert_eq!(faces(&[table.clone(), water]), 0, "on water");
        let side = block(vec3(1.0, -0.5, -1.0), vec3(1.02, 0.5, 1.0), as_is);
        assert_eq!(faces(&[table.clone(), side]), 8, "a case of plates");
        let second = block(vec3(-1.0, 0.02, -1.0), vec3(1.0, 0.04, 1.0), as_is);
        assert_eq!(faces(&[table.clone(), second]), 0, "on each other");
        let through = block(vec3(-0.1, -0.2, -0.1), vec3(0.1, 0.2, 0.1), as_is);
        assert_eq!(faces(&[table.clone(), through]), 4, "through it");
        let around = block(vec3(-2.0, -2.0, -2.0), vec3(2.0, 2.0, 2.0), as_is);
        assert_eq!(faces(&[table.clone(), around]), 0, "in water");
        let corner = block(vec3(-1.0, -0.5, -1.0), vec3(1.0, 0.5, -0.98), as_is);
        assert_eq!(faces(&[table.clone(), corner]), 8, "overlapping at a corner");
        let next = block(vec3(1.0, 0.0, -1.0), vec3(3.0, 0.02, 1.0), as_is);
        assert_eq!(faces(&[table, next]), 8, "beside each other");
    }
}
