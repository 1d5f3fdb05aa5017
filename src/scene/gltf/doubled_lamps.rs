//! Lamps that lie exactly in each other.

use std::collections::HashSet;

use glam::Vec3;

use super::fault::Notes;
use crate::scene::{Scene, Triangle, vertex_bits};

/// Leaves out emissive triangles that lie exactly where another one does and face the same way: a
/// ray meets one of them, and photons and direct light must not come from both.
pub(super) fn remove(scene: &mut Scene, notes: &mut Notes) {
    let shines: Vec<bool> = scene.materials.iter().map(|material| material.emission != Vec3::ZERO).collect();
    let mut known = HashSet::new();
    let mut is_first = |triangle: &Triangle| {
        let corners = triangle.positions.map(vertex_bits);
        // The smallest corner first: the order of the others decides which way the triangle faces.
        let start = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
        known.insert([0, 1, 2].map(|i| corners[(start + i) % 3]))
    };
    let kept: Vec<bool> =
        scene.triangles.iter().map(|triangle| !shines[triangle.material as usize] || is_first(triangle)).collect();
    let doubled = kept.iter().filter(|kept| !**kept).count();
    if doubled == 0 {
        return;
    }
    notes.add(format!("{doubled} emissive triangles lie exactly in others; the first ones shine"));
    let mut flags = kept.iter();
    scene.triangles.retain(|_| flags.next() == Some(&true));
    let mut flags = kept.iter();
    scene.shells.retain(|_| flags.next() == Some(&true));
}
