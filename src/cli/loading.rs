//! Options of reading a scene file.

use caustica::scene::LoadOptions;

/// Which of the file's scenes is read, and what is allowed to it.
#[derive(Debug, clap::Args)]
pub struct LoadingOptions {
    /// Scene of the file, by name or by index from 0 [default: the one that the file says]
    #[arg(id = "scene_of_file", long = "scene", value_name = "NAME|INDEX", help_heading = "Scene")]
    pub scene: Option<String>,

    /// Read buffers from anywhere, not only from the scene's folder and below it
    #[arg(long, help_heading = "Scene")]
    pub allow_outside: bool,

    /// Read the file although it requires this extension, which is not supported; may be given
    /// several times
    #[arg(long, value_name = "EXTENSION", help_heading = "Scene")]
    pub ignore_required: Vec<String>,
}

impl LoadingOptions {
    /// Converts the arguments to the library's options.
    pub fn options(&self) -> LoadOptions {
        LoadOptions {
            scene: self.scene.clone(),
            allow_outside: self.allow_outside,
            ignore_required: self.ignore_required.clone(),
        }
    }
}
