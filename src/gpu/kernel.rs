//! A kernel, its bindings by name, and dispatches.

use std::sync::{Arc, OnceLock};

use super::{
    Buffer, Commands, Gpu, Table,
    shaders::{BindingKind, SHADERS, Shader, shader},
};

/// The bind group that says which part of a dispatch runs: owned here, filled for each dispatch
/// (`shaders/bindings/dispatch.wesl`).
const PART_GROUP: u32 = 3;

/// A compute kernel. Several that are equal share what was compiled.
#[derive(Clone, Debug)]
pub struct Kernel {
    program: Arc<Program>,
    /// Those of which its dispatches read, by the names of the shader's variables.
    tables: Vec<(&'static str, Table)>,
}

/// The buffers of one dispatch, one bind group per group that the kernel uses.
#[derive(Debug)]
pub struct Bindings(Vec<(u32, wgpu::BindGroup)>);

/// A kernel with its constants, compiled by whoever comes first: a thread of the [`Compiler`], or
/// one that needs it.
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
    /// The kernel `stem`, which other threads begin to compile; `overrides` sets its `override`
    /// constants. Names that only other kernels have are passed over, so that one list serves
    /// several kernels.
    ///
    /// # Panics
    /// If no kernel has that stem, or none a constant of one of the names.
    #[must_use]
    pub fn new(gpu: &Gpu, stem: &str, overrides: &[(&str, f64)]) -> Self {
        Self::of(gpu, shader(stem), overrides)
    }

    /// The same of an entry of another table: the probes of the tests.
    #[doc(hidden)]
    #[must_use]
    pub fn of(gpu: &Gpu, shader: &'static Shader, overrides: &[(&str, f64)]) -> Self {
        for (name, _) in overrides {
            let is_known = SHADERS.iter().chain([shader]).any(|s| s.overrides.contains(name));
            assert!(is_known, "{}: no kernel has an override {name}", shader.stem);
        }
        let of_device = [("LANES", f64::from(gpu.lanes))];
        let value = |name: &str| overrides.iter().chain(&of_device).find(|(n, _)| *n == name).map(|(_, value)| *value);
        let constants = shader.overrides.iter().filter_map(|name| Some((*name, value(name)?))).collect();
        let program = gpu.compiler.program(&gpu.device, &gpu.parts.layout, shader, constants);
        Self { program, tables: Vec::new() }
    }

    /// The kernel with tables for all its dispatches. Names that only other kernels use are passed
    /// over.
    #[must_use]
    pub fn with_tables(mut self, tables: &[(&'static str, &Table)]) -> Self {
        let binds = |name: &str| self.program.shader.bindings.iter().any(|b| b.name == name);
        let used = tables.iter().filter(|(name, _)| binds(name));
        self.tables = used.map(|(name, table)| (*name, (*table).clone())).collect();
        self
    }

    /// Binds buffers by the names of the shader's variables. Names that only other kernels use are
    /// passed over, so that one list serves several kernels.
    ///
    /// # Panics
    /// If a variable of the kernel has no buffer in the list, nor a table in [`Self::with_tables`],
    /// or no kernel has a variable of one of the names.
    #[must_use]
    pub fn bind(&self, gpu: &Gpu, buffers: &[(&str, &Buffer)]) -> Bindings {
        for (name, _) in buffers {
            let mut all = SHADERS.iter().chain([self.program.shader]);
            let is_known = all.any(|s| s.bindings.iter().any(|b| b.name == *name));
            assert!(is_known, "{}: no kernel binds {name}", self.program.shader.stem);
        }
        let find = |name: &str| {
            let buffer = buffers.iter().find(|(n, _)| *n == name).map(|(_, buffer)| buffer.as_entire_binding());
            let table = self.tables.iter().find(|(n, _)| *n == name).map(|(_, table)| table.view());
            let found = buffer.or(table.map(wgpu::BindingResource::TextureView));
            found.unwrap_or_else(|| panic!("{}: nothing is bound to {name}", self.program.shader.stem))
        };
        let group = |(g, layout): (usize, &Option<wgpu::BindGroupLayout>)| {
            let entries: Vec<_> = self
                .program
                .shader
                .bindings
                .iter()
                .filter(|b| b.group as usize == g)
                .map(|b| wgpu::BindGroupEntry { binding: b.index, resource: find(b.name) })
                .collect();
            let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.program.shader.stem),
                layout: layout.as_ref()?,
                entries: &entries,
            });
            Some((g as u32, bind_group))
        };
        Bindings(self.program.compiled().layouts.iter().enumerate().filter_map(group).collect())
    }

    /// Runs `invocations` invocations, in workgroups of [`crate::layout::WORKGROUP_SIZE`] folded to
    /// two dimensions where one is too short, and in several dispatches where one would take too
    /// long ([`super::Pacing`]); the kernel finds its index with `invocation_index` and must check
    /// it.
    pub fn dispatch(&self, commands: &mut Commands, bindings: &Bindings, invocations: u64) {
        self.record(commands, bindings, invocations, None);
    }

    /// Runs as many workgroups as the first three `u32` of `arguments` say, which the device has
    /// written: at most those of `most` invocations.
    pub fn dispatch_indirect(&self, commands: &mut Commands, bindings: &Bindings, arguments: &Buffer, most: u64) {
        self.record(commands, bindings, most, Some(arguments));
    }

    fn record(&self, commands: &mut Commands, bindings: &Bindings, most: u64, arguments: Option<&Buffer>) {
        let gpu = commands.gpu;
        let stem = self.program.shader.stem;
        let record = |pass: &mut wgpu::ComputePass<'_>, first: u64, invocations: u64| {
            pass.set_pipeline(&self.program.compiled().pipeline);
            for (group, bind_group) in &bindings.0 {
                pass.set_bind_group(*group, bind_group, &[]);
            }
            if self.program.can_be_cut() {
                pass.set_bind_group(PART_GROUP, &gpu.parts.from(gpu, first), &[]);
            }
            match arguments {
                Some(arguments) if invocations == most => pass.dispatch_workgroups_indirect(arguments, 0),
                // How many there are in truth is known to the device alone: those beyond the end
                // find nothing to do.
                _ => {
                    let (x, y) = fold(invocations.div_ceil(u64::from(crate::layout::WORKGROUP_SIZE)));
                    pass.dispatch_workgroups(x, y, 1);
                }
            }
        };
        match self.program.can_be_cut() {
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

const MAX_WORKGROUPS: u64 = crate::layout::MAX_WORKGROUPS as u64;

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
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let ty = match kind {
        BindingKind::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        BindingKind::ReadOnly => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        BindingKind::ReadWrite => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        BindingKind::Table => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
    };
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None }
}

#[cfg(test)]
mod tests {
    use std::{
        panic::{AssertUnwindSafe, catch_unwind},
        sync::Arc,
    };

    use super::{Kernel, fold};
    use crate::gpu::{Gpu, shaders::SHADERS};

    #[test]
    fn equal_kernels_are_compiled_once() {
        let gpu = Gpu::open(None).expect("tests need an adapter");
        let same = |a: &[(&str, f64)], b: &[(&str, f64)]| {
            Arc::ptr_eq(&Kernel::new(&gpu, "gather", a).program, &Kernel::new(&gpu, "gather", b).program)
        };
        assert!(same(&[("WINDOWS", 1.0)], &[("STACK_WORDS", 3.0), ("WINDOWS", 1.0)]));
        assert!(!same(&[("WINDOWS", 1.0)], &[("WINDOWS", 2.0)]), "control: constants matter");
        // Those that were asked for and never used hold up nobody.
        let all: Vec<_> = SHADERS.iter().map(|shader| Kernel::new(&gpu, shader.stem, &[])).collect();
        drop((gpu, all));
    }

    #[test]
    fn names_that_no_kernel_has_are_bugs() {
        let gpu = Gpu::open(None).expect("tests need an adapter");
        let buffer = gpu.storage::<u32>("anything", 1).expect("fits");
        let message = |what: &dyn Fn()| {
            let panic = catch_unwind(AssertUnwindSafe(what)).expect_err("it panics");
            panic.downcast::<String>().map_or_else(|_| String::new(), |text| *text)
        };
        let kernel = Kernel::new(&gpu, "merge_bounds", &[("WINDOWS", 1.0)]);
        let wrong_override = message(&|| drop(Kernel::new(&gpu, "merge_bounds", &[("WINDOW", 1.0)])));
        assert_eq!(wrong_override, "merge_bounds: no kernel has an override WINDOW");
        let name = kernel.program.shader.bindings[0].name;
        let wrong_binding = message(&|| drop(kernel.bind(&gpu, &[(name, &buffer), ("photon", &buffer)])));
        assert_eq!(wrong_binding, "merge_bounds: no kernel binds photon");
        // Control: those of other kernels are passed over.
        drop(kernel.bind(&gpu, &[(name, &buffer), ("points", &buffer)]));
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
