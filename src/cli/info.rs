//! `caustica info`.

use std::path::Path;

use caustica::{
    Result,
    scene::{LoadOptions, Scene},
};

use super::say::print;

/// Prints the contents of a scene and how they are read.
pub fn info(path: &Path, options: &LoadOptions) -> Result<()> {
    let mut scene = Scene::load_with(path, options)?;
    scene.add_default_light();
    let text = scene.describe().to_string();
    print(&format!("{}\n", text.trim_end()));
    Ok(())
}
