//! `caustica info`.

use std::path::Path;

use caustica::{
    Result,
    scene::{LoadOptions, Scene},
};

use super::say::print;

/// Prints the contents of a scene and how they are read, as text or as JSON.
pub fn info(path: &Path, options: &LoadOptions, json: bool) -> Result<()> {
    let mut scene = Scene::load_with(path, options)?;
    scene.add_default_light();
    let info = scene.describe();
    let text = if json { serde_json::to_string_pretty(&info).expect("plain values") } else { info.to_string() };
    print(&format!("{}\n", text.trim_end()));
    Ok(())
}
