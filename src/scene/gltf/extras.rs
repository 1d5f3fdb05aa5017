//! Data in files for this renderer alone: `extras.caustica` of materials, lights and nodes.

use gltf::json::Extras;
use serde_json::Value;

use super::fault::{Read, fault};

/// A value of `extras.caustica`.
fn value(extras: &Extras, name: &str) -> Option<Value> {
    let extras: Value = serde_json::from_str(extras.as_ref()?.get()).ok()?;
    extras.get("caustica")?.get(name).cloned()
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
