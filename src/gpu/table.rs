//! Read-only arrays in textures: a kernel may bind few storage buffers, and 16 textures besides.

use std::sync::Arc;

use super::{Gpu, buffer::MemoryCount};
use crate::{
    error::{Error, Result},
    layout::TABLE_COLUMNS,
};

/// An array that kernels read with `textureLoad`: texel `i` lies in column `i % TABLE_COLUMNS` of
/// row `i / TABLE_COLUMNS`. Clones share the texture.
#[derive(Clone, Debug)]
pub struct Table(Arc<Texture>);

#[derive(Debug)]
struct Texture {
    view: wgpu::TextureView,
    bytes: u64,
    memory: Arc<MemoryCount>,
}

impl Drop for Texture {
    fn drop(&mut self) {
        self.memory.subtract(self.bytes);
    }
}

impl Table {
    /// A table of `data`, whose elements have 4 bytes, one texel each, or a multiple of 16, a texel
    /// for each 16.
    ///
    /// # Errors
    /// [`Error::Limit`] if a texture cannot hold it, [`Error::Memory`] if none is left.
    pub fn new<T: bytemuck::Pod>(gpu: &Gpu, label: &str, data: &[T]) -> Result<Self> {
        let (format, texel) = texel_of::<T>(label);
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let texels = (bytes.len() / texel) as u64;
        check(gpu, label, texels, gpu.max_table_texels(), "maxImageDimension2D")?;
        let columns = (texels as u32).clamp(1, TABLE_COLUMNS);
        let size = wgpu::Extent3d {
            width: columns,
            height: (texels as u32).div_ceil(columns).max(1),
            depth_or_array_layers: 1,
        };
        let allotted = u64::from(size.width) * u64::from(size.height) * texel as u64;
        let texture = gpu.allot(label, allotted, || create(gpu, label, size, format))?;
        write(gpu, &texture, 0, bytes, columns, texel as u32);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(Self(Arc::new(Texture { view, bytes: allotted, memory: Arc::clone(&gpu.memory) })))
    }

    /// A table as [`Self::new`] makes, with layers of `TABLE_COLUMNS` rows: it holds more than one
    /// texture.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn layered<T: bytemuck::Pod>(gpu: &Gpu, label: &str, data: &[T]) -> Result<Self> {
        let (format, texel) = texel_of::<T>(label);
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let texels = bytes.len() / texel;
        let layer = TABLE_COLUMNS as usize * TABLE_COLUMNS as usize;
        check(gpu, label, texels as u64, gpu.max_layered_texels(), "maxImageArrayLayers")?;
        let columns = if data.is_empty() { 1 } else { TABLE_COLUMNS };
        let size = wgpu::Extent3d {
            width: columns,
            height: (texels.div_ceil(columns as usize)).clamp(1, TABLE_COLUMNS as usize) as u32,
            depth_or_array_layers: texels.div_ceil(layer).max(1) as u32,
        };
        let all = u64::from(columns) * u64::from(size.height) * u64::from(size.depth_or_array_layers);
        let allotted = texel as u64 * all;
        let texture = gpu.allot(label, allotted, || create(gpu, label, size, format))?;
        for (z, bytes) in bytes.chunks(layer * texel).enumerate() {
            write(gpu, &texture, z as u32, bytes, columns, texel as u32);
        }
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        Ok(Self(Arc::new(Texture { view, bytes: allotted, memory: Arc::clone(&gpu.memory) })))
    }

    pub(super) fn view(&self) -> &wgpu::TextureView {
        &self.0.view
    }
}

/// Format of the texels of a table, and their size in bytes.
fn texel_of<T>(label: &str) -> (wgpu::TextureFormat, usize) {
    let (format, texel) = match size_of::<T>() {
        4 => (format_of(1), 4),
        _ => (format_of(4), 16),
    };
    assert_eq!(size_of::<T>() % texel, 0, "{label}: elements of a table fill texels");
    (format, texel)
}

/// Format of texels of so many words.
pub(super) fn format_of(words: u32) -> wgpu::TextureFormat {
    if words == 1 { wgpu::TextureFormat::R32Uint } else { wgpu::TextureFormat::Rgba32Uint }
}

fn check(gpu: &Gpu, label: &str, texels: u64, max_texels: u64, limit: &'static str) -> Result<()> {
    if texels <= max_texels {
        return Ok(());
    }
    Err(Error::Limit {
        what: label.to_string(),
        needed: texels,
        unit: "texels",
        limit,
        adapter: gpu.name.clone(),
        allowed: max_texels,
        advice: "ask for less or use another `device`".to_string(),
    })
}

fn create(gpu: &Gpu, label: &str, size: wgpu::Extent3d, format: wgpu::TextureFormat) -> wgpu::Texture {
    use wgpu::TextureUsages as U;
    let read = if gpu.reads_images { U::STORAGE_BINDING } else { U::TEXTURE_BINDING };
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: read | U::COPY_DST,
        view_formats: &[],
    })
}

/// Writes the full rows of a layer, then the rest of the data to the last row.
fn write(gpu: &Gpu, texture: &wgpu::Texture, z: u32, bytes: &[u8], columns: u32, texel: u32) {
    let row = (columns * texel) as usize;
    let (whole, rest) = bytes.split_at(bytes.len() / row * row);
    let rows = (whole.len() / row) as u32;
    for (data, y, width, height) in [(whole, 0, columns, rows), (rest, rows, rest.len() as u32 / texel, 1)] {
        if data.is_empty() {
            continue;
        }
        let target = wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x: 0, y, z }, ..texture.as_image_copy() };
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * texel), rows_per_image: None };
        gpu.queue.write_texture(target, data, layout, wgpu::Extent3d { width, height, depth_or_array_layers: 1 });
    }
}
