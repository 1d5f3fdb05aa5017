//! Meshes in their own coordinates: triangles out of lists, strips and fans.

use glam::Vec3;
use gltf::json;
use json::accessor::{ComponentType, Type};
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::Checked;

use super::accessor::{Document, Format, number};
use super::fault::{Notes, Read, fault};

/// Triangles that share vertices and a material.
#[derive(Debug)]
pub(super) struct Part {
    /// All finite.
    pub(super) positions: Vec<Vec3>,
    /// One for each position, of any length; `None` where the file has none.
    pub(super) normals: Option<Vec<Vec3>>,
    /// Indices into the positions, all valid.
    pub(super) corners: Vec<[u32; 3]>,
    /// Index into the file's materials, valid; `None` for the default one.
    pub(super) material: Option<usize>,
}

/// All meshes of the file; those that no node shows are checked too.
pub(super) fn read(document: &Document<'_>, notes: &mut Notes) -> Read<Vec<Vec<Part>>> {
    let mut meshes = Vec::with_capacity(document.root.meshes.len());
    for (i, mesh) in document.root.meshes.iter().enumerate() {
        let mut parts = Vec::with_capacity(mesh.primitives.len());
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            parts.extend(read_part(document, primitive, &format!("meshes[{i}].primitives[{j}]"), notes)?);
        }
        meshes.push(parts);
    }
    Ok(meshes)
}

/// One primitive of the file; `None` if it has no triangles.
fn read_part(document: &Document<'_>, primitive: &Primitive, place: &str, notes: &mut Notes) -> Read<Option<Part>> {
    let root = document.root;
    let material = primitive.material.map(|material| material.value());
    if let Some(material) = material.filter(|material| *material >= root.materials.len()) {
        return fault(format!("{place}.material"), format!("{material} of {}", root.materials.len()));
    }
    let Checked::Valid(mode) = primitive.mode else {
        return fault(format!("{place}.mode"), "is not one of glTF's");
    };
    note_unread(primitive, notes);
    check_counts(document, primitive, place)?;
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|accessor| accessor.value());
    let Some(positions) = attribute(Semantic::Positions) else {
        notes.add("primitives without positions are not drawn");
        return Ok(None);
    };
    let at = format!("{place}.attributes.POSITION");
    let positions = read_vectors(document, positions, &at)?;
    if let Some(vertex) = positions.iter().position(|position| !position.is_finite()) {
        return fault(at, format!("vertex {vertex} is not finite: {}", positions[vertex]));
    }
    let normals = attribute(Semantic::Normals)
        .map(|normals| read_vectors(document, normals, &format!("{place}.attributes.NORMAL")))
        .transpose()?;
    let indices = match primitive.indices {
        Some(indices) => Some(read_indices(document, indices.value(), positions.len(), &format!("{place}.indices"))?),
        None => None,
    };
    let count = indices.as_ref().map_or(positions.len(), Vec::len);
    let vertex = |i: usize| indices.as_ref().map_or(i as u32, |indices| indices[i]);
    let corners = triangles(mode, count, vertex, notes);
    Ok(corners.map(|corners| Part { positions, normals, corners, material }))
}

/// All attributes of a primitive have as many elements as there are positions.
fn check_counts(document: &Document<'_>, primitive: &Primitive, place: &str) -> Read<()> {
    let mut vertices = None;
    for (semantic, accessor) in &primitive.attributes {
        let name = match semantic {
            Checked::Valid(semantic) => semantic.to_string(),
            Checked::Invalid => continue,
        };
        let at = format!("{place}.attributes.{name}");
        let (count, _) = document.shape(accessor.value(), &at)?;
        match vertices {
            Some(expected) if expected != count => {
                return fault(at, format!("has {count} elements, other attributes have {expected}"));
            }
            _ => vertices = Some(count),
        }
    }
    Ok(())
}

/// Three numbers a vertex: floats, or integers where KHR_mesh_quantization is in use.
fn read_vectors(document: &Document<'_>, accessor: usize, place: &str) -> Read<Vec<Vec3>> {
    let (_, format) = document.shape(accessor, place)?;
    let quantized = document.root.extensions_used.iter().any(|name| name == "KHR_mesh_quantization");
    let component = match format.component {
        ComponentType::F32 => true,
        ComponentType::U32 => false,
        _ => quantized,
    };
    if format.kind != Type::Vec3 || !component {
        let hint = if quantized { "" } else { " of F32" };
        return fault(place, format!("is {format}, not Vec3{hint}"));
    }
    let size = format.component.size();
    document.decode(accessor, |bytes| {
        Vec3::new(number(bytes, format), number(&bytes[size..], format), number(&bytes[2 * size..], format))
    })
}

/// Indices of vertices, all below `vertices`.
fn read_indices(document: &Document<'_>, accessor: usize, vertices: usize, place: &str) -> Read<Vec<u32>> {
    let (_, format) = document.shape(accessor, place)?;
    let component = matches!(format.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
    if format != (Format { kind: Type::Scalar, normalized: false, ..format }) || !component {
        return fault(place, format!("is {format}, not Scalar of U8, U16 or U32"));
    }
    let indices = document.decode_unsigned(accessor, format.component)?;
    match indices.iter().position(|index| *index as usize >= vertices) {
        Some(at) => fault(place, format!("index {} at {at}, but there are {vertices} vertices", indices[at])),
        None => Ok(indices),
    }
}

/// Triangles of a list, strip or fan of `count` vertices, in the winding of glTF 2.0, 3.7.2.1; `None` for points and
/// lines.
fn triangles(mode: Mode, count: usize, vertex: impl Fn(usize) -> u32, notes: &mut Notes) -> Option<Vec<[u32; 3]>> {
    let by = |[a, b, c]: [usize; 3]| [vertex(a), vertex(b), vertex(c)];
    match mode {
        Mode::Triangles => {
            if !count.is_multiple_of(3) {
                notes.add("vertices beyond the last whole triangle of a list are ignored");
            }
            Some((0..count / 3).map(|i| by([3 * i, 3 * i + 1, 3 * i + 2])).collect())
        }
        Mode::TriangleStrip => {
            Some((0..count.saturating_sub(2)).map(|i| by([i, i + 1 + i % 2, i + 2 - i % 2])).collect())
        }
        Mode::TriangleFan => Some((0..count.saturating_sub(2)).map(|i| by([i + 1, i + 2, 0])).collect()),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
            notes.add("points and lines are not drawn");
            None
        }
    }
}

/// Names what a primitive has beyond its triangles.
fn note_unread(primitive: &Primitive, notes: &mut Notes) {
    if primitive.attributes.keys().any(|semantic| matches!(semantic, Checked::Valid(Semantic::Colors(_)))) {
        notes.add("vertex colours are not read yet");
    }
    if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
        notes.add("morph targets are not read: meshes are drawn as they stand");
    }
}
