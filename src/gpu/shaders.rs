//! The table of kernels that `build.rs` composed from `shaders/`.

/// Access of a kernel to a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// A uniform buffer.
    Uniform,
    /// A storage buffer that the kernel reads.
    ReadOnly,
    /// A storage buffer that the kernel writes.
    ReadWrite,
    /// A texture that is read texel by texel, of one word each or of four.
    Table { layered: bool, words: u32 },
}

/// One buffer or table that a kernel uses.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Bind group.
    pub group: u32,
    /// Number within the group.
    pub index: u32,
    /// Name of the variable in the shader.
    pub name: &'static str,
    /// Access of the kernel to it.
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
    /// Its bindings.
    pub bindings: &'static [Binding],
    /// Invocations of a workgroup.
    pub workgroup_size: u32,
}

/// All kernels, sorted by stem.
pub const SHADERS: &[Shader] = &include!(concat!(env!("OUT_DIR"), "/shader_table.rs"));

impl Shader {
    /// Number of storage buffers that the kernel binds.
    #[must_use]
    pub fn storage_buffers(&self) -> u32 {
        self.bound(|kind| matches!(kind, BindingKind::ReadOnly | BindingKind::ReadWrite))
    }

    /// Number of uniform buffers that the kernel binds.
    #[must_use]
    pub fn uniform_buffers(&self) -> u32 {
        self.bound(|kind| kind == BindingKind::Uniform)
    }

    /// Number of tables that the kernel binds.
    #[must_use]
    pub fn tables(&self) -> u32 {
        self.bound(|kind| matches!(kind, BindingKind::Table { .. }))
    }

    fn bound(&self, is: impl Fn(BindingKind) -> bool) -> u32 {
        self.bindings.iter().filter(|b| is(b.kind)).count() as u32
    }
}

/// Needs of the kernels beyond the usual limits of devices: of each kind the most that one of them
/// uses.
#[must_use]
pub fn needs() -> wgpu::Limits {
    let most = |of: &dyn Fn(&Shader) -> u32| SHADERS.iter().map(of).max().unwrap_or(0);
    let groups = |s: &Shader| s.bindings.iter().map(|b| b.group + 1).max().unwrap_or(0);
    wgpu::Limits {
        max_bind_groups: most(&groups),
        max_storage_buffers_per_shader_stage: most(&Shader::storage_buffers),
        max_uniform_buffers_per_shader_stage: most(&Shader::uniform_buffers),
        max_sampled_textures_per_shader_stage: most(&Shader::tables),
        max_compute_invocations_per_workgroup: most(&|s| s.workgroup_size),
        ..wgpu::Limits::default()
    }
}

/// The kernel of that stem.
///
/// # Panics
/// If there is none: stems are written in the source, so that is a bug.
#[must_use]
pub fn shader(stem: &str) -> &'static Shader {
    SHADERS.iter().find(|s| s.stem == stem).unwrap_or_else(|| panic!("no kernel {stem} in shaders/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Needs of kernels that exceed what nearly every device has, a line each.
    fn not_portable(shaders: &[Shader]) -> Vec<String> {
        let line = |s: &Shader| {
            let counts = [
                ("storage buffers", s.storage_buffers(), 10),
                ("uniform buffers", s.uniform_buffers(), 4),
                ("textures", s.tables(), 16),
                ("invocations", s.workgroup_size, 256),
            ];
            let over = counts.into_iter().filter(|(_, has, most)| has > most);
            over.map(|(what, has, most)| format!("{}: {has} {what}, at most {most}", s.stem)).collect::<Vec<_>>()
        };
        shaders.iter().flat_map(line).collect()
    }

    #[test]
    fn kernels_are_portable() {
        assert_eq!(not_portable(SHADERS), Vec::<String>::new());
        // Control: the kernel that binds most, with more of each kind.
        let most = *shader("trace_camera");
        let more = |kind, count| {
            let extra = (0..count).map(|index| Binding { group: 2, index: 100 + index, name: "more", kind });
            let bindings: Vec<_> = most.bindings.iter().copied().chain(extra).collect();
            not_portable(&[Shader { bindings: bindings.leak(), ..most }])
        };
        assert_eq!(more(BindingKind::ReadOnly, 1), ["trace_camera: 11 storage buffers, at most 10"]);
        assert_eq!(more(BindingKind::Uniform, 2), ["trace_camera: 5 uniform buffers, at most 4"]);
        assert_eq!(more(BindingKind::Table { layered: false, words: 4 }, 6), ["trace_camera: 17 textures, at most 16"]);
        let large = Shader { workgroup_size: 512, ..most };
        assert_eq!(not_portable(&[large]), ["trace_camera: 512 invocations, at most 256"]);
    }
}
