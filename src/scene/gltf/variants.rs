//! Variants: sets of materials of which one is chosen (KHR_materials_variants).

use gltf::json;
use json::mesh::Primitive;
use serde::Deserialize;
use serde_json::Value;

use super::extensions::VARIANTS;
use super::fault::{Read, fault};
use super::strict_json::typed;
use crate::{Error, Result};

#[derive(Deserialize)]
struct Named {
    name: String,
}

#[derive(Deserialize)]
struct Mapping {
    material: usize,
    variants: Vec<usize>,
}

/// Names of the variants of a file.
pub(super) fn names(root: &json::Root) -> Read<Vec<String>> {
    let extension = root.extensions.as_ref().and_then(|extensions| extensions.others.get(VARIANTS));
    let Some(extension) = extension else { return Ok(Vec::new()) };
    let place = format!("extensions.{VARIANTS}.variants");
    let variants = extension.get("variants").unwrap_or(&Value::Null);
    let variants = typed::<Vec<Named>>(variants, place)?;
    Ok(variants.into_iter().map(|variant| variant.name).collect())
}

/// Index of the variant of that name.
pub(super) fn choose(names: &[String], wanted: Option<&str>, file_name: &str) -> Result<Option<usize>> {
    let Some(wanted) = wanted else { return Ok(None) };
    let found = names.iter().position(|name| name == wanted);
    found.map(Some).ok_or_else(|| {
        let list: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
        let list = if list.is_empty() { "no variants".to_owned() } else { format!("the variants {}", list.join(", ")) };
        Error::Setting { name: "load.variant", value: wanted.to_owned(), problem: format!("{file_name} has {list}") }
    })
}

/// Sets the materials of all primitives to those of the chosen variant, where it has one, and
/// checks all mappings.
pub(super) fn apply(root: &mut json::Root, variants: usize, chosen: Option<usize>) -> Read<()> {
    let materials = root.materials.len();
    for (i, mesh) in root.meshes.iter_mut().enumerate() {
        for (j, primitive) in mesh.primitives.iter_mut().enumerate() {
            let place = || format!("meshes[{i}].primitives[{j}].extensions.{VARIANTS}.mappings");
            for (k, mapping) in mappings(primitive, &place)?.into_iter().enumerate() {
                if mapping.material >= materials {
                    return fault(format!("{}[{k}].material", place()), format!("{} of {materials}", mapping.material));
                }
                if let Some(variant) = mapping.variants.iter().find(|variant| **variant >= variants) {
                    return fault(format!("{}[{k}].variants", place()), format!("{variant} of {variants}"));
                }
                if chosen.is_some_and(|chosen| mapping.variants.contains(&chosen)) {
                    primitive.material = Some(json::Index::new(mapping.material as u32));
                }
            }
        }
    }
    Ok(())
}

fn mappings(primitive: &Primitive, place: &dyn Fn() -> String) -> Read<Vec<Mapping>> {
    let extension = primitive.extensions.as_ref().and_then(|extensions| extensions.others.get(VARIANTS));
    let Some(extension) = extension else { return Ok(Vec::new()) };
    let mappings = extension.get("mappings").unwrap_or(&Value::Null);
    typed(mappings, place())
}
