//! What may be chosen when a file is read.

/// How a file is read into a [`Scene`](super::Scene).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Which of the file's scenes, by name or else by number from 0; the file's default one if none is asked for.
    pub scene: Option<String>,
    /// Buffers may lie anywhere, not only in the folder of the file and below it.
    pub allow_outside: bool,
    /// Extensions that are not supported and that are read past although the file requires them, by name.
    pub ignore_required: Vec<String>,
}
