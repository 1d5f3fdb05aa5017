//! Lamps that lie in each other.

use std::collections::HashSet;

use glam::Vec3;

use super::fault::Notes;
use crate::scene::{Bounds, CompleteTree, Material, Scene, Triangle, vertex_bits};

/// Distance between the corners of two lamps that are one, over the largest coordinate: twice the
/// offset at which rays leave a surface, which would bring the light of the rear one past the
/// other.
const TOLERANCE: f32 = 2.0 * crate::layout::OFFSET_SCALE;
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

/// Which lamps, by their indices, lie in none before them.
fn apart(triangles: &[Triangle], lamps: &[usize], materials: &[Material]) -> Vec<bool> {
    let boxes: Vec<Bounds> = lamps.iter().map(|i| Bounds::from(&triangles[*i])).collect();
    let tree = CompleteTree::of_boxes(&boxes);
    let mut kept = vec![true; lamps.len()];
    for (number, bounds) in boxes.iter().enumerate() {
        let slack = TOLERANCE * bounds.min.abs().max(bounds.max.abs()).max_element();
        let widened = Bounds { min: bounds.min - slack, max: bounds.max + slack };
        let (mut compared, mut is_apart) = (0, true);
        tree.near(&widened, |other| {
            if other < number && kept[other] && boxes[other].touches(&widened) {
                let pair = [number, other].map(|i| &triangles[lamps[i]]);
                is_apart =
                    !is_same(pair, slack, pair.map(|t| materials[t.material as usize].double_sided) == [true; 2]);
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
