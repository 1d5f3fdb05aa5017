//! Meshes placed in the world by their nodes, in f64 until the middle of the scene is subtracted.

use glam::{DMat3, DMat4, DVec3, Vec3};

use super::fault::{Notes, Read, fault};
use super::meshes::Part;
use super::shown::Shown;
use crate::scene::Triangle;

/// Size that a scene may have, metres.
pub(super) const MAX_EXTENT: f64 = 1e18;

/// What is said of a larger one.
pub(super) const TOO_FAR: &str = "lies too far away to compute with: more than 1e18 m from the rest";

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
    for shown in shown {
        for i in 0..shown.copies() {
            let to_world = shown.world(i)?;
            for part in shown.parts {
                (0..part.positions.len()).for_each(|v| {
                    bounds.add(shown.matrix(part, v, to_world).transform_point3(part.positions[v].as_dvec3()), 0.0)
                });
            }
            if !bounds.fits() {
                return fault(format!("nodes[{}]", shown.node), TOO_FAR);
            }
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
    let claimed: usize = shown.iter().map(|shown| shown.copies() * total(shown.parts, |part| part.claimed)).sum();
    let kept = shown.iter().map(|shown| shown.copies() * total(shown.parts, |part| part.corners.len())).sum();
    let mut triangles = Vec::with_capacity(kept);
    for shown in shown {
        for i in 0..shown.copies() {
            let to_scene = DMat4::from_translation(-center) * shown.world(i)?;
            for part in shown.parts {
                let material = material(part.material);
                if part.influences.is_empty() {
                    place_part(part, to_scene, material, &mut triangles);
                } else {
                    place_skinned(shown, part, center, material, &mut triangles);
                }
            }
        }
    }
    let dropped = claimed - triangles.len();
    if dropped > 0 {
        notes.add(format!("{dropped} of {claimed} triangles have no area and are not drawn"));
    }
    Ok(triangles)
}

fn total(parts: &[Part], of: impl Fn(&Part) -> usize) -> usize {
    parts.iter().map(of).sum()
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
    let of = |corners: [usize; 3]| {
        let normals = normals.as_ref();
        (corners.map(|corner| positions[corner]), normals.map(|normals| corners.map(|corner| normals[corner])))
    };
    add_triangles(part, |_| mirrored, of, material, triangles);
}

/// The same where joints move each vertex in its own way.
fn place_skinned(shown: &Shown<'_>, part: &Part, center: DVec3, material: u32, triangles: &mut Vec<Triangle>) {
    let vertices = 0..part.positions.len();
    let moves: Vec<DMat4> =
        vertices.map(|v| DMat4::from_translation(-center) * shown.matrix(part, v, DMat4::IDENTITY)).collect();
    let mirrored = |v: usize| DMat3::from_mat4(moves[v]).determinant() < 0.0;
    let position = |v: usize| moves[v].transform_point3(part.positions[v].as_dvec3()).as_vec3();
    let normal = |normals: &[Vec3], v: usize| {
        let to_normal = cofactors(DMat3::from_mat4(moves[v]), mirrored(v));
        (to_normal * normals[v].as_dvec3()).normalize_or_zero().as_vec3()
    };
    let of = |corners: [usize; 3]| {
        let normals = part.normals.as_deref();
        (corners.map(position), normals.map(|normals| corners.map(|v| normal(normals, v))))
    };
    add_triangles(part, mirrored, of, material, triangles);
}

/// Adds the triangles of a part that have an area. `of` gives their corners' positions and normals.
fn add_triangles(
    part: &Part,
    mirrored: impl Fn(usize) -> bool,
    of: impl Fn([usize; 3]) -> ([Vec3; 3], Option<[Vec3; 3]>),
    material: u32,
    triangles: &mut Vec<Triangle>,
) {
    for &[a, b, c] in &part.corners {
        // A mirroring transform turns the winding round; swapping two corners keeps the outside outside.
        let corners = if mirrored(a as usize) { [a, c, b] } else { [a, b, c] }.map(|corner| corner as usize);
        let (positions, normals) = of(corners);
        let mut triangle = Triangle { positions, normals: [Vec3::ZERO; 3], material };
        let flat = triangle.geometric_normal();
        if flat == Vec3::ZERO {
            continue;
        }
        let normals = normals.unwrap_or([Vec3::ZERO; 3]);
        triangle.normals = normals.map(|normal| if normal == Vec3::ZERO { flat } else { normal });
        triangles.push(triangle);
    }
}

/// Matrix that takes normals along: the inverse transpose up to a positive factor, also where there is no inverse.
fn cofactors(m: DMat3, mirrored: bool) -> DMat3 {
    let sign = if mirrored { -1.0 } else { 1.0 };
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign
}
