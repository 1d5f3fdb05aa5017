//! Attributes of vertices for textures: texture coordinates, colours and tangents.

use glam::{Vec2, Vec3, Vec4};
use gltf::json;
use json::accessor::Type;
use json::mesh::{Primitive, Semantic};
use json::validation::Checked;

use super::accessor::{Column, Document};
use super::fault::Read;
use super::material_table::{Axes, Slot};
use super::primitives::attribute;
use super::tangents;
use super::textures::AXES;
use crate::scene::{Attributes, UV_SETS};

/// Attributes of the vertices of a primitive; lists are empty where the material needs none.
#[derive(Debug, Default)]
pub(super) struct VertexAttributes {
    uvs: [Vec<Vec2>; UV_SETS],
    colors: Vec<Vec4>,
    tangents: Tangents,
}

/// Tangents along a texture in object space, with ±1; those without a direction are zero.
#[derive(Debug, Default)]
enum Tangents {
    #[default]
    Unneeded,
    OfVertices(Vec<Vec4>),
    /// By triangle.
    OfCorners(Vec<[Vec4; 3]>),
}

/// Triangles to which attributes are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangles<'a> {
    /// Vertices of the file that are in use.
    pub(super) vertices: &'a [u32],
    /// Positions of these vertices.
    pub(super) positions: &'a [Vec3],
    pub(super) normals: Option<&'a [Vec3]>,
    /// Indices into these vertices.
    pub(super) corners: &'a [[u32; 3]],
    /// Morph targets have moved the vertices.
    pub(super) is_morphed: bool,
}

/// TEXCOORD_n of a primitive, and [`AXES`] if it has them.
pub(super) fn sets(primitive: &Primitive) -> Vec<u32> {
    let set = |semantic: &Checked<Semantic>| match semantic {
        Checked::Valid(Semantic::TexCoords(set)) => Some(*set),
        _ => None,
    };
    let mut sets: Vec<u32> = primitive.attributes.keys().filter_map(set).collect();
    let has_tangents =
        [Semantic::Normals, Semantic::Tangents].into_iter().all(|semantic| attribute(primitive, semantic).is_some());
    if has_tangents || sets.contains(&0) {
        sets.push(AXES);
    }
    sets
}

/// Whether triangles of the primitive need attributes.
pub(super) fn are_needed(primitive: &Primitive, slot: &Slot) -> bool {
    !slot.sets.is_empty() || attribute(primitive, Semantic::Colors(0)).is_some()
}

/// Reads the attributes of triangles; `None` where they need none.
pub(super) fn read(
    document: &Document<'_>,
    primitive: &Primitive,
    slot: &Slot,
    triangles: Triangles<'_>,
    place: &str,
) -> Read<Option<VertexAttributes>> {
    let column = |semantic: Semantic| {
        attribute(primitive, semantic).map(|accessor| document.column(accessor, place)).transpose()
    };
    let vertices = triangles.vertices;
    let mut attributes = VertexAttributes::default();
    for (uvs, set) in attributes.uvs.iter_mut().zip(&slot.sets) {
        let Some(column) = column(Semantic::TexCoords(*set))? else { continue };
        let uv = |v: &u32| Vec2::new(column.number(*v as usize, 0), column.number(*v as usize, 1));
        *uvs = vertices.iter().map(uv).collect();
    }
    if let Some(column) = column(Semantic::Colors(0))? {
        let colors: Vec<Vec4> = vertices.iter().map(|v| color(&column, *v as usize)).collect();
        // White changes nothing.
        if colors.iter().any(|color| *color != Vec4::ONE) {
            attributes.colors = colors;
        }
    }
    if let Some(axes) = &slot.axes {
        let can_generate = !attributes.uvs[axes.uv_set as usize].is_empty();
        // Those of the file lie on the surface as it was before morph targets moved it.
        let are_right = triangles.normals.is_some() && !(triangles.is_morphed && can_generate);
        attributes.tangents = match column(Semantic::Tangents)?.filter(|_| are_right) {
            Some(column) => Tangents::OfVertices(vertices.iter().map(|v| tangent(&column, *v as usize)).collect()),
            None if can_generate => attributes.generated(axes, triangles),
            None => Tangents::Unneeded,
        };
    }
    let is_needed = !slot.sets.is_empty() || !attributes.colors.is_empty();
    Ok(is_needed.then_some(attributes))
}

/// Colour of a vertex, clamped to 0..1 (glTF 2.0, 3.7.2.1).
fn color(column: &Column<'_>, vertex: usize) -> Vec4 {
    let alpha = if column.format.kind == Type::Vec4 { column.number(vertex, 3) } else { 1.0 };
    let [r, g, b] = [0, 1, 2].map(|c| column.number(vertex, c));
    Vec4::new(r, g, b, alpha).clamp(Vec4::ZERO, Vec4::ONE)
}

/// Tangent of a vertex and the sign of its bitangent.
fn tangent(column: &Column<'_>, vertex: usize) -> Vec4 {
    let [x, y, z, w] = [0, 1, 2, 3].map(|c| column.number(vertex, c));
    Vec4::new(x, y, z, if w < 0.0 { -1.0 } else { 1.0 })
}

impl VertexAttributes {
    /// Tangents along those axes, where the file has none.
    fn generated(&self, axes: &Axes, triangles: Triangles<'_>) -> Tangents {
        let [u, v] = axes.transform.map(Vec3::from_array);
        let placed = |uv: &Vec2| Vec2::new(u.dot(uv.extend(1.0)), v.dot(uv.extend(1.0)));
        let uvs: Vec<Vec2> = self.uvs[axes.uv_set as usize].iter().map(placed).collect();
        let Triangles { positions, normals, corners, .. } = triangles;
        Tangents::OfCorners(tangents::generate(positions, normals, &uvs, corners))
    }

    /// Tangents of the corners of triangle `i`, in object space; `None` where none are needed.
    /// `order`: which of the triangle's corners each of `corners` is.
    pub(super) fn tangents(&self, i: usize, corners: [usize; 3], order: [usize; 3]) -> Option<[Vec4; 3]> {
        match &self.tangents {
            Tangents::Unneeded => None,
            Tangents::OfVertices(tangents) => Some(corners.map(|corner| tangents[corner])),
            Tangents::OfCorners(tangents) => Some(order.map(|corner| tangents[i][corner])),
        }
    }

    /// Attributes of a triangle with those vertices, without tangents.
    pub(super) fn of(&self, corners: [usize; 3]) -> Attributes {
        let mut attributes = Attributes::default();
        for (of_corners, uvs) in attributes.uvs.iter_mut().zip(&self.uvs).filter(|(_, uvs)| !uvs.is_empty()) {
            *of_corners = corners.map(|corner| uvs[corner]);
        }
        if !self.colors.is_empty() {
            attributes.colors = corners.map(|corner| self.colors[corner]);
        }
        attributes
    }
}
