//! Attributes of vertices for textures: texture coordinates and colours.

use glam::{Vec2, Vec4};
use gltf::json;
use json::accessor::Type;
use json::mesh::{Primitive, Semantic};
use json::validation::Checked;

use super::accessor::{Column, Document};
use super::fault::Read;
use super::material_table::Slot;
use super::primitives::attribute;
use crate::scene::{Attributes, UV_SETS};

/// Attributes of the vertices of a primitive; lists are empty where the material needs none.
#[derive(Debug, Default)]
pub(super) struct VertexAttributes {
    uvs: [Vec<Vec2>; UV_SETS],
    colors: Vec<Vec4>,
}

/// TEXCOORD_n of a primitive.
pub(super) fn sets(primitive: &Primitive) -> Vec<u32> {
    let set = |semantic: &Checked<Semantic>| match semantic {
        Checked::Valid(Semantic::TexCoords(set)) => Some(*set),
        _ => None,
    };
    primitive.attributes.keys().filter_map(set).collect()
}

/// Whether triangles of the primitive need attributes.
pub(super) fn are_needed(primitive: &Primitive, slot: &Slot) -> bool {
    !slot.sets.is_empty() || attribute(primitive, Semantic::Colors(0)).is_some()
}

/// Reads the attributes of those vertices; `None` where they need none.
pub(super) fn read(
    document: &Document<'_>,
    primitive: &Primitive,
    slot: &Slot,
    vertices: &[u32],
    place: &str,
) -> Read<Option<VertexAttributes>> {
    let column = |semantic: Semantic| {
        attribute(primitive, semantic).map(|accessor| document.column(accessor, place)).transpose()
    };
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
    let is_needed = !slot.sets.is_empty() || !attributes.colors.is_empty();
    Ok(is_needed.then_some(attributes))
}

/// Colour of a vertex, clamped to 0..1 (glTF 2.0, 3.7.2.1).
fn color(column: &Column<'_>, vertex: usize) -> Vec4 {
    let alpha = if column.format.kind == Type::Vec4 { column.number(vertex, 3) } else { 1.0 };
    let [r, g, b] = [0, 1, 2].map(|c| column.number(vertex, c));
    Vec4::new(r, g, b, alpha).clamp(Vec4::ZERO, Vec4::ONE)
}

impl VertexAttributes {
    /// Attributes of a triangle with those vertices.
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
