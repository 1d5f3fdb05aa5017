//! Parts that belong to one picture: those of equal scene, settings and version.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::exr::{Attributes, CRYPTOMATTE};

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

/// Characters of a hash that a message has: enough to tell scenes apart.
const SHORT_HASH: usize = 12;

/// Differences between the pictures of two parts: scene, settings or version, one by one. Names of
/// settings stand in backquotes.
#[must_use]
pub fn differences(one: &Attributes, other: &Attributes) -> Vec<String> {
    let (ours, theirs) = (identity(one), identity(other));
    let names: BTreeSet<&String> = ours.keys().chain(theirs.keys()).collect();
    let differ = names.into_iter().filter(|name| ours.get(*name) != theirs.get(*name));
    let told = |name: &String| {
        format!("{name} is {}, not {}", words(name, theirs.get(name), other), words(name, ours.get(name), one))
    };
    differ.map(told).collect()
}

/// A value in words; a hash with the name of the scene.
fn words(name: &str, value: Option<&String>, attributes: &Attributes) -> String {
    match value.map(String::as_str) {
        None | Some("null") => "none".to_owned(),
        Some(hash) if name == "sceneHash" => {
            let short: String = hash.chars().take(SHORT_HASH).collect();
            attributes.get("scene").map_or(short.clone(), |scene| format!("{short} ({scene})"))
        }
        Some(size) if name == "`picture.size`" => size.trim_matches(['[', ']']).replace(',', "x"),
        Some(value) => value.to_owned(),
    }
}

/// All that decides the pixels of a picture, by name.
fn identity(attributes: &Attributes) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    // Mattes follow from the scene and the settings.
    let is_of_picture = |name: &str| !OF_PART.contains(&name) && !name.starts_with(CRYPTOMATTE);
    for (name, value) in attributes.iter().filter(|(name, _)| is_of_picture(name)) {
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

    #[test]
    fn scenes_sizes_and_what_is_none_are_told_in_words() {
        let settings = Settings::default();
        let named = |settings: &Settings, hash: &str, scene: &str, matte: &str| {
            let mut all = attributes(settings, &hash.repeat(32));
            all.insert("scene".to_owned(), scene.to_owned());
            all.insert(format!("{CRYPTOMATTE}12ab/manifest"), matte.to_owned());
            all
        };
        let one = named(&settings.clone().with(|s| s.picture.size = Some((8, 6))), "ab", "a.glb", "{}");
        assert_eq!(differences(&one, &named(&settings, "ab", "b.glb", "{}")), ["`picture.size` is none, not 8x6"]);
        let other = named(&settings.with(|s| s.picture.size = Some((8, 6))), "cd", "b.glb", "{\"a\":1}");
        assert_eq!(differences(&one, &other), ["sceneHash is cdcdcdcdcdcd (b.glb), not abababababab (a.glb)"]);
    }
}
