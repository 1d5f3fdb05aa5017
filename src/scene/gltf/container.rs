//! The container: a GLB's chunks or plain JSON, the glTF version, and the extensions that a file may require.

use gltf::json;
use serde::Deserialize;

use super::fault::{Notes, Read, fault};

/// Extensions that are read, or that change nothing which is read.
const SUPPORTED: [&str; 10] = [
    "KHR_implicit_shapes",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// JSON text and binary chunk of a file.
pub(super) fn split(bytes: &[u8]) -> Read<(&[u8], Option<&[u8]>)> {
    let (text, bin) = if bytes.starts_with(b"glTF") { split_glb(bytes)? } else { (bytes, None) };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
        Some(b'{') => Ok((text, bin)),
        _ => fault("file", "is neither glTF JSON nor a GLB container"),
    }
}

/// Chunks of a GLB; unknown ones are skipped, as the format asks.
fn split_glb(bytes: &[u8]) -> Read<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| -> Option<u32> { bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes) };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return fault("GLB header", format!("needs 12 bytes, the file has {}", bytes.len()));
    };
    if version != 2 {
        return fault("GLB header", format!("version {version} is not read, only 2"));
    }
    if length as usize != bytes.len() {
        return fault("GLB header", format!("says {length} bytes, the file has {}", bytes.len()));
    }
    let (mut json, mut bin, mut at) = (None, None, 12);
    while at < bytes.len() {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return fault("GLB chunk", format!("header at byte {at} is cut off"));
        };
        let Some(data) = bytes.get(at + 8..).and_then(|rest| rest.get(..size as usize)) else {
            let left = bytes.len() - at - 8;
            return fault("GLB chunk", format!("at byte {at} says {size} bytes, {left} are left"));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() && at == 12 => json = Some(data),
            b"BIN\0" if bin.is_none() => bin = Some(data),
            _ => {}
        }
        at += 8 + size as usize;
    }
    json.map_or_else(|| fault("GLB chunk", "the first chunk is not JSON"), |json| Ok((json, bin)))
}

/// What is looked at before the rest: other versions may be shaped differently.
#[derive(Deserialize)]
struct Head {
    asset: Asset,
    #[serde(default, rename = "extensionsRequired")]
    required: Vec<String>,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
    #[serde(rename = "minVersion")]
    min_version: Option<String>,
}

/// Parses the JSON text; refuses versions and required extensions that are not read, by name.
pub(super) fn parse(text: &[u8], ignored: &[String], notes: &mut Notes) -> Read<json::Root> {
    let head: Head = serde_json::from_slice(text).or_else(|error| fault("JSON", error.to_string()))?;
    if head.asset.version.split('.').next() != Some("2") {
        return fault("asset.version", format!("glTF {} is not read, only 2.0", head.asset.version));
    }
    if let Some(version) = head.asset.min_version.filter(|version| version != "2.0") {
        return fault("asset.minVersion", format!("the file needs glTF {version}, only 2.0 is read"));
    }
    for (i, name) in head.required.iter().enumerate() {
        if SUPPORTED.contains(&name.as_str()) {
            continue;
        }
        if !ignored.contains(name) {
            let problem = format!("{name} is not supported; --ignore-required {name} reads the file without it");
            return fault(format!("extensionsRequired[{i}]"), problem);
        }
        notes.add(format!("extension {name} is required, but not read"));
    }
    let document = gltf::Gltf::from_slice_without_validation(text).or_else(|error| fault("JSON", error.to_string()))?;
    let root = document.document.into_json();
    for name in root.extensions_used.iter().filter(|name| !SUPPORTED.contains(&name.as_str())) {
        if head.required.contains(name) {
            continue;
        }
        notes.add(format!("extension {name} is not read"));
    }
    Ok(root)
}
