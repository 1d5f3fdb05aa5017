//! Compressed bufferViews (EXT_meshopt_compression): properties are checked, then data is decoded
//! in safe code.

use gltf::json;
use serde::Deserialize;
use serde_json::Value;

use super::buffers::{Buffers, slice};
use super::extensions::MESHOPT;
use super::fault::{Read, fault};
use super::strict_json::typed;

mod filters;
mod indices;
mod vertices;

/// Maximum decoded size of all views of a file: a constant, plus a factor per byte of the buffers.
const MAX_BYTES: u64 = 1 << 26;
const MAX_RATIO: u64 = 64;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

/// Decoded bytes of each view; `None` for uncompressed views.
pub(super) fn decode(root: &json::Root, buffers: &Buffers<'_>) -> Read<Vec<Option<Vec<u8>>>> {
    let held: usize = buffers.iter().flatten().map(|bytes| bytes.len()).sum();
    let mut left = MAX_BYTES.max(MAX_RATIO * held as u64);
    let mut views = Vec::with_capacity(root.buffer_views.len());
    for (i, view) in root.buffer_views.iter().enumerate() {
        let extension = view.extensions.as_ref().and_then(|extensions| extensions.others.get(MESHOPT));
        let place = format!("bufferViews[{i}].extensions.{MESHOPT}");
        views.push(extension.map(|extension| decode_view(view, extension, buffers, &mut left, &place)).transpose()?);
    }
    Ok(views)
}

fn decode_view(
    view: &json::buffer::View,
    extension: &Value,
    buffers: &Buffers<'_>,
    left: &mut u64,
    place: &str,
) -> Read<Vec<u8>> {
    let asked = typed::<Compressed>(extension, place)?;
    let Compressed { byte_stride: stride, count, .. } = asked;
    let size = count.checked_mul(stride).filter(|size| *size == view.byte_length.0);
    let Some(size) = size else {
        let problem = format!("{count} elements of {stride} bytes do not fill the view's {}", view.byte_length.0);
        return fault(place, problem);
    };
    *left = match left.checked_sub(size) {
        Some(left) => left,
        None => return fault(place, format!("{size} bytes are more than the file's buffers can hold compressed")),
    };
    let bytes = slice(buffers, asked.buffer, asked.byte_offset, asked.byte_length, place)?;
    let (stride, count) = (stride as usize, count as usize);
    let is_index = stride == 2 || stride == 4;
    let decoded = match asked.mode.as_str() {
        "ATTRIBUTES" if stride.is_multiple_of(4) && (4..=256).contains(&stride) => {
            vertices::decode(bytes, count, stride)
        }
        "TRIANGLES" if is_index && count.is_multiple_of(3) => {
            indices::decode_triangles(bytes, count).map(|list| narrow(&list, stride))
        }
        "INDICES" if is_index => indices::decode_sequence(bytes, count).map(|list| narrow(&list, stride)),
        mode => return fault(place, format!("mode {mode:?} with a stride of {stride} and a count of {count}")),
    };
    let Some(mut decoded) = decoded else { return fault(place, "the compressed data is damaged") };
    match (asked.filter.as_deref().unwrap_or("NONE"), stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => filters::octahedral::<1>(&mut decoded),
        ("OCTAHEDRAL", 8) => filters::octahedral::<2>(&mut decoded),
        ("QUATERNION", 8) => filters::quaternion(&mut decoded),
        ("EXPONENTIAL", _) => filters::exponential(&mut decoded),
        (filter, _) => return fault(place, format!("filter {filter:?} with a stride of {stride}")),
    }
    Ok(decoded)
}

/// Indices in two or four bytes each.
fn narrow(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|index| index.to_le_bytes().into_iter().take(stride)).collect()
}
