//! Compressed primitives (KHR_draco_mesh_compression).

use std::collections::HashMap;

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::json;
use json::accessor::{ComponentType, Type};
use json::mesh::{Mode, Primitive};
use json::validation::Checked;
use serde::Deserialize;

use super::accessor::Document;
use super::fault::{Read, fault};
use super::format::{Format, MAX_ZEROS, Unpacked};
use super::strict_json::typed;

const NAME: &str = "KHR_draco_mesh_compression";

/// Prefixes of the names of attributes that are read.
const READ: [&str; 7] = ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_", "COLOR_0", "JOINTS_", "WEIGHTS_"];

/// Maximum size of a vertex's attributes, bytes; those of glTF take less than 200.
const BYTES_PER_VERTEX: u64 = 1024;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer_view: usize,
    /// Attribute identifiers in the stream, by attribute name.
    attributes: HashMap<String, u32>,
}

/// Maximum number of vertices and indices per byte of the file's buffers, for large counts.
const MAX_RATIO: u64 = 64;

/// A primitive to decode.
struct CompressedPrimitive<'a> {
    primitive: &'a Primitive,
    compressed: Compressed,
    place: String,
}

/// Elements of all accessors of compressed primitives.
pub(super) fn decode(document: &Document<'_>) -> Read<HashMap<usize, Unpacked>> {
    let mut unpacked = HashMap::new();
    let mut origins: HashMap<usize, usize> = HashMap::new();
    // A stream of a few bytes may hold millions of equal vertices, hence the limit on the total.
    let mut left = MAX_ZEROS.max(MAX_RATIO * document.held());
    for (i, mesh) in document.root.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            let Some(packed) = packed(document, primitive, format!("meshes[{i}].primitives[{j}]"))? else { continue };
            let view = packed.compressed.buffer_view;
            // Primitives with the same accessors must have the same stream.
            if let Some(indices) = primitive.indices.and_then(|indices| origins.insert(indices.value(), view)) {
                if indices != view {
                    return fault(packed.place, "its indices come out of another bufferView too");
                }
                continue;
            }
            packed.decode(document, &mut left, &mut unpacked)?;
        }
    }
    Ok(unpacked)
}

/// Stream of a primitive; `None` if it is not compressed, or also stored uncompressed.
fn packed<'a>(
    document: &Document<'a>,
    primitive: &'a Primitive,
    place: String,
) -> Read<Option<CompressedPrimitive<'a>>> {
    let extensions = primitive.extensions.as_ref();
    let Some(extension) = extensions.and_then(|extensions| extensions.others.get(NAME)) else { return Ok(None) };
    let place = format!("{place}.extensions.{NAME}");
    let compressed = typed::<Compressed>(extension, &place)?;
    let mut accessors = primitive.attributes.values().copied().chain(primitive.indices);
    if accessors
        .try_fold(true, |all, accessor| Ok(all && document.accessor(accessor.value(), &place)?.buffer_view.is_some()))?
    {
        return Ok(None);
    }
    if primitive.mode != Checked::Valid(Mode::Triangles) || primitive.indices.is_none() {
        return fault(place, "is read for lists of indexed triangles only");
    }
    Ok(Some(CompressedPrimitive { primitive, compressed, place }))
}

impl CompressedPrimitive<'_> {
    fn decode(&self, document: &Document<'_>, left: &mut u64, unpacked: &mut HashMap<usize, Unpacked>) -> Read<()> {
        let Some(indices) = self.primitive.indices.map(|indices| indices.value()) else { return Ok(()) };
        let place = &self.place;
        let vertices = self.vertices(document)?;
        let corners = document.accessor(indices, place)?.count.0;
        *left = match left.checked_sub(corners.saturating_add(vertices)) {
            Some(left) => left,
            None => return fault(place, format!("{vertices} vertices and {corners} indices are too many")),
        };
        let bytes = document.view(self.compressed.buffer_view, place)?;
        let limits = DecodeLimits::default()
            .with_max_points(vertices)
            .with_max_faces(corners)
            .with_max_decoded_bytes(BYTES_PER_VERTEX.saturating_mul(vertices.max(1)));
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
        MeshDecoder::new().decode(&mut buffer, &mut mesh).or_else(|error| {
            // Some of the decoder's messages are indented over several lines.
            let words: Vec<_> = error.to_string().split_whitespace().map(str::to_owned).collect();
            fault(place, format!("the compressed data is damaged: {}", words.join(" ")))
        })?;
        if mesh.num_points() as u64 != vertices {
            return fault(place, format!("holds {} vertices, the accessors {vertices}", mesh.num_points()));
        }
        unpacked.insert(indices, self.indices(&mesh, corners)?);
        for (name, number) in &self.compressed.attributes {
            self.attribute(document, &mesh, name, *number, unpacked)?;
        }
        Ok(())
    }

    /// Number of vertices by the accessors of the compressed attributes.
    fn vertices(&self, document: &Document<'_>) -> Read<u64> {
        let mut vertices = None;
        for name in self.compressed.attributes.keys() {
            let Some(accessor) = self.accessor(name) else { continue };
            let count = document.accessor(accessor, &self.place)?.count.0;
            if *vertices.get_or_insert(count) != count {
                return fault(&self.place, "its attributes have different counts");
            }
        }
        vertices.map_or_else(|| fault(format!("{}.attributes", self.place), "names none of the primitive's"), Ok)
    }

    /// The accessor of the primitive's attribute of that name.
    fn accessor(&self, name: &str) -> Option<usize> {
        let is_it = |semantic: &Checked<json::mesh::Semantic>| semantic.to_string() == name;
        let found = self.primitive.attributes.iter().find(|(semantic, _)| is_it(semantic));
        found.map(|(_, accessor)| accessor.value())
    }

    fn indices(&self, mesh: &Mesh, corners: u64) -> Read<Unpacked> {
        if 3 * mesh.num_faces() as u64 != corners {
            let problem = format!("holds {} triangles, the accessor {corners} indices", mesh.num_faces());
            return fault(&self.place, problem);
        }
        let bytes = mesh.faces().iter().flatten().flat_map(|point| point.0.to_le_bytes()).collect();
        let format = Format { kind: Type::Scalar, component: ComponentType::U32, normalized: false };
        Ok(Unpacked { bytes, format })
    }

    /// Attribute in the component type of its accessor.
    fn attribute(
        &self,
        document: &Document<'_>,
        mesh: &Mesh,
        name: &str,
        number: u32,
        unpacked: &mut HashMap<usize, Unpacked>,
    ) -> Read<()> {
        let place = format!("{}.attributes.{name}", self.place);
        let Some(accessor) = self.accessor(name) else { return fault(place, "the primitive has no such attribute") };
        if !READ.iter().any(|prefix| name.starts_with(prefix)) {
            return Ok(());
        }
        if unpacked.contains_key(&accessor) {
            return fault(place, format!("accessors[{accessor}] comes out of another primitive too"));
        }
        let (count, format) = document.shape(accessor, &place)?;
        let Some(attribute) = mesh.attribute_by_unique_id(number) else {
            return fault(place, format!("the compressed data has no attribute {number}"));
        };
        let components = format.kind.multiplicity();
        if usize::from(attribute.num_components()) != components {
            let problem =
                format!("has {} components, not the {components} of its accessor", attribute.num_components());
            return fault(place, problem);
        }
        let mut bytes = Vec::with_capacity(count * format.size());
        for value in attribute.read_f32s(count, components) {
            match format.component {
                ComponentType::F32 => bytes.extend(value.to_le_bytes()),
                ComponentType::I8 => bytes.extend((value as i8).to_le_bytes()),
                ComponentType::U8 => bytes.extend((value as u8).to_le_bytes()),
                ComponentType::I16 => bytes.extend((value as i16).to_le_bytes()),
                ComponentType::U16 => bytes.extend((value as u16).to_le_bytes()),
                ComponentType::U32 => bytes.extend((value as u32).to_le_bytes()),
            }
        }
        unpacked.insert(accessor, Unpacked { bytes, format });
        Ok(())
    }
}
