//! A compiled kernel, its bindings by name, and dispatches.

use super::{
    Buffer, Gpu,
    shaders::{BindingKind, Shader, shader},
};

/// A compiled compute kernel.
#[derive(Debug)]
pub struct Kernel {
    shader: &'static Shader,
    pipeline: wgpu::ComputePipeline,
    layouts: Vec<Option<wgpu::BindGroupLayout>>,
}

/// The buffers of one dispatch, one bind group per group that the kernel uses.
#[derive(Debug)]
pub struct Bindings(Vec<(u32, wgpu::BindGroup)>);

impl Kernel {
    /// Compiles the kernel `stem`; `overrides` sets its `override` constants. Names that this kernel does not have are
    /// passed over, so that one list serves several kernels.
    ///
    /// # Panics
    /// If no kernel has that stem.
    #[must_use]
    pub fn new(gpu: &Gpu, stem: &str, overrides: &[(&str, f64)]) -> Self {
        let shader = shader(stem);
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(stem),
            source: wgpu::ShaderSource::Wgsl(shader.wgsl.into()),
        });
        let constants: Vec<_> = overrides.iter().copied().filter(|(name, _)| shader.overrides.contains(name)).collect();
        let groups = shader.bindings.iter().map(|b| b.group + 1).max().unwrap_or(0);
        let layouts: Vec<_> = (0..groups).map(|g| group_layout(gpu, shader, g)).collect();
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(stem),
            bind_group_layouts: &layouts.iter().map(Option::as_ref).collect::<Vec<_>>(),
            immediate_size: 0,
        });
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(stem),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(stem),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        });
        Self { shader, pipeline, layouts }
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
                .unwrap_or_else(|| panic!("{}: no buffer is bound to {name}", self.shader.stem))
                .1
        };
        let group = |(g, layout): (usize, &Option<wgpu::BindGroupLayout>)| {
            let entries: Vec<_> = self
                .shader
                .bindings
                .iter()
                .filter(|b| b.group as usize == g)
                .map(|b| wgpu::BindGroupEntry { binding: b.index, resource: find(b.name).as_entire_binding() })
                .collect();
            let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.shader.stem),
                layout: layout.as_ref()?,
                entries: &entries,
            });
            Some((g as u32, bind_group))
        };
        Bindings(self.layouts.iter().enumerate().filter_map(group).collect())
    }

    /// Runs `invocations` invocations, in workgroups of [`crate::layout::WORKGROUP_SIZE`] folded to two dimensions
    /// where one is too short; the kernel finds its index with `invocation_index` and must check it.
    pub fn dispatch(&self, encoder: &mut wgpu::CommandEncoder, bindings: &Bindings, invocations: u64) {
        let (x, y) = fold(invocations.div_ceil(u64::from(crate::layout::WORKGROUP_SIZE)));
        if x > 0 {
            self.pass(encoder, bindings).dispatch_workgroups(x, y, 1);
        }
    }

    /// Runs as many workgroups as the three `u32` at `offset` of `arguments` say.
    pub fn dispatch_indirect(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &Bindings,
        arguments: &Buffer,
        offset: u64,
    ) {
        self.pass(encoder, bindings).dispatch_workgroups_indirect(arguments, offset);
    }

    fn pass<'e>(&self, encoder: &'e mut wgpu::CommandEncoder, bindings: &Bindings) -> wgpu::ComputePass<'e> {
        let mut pass = encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(self.shader.stem), timestamp_writes: None });
        pass.set_pipeline(&self.pipeline);
        for (group, bind_group) in &bindings.0 {
            pass.set_bind_group(*group, bind_group, &[]);
        }
        pass
    }
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
fn group_layout(gpu: &Gpu, shader: &Shader, group: u32) -> Option<wgpu::BindGroupLayout> {
    let entries: Vec<_> = shader
        .bindings
        .iter()
        .filter(|b| b.group == group)
        .map(|b| wgpu::BindGroupLayoutEntry {
            binding: b.index,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: match b.kind {
                    BindingKind::Uniform => wgpu::BufferBindingType::Uniform,
                    BindingKind::ReadOnly => wgpu::BufferBindingType::Storage { read_only: true },
                    BindingKind::ReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect();
    let describe = |entries| {
        gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(shader.stem), entries })
    };
    (!entries.is_empty()).then(|| describe(&entries))
}

#[cfg(test)]
mod tests {
    use super::fold;

    #[test]
    fn dispatches_fold_to_two_dimensions() {
        assert_eq!(fold(0), (0, 1));
        assert_eq!(fold(1), (1, 1));
        assert_eq!(fold(65_535), (65_535, 1));
        let (x, y) = fold(65_536);
        assert!(u64::from(x) * u64::from(y) >= 65_536 && x <= 65_535 && y == 2);
    }
}
