//! Data in files for this renderer alone: `extras.caustica` of materials, lights and nodes.

use gltf::json::{self, Extras};
use serde_json::Value;

use super::fault::{Notes, Read, fault};

/// `extras.caustica`.
fn own(extras: &Extras) -> Option<Value> {
    let mut extras: Value = serde_json::from_str(extras.as_ref()?.get()).ok()?;
    extras.get_mut("caustica").map(Value::take)
}

/// A value of `extras.caustica`.
fn value(extras: &Extras, name: &str) -> Option<Value> {
    own(extras)?.get(name).cloned()
}

/// Notes what of `extras.caustica` is not read, as misspelt keys are not.
pub(super) fn note_unread(root: &json::Root, notes: &mut Notes) {
    let mut note = |kind: &'static str, (i, name): (usize, &Option<String>), extras: &Extras, read: &[&str]| {
        let Some(own) = own(extras) else { return };
        let name = name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("{kind} {i}"));
        let Value::Object(values) = own else {
            return notes.about(kind, &name, ": its extras.caustica is not an object, and not read");
        };
        for key in values.keys().filter(|key| !read.contains(&key.as_str())) {
            notes.about(kind, &name, &format!(": {key:?} in its extras.caustica is not read"));
        }
    };
    for (i, material) in root.materials.iter().enumerate() {
        note("material", (i, &material.name), &material.extras, &["group", "priority"]);
    }
    for (i, node) in root.nodes.iter().enumerate() {
        note("node", (i, &node.name), &node.extras, &["group"]);
    }
    for (i, mesh) in root.meshes.iter().enumerate() {
        note("mesh", (i, &mesh.name), &mesh.extras, &[]);
    }
    let lights = root.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    for (i, light) in lights.iter().flat_map(|extension| &extension.lights).enumerate() {
        note("light", (i, &light.name), &light.extras, &["group"]);
    }
}

/// Rank among overlapping solids: `extras.caustica.priority`, an integer; 0 without one.
pub(super) fn priority(extras: &Extras, place: &str) -> Read<i32> {
    let Some(priority) = value(extras, "priority") else { return Ok(0) };
    let integer = priority.as_i64().and_then(|priority| i32::try_from(priority).ok());
    integer.map_or_else(
        || fault(format!("{place}.extras.caustica.priority"), format!("{priority} is not an integer of 32 bits")),
        Ok,
    )
}

/// Group of a light: `extras.caustica.group`, a text; `None` without one.
pub(super) fn group(extras: &Extras, place: &str) -> Read<Option<String>> {
    match value(extras, "group") {
        None => Ok(None),
        Some(Value::String(group)) if !group.is_empty() => Ok(Some(group)),
        Some(other) => fault(format!("{place}.extras.caustica.group"), format!("{other} is no name")),
    }
}
