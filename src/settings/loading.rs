//! Options of reading a scene file.

use serde::Serialize;

use super::Range;

/// Options of reading a file into a [`Scene`](crate::scene::Scene).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadOptions {
    /// Scene of the file, by name or else by index from 0; `None` for its default scene.
    pub scene: Option<String>,
    /// Variant of the file's materials, by name (KHR_materials_variants); `None` for the materials
    /// that are there without one.
    pub variant: Option<String>,
    /// Longest side of images, texels: larger ones are halved. `None` for no limit.
    pub texture_size: Option<u32>,
    /// Roughness up to which metal and glass, but for [small glass](crate::Scene::small_glass),
    /// cast caustics, in [`Self::CAUSTIC_ROUGHNESS`]: light that rougher surfaces throw is gathered
    /// as that of diffuse ones.
    pub caustic_roughness: f32,
    /// Metals lose the light that their microfacets reflect more than once, as by the bare
    /// specification.
    pub single_scattering: bool,
    /// Allows buffers and images outside the folder of the file and its subfolders.
    pub allow_outside: bool,
    /// Names of unsupported extensions that are ignored although the file requires them.
    pub ignore_required: Vec<String>,
    /// A mesh is held once for all its copies from that number of triangles on, of all copies
    /// together. Held for themselves they take more memory, and rays are faster. Pictures differ by
    /// rounding.
    #[serde(skip)]
    pub share_from: usize,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            scene: None,
            variant: None,
            texture_size: None,
            caustic_roughness: 0.45,
            single_scattering: false,
            allow_outside: false,
            ignore_required: Vec::new(),
            share_from: 200_000,
        }
    }
}

impl LoadOptions {
    /// Range of `caustic_roughness`.
    pub const CAUSTIC_ROUGHNESS: Range<f32> = Range::closed(0.0, 1.0);
    /// Range of `texture_size`: the largest side of an image that is read.
    pub const TEXTURE_SIZE: Range<u32> = Range::closed(1, 16_384);
}
