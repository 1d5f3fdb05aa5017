//! Lamps that lie in each other.

use std::collections::{HashMap, HashSet};

use glam::{DVec2, DVec3, Vec3, dvec2};

use super::fault::Notes;
use crate::scene::{Alpha, Bounds, CompleteTree, Material, Scene, Triangle, vertex_bits};

/// Distance between the corners of two lamps that are one, over the largest coordinate: twice the
/// offset at which rays leave a surface, which would bring the light of the rear one past the
/// other.
const TOLERANCE: f32 = 2.0 * crate::layout::OFFSET_SCALE;
/// Cosine between the normals of two lamps in one plane, and the part of a lamp's area that is left
/// of one that others cover.
const PARALLEL: f64 = 1.0 - 1e-6;
const UNCOVERED: f64 = 1e-3;
/// Ratio of the areas of two objects up to which they are equal: of unequal ones in one place, rays
/// meet the smaller one.
const EQUAL_AREAS: f64 = 1.001;
/// Pieces of a lamp that are looked at, at most.
const MOST_PIECES: usize = 64;
/// Others that a lamp is compared with at most.
const MOST_COMPARED: usize = 1 << 10;

/// Leaves out emissive triangles that lie where another one does, up to rounding, and shine the
/// same way: a ray meets one of them, and photons and direct light must not come from both.
pub(super) fn remove_triangles(scene: &mut Scene, notes: &mut Notes) {
    let materials = &scene.materials;
    let shines = |material: u32| materials[material as usize].emission != Vec3::ZERO;
    let mut known = HashSet::new();
    let mut is_first = |triangle: &Triangle| {
        let corners = triangle.positions.map(vertex_bits);
        // The smallest corner first: the order of the others decides which way the triangle faces.
        let start = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
        known.insert([0, 1, 2].map(|i| corners[(start + i) % 3]))
    };
    let mut kept: Vec<bool> = scene.triangles.iter().map(|t| !shines(t.material)).collect();
    let all: Vec<usize> = (0..kept.len()).filter(|i| !kept[*i]).collect();
    let lamps: Vec<usize> = all.iter().copied().filter(|i| is_first(&scene.triangles[*i])).collect();
    for (lamp, is_kept) in lamps.iter().zip(apart(&scene.triangles, &lamps, materials)) {
        kept[*lamp] = is_kept;
    }
    let twice = kept.iter().filter(|kept| !**kept).count();
    if twice > 0 {
        notes.add(said(twice, "triangles"));
        let mut flags = kept.iter();
        scene.triangles.retain(|_| flags.next() == Some(&true));
        let mut flags = kept.iter();
        scene.shells.retain(|_| flags.next() == Some(&true));
    }
}

/// The same for emissive spheres. Solids refer to spheres by index, and are found afterwards.
pub(super) fn remove_spheres(scene: &mut Scene, notes: &mut Notes) {
    let (materials, mut known) = (&scene.materials, HashSet::new());
    let count = scene.spheres.len();
    scene.spheres.retain(|sphere| {
        let key = (vertex_bits(sphere.center), sphere.radius.to_bits());
        materials[sphere.material as usize].emission == Vec3::ZERO || known.insert(key)
    });
    if scene.spheres.len() < count {
        notes.add(said(count - scene.spheres.len(), "spheres"));
    }
}

fn said(doubled: usize, what: &str) -> String {
    format!("{doubled} emissive {what} lie in others; the first ones shine")
}

/// Which lamps, by their indices, lie in none before them, nor in several together.
fn apart(triangles: &[Triangle], lamps: &[usize], materials: &[Material]) -> Vec<bool> {
    let boxes: Vec<Bounds> = lamps.iter().map(|i| Bounds::from(&triangles[*i])).collect();
    let tree = CompleteTree::of_boxes(&boxes);
    let object = |i: &usize| (triangles[*i].object, triangles[*i].material);
    let mut areas: HashMap<(u32, u32), f64> = HashMap::new();
    lamps.iter().for_each(|i| *areas.entry(object(i)).or_default() += triangles[*i].area());
    let mut kept = vec![true; lamps.len()];
    for (number, bounds) in boxes.iter().enumerate() {
        let slack = TOLERANCE * bounds.min.abs().max(bounds.max.abs()).max_element();
        let widened = Bounds { min: bounds.min - slack, max: bounds.max + slack };
        let (mut compared, mut is_apart) = (0, true);
        let mut rest = Rest::of(&triangles[lamps[number]]);
        tree.near(&widened, |other| {
            if other < number && kept[other] && boxes[other].touches(&widened) {
                let pair = [number, other].map(|i| &triangles[lamps[i]]);
                let both_sides = pair.map(|t| materials[t.material as usize].double_sided) == [true; 2];
                let covers = materials[pair[1].material as usize].alpha == Alpha::Opaque
                    && areas[&object(&lamps[other])] <= EQUAL_AREAS * areas[&object(&lamps[number])];
                if covers {
                    rest.cut(pair[1], slack, both_sides);
                }
                is_apart = !is_same(pair, slack, both_sides) && !rest.is_covered();
                compared += 1;
            }
            is_apart && compared < MOST_COMPARED
        });
        kept[number] = is_apart;
    }
    kept
}

/// Whether two triangles have the same corners in the same order round, or in any.
fn is_same([a, b]: [&Triangle; 2], slack: f32, any_order: bool) -> bool {
    let [p, q, r] = b.positions;
    let orders = [[p, q, r], [q, r, p], [r, p, q], [p, r, q], [r, q, p], [q, p, r]];
    let near = |order: &[Vec3; 3]| a.positions.iter().zip(order).all(|(x, y)| x.distance(*y) <= slack);
    orders[..if any_order { 6 } else { 3 }].iter().any(near)
}

/// What other triangles of its plane leave of a triangle.
struct Rest {
    origin: DVec3,
    normal: DVec3,
    axes: [DVec3; 2],
    area: f64,
    /// Convex, in the coordinates of the plane.
    pieces: Vec<Vec<DVec2>>,
}

impl Rest {
    fn of(triangle: &Triangle) -> Self {
        let [a, b, c] = triangle.positions.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let along = (b - a).normalize_or_zero();
        let mut rest =
            Self { origin: a, normal, axes: [along, normal.cross(along)], area: triangle.area(), pieces: Vec::new() };
        rest.pieces.push([a, b, c].map(|corner| rest.in_plane(corner)).to_vec());
        rest
    }

    fn in_plane(&self, point: DVec3) -> DVec2 {
        let [x, y] = self.axes.map(|axis| axis.dot(point - self.origin));
        dvec2(x, y)
    }

    fn is_covered(&self) -> bool {
        self.area > 0.0 && self.pieces.iter().map(|piece| area_of(piece)).sum::<f64>() <= UNCOVERED * self.area
    }

    /// Takes away what lies in another triangle, if that is in the plane and shines the same way.
    fn cut(&mut self, other: &Triangle, slack: f32, both_sides: bool) {
        let [a, b, c] = other.positions.map(Vec3::as_dvec3);
        let cosine = (b - a).cross(c - a).normalize_or_zero().dot(self.normal);
        let is_flat = [a, b, c].iter().all(|p| self.normal.dot(*p - self.origin).abs() <= f64::from(slack));
        if !is_flat || (if both_sides { cosine.abs() } else { cosine }) < PARALLEL || self.pieces.len() > MOST_PIECES {
            return;
        }
        let corners = if cosine > 0.0 { [a, b, c] } else { [a, c, b] }.map(|corner| self.in_plane(corner));
        let mut left = Vec::new();
        for mut piece in std::mem::take(&mut self.pieces) {
            for (p, q) in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (corners[i], corners[j])) {
                left.push(clipped(&piece, q, p));
                piece = clipped(&piece, p, q);
            }
        }
        left.retain(|piece| area_of(piece) > 0.0);
        self.pieces = left;
    }
}

/// The part of a convex polygon to the left of a line (Sutherland and Hodgman 1974).
fn clipped(polygon: &[DVec2], from: DVec2, to: DVec2) -> Vec<DVec2> {
    let height = |p: DVec2| (to - from).perp_dot(p - from);
    let mut kept = Vec::new();
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (a, b) = (height(*p), height(q));
        if a >= 0.0 {
            kept.push(*p);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            kept.push(p.lerp(q, a / (a - b)));
        }
    }
    kept
}

fn area_of(polygon: &[DVec2]) -> f64 {
    (2..polygon.len()).map(|i| 0.5 * (polygon[i - 1] - polygon[0]).perp_dot(polygon[i] - polygon[0])).sum()
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    #[test]
    fn lamps_that_others_cover_are_left_out() {
        let at = |x: f32, y: f32| vec3(x, 0.0, y);
        let quad = |corners: [Vec3; 4], object: u32| {
            [[0, 1, 2], [0, 2, 3]]
                .map(|of| Triangle { object, ..Triangle::new(of.map(|i| corners[i]), [Vec3::Y; 3], 0) })
        };
        let square = |x: f32, side: f32| [at(x, 0.0), at(x, side), at(x + side, side), at(x + side, 0.0)];
        let turned = |[a, b, c, d]: [Vec3; 4]| [b, c, d, a];
        let backwards = |[a, b, c, d]: [Vec3; 4]| [d, c, b, a];
        let mut material = Material::new("", crate::scene::Surface::Diffuse { albedo: Vec3::ONE });
        material.emission = Vec3::ONE;
        let kept = |second: [Vec3; 4], double_sided: bool| {
            let mut scene = Scene {
                materials: vec![Material { double_sided, ..material.clone() }],
                triangles: [quad(square(0.0, 1.0), 0), quad(second, 1)].concat(),
                ..Scene::default()
            };
            remove_triangles(&mut scene, &mut Notes::default());
            scene.triangles.len()
        };
        let first = square(0.0, 1.0);
        assert_eq!(kept(turned(first), false), 2, "cut along the other diagonal");
        assert_eq!(kept(turned(backwards(first)), true), 2, "and shining both ways");
        assert_eq!(kept(turned(backwards(first)), false), 4, "control: shining the other way");
        assert_eq!(kept(square(0.1, 1.0), false), 4, "control: not all is covered");
        assert_eq!(kept(square(0.2, 0.5), false), 4, "control: a smaller lamp, which is seen there");
    }
}
