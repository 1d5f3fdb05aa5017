//! Options of reading a scene file.

use crate::settings::Range;

/// Options of reading a file into a [`Scene`](super::Scene).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Scene of the file, by name or else by index from 0; `None` for its default scene.
    pub scene: Option<String>,
    /// Variant of the file's materials, by name (KHR_materials_variants); `None` for the materials
    /// that are there without one.
    pub variant: Option<String>,
    /// Longest side of images, texels: larger ones are halved. `None` for no limit.
    pub texture_size: Option<u32>,
    /// Allows buffers and images outside the folder of the file and its subfolders.
    pub allow_outside: bool,
    /// Names of unsupported extensions that are ignored although the file requires them.
    pub ignore_required: Vec<String>,
}

impl LoadOptions {
    /// Range of `texture_size`: the largest side of an image that is read.
    pub const TEXTURE_SIZE: Range<u32> = Range::closed(1, 16_384);
}
