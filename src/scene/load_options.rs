//! Options of reading a scene file.

/// Options of reading a file into a [`Scene`](super::Scene).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Scene of the file, by name or else by index from 0; `None` for its default scene.
    pub scene: Option<String>,
    /// Allows buffers outside the folder of the file and its subfolders.
    pub allow_outside: bool,
    /// Names of unsupported extensions that are ignored although the file requires them.
    pub ignore_required: Vec<String>,
}
