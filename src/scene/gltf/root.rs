//! JSON part of a file, read element by element, so that errors name the element.

use gltf::json;
use serde_json::{Map, Value};

use super::extensions;
use super::fault::{Notes, Read, fault};
use super::strict_json::{elements, member, objects, parse, typed};

/// Maximum number of materials in a file.
const MAX_MATERIALS: usize = 1 << 16;

/// Parses the JSON text. Unsupported versions and required extensions are refused by name.
/// Animations are left out. All references of materials to textures are checked.
pub(super) fn read(text: &[u8], ignored: &[String], notes: &mut Notes) -> Read<json::Root> {
    let Value::Object(mut file) = parse(text)? else { return fault("JSON", "is not an object") };
    let asset = read_asset(&mut file)?;
    let used = member::<Vec<String>>(&mut file, "extensionsUsed")?.unwrap_or_default();
    let required = member::<Vec<String>>(&mut file, "extensionsRequired")?.unwrap_or_default();
    extensions::check(&used, &required, ignored, notes)?;
    let images = elements(&mut file, "images")?;
    let (textures, samplers): (Vec<json::Texture>, _) =
        (elements(&mut file, "textures")?, elements(&mut file, "samplers")?);
    if let Some(materials) = file.get("materials") {
        check_textures(materials, textures.len() as u64, false, &|| "materials".to_owned())?;
        extensions::note_unlisted(materials, &used, notes);
    }
    if file.get("meshes").is_some_and(morphs_more) {
        notes.add("morph targets of texture coordinates and colours are not read: these stay as in the mesh");
    }
    if !objects(&mut file, "animations")?.is_empty() {
        notes.add("animations are not read: nodes stand as in the file");
    }
    Ok(json::Root {
        asset,
        scene: member(&mut file, "scene")?,
        scenes: read_scenes(&mut file)?,
        nodes: elements(&mut file, "nodes")?,
        meshes: elements(&mut file, "meshes")?,
        skins: elements(&mut file, "skins")?,
        cameras: elements(&mut file, "cameras")?,
        materials: read_materials(&mut file)?,
        accessors: elements(&mut file, "accessors")?,
        buffer_views: elements(&mut file, "bufferViews")?,
        buffers: elements(&mut file, "buffers")?,
        images,
        textures,
        samplers,
        extensions: member(&mut file, "extensions")?,
        extensions_used: used,
        extensions_required: required,
        ..json::Root::default()
    })
}

/// Checks the indices of textures in all materials, used or not, extensions included: those of
/// objects that are called a texture.
fn check_textures(value: &Value, known: u64, is_texture: bool, place: &dyn Fn() -> String) -> Read<()> {
    match value {
        Value::Array(list) => (list.iter().enumerate())
            .try_for_each(|(i, value)| check_textures(value, known, false, &|| format!("{}[{i}]", place()))),
        Value::Object(object) => {
            let index = object.get("index").and_then(Value::as_u64).filter(|index| is_texture && *index >= known);
            if let Some(index) = index {
                return fault(format!("{}.index", place()), format!("{index} of {known}"));
            }
            (object.iter()).try_for_each(|(name, value)| {
                check_textures(value, known, name.ends_with("Texture"), &|| format!("{}.{name}", place()))
            })
        }
        _ => Ok(()),
    }
}

/// Whether morph targets of a list of meshes displace what the crate does not know.
fn morphs_more(meshes: &Value) -> bool {
    fn list(value: Option<&Value>) -> &[Value] {
        value.and_then(Value::as_array).map_or(&[], Vec::as_slice)
    }
    let primitives = list(Some(meshes)).iter().flat_map(|mesh| list(mesh.get("primitives")));
    let mut targets = primitives.flat_map(|primitive| list(primitive.get("targets"))).filter_map(Value::as_object);
    targets.any(|target| target.keys().any(|name| name.starts_with("TEXCOORD_") || name.starts_with("COLOR_")))
}

/// Version of a file, checked before the rest, whose structure depends on it.
fn read_asset(file: &mut Map<String, Value>) -> Read<json::Asset> {
    let Some(asset) = member::<json::Asset>(file, "asset")? else { return fault("asset", "is missing") };
    if asset.version.split('.').next() != Some("2") {
        return fault("asset.version", format!("glTF {} is not read, only 2.0", asset.version));
    }
    match &asset.min_version {
        Some(version) if version != "2.0" => {
            fault("asset.minVersion", format!("the file needs glTF {version}, only 2.0 is read"))
        }
        _ => Ok(asset),
    }
}

/// Reads the scenes. The `nodes` list is optional in glTF but required by the crate.
fn read_scenes(file: &mut Map<String, Value>) -> Read<Vec<json::Scene>> {
    let mut scenes = Vec::new();
    for (i, mut scene) in objects(file, "scenes")?.into_iter().enumerate() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
        scenes.push(typed(&scene, format_args!("scenes[{i}]"))?);
    }
    Ok(scenes)
}

/// Reads the materials. Their number is bounded, as each takes much more memory than text.
fn read_materials(file: &mut Map<String, Value>) -> Read<Vec<json::Material>> {
    match file.get("materials").and_then(Value::as_array).map_or(0, Vec::len) {
        count if count > MAX_MATERIALS => {
            fault("materials", format!("{count} of them, at most {MAX_MATERIALS} are read"))
        }
        _ => elements(file, "materials"),
    }
}
