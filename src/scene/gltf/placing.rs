//! Meshes placed in the world by their nodes, in f64 until the middle of the scene is subtracted.

use glam::{DMat3, DMat4, DVec3, Vec3};

use super::fault::{Notes, Read, fault};
use super::meshes::Part;
use super::nodes::Placed;
use crate::scene::Triangle;

/// Triangles that a scene may hold: 7.6 GB of memory.
const MAX_TRIANGLES: usize = 100_000_000;

/// Size that a scene may have, metres.
pub(super) const MAX_EXTENT: f64 = 1e18;

/// What is said of a larger one.
pub(super) const TOO_FAR: &str = "lies too far away to compute with: more than 1e18 m from the rest";

/// A mesh shown by a node.
pub(super) struct Shown<'a> {
    pub(super) placed: Placed,
    pub(super) parts: &'a [Part],
}

/// Box in the world around points.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldBounds {
    min: DVec3,
    max: DVec3,
}

impl WorldBounds {
    pub(super) const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    pub(super) fn add(&mut self, point: DVec3, radius: f64) {
        let point = if point.is_finite() { point } else { DVec3::INFINITY };
        self.min = self.min.min(point - radius);
        self.max = self.max.max(point + radius);
    }

    /// Whether areas within the box can be computed in f32.
    pub(super) fn fits(&self) -> bool {
        let extent = self.max - self.min;
        self.min.x > self.max.x || extent.max_element() < MAX_EXTENT
    }

    /// Middle of the box; the origin for the empty one.
    pub(super) fn center(&self) -> DVec3 {
        if self.min.x <= self.max.x { 0.5 * (self.min + self.max) } else { DVec3::ZERO }
    }
}

/// Adds the vertices of all shown triangles to `bounds`.
pub(super) fn measure(shown: &[Shown<'_>], bounds: &mut WorldBounds) -> Read<()> {
    for Shown { placed, parts } in shown {
        for part in *parts {
            let mut used = vec![false; part.positions.len()];
            part.corners.iter().flatten().for_each(|vertex| used[*vertex as usize] = true);
            let used = part.positions.iter().zip(used).filter(|(_, used)| *used);
            used.for_each(|(position, _)| bounds.add(placed.world.transform_point3(position.as_dvec3()), 0.0));
        }
        if !bounds.fits() {
            return fault(format!("nodes[{}]", placed.node), TOO_FAR);
        }
    }
    Ok(())
}

/// All shown triangles relative to `center`. `material` maps the file's materials to the scene's.
pub(super) fn place(
    shown: &[Shown<'_>],
    center: DVec3,
    material: impl Fn(Option<usize>) -> u32,
    notes: &mut Notes,
) -> Read<Vec<Triangle>> {
    let parts = || shown.iter().flat_map(|shown| shown.parts);
    let total: usize = parts().map(|part| part.corners.len()).sum();
    if total > MAX_TRIANGLES {
        return fault("scene", format!("{total} triangles, at most {MAX_TRIANGLES} are read"));
    }
    let mut triangles = Vec::with_capacity(total);
    for Shown { placed, parts } in shown {
        let to_world = placed.world;
        let to_scene = DMat4::from_translation(-center) * to_world;
        for part in *parts {
            place_part(part, to_scene, material(part.material), &mut triangles);
        }
    }
    let dropped = total - triangles.len();
    if dropped > 0 {
        notes.add(format!("{dropped} of {total} triangles have no area and are not drawn"));
    }
    Ok(triangles)
}

/// The triangles of one part that have an area.
fn place_part(part: &Part, to_scene: DMat4, material: u32, triangles: &mut Vec<Triangle>) {
    let linear = DMat3::from_mat4(to_scene);
    let mirrored = linear.determinant() < 0.0;
    let to_normal = cofactors(linear, mirrored);
    let positions: Vec<Vec3> =
        part.positions.iter().map(|position| to_scene.transform_point3(position.as_dvec3()).as_vec3()).collect();
    let normals: Option<Vec<Vec3>> = part.normals.as_ref().map(|normals| {
        normals.iter().map(|normal| (to_normal * normal.as_dvec3()).normalize_or_zero().as_vec3()).collect()
    });
    for &[a, b, c] in &part.corners {
        // A mirroring transform turns the winding round; swapping two corners keeps the outside outside.
        let corners = if mirrored { [a, c, b] } else { [a, b, c] }.map(|corner| corner as usize);
        let mut triangle =
            Triangle { positions: corners.map(|corner| positions[corner]), normals: [Vec3::ZERO; 3], material };
        let flat = triangle.geometric_normal();
        if flat == Vec3::ZERO {
            continue;
        }
        let normal = |corner: usize| normals.as_ref().map_or(Vec3::ZERO, |normals| normals[corner]);
        triangle.normals = corners.map(|corner| Some(normal(corner)).filter(|n| *n != Vec3::ZERO).unwrap_or(flat));
        triangles.push(triangle);
    }
}

/// Matrix that takes normals along: the inverse transpose up to a positive factor, also where there is no inverse.
fn cofactors(m: DMat3, mirrored: bool) -> DMat3 {
    let sign = if mirrored { -1.0 } else { 1.0 };
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign
}
