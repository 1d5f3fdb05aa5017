//! Lamps whose surface is closed and shines on both sides, as a bulb of an opaque mesh: what shines
//! inwards meets nothing but the inner side of the lamp, and nobody sees it there.

use std::collections::BTreeMap;

use glam::Vec3;

use super::shells::Shells;
use crate::scene::{Alpha, Bounds, Camera, Material, Scene};

/// Triangles of one object that are looked at, at most.
const MAX_TRIANGLES: usize = 1 << 18;

/// For each triangle, and each sphere behind them, whether light from its back stays within a
/// closed opaque surface in which no camera's rays begin; empty where that holds for none.
///
/// A surface is closed where each edge of its triangles is one of another's in the other direction,
/// its faces look outwards, and points below them lie inside. It may have several materials.
pub fn hidden_backs(scene: &Scene) -> Vec<bool> {
    let is_opaque: Vec<bool> = scene.materials.iter().map(is_opaque).collect();
    let is_lamp = |material: u32| {
        let of = &scene.materials[material as usize];
        is_opaque[material as usize] && of.double_sided && of.emission != Vec3::ZERO
    };
    let mut hidden = Vec::new();
    let mut mark = |primitive: usize| {
        hidden.resize(scene.triangles.len() + scene.spheres.len(), false);
        hidden[primitive] = true;
    };
    for (i, sphere) in scene.spheres.iter().enumerate().filter(|(_, sphere)| is_lamp(sphere.material)) {
        if !scene.cameras.iter().any(|camera| begins_in(camera, &Bounds::from(sphere))) {
            mark(scene.triangles.len() + i);
        }
    }
    let found = Shells::new(&scene.triangles, &groups(scene, &is_opaque, is_lamp));
    for (shell, crosses_itself) in found.shells.iter().zip(found.crossing(&scene.triangles)) {
        let is_closed = shell.rim.is_empty() && shell.volume > 0.0;
        let is_seen = |camera: &Camera| begins_in(camera, &shell.bounds);
        if is_closed && !crosses_itself && !scene.cameras.iter().any(is_seen) {
            let lamps = shell.triangles.iter().filter(|i| is_lamp(scene.triangles[**i as usize].material));
            lamps.for_each(|i| mark(*i as usize));
        }
    }
    hidden
}

/// Whether no light passes the surface.
fn is_opaque(material: &Material) -> bool {
    !material.surface.transmits() && material.alpha == Alpha::Opaque && material.diffuse_transmission == 0.0
}

/// The lamps of each object, and the lamps with what is opaque around them.
fn groups(scene: &Scene, is_opaque: &[bool], is_lamp: impl Fn(u32) -> bool) -> Vec<Vec<u32>> {
    let mut lamps: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (triangle, i) in scene.triangles.iter().zip(0..).filter(|(triangle, _)| is_lamp(triangle.material)) {
        lamps.entry(triangle.object).or_default().push(i);
    }
    let mut wholes: BTreeMap<u32, Vec<u32>> = lamps.keys().map(|object| (*object, Vec::new())).collect();
    if !lamps.is_empty() {
        for (triangle, i) in scene.triangles.iter().zip(0..).filter(|(t, _)| is_opaque[t.material as usize]) {
            wholes.entry(triangle.object).and_modify(|whole| whole.push(i));
        }
    }
    wholes.retain(|object, whole| whole.len() > lamps[object].len());
    let all = lamps.into_values().chain(wholes.into_values());
    all.filter(|group| group.len() <= MAX_TRIANGLES).collect()
}

/// Whether rays of the camera may begin in a box, or pass its surfaces before the near plane.
fn begins_in(camera: &Camera, bounds: &Bounds) -> bool {
    let corner =
        |i: u32| Vec3::from_array([0, 1, 2].map(|k| if i >> k & 1 == 1 { bounds.max[k] } else { bounds.min[k] }));
    let depths = (0..8).map(|i| (corner(i) - camera.position).dot(camera.forward));
    let (least, most) = depths.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), depth| (a.min(depth), b.max(depth)));
    let slack = 1e-4 * (least.abs().max(most.abs()) + camera.position.abs().max_element());
    least <= camera.near.max(0.0) + slack && most >= camera.near.min(0.0) - slack
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;
    use crate::scene::{Sphere, Surface, Triangle};

    /// A cube of side 2 about the origin, of which face 0 may have another material; and a camera
    /// at z = 5 that looks at it.
    fn cube(lamp: Material, other: Material, faces: usize) -> Scene {
        let mut scene = Scene { materials: vec![lamp, other], ..Scene::default() };
        for face in 0..faces {
            let (axis, side) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
            let at = |u: f32, v: f32| {
                let mut p = Vec3::ZERO;
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v * side);
                p
            };
            for positions in [[at(-1., -1.), at(1., -1.), at(1., 1.)], [at(-1., -1.), at(1., 1.), at(-1., 1.)]] {
                scene.triangles.push(Triangle::new(positions, [Vec3::X; 3], u32::from(face == 0)));
            }
        }
        scene.cameras.push(looking_from(5.0));
        scene
    }

    fn looking_from(z: f32) -> Camera {
        let (right, up, forward) = (Vec3::X, Vec3::Y, Vec3::NEG_Z);
        let bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
        Camera { position: vec3(0.0, 0.0, z), right, up, forward, ..Camera::framing(bounds) }
    }

    fn lamp() -> Material {
        let surface = Surface::Diffuse { albedo: Vec3::splat(0.5) };
        Material { emission: Vec3::ONE, double_sided: true, ..Material::new("lamp", surface) }
    }

    fn count(scene: &Scene) -> usize {
        hidden_backs(scene).into_iter().filter(|is_hidden| *is_hidden).count()
    }

    #[test]
    fn closed_opaque_lamps_have_hidden_backs() {
        assert_eq!(count(&cube(lamp(), lamp(), 6)), 12);
        let base = Material { emission: Vec3::ZERO, ..lamp() };
        assert_eq!(count(&cube(lamp(), base.clone(), 6)), 10, "a base that does not shine closes it");
        assert_eq!(count(&cube(lamp(), lamp(), 5)), 0, "an open side");
        let glass = Material::new("glass", Surface::Glass { ior: 1.5, tint: Vec3::ONE });
        assert_eq!(count(&cube(lamp(), glass, 6)), 0, "a window");
        assert_eq!(count(&cube(lamp(), Material { alpha: Alpha::Blend, ..base.clone() }, 6)), 0, "a gauze");
        assert_eq!(count(&cube(lamp(), Material { diffuse_transmission: 0.5, ..base }, 6)), 0, "paper");
        let single = Material { double_sided: false, ..lamp() };
        assert_eq!(count(&cube(single.clone(), single, 6)), 0, "nothing shines inwards");
        let mut inverted = cube(lamp(), lamp(), 6);
        inverted.triangles.iter_mut().for_each(|t| t.positions.swap(1, 2));
        assert_eq!(count(&inverted), 0, "its faces look inwards");
        let mut two = cube(lamp(), lamp(), 6);
        let shifted: Vec<Triangle> =
            two.triangles.iter().map(|t| Triangle { positions: t.positions.map(|p| p - 9.0), ..*t }).collect();
        two.triangles.extend(&shifted[..11]);
        assert_eq!(count(&two), 12, "an open lamp beside it");
    }

    #[test]
    fn what_a_camera_may_see_from_within_is_not_hidden() {
        for (z, near, expected) in [(5.0, 0.0, 12), (0.0, 0.0, 0), (-5.0, 0.0, 12), (5.0, 3.9, 12), (5.0, 4.5, 0)] {
            let mut scene = cube(lamp(), lamp(), 6);
            scene.cameras = vec![Camera { near, ..looking_from(z) }];
            assert_eq!(count(&scene), expected, "at {z}, near plane at {near}");
            let ball = Sphere { center: Vec3::ZERO, radius: 1.0, material: 0, object: 0 };
            let balls = Scene { triangles: Vec::new(), spheres: vec![ball], ..scene };
            assert_eq!(count(&balls), expected / 12, "a sphere: at {z}, near plane at {near}");
        }
    }
}
