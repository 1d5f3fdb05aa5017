//! Read-only arrays in textures: a kernel may bind few storage buffers, and 16 textures besides.

use std::sync::Arc;

use super::{Buffer, Gpu, buffer::MemoryCount, read_images::format_of};
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

    /// A table of what lies in buffers, one after the other, in texels of 16 bytes.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn copied(gpu: &Gpu, label: &str, parts: &[Buffer]) -> Result<Self> {
        let texels = |part: &Buffer| part.size() / COPIED_TEXEL;
        let all = parts.iter().map(texels).sum();
        check(gpu, label, all, gpu.max_table_texels(), "maxImageDimension2D")?;
        let height = (all as u32).div_ceil(TABLE_COLUMNS).max(1);
        let size = wgpu::Extent3d { width: TABLE_COLUMNS, height, depth_or_array_layers: 1 };
        let allotted = u64::from(TABLE_COLUMNS) * u64::from(height) * COPIED_TEXEL;
        let texture = gpu.allot(label, allotted, || create(gpu, label, size, format_of(4)))?;
        let mut encoder = gpu.encoder();
        let mut at = 0;
        for part in parts {
            let end = at + texels(part) as u32;
            let mut from = at;
            while from < end {
                let (origin, run) = run_of_texels(from, end);
                let offset = u64::from(from - at) * COPIED_TEXEL;
                let source = wgpu::TexelCopyBufferInfo { buffer: &part.inner, layout: layout_at(offset) };
                let target = wgpu::TexelCopyTextureInfo { origin, ..texture.as_image_copy() };
                encoder.copy_buffer_to_texture(source, target, run);
                from += run.width * run.height;
            }
            at = end;
        }
        gpu.submit(encoder);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(Self(Arc::new(Texture { view, bytes: allotted, memory: Arc::clone(&gpu.memory) })))
    }

    /// Reads the first `count` elements of a [`Self::copied`] table, of a multiple of 16 bytes
    /// each.
    ///
    /// # Errors
    /// As [`Gpu::read`].
    pub fn read<T: bytemuck::Pod>(&self, gpu: &Gpu, count: u64) -> Result<Vec<T>> {
        let end = (count * size_of::<T>() as u64 / COPIED_TEXEL) as u32;
        let piece = gpu.storage::<[u32; 4]>("texels to read back", u64::from(end.min(READ_TEXELS)))?;
        let mut data: Vec<T> = Vec::with_capacity(count as usize);
        for first in (0..end).step_by(READ_TEXELS as usize) {
            let last = end.min(first + READ_TEXELS);
            let mut encoder = gpu.encoder();
            let mut from = first;
            while from < last {
                let (origin, run) = run_of_texels(from, last);
                let offset = u64::from(from - first) * COPIED_TEXEL;
                let source = wgpu::TexelCopyTextureInfo { origin, ..self.0.view.texture().as_image_copy() };
                let target = wgpu::TexelCopyBufferInfo { buffer: &piece.inner, layout: layout_at(offset) };
                encoder.copy_texture_to_buffer(source, target, run);
                from += run.width * run.height;
            }
            gpu.submit(encoder);
            let bytes = u64::from(last - first) * COPIED_TEXEL;
            data.extend(gpu.read::<T>(&piece, 0, bytes / size_of::<T>() as u64)?);
        }
        Ok(data)
    }

    /// Bytes of device memory that it takes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.0.bytes
    }

    pub(super) fn view(&self) -> &wgpu::TextureView {
        &self.0.view
    }
}

/// Bytes of a texel of a [`Table::copied`] table.
const COPIED_TEXEL: u64 = 16;
/// Texels that are read back at once: whole rows.
const READ_TEXELS: u32 = 512 * TABLE_COLUMNS;

/// Where texel `from` lies, and the texels up to `end` that follow it as a rectangle: whole rows,
/// or a part of one.
fn run_of_texels(from: u32, end: u32) -> (wgpu::Origin3d, wgpu::Extent3d) {
    let (x, y) = (from % TABLE_COLUMNS, from / TABLE_COLUMNS);
    let rows = if x == 0 { (end - from) / TABLE_COLUMNS } else { 0 };
    let (width, height) = if rows > 0 { (TABLE_COLUMNS, rows) } else { ((end - from).min(TABLE_COLUMNS - x), 1) };
    (wgpu::Origin3d { x, y, z: 0 }, wgpu::Extent3d { width, height, depth_or_array_layers: 1 })
}

fn layout_at(offset: u64) -> wgpu::TexelCopyBufferLayout {
    let bytes_per_row = Some(TABLE_COLUMNS * COPIED_TEXEL as u32);
    wgpu::TexelCopyBufferLayout { offset, bytes_per_row, rows_per_image: None }
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
        usage: read | U::COPY_DST | U::COPY_SRC,
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
