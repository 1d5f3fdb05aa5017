//! Accessors: every offset, stride, count and index is checked against the bytes that are there before any is used.

use gltf::json;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;

use super::buffers::Buffers;
use super::fault::{Read, fault};

/// Elements that an accessor without a bufferView (all zeros) may have.
const MAX_ZEROS: u64 = 1 << 24;

/// A parsed file with its bytes.
pub(super) struct Document<'a> {
    pub(super) root: &'a json::Root,
    pub(super) buffers: Buffers<'a>,
}

/// Shape of an accessor's elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Format {
    pub(super) kind: Type,
    pub(super) component: ComponentType,
    pub(super) normalized: bool,
}

impl Format {
    fn of(accessor: &Accessor, place: &str) -> Read<Self> {
        let (Checked::Valid(kind), Checked::Valid(component)) = (accessor.type_, accessor.component_type) else {
            return fault(place, "type or componentType is not one of glTF's");
        };
        Ok(Self { kind, component: component.0, normalized: accessor.normalized })
    }

    /// Bytes of one element; matrices are read by nobody, so their padding does not matter.
    fn size(self) -> usize {
        self.component.size() * self.kind.multiplicity()
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let normalized = if self.normalized { "normalized " } else { "" };
        write!(f, "{:?} of {normalized}{:?}", self.kind, self.component)
    }
}

/// Elements that lie within their buffer.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |i| &bytes[i * stride..i * stride + size])
    }
}

impl<'a> Document<'a> {
    /// Number of elements and their format.
    pub(super) fn shape(&self, index: usize, place: &str) -> Read<(usize, Format)> {
        let accessor = self.accessor(index, place)?;
        Ok((accessor.count.0 as usize, Format::of(accessor, place)?))
    }

    /// All elements, through `element`; sparse ones replaced.
    pub(super) fn decode<T: Copy + Default>(&self, index: usize, element: impl Fn(&[u8]) -> T) -> Read<Vec<T>> {
        let place = format!("accessors[{index}]");
        let accessor = self.accessor(index, &place)?;
        let size = Format::of(accessor, &place)?.size();
        let count = accessor.count.0;
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                self.elements(view.value(), offset, count, size, &place)?.iter().map(&element).collect()
            }
            None if count <= MAX_ZEROS => vec![T::default(); count as usize],
            None => return fault(place, format!("{count} elements without a bufferView")),
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace_sparse(sparse, size, &mut values, element, &place)?;
        }
        Ok(values)
    }

    /// Scalars of any unsigned type.
    pub(super) fn decode_unsigned(&self, index: usize, component: ComponentType) -> Read<Vec<u32>> {
        self.decode(index, |bytes| unsigned(bytes, component))
    }

    /// Checks all accessors, also those that nothing uses: ranges, references, and that floats are finite.
    pub(super) fn check(&self) -> Read<()> {
        for (i, accessor) in self.root.accessors.iter().enumerate() {
            let place = format!("accessors[{i}]");
            let float =
                matches!(accessor.component_type, Checked::Valid(component) if component.0 == ComponentType::F32);
            let is_finite = |bytes: &[u8]| !float || bytes.chunks_exact(4).all(|chunk| float32(chunk).is_finite());
            if let Some(at) = self.decode(i, |bytes| !is_finite(bytes))?.iter().position(|bad| *bad) {
                return fault(place, format!("element {at} is not finite"));
            }
        }
        Ok(())
    }

    fn accessor(&self, index: usize, place: &str) -> Read<&'a Accessor> {
        let known = self.root.accessors.len();
        self.root.accessors.get(index).map_or_else(|| fault(place, format!("accessor {index} of {known}")), Ok)
    }

    /// `count` elements of `size` bytes at `offset` of a bufferView.
    fn elements(&self, view: usize, offset: u64, count: u64, size: usize, place: &str) -> Read<Elements<'_>> {
        let bytes = self.view(view, place)?;
        let stride = self.root.buffer_views[view].byte_stride.map_or(size, |stride| stride.0);
        if stride < size {
            return fault(
                format!("bufferViews[{view}].byteStride"),
                format!("{stride} is less than the {size} bytes of an element of {place}"),
            );
        }
        let span = |count: u64| (count - 1).checked_mul(stride as u64)?.checked_add(size as u64);
        let end = if count == 0 { Some(offset) } else { span(count).and_then(|span| span.checked_add(offset)) };
        match end {
            Some(end) if end <= bytes.len() as u64 => {
                Ok(Elements { bytes: &bytes[offset as usize..], stride, size, count: count as usize })
            }
            _ => fault(
                place,
                format!(
                    "{count} elements at byte {offset} run past bufferViews[{view}], which has {} bytes",
                    bytes.len()
                ),
            ),
        }
    }

    /// Bytes of a bufferView.
    fn view(&self, index: usize, place: &str) -> Read<&[u8]> {
        let Some(view) = self.root.buffer_views.get(index) else {
            return fault(format!("{place}.bufferView"), format!("{index} of {}", self.root.buffer_views.len()));
        };
        let place = format!("bufferViews[{index}]");
        let buffer = view.buffer.value();
        let Some(data) = self.buffers.get(buffer) else {
            return fault(format!("{place}.buffer"), format!("{buffer} of {}", self.buffers.len()));
        };
        let Some(data) = data else {
            return fault(format!("buffers[{buffer}]"), "has no uri, and there is no binary chunk for it");
        };
        let (offset, length) = (view.byte_offset.map_or(0, |offset| offset.0), view.byte_length.0);
        let size = self.root.buffers[buffer].byte_length.0.min(data.len() as u64);
        match offset.checked_add(length) {
            Some(end) if end <= size => Ok(&data[offset as usize..end as usize]),
            _ => fault(place, format!("{length} bytes at {offset} run past buffers[{buffer}], which has {size}")),
        }
    }

    /// Overwrites the elements that a sparse accessor lists.
    fn replace_sparse<T>(
        &self,
        sparse: &json::accessor::sparse::Sparse,
        size: usize,
        values: &mut [T],
        element: impl Fn(&[u8]) -> T,
        place: &str,
    ) -> Read<()> {
        let at = format!("{place}.sparse.indices");
        let Checked::Valid(component) = sparse.indices.component_type else {
            return fault(at, "componentType is not an unsigned integer");
        };
        let (list, new) = (&sparse.indices, &sparse.values);
        let count = sparse.count.0;
        let list = self.elements(list.buffer_view.value(), list.byte_offset.0, count, component.0.size(), &at)?;
        let new =
            self.elements(new.buffer_view.value(), new.byte_offset.0, count, size, &format!("{place}.sparse.values"))?;
        let known = values.len();
        for (index, bytes) in list.iter().map(|bytes| unsigned(bytes, component.0)).zip(new.iter()) {
            match values.get_mut(index as usize) {
                Some(value) => *value = element(bytes),
                None => return fault(at, format!("index {index} of {known} elements")),
            }
        }
        Ok(())
    }
}

fn unsigned(bytes: &[u8], component: ComponentType) -> u32 {
    match component {
        ComponentType::U8 => u32::from(bytes[0]),
        ComponentType::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

fn float32(bytes: &[u8]) -> f32 {
    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// A number of any type; normalised integers are spread over 0..1 or -1..1 (glTF 2.0, 3.11).
pub(super) fn number(bytes: &[u8], format: Format) -> f32 {
    let (value, max) = match format.component {
        ComponentType::F32 => return float32(bytes),
        ComponentType::I8 => (f32::from(bytes[0] as i8), 127.0),
        ComponentType::U8 => (f32::from(bytes[0]), 255.0),
        ComponentType::I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        ComponentType::U16 => (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        ComponentType::U32 => (unsigned(bytes, format.component) as f32, u32::MAX as f32),
    };
    if format.normalized { (value / max).max(-1.0) } else { value }
}
