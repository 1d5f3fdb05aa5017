//! Options of reading a scene file.

use caustica::scene::LoadOptions;

use super::values::{caustic_roughness, whole};

/// Which of the file's scenes is read, and what is allowed to it.
#[derive(Debug, clap::Args)]
pub struct LoadingOptions {
    /// Scene of the file, by name or by index from 0 [default: the one that the file says]
    #[arg(id = "scene_of_file", long = "scene", value_name = "NAME|INDEX", help_heading = "Scene")]
    pub scene: Option<String>,

    /// Variant of the file's materials, by name [default: none]
    #[arg(long, value_name = "NAME", help_heading = "Scene")]
    pub variant: Option<String>,

    /// Longest side of a texture's image: larger images are halved until they fit
    #[arg(long, value_name = "N", value_parser = whole(LoadOptions::TEXTURE_SIZE), help_heading = "Scene")]
    pub texture_size: Option<u32>,

    /// Roughness up to which metal and glass cast caustics; the light that rougher ones throw is
    /// gathered as that of diffuse surfaces
    #[arg(long, value_name = "R", default_value_t = LoadOptions::default().caustic_roughness, value_parser = caustic_roughness, help_heading = "Scene")]
    pub caustic_roughness: f32,

    /// Metals lose the light that they reflect more than once, as by the bare specification of glTF
    #[arg(long, help_heading = "Scene")]
    pub single_scattering: bool,

    /// Read buffers and images from anywhere, not only from the scene's folder and below it
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
            variant: self.variant.clone(),
            texture_size: self.texture_size,
            caustic_roughness: self.caustic_roughness,
            single_scattering: self.single_scattering,
            allow_outside: self.allow_outside,
            share_from: LoadOptions::default().share_from,
            ignore_required: self.ignore_required.clone(),
        }
    }
}
