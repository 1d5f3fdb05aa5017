//! A kernel, its bindings by name, and dispatches.

use std::sync::{Arc, OnceLock};

use super::{
    Buffer, Commands, Gpu,
    shaders::{BindingKind, Shader, shader},
};

/// The bind group that says which part of a dispatch runs: owned here, filled for each dispatch (`shaders/bindings/dispatch.wesl`).
const PART_GROUP: u32 = 3;

/// A compute kernel. Several that are equal share what was compiled.
#[derive(Clone, Debug)]
pub struct Kernel(Arc<Program>);

/// The buffers of one dispatch, one bind group per group that the kernel uses.
#[derive(Debug)]
pub struct Bindings(Vec<(u32, wgpu::BindGroup)>);

/// A kernel with its constants, compiled by whoever comes first: a thread of the [`Compiler`], or one that needs it.
#[derive(Debug)]
pub(super) struct Program {
    shader: &'static Shader,
    constants: Vec<(&'static str, f64)>,
    device: wgpu::Device,
    part_layout: wgpu::BindGroupLayout,
    compiled: OnceLock<Compiled>,
}

#[derive(Debug)]
struct Compiled {
    pipeline: wgpu::ComputePipeline,
    /// Of the groups that the caller fills.
    layouts: Vec<Option<wgpu::BindGroupLayout>>,
}

impl Program {
    pub fn new(
        device: &wgpu::Device,
        part_layout: &wgpu::BindGroupLayout,
        shader: &'static Shader,
        constants: Vec<(&'static str, f64)>,
    ) -> Self {
        let (device, part_layout) = (device.clone(), part_layout.clone());
        Self { shader, constants, device, part_layout, compiled: OnceLock::new() }
    }

    /// Compiles the kernel, or waits for who does.
    pub fn compile(&self) {
        self.compiled();
    }

    fn compiled(&self) -> &Compiled {
        self.compiled.get_or_init(|| {
            let (device, shader) = (&self.device, self.shader);
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(shader.stem),
                source: wgpu::ShaderSource::Wgsl(shader.wgsl.into()),
            });
            let layouts: Vec<_> = (0..PART_GROUP).map(|g| group_layout(device, shader, g)).collect();
            let part = self.can_be_cut().then_some(&self.part_layout);
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(shader.stem),
                bind_group_layouts: &layouts.iter().map(Option::as_ref).chain([part]).collect::<Vec<_>>(),
                immediate_size: 0,
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(shader.stem),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(shader.stem),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &self.constants,
                    zero_initialize_workgroup_memory: false,
                },
                cache: None,
            });
            Compiled { pipeline, layouts }
        })
    }

    /// The kernel finds its index with `invocation_index`, so that its dispatches can be cut.
    fn can_be_cut(&self) -> bool {
        self.shader.bindings.iter().any(|b| b.group == PART_GROUP)
    }
}

impl Kernel {
    /// The kernel `stem`, which other threads begin to compile; `overrides` sets its `override` constants. Names that this
    /// kernel does not have are passed over, so that one list serves several kernels.
    ///
    /// # Panics
    /// If no kernel has that stem.
    #[must_use]
    pub fn new(gpu: &Gpu, stem: &str, overrides: &[(&str, f64)]) -> Self {
        Self::of(gpu, shader(stem), overrides)
    }

    /// The same of an entry of another table: the probes of the tests.
    #[doc(hidden)]
    #[must_use]
    pub fn of(gpu: &Gpu, shader: &'static Shader, overrides: &[(&str, f64)]) -> Self {
        let value = |name: &str| overrides.iter().find(|(n, _)| *n == name).map(|(_, value)| *value);
        let constants = shader.overrides.iter().filter_map(|name| Some((*name, value(name)?))).collect();
        Self(gpu.compiler.program(&gpu.device, &gpu.parts.layout, shader, constants))
    }

    /// Binds buffers by the names of the shader's variables. Names that this kernel does not use are passed over, so
    /// that one list serves several kernels.
    ///
    /// # Panics
    /// If a variable of the kernel has no buffer in the list.
    #[must_use]
    pub fn bind(&self, gpu: &Gpu, buffers: &[(&str, &Buffer)]) -> Bindings {
        let find = |name: &str| {
            buffers
                .iter()
                .find(|(n, _)| *n == name)
                .unwrap_or_else(|| panic!("{}: no buffer is bound to {name}", self.0.shader.stem))
                .1
        };
        let group = |(g, layout): (usize, &Option<wgpu::BindGroupLayout>)| {
            let entries: Vec<_> = self
                .0
                .shader
                .bindings
                .iter()
                .filter(|b| b.group as usize == g)
                .map(|b| wgpu::BindGroupEntry { binding: b.index, resource: find(b.name).as_entire_binding() })
                .collect();
            let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.0.shader.stem),
                layout: layout.as_ref()?,
                entries: &entries,
            });
            Some((g as u32, bind_group))
        };
        Bindings(self.0.compiled().layouts.iter().enumerate().filter_map(group).collect())
    }

    /// Runs `invocations` invocations, in workgroups of [`crate::layout::WORKGROUP_SIZE`] folded to two dimensions
    /// where one is too short, and in several dispatches where one would take too long ([`super::Pacing`]); the kernel finds its
    /// index with `invocation_index` and must check it.
    pub fn dispatch(&self, commands: &mut Commands, bindings: &Bindings, invocations: u64) {
        self.record(commands, bindings, invocations, None);
    }

    /// Runs as many workgroups as the first three `u32` of `arguments` say, which the device has written: at most those of
    /// `most` invocations.
    pub fn dispatch_indirect(&self, commands: &mut Commands, bindings: &Bindings, arguments: &Buffer, most: u64) {
        self.record(commands, bindings, most, Some(arguments));
    }

    fn record(&self, commands: &mut Commands, bindings: &Bindings, most: u64, arguments: Option<&Buffer>) {
        let gpu = commands.gpu;
        let stem = self.0.shader.stem;
        let record = |pass: &mut wgpu::ComputePass<'_>, first: u64, invocations: u64| {
            pass.set_pipeline(&self.0.compiled().pipeline);
            for (group, bind_group) in &bindings.0 {
                pass.set_bind_group(*group, bind_group, &[]);
            }
            if self.0.can_be_cut() {
                pass.set_bind_group(PART_GROUP, &gpu.parts.from(gpu, first), &[]);
            }
            match arguments {
                Some(arguments) if invocations == most => pass.dispatch_workgroups_indirect(arguments, 0),
                // How many there are in truth is known to the device alone: those beyond the end find nothing to do.
                _ => {
                    let (x, y) = fold(invocations.div_ceil(u64::from(crate::layout::WORKGROUP_SIZE)));
                    pass.dispatch_workgroups(x, y, 1);
                }
            }
        };
        match self.0.can_be_cut() {
            true => commands.dispatch(stem, most, record),
            false => {
                assert_eq!(most, 1, "{stem}: a kernel without invocation_index is a single invocation");
                commands.dispatch(stem, 1, record);
            }
        }
    }
}

/// Says where a part of a dispatch begins.
#[derive(Debug)]
pub(super) struct Parts {
    pub(super) layout: wgpu::BindGroupLayout,
    /// That of all dispatches that are not cut.
    whole: wgpu::BindGroup,
}

impl Parts {
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("part of a dispatch"),
            entries: &[layout_entry(0, BindingKind::Uniform)],
        });
        Self { whole: starting_at(device, &layout, 0), layout }
    }

    /// The bind group of a part.
    fn from(&self, gpu: &Gpu, first: u64) -> wgpu::BindGroup {
        if first == 0 { self.whole.clone() } else { starting_at(&gpu.device, &self.layout, first) }
    }
}

fn starting_at(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, first: u64) -> wgpu::BindGroup {
    let first = u32::try_from(first).expect("invocations are counted in 32 bits");
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("first invocation"),
        size: 16,
        usage: wgpu::BufferUsages::UNIFORM,
        mapped_at_creation: true,
    });
    // Fails only where the device is lost, which is told elsewhere.
    if let Ok(mut bytes) = buffer.slice(..).get_mapped_range_mut() {
        bytes.slice(..4).copy_from_slice(&first.to_le_bytes());
    }
    buffer.unmap();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("part of a dispatch"),
        layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
    })
}

/// Workgroups per dimension that every adapter can dispatch.
const MAX_WORKGROUPS: u64 = 65_535;

/// Folds a count of workgroups to two dimensions; all rows but the last are full, none is needless.
fn fold(workgroups: u64) -> (u32, u32) {
    let rows = workgroups.div_ceil(MAX_WORKGROUPS).max(1);
    let columns = workgroups.div_ceil(rows);
    assert!(rows <= MAX_WORKGROUPS, "{workgroups} workgroups are more than one dispatch can hold");
    (columns as u32, rows as u32)
}

/// Layout of one group of a kernel; `None` if the kernel does not use the group.
fn group_layout(device: &wgpu::Device, shader: &Shader, group: u32) -> Option<wgpu::BindGroupLayout> {
    let entries: Vec<_> =
        shader.bindings.iter().filter(|b| b.group == group).map(|b| layout_entry(b.index, b.kind)).collect();
    let describe = |entries| {
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(shader.stem), entries })
    };
    (!entries.is_empty()).then(|| describe(&entries))
}

fn layout_entry(binding: u32, kind: BindingKind) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: match kind {
                BindingKind::Uniform => wgpu::BufferBindingType::Uniform,
                BindingKind::ReadOnly => wgpu::BufferBindingType::Storage { read_only: true },
                BindingKind::ReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
            },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::{Kernel, fold};
    use crate::gpu::{Gpu, shaders::SHADERS};

    #[test]
    fn equal_kernels_are_compiled_once() {
        let gpu = Gpu::open(None).expect("tests need an adapter");
        let same = |a: &[(&str, f64)], b: &[(&str, f64)]| {
            Arc::ptr_eq(&Kernel::new(&gpu, "gather", a).0, &Kernel::new(&gpu, "gather", b).0)
        };
        assert!(same(&[("WINDOWS", 1.0)], &[("NOT_OF_THIS_KERNEL", 3.0), ("WINDOWS", 1.0)]));
        assert!(!same(&[("WINDOWS", 1.0)], &[("WINDOWS", 2.0)]), "control: constants matter");
        // Those that were asked for and never used hold up nobody.
        let all: Vec<_> = SHADERS.iter().map(|shader| Kernel::new(&gpu, shader.stem, &[])).collect();
        drop((gpu, all));
    }

    #[test]
    fn dispatches_fold_to_two_dimensions() {
        assert_eq!(fold(0), (0, 1));
        assert_eq!(fold(1), (1, 1));
        assert_eq!(fold(65_535), (65_535, 1));
        let (x, y) = fold(65_536);
        assert!(u64::from(x) * u64::from(y) >= 65_536 && x <= 65_535 && y == 2);
    }
}
