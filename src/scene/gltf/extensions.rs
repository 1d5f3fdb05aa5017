//! Extensions that a file may use or require.

use std::collections::{BTreeSet, HashSet};

use gltf::json;
use serde_json::Value;

use super::fault::{Notes, Read, fault};

/// Compressed bufferViews.
pub(super) const MESHOPT: &str = "EXT_meshopt_compression";
/// Nodes that are not there, nor what is below them.
pub(super) const NODE_VISIBILITY: &str = "KHR_node_visibility";

/// Textures in KTX2, which are not read: no crate without C++ decodes them that damaged files do
/// not make end the process.
pub(super) const BASISU: &str = "KHR_texture_basisu";
/// Textures in WebP.
pub(super) const WEBP: &str = "EXT_texture_webp";
/// Transforms of texture coordinates.
pub(super) const TEXTURE_TRANSFORM: &str = "KHR_texture_transform";
/// Sets of materials of which one is chosen.
pub(super) const VARIANTS: &str = "KHR_materials_variants";

/// Extensions that are read, or that do not affect what is read. Materials whose extension is read
/// but not rendered have a note of their own.
const SUPPORTED: [&str; 23] = [
    "EXT_mesh_gpu_instancing",
    MESHOPT,
    WEBP,
    "KHR_draco_mesh_compression",
    "KHR_implicit_shapes",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    VARIANTS,
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    NODE_VISIBILITY,
    TEXTURE_TRANSFORM,
];

/// Refuses required unsupported extensions by name, unless they are among the `ignored`, and notes
/// other extensions that are not read.
pub(super) fn check(used: &[String], required: &[String], ignored: &[String], notes: &mut Notes) -> Read<()> {
    let unsupported = |name: &&String| !SUPPORTED.contains(&name.as_str());
    for (i, name) in required.iter().enumerate().filter(|(_, name)| unsupported(name)) {
        if !ignored.contains(name) {
            let problem = format!("{name} is not supported; `load.ignore_required` {name} reads the file without it");
            return fault(format!("extensionsRequired[{i}]"), problem);
        }
        notes.add(format!("extension {name} is required, but not read"));
    }
    let required: HashSet<&String> = required.iter().collect();
    for name in used.iter().filter(unsupported).filter(|name| !required.contains(name)) {
        notes.add(format!("extension {name} is not read"));
    }
    Ok(())
}

/// Notes extensions of materials that are not read, and that the file does not list as it should.
pub(super) fn note_unlisted(materials: &Value, used: &[String], notes: &mut Notes) {
    let extensions =
        materials.as_array().into_iter().flatten().filter_map(|material| material["extensions"].as_object());
    let names: BTreeSet<&String> = extensions.flat_map(|extensions| extensions.keys()).collect();
    for name in names.into_iter().filter(|name| !SUPPORTED.contains(&name.as_str()) && !used.contains(name)) {
        notes.add(format!("extension {name} is not read"));
    }
}

/// Whether a buffer has no data because all its views are compressed.
pub(super) fn is_fallback(buffer: &json::Buffer) -> bool {
    buffer.extensions.as_ref().is_some_and(|extensions| extensions.others.contains_key(MESHOPT))
}
