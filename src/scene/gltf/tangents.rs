//! Tangents of normal maps where the file has none: MikkTSpace, as glTF 2.0, 3.7.2.1 asks.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

/// Triangles with the texture coordinates of their normal map.
struct Surface<'a> {
    positions: &'a [Vec3],
    normals: Option<&'a [Vec3]>,
    uvs: &'a [Vec2],
    corners: &'a [[u32; 3]],
    /// Tangent of each corner of each triangle; zero where there is none.
    tangents: Vec<[Vec4; 3]>,
}

/// Tangents of the corners of triangles, which may be zero. `uvs` are where the map is sampled, v
/// pointing down.
pub(super) fn generate(
    positions: &[Vec3],
    normals: Option<&[Vec3]>,
    uvs: &[Vec2],
    corners: &[[u32; 3]],
) -> Vec<[Vec4; 3]> {
    let tangents = vec![[Vec4::ZERO; 3]; corners.len()];
    let mut surface = Surface { positions, normals, uvs, corners, tangents };
    // The crate knows no error yet; with one, tangents would stay zero.
    let _ = generate_tangents(&mut surface);
    surface.tangents
}

impl Surface<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.corners[face][corner] as usize
    }
}

impl Geometry for Surface<'_> {
    fn num_faces(&self) -> usize {
        self.corners.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.positions[self.vertex(face, corner)].to_array()
    }

    /// Normal of the vertex; without one that of the plane, as flat shading has it.
    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        let normal = self.normals.map_or(Vec3::ZERO, |normals| normals[self.vertex(face, corner)].normalize_or_zero());
        if normal != Vec3::ZERO {
            return normal.to_array();
        }
        let [a, b, c] = self.corners[face].map(|v| self.positions[v as usize].as_dvec3());
        (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
    }

    /// v points up there: the bitangent then points to the top of the image, as glTF wants it.
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.uvs[self.vertex(face, corner)];
        [uv.x, -uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = space.map_or(Vec4::ZERO, |space| Vec4::from_array(space.tangent_encoded()));
        self.tangents[face][corner] = if tangent.is_finite() { tangent } else { Vec4::ZERO };
    }
}
