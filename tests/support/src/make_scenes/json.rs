//! Readable JSON: one property a line, arrays of numbers on one line.

use serde_json::Value;

/// Text of a value whose own line is indented by `depth` steps.
pub fn text(value: &Value, depth: usize) -> String {
    let (inner, outer) = ("  ".repeat(depth + 1), "  ".repeat(depth));
    match value {
        Value::Object(map) if !map.is_empty() => {
            let mut keys: Vec<&String> = map.keys().collect();
            // Members that describe the file come first, those that list bytes last.
            keys.sort_by_key(|key| (rank(key), key.as_str()));
            let lines =
                keys.iter().map(|key| format!("{inner}{}: {}", Value::from(key.as_str()), text(&map[*key], depth + 1)));
            format!("{{\n{}\n{outer}}}", lines.collect::<Vec<_>>().join(",\n"))
        }
        Value::Array(items) if items.iter().any(|item| item.is_object() || item.is_array()) => {
            let lines = items.iter().map(|item| format!("{inner}{}", text(item, depth + 1)));
            format!("[\n{}\n{outer}]", lines.collect::<Vec<_>>().join(",\n"))
        }
        Value::Array(items) => {
            let items = items.iter().map(Value::to_string);
            format!("[{}]", items.collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

fn rank(key: &str) -> usize {
    const FIRST: [&str; 12] = [
        "asset",
        "extensionsUsed",
        "extensionsRequired",
        "name",
        "type",
        "scene",
        "scenes",
        "nodes",
        "cameras",
        "extensions",
        "materials",
        "meshes",
    ];
    const LAST: [&str; 3] = ["accessors", "bufferViews", "buffers"];
    let first = FIRST.iter().position(|first| *first == key);
    first.or_else(|| Some(100 + LAST.iter().position(|last| *last == key)?)).unwrap_or(50)
}
