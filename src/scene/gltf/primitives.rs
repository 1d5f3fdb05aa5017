//! References of a primitive: every accessor is checked, none is decoded.

use std::collections::HashMap;

use gltf::json;
use json::accessor::{ComponentType, Type};
use json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use json::validation::Checked;

use super::accessor::{Column, Document};
use super::fault::{Notes, Read, fault};
use super::format::Format;
use super::topology::triangle_count;

/// Maximum number of sets of four joints of a vertex.
const MAX_JOINT_SETS: u32 = 8;

/// A primitive that has triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) mode: Mode,
    /// Number of triangles by the indices or vertices, including those of zero area.
    pub(super) triangles: usize,
}

/// Checker of primitives, which caches results common to several of them.
pub(super) struct Checker<'a> {
    document: &'a Document<'a>,
    quantized: bool,
    /// The largest index of each accessor of indices.
    largest: HashMap<usize, Option<u32>>,
}

impl<'a> Checker<'a> {
    pub(super) fn new(document: &'a Document<'a>) -> Self {
        let quantized = document.root.extensions_used.iter().any(|name| name == "KHR_mesh_quantization");
        Self { document, quantized, largest: HashMap::new() }
    }

    /// Checks a primitive and notes its unread parts; `None` if it has no triangles.
    pub(super) fn check(&mut self, primitive: &Primitive, place: &str, notes: &mut Notes) -> Read<Option<Shape>> {
        let materials = self.document.root.materials.len();
        if let Some(material) = primitive.material.map(|material| material.value()).filter(|i| *i >= materials) {
            return fault(format!("{place}.material"), format!("{material} of {materials}"));
        }
        let Checked::Valid(mode) = primitive.mode else {
            return fault(format!("{place}.mode"), "is not one of glTF's");
        };
        let vertices = self.check_attributes(primitive, place)?;
        for (t, target) in primitive.targets.iter().flatten().enumerate() {
            self.check_target(target, vertices, &format!("{place}.targets[{t}]"))?;
        }
        let Some(positions) = attribute(primitive, Semantic::Positions) else {
            notes.add("primitives without positions are not drawn");
            return Ok(None);
        };
        self.check_vectors(positions, true, &format!("{place}.attributes.POSITION"))?;
        if let Some(normals) = attribute(primitive, Semantic::Normals) {
            self.check_vectors(normals, true, &format!("{place}.attributes.NORMAL"))?;
        }
        let count = match primitive.indices {
            Some(indices) => self.check_indices(indices.value(), vertices, &format!("{place}.indices"))?,
            None => vertices,
        };
        if mode == Mode::Triangles && !count.is_multiple_of(3) {
            notes.add("vertices beyond the last whole triangle of a list are ignored");
        }
        let triangles = triangle_count(mode, count);
        if triangles.is_none() {
            notes.add("points and lines are not drawn");
        }
        Ok(triangles.map(|triangles| Shape { mode, triangles }))
    }

    /// Checks that all attributes of a primitive have equally many elements, and returns that
    /// number of vertices.
    fn check_attributes(&self, primitive: &Primitive, place: &str) -> Read<usize> {
        let mut vertices = None;
        for (semantic, accessor) in &primitive.attributes {
            let Checked::Valid(semantic) = semantic else { continue };
            let at = format!("{place}.attributes.{}", semantic.to_string());
            let (count, format) = self.document.shape(accessor.value(), &at)?;
            if *vertices.get_or_insert(count) != count {
                let expected = vertices.unwrap_or_default();
                return fault(at, format!("has {count} elements, other attributes have {expected}"));
            }
            if let Semantic::Joints(set) = semantic
                && *set >= MAX_JOINT_SETS
            {
                return fault(at, format!("is one of more than {MAX_JOINT_SETS} sets of joints"));
            }
            let (fits, what) = self.fits(semantic, format);
            if !fits {
                return fault(at, format!("is {format}, which {what} cannot be"));
            }
        }
        Ok(vertices.unwrap_or(0))
    }

    /// Whether an attribute can have that format, and what it is in messages. Positions, normals
    /// and attributes that are not read have any.
    fn fits(&self, semantic: &Semantic, format: Format) -> (bool, &'static str) {
        let is_float = format.component == ComponentType::F32;
        let is_small = matches!(format.component, ComponentType::U8 | ComponentType::U16);
        let is_signed = matches!(format.component, ComponentType::I8 | ComponentType::I16);
        let normal = is_float || (is_small && format.normalized);
        match semantic {
            Semantic::Joints(_) => {
                (is_small && !format.normalized && format.kind == Type::Vec4, "joints and their weights")
            }
            Semantic::Weights(_) => (normal && format.kind == Type::Vec4, "joints and their weights"),
            Semantic::TexCoords(_) => {
                let fits = normal || (self.quantized && (is_small || is_signed));
                (fits && format.kind == Type::Vec2, "texture coordinates")
            }
            Semantic::Colors(0) => (normal && matches!(format.kind, Type::Vec3 | Type::Vec4), "colours"),
            Semantic::Tangents => {
                let fits = is_float || (self.quantized && is_signed && format.normalized);
                (fits && format.kind == Type::Vec4, "tangents")
            }
            _ => (true, ""),
        }
    }

    fn check_target(&self, target: &MorphTarget, vertices: usize, place: &str) -> Read<()> {
        for (accessor, name) in [(target.positions, "POSITION"), (target.normals, "NORMAL")] {
            let Some(accessor) = accessor else { continue };
            let at = format!("{place}.{name}");
            let count = self.check_vectors(accessor.value(), false, &at)?;
            if count != vertices {
                return fault(at, format!("has {count} elements, the primitive has {vertices} vertices"));
            }
        }
        Ok(())
    }

    /// Checks an attribute of three numbers per vertex: floats, or integers with
    /// KHR_mesh_quantization, which permits unsigned integers for base positions but not for morph
    /// displacements.
    fn check_vectors(&self, accessor: usize, unsigned: bool, place: &str) -> Read<usize> {
        let (count, format) = self.document.shape(accessor, place)?;
        let component = match format.component {
            ComponentType::F32 => true,
            ComponentType::U32 => false,
            ComponentType::U8 | ComponentType::U16 => self.quantized && unsigned,
            ComponentType::I8 | ComponentType::I16 => self.quantized,
        };
        if format.kind != Type::Vec3 || !component {
            let hint = if self.quantized { "" } else { " of F32" };
            return fault(place, format!("is {format}, not Vec3{hint}"));
        }
        Ok(count)
    }

    /// Checks that all indices are below `vertices`; returns their number.
    fn check_indices(&mut self, accessor: usize, vertices: usize, place: &str) -> Read<usize> {
        let column = self.document.column(accessor, place)?;
        let format = column.format;
        let component = matches!(format.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if format != (Format { kind: Type::Scalar, normalized: false, ..format }) || !component {
            return fault(place, format!("is {format}, not Scalar of U8, U16 or U32"));
        }
        match self.largest.entry(accessor).or_insert_with(|| column.max_unsigned()) {
            Some(index) if *index as usize >= vertices => {
                let at = (0..column.count).position(|i| column.unsigned(i, 0) == *index).unwrap_or_default();
                fault(place, format!("index {index} at {at}, but there are {vertices} vertices"))
            }
            _ => Ok(column.count),
        }
    }
}

/// The accessor of an attribute.
pub(super) fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|accessor| accessor.value())
}

/// Sets of joints and weights of a primitive.
pub(super) fn joint_sets<'d>(
    document: &'d Document<'_>,
    primitive: &Primitive,
    place: &str,
) -> Read<Vec<(Column<'d>, Column<'d>)>> {
    let mut sets = Vec::new();
    for set in 0..MAX_JOINT_SETS {
        let (joints, weights) =
            (attribute(primitive, Semantic::Joints(set)), attribute(primitive, Semantic::Weights(set)));
        match (joints, weights) {
            (Some(joints), Some(weights)) => {
                sets.push((document.column(joints, place)?, document.column(weights, place)?));
            }
            (None, None) => {}
            _ => return fault(format!("{place}.attributes"), format!("JOINTS_{set} and WEIGHTS_{set} come together")),
        }
    }
    Ok(sets)
}
