//! Bind group that says with which invocation a chunk of its dispatch begins
//! (`shaders/bindings/dispatch.wesl`).

/// The group of these bind groups. [`super::Kernel`] fills it for each dispatch.
pub(super) const CHUNK_GROUP: u32 = 3;

/// Bind groups of the chunks of dispatches.
#[derive(Debug)]
pub(super) struct Chunks {
    device: wgpu::Device,
    pub layout: wgpu::BindGroupLayout,
    /// The bind group of all chunks that begin with invocation 0.
    first: wgpu::BindGroup,
}

impl Chunks {
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("chunk of a dispatch"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        Self { device: device.clone(), first: bind_group(device, &layout, 0), layout }
    }

    /// The bind group of a chunk that begins with that invocation.
    pub fn starting_at(&self, invocation: u64) -> wgpu::BindGroup {
        if invocation == 0 { self.first.clone() } else { bind_group(&self.device, &self.layout, invocation) }
    }
}

fn bind_group(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, first: u64) -> wgpu::BindGroup {
    let first = u32::try_from(first).expect("invocations are counted in 32 bits");
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("first invocation"),
        size: 16,
        usage: wgpu::BufferUsages::UNIFORM,
        mapped_at_creation: true,
    });
    // Fails only where the device is lost, which the next wait reports.
    if let Ok(mut bytes) = buffer.slice(..).get_mapped_range_mut() {
        bytes.slice(..4).copy_from_slice(&first.to_le_bytes());
    }
    buffer.unmap();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("chunk of a dispatch"),
        layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
    })
}
