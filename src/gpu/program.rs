//! A kernel's program: shader and constants, compiled once.

use std::{borrow::Cow, sync::OnceLock};

use super::{
    chunks::CHUNK_GROUP,
    hide_uniforms::hide_uniforms,
    read_images::{format_of, read_images},
    shaders::{BindingKind, Shader},
    specialize::specialized,
};

/// A kernel with its constants, compiled by the first thread that comes: one of the compiler's, or
/// one that needs it.
#[derive(Debug)]
pub(super) struct Program {
    pub shader: &'static Shader,
    pub constants: Vec<(&'static str, f64)>,
    rewrites: Rewrites,
    device: wgpu::Device,
    chunk_layout: wgpu::BindGroupLayout,
    compiled: OnceLock<Compiled>,
}

/// How kernels are rewritten to suit a driver.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rewrites {
    /// Uniforms are hidden, see [`super::hide_uniforms`].
    pub hides_uniforms: bool,
    /// Tables are images, see [`super::read_images`].
    pub reads_images: bool,
}

#[derive(Debug)]
pub(super) struct Compiled {
    pub pipeline: wgpu::ComputePipeline,
    /// Layouts of the groups that the caller fills.
    pub layouts: Vec<Option<wgpu::BindGroupLayout>>,
}

impl Program {
    pub fn new(
        device: &wgpu::Device,
        chunk_layout: &wgpu::BindGroupLayout,
        shader: &'static Shader,
        constants: Vec<(&'static str, f64)>,
        rewrites: Rewrites,
    ) -> Self {
        let (device, chunk_layout) = (device.clone(), chunk_layout.clone());
        Self { shader, constants, rewrites, device, chunk_layout, compiled: OnceLock::new() }
    }

    /// Compiles the kernel, or waits for the thread that does.
    pub fn compiled(&self) -> &Compiled {
        self.compiled.get_or_init(|| {
            let (device, shader) = (&self.device, self.shader);
            let mut specialized = specialized(shader.wgsl, &self.constants).expect("a text that build.rs composed");
            if self.rewrites.hides_uniforms {
                hide_uniforms(&mut specialized);
            }
            if self.rewrites.reads_images {
                read_images(&mut specialized, shader);
            }
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(shader.stem),
                source: wgpu::ShaderSource::Naga(Cow::Owned(specialized)),
            });
            let layouts: Vec<_> = (0..CHUNK_GROUP).map(|g| self.group_layout(g)).collect();
            let chunk = self.can_be_cut().then_some(&self.chunk_layout);
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(shader.stem),
                bind_group_layouts: &layouts.iter().map(Option::as_ref).chain([chunk]).collect::<Vec<_>>(),
                immediate_size: 0,
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(shader.stem),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(shader.stem),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &[],
                    zero_initialize_workgroup_memory: false,
                },
                cache: None,
            });
            Compiled { pipeline, layouts }
        })
    }

    /// Layout of one group of the kernel; `None` if it does not use the group.
    fn group_layout(&self, group: u32) -> Option<wgpu::BindGroupLayout> {
        let used = self.shader.bindings.iter().filter(|b| b.group == group);
        let entries: Vec<_> = used.map(|b| layout_entry(b.index, b.kind, self.rewrites.reads_images)).collect();
        let label = Some(self.shader.stem);
        let describe = |entries| wgpu::BindGroupLayoutDescriptor { label, entries };
        (!entries.is_empty()).then(|| self.device.create_bind_group_layout(&describe(&entries)))
    }

    /// Whether the kernel finds its index with `invocation_index`, so that its dispatches can be
    /// cut into chunks.
    pub fn can_be_cut(&self) -> bool {
        self.shader.bindings.iter().any(|b| b.group == CHUNK_GROUP)
    }
}

fn layout_entry(binding: u32, kind: BindingKind, reads_images: bool) -> wgpu::BindGroupLayoutEntry {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let ty = match kind {
        BindingKind::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        BindingKind::ReadOnly => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        BindingKind::ReadWrite => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        BindingKind::Table { layered, words } => {
            let view_dimension =
                if layered { wgpu::TextureViewDimension::D2Array } else { wgpu::TextureViewDimension::D2 };
            let access = wgpu::StorageTextureAccess::ReadOnly;
            let sample_type = wgpu::TextureSampleType::Uint;
            match reads_images {
                true => wgpu::BindingType::StorageTexture { access, format: format_of(words), view_dimension },
                false => wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false },
            }
        }
    };
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None }
}
