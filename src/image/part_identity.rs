//! Parts that belong to one picture: those of equal scene, settings and version.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::exr::Attributes;

/// Attributes that parts of one picture may differ in, since they follow from where and what a part
/// is.
const OF_PART: [&str; 12] = [
    "scene",
    // The settings hold it too.
    "seed",
    "device",
    "driver",
    "passes",
    "blocks",
    "partFormat",
    "globalEmitted",
    "globalStored",
    "causticEmitted",
    "causticStored",
    "extraSamples",
];
/// Attributes that hold settings as JSON.
const OF_SETTINGS: [&str; 2] = ["settings", "loading"];

/// Differences between the pictures of two parts: scene, settings or version, one by one. Names of
/// settings stand in backquotes.
#[must_use]
pub fn differences(one: &Attributes, other: &Attributes) -> Vec<String> {
    let (one, other) = (identity(one), identity(other));
    let names: BTreeSet<&String> = one.keys().chain(other.keys()).collect();
    let differ = names.into_iter().filter(|name| one.get(*name) != other.get(*name));
    let value = |of: &BTreeMap<String, String>, name: &String| of.get(name).map_or("none", String::as_str).to_owned();
    differ.map(|name| format!("{name} is {}, not {}", value(&other, name), value(&one, name))).collect()
}

/// All that decides the pixels of a picture, by name.
fn identity(attributes: &Attributes) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    for (name, value) in attributes.iter().filter(|(name, _)| !OF_PART.contains(&name.as_str())) {
        let settings = serde_json::from_str::<Value>(value).ok().filter(|_| OF_SETTINGS.contains(&name.as_str()));
        match settings {
            Some(Value::Object(fields)) => {
                let section = if name == "loading" { "load." } else { "" };
                fields.iter().for_each(|(field, value)| flatten(&format!("{section}{field}"), value, &mut all));
            }
            _ => drop(all.insert(name.clone(), value.clone())),
        }
    }
    if let Some(alpha) = all.remove("alpha") {
        all.insert("`passes.alpha`".to_owned(), alpha);
    }
    // The part's pixels are those of its data window.
    all.retain(|name, _| !name.starts_with("`picture.crop"));
    all
}

/// Settings by path, in backquotes.
fn flatten(path: &str, value: &Value, all: &mut BTreeMap<String, String>) {
    match value {
        Value::Object(fields) => {
            fields.iter().for_each(|(field, value)| flatten(&format!("{path}.{field}"), value, all))
        }
        _ => drop(all.insert(format!("`{path}`"), value.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Crop, Settings};

    fn attributes(settings: &Settings, scene: &str) -> Attributes {
        let settings = serde_json::to_string(settings).unwrap();
        let all = [("settings", settings.as_str()), ("sceneHash", scene), ("device", scene), ("loading", "{\"a\":1}")];
        all.map(|(a, b)| (a.to_owned(), b.to_owned())).into()
    }

    #[test]
    fn scene_and_settings_are_told_by_name() {
        let settings = Settings::default();
        let one = attributes(&settings, "ab");
        assert_eq!(differences(&one, &one), [""; 0]);
        let other = settings.clone().with(|s| {
            s.picture.spp = 9;
            s.photons.seed = 3;
            s.picture.crop = Some(Crop { column: 0, row: 0, width: 1, height: 1 });
        });
        let told = differences(&one, &attributes(&other, "cd"));
        assert_eq!(told, ["`photons.seed` is 3, not 0", "`picture.spp` is 9, not 4", "sceneHash is cd, not ab"]);
        let mut lacking = one.clone();
        lacking.remove("sceneHash");
        assert_eq!(differences(&one, &lacking), ["sceneHash is none, not ab"]);
    }
}
