//! The table of kernels that `build.rs` composed from `shaders/`.

/// What a kernel may do with a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    Uniform,
    ReadOnly,
    ReadWrite,
}

/// One buffer that a kernel uses.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    pub group: u32,
    pub index: u32,
    /// Name of the variable in the shader.
    pub name: &'static str,
    pub kind: BindingKind,
}

/// One kernel.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// Stem of its file, also the name of its entry point.
    pub stem: &'static str,
    /// The composed text.
    pub wgsl: &'static str,
    /// Names of its `override` constants.
    pub overrides: &'static [&'static str],
    pub bindings: &'static [Binding],
}

/// All kernels, sorted by stem.
pub const SHADERS: &[Shader] = &include!(concat!(env!("OUT_DIR"), "/shader_table.rs"));

/// The kernel of that stem.
///
/// # Panics
/// If there is none: stems are written in the source, so that is a bug.
#[must_use]
pub fn shader(stem: &str) -> &'static Shader {
    SHADERS.iter().find(|s| s.stem == stem).unwrap_or_else(|| panic!("no kernel {stem} in shaders/"))
}
