//! Accessors: every offset, stride, count and index is checked against the available bytes before
//! use.

use std::collections::HashMap;

use glam::{DMat4, Vec3};
use gltf::json;
use gltf::json::accessor::{Accessor, ComponentType};
use gltf::json::validation::Checked;

use super::buffers::{Buffers, slice};
use super::fault::{Read, fault};
use super::format::{Format, MAX_ZEROS, Unpacked, float32, number, unsigned};
use super::meshopt;

/// A parsed file with its bytes.
pub(super) struct Document<'a> {
    pub(super) root: &'a json::Root,
    buffers: Buffers<'a>,
    /// Decoded contents of compressed bufferViews.
    views: Vec<Option<Vec<u8>>>,
    /// Decoded contents of compressed primitives, by accessor.
    unpacked: HashMap<usize, Unpacked>,
}

/// Elements that lie within their buffer.
#[derive(Clone, Copy, Debug)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn get(&self, i: usize) -> &'a [u8] {
        &self.bytes[i * self.stride..][..self.size]
    }

    /// All bytes, if the elements are contiguous.
    fn tight(&self) -> Option<&'a [u8]> {
        (self.stride == self.size).then(|| &self.bytes[..self.count * self.size])
    }

    /// First element that holds a non-finite float.
    fn first_not_finite(&self) -> Option<usize> {
        // Without a branch per float, the check runs at memory speed; a file may have many
        // accessors over the same bytes.
        let largest = |bytes: &[u8]| bytes.chunks_exact(4).fold(0, |max, x| float32(x).abs().to_bits().max(max));
        if self.tight().is_some_and(|bytes| largest(bytes) <= f32::MAX.to_bits()) {
            return None;
        }
        (0..self.count).find(|i| self.get(*i).chunks_exact(4).any(|chunk| !float32(chunk).is_finite()))
    }
}

/// Sparse elements, which replace others.
#[derive(Clone, Copy, Debug)]
struct Sparse<'a> {
    /// Ascending, once [`Document::check`] has seen them.
    indices: Elements<'a>,
    component: ComponentType,
    values: Elements<'a>,
}

impl<'a> Sparse<'a> {
    fn index(&self, i: usize) -> u32 {
        unsigned(self.indices.get(i), self.component)
    }

    /// Element that replaces element `i`.
    fn get(&self, i: usize) -> Option<&'a [u8]> {
        let (mut low, mut high) = (0, self.indices.count);
        while low < high {
            let middle = (low + high) / 2;
            match (self.index(middle) as usize).cmp(&i) {
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
                std::cmp::Ordering::Equal => return Some(self.values.get(middle)),
            }
        }
        None
    }
}

/// Elements of one accessor, each decoded on access. Needs [`Document::check`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Column<'a> {
    pub(super) format: Format,
    pub(super) count: usize,
    /// Stored elements; zeros without them.
    dense: Option<Elements<'a>>,
    sparse: Option<Sparse<'a>>,
}

impl Column<'_> {
    /// Component `c` of element `i` as a number; floats are finite.
    pub(super) fn number(&self, i: usize, c: usize) -> f32 {
        let at = c * self.format.component.size();
        self.bytes(i).map_or(0.0, |bytes| number(&bytes[at..], self.format))
    }

    /// Three numbers of element `i`.
    pub(super) fn vector(&self, i: usize) -> Vec3 {
        let size = self.format.component.size();
        self.bytes(i).map_or(Vec3::ZERO, |bytes| {
            if self.format.component == ComponentType::F32 {
                return Vec3::new(float32(bytes), float32(&bytes[4..]), float32(&bytes[8..]));
            }
            let [x, y, z] = [0, 1, 2].map(|c| number(&bytes[c * size..], self.format));
            Vec3::new(x, y, z)
        })
    }

    /// Component `c` of element `i` as an unsigned integer.
    pub(super) fn unsigned(&self, i: usize, c: usize) -> u32 {
        let at = c * self.format.component.size();
        self.bytes(i).map_or(0, |bytes| unsigned(&bytes[at..], self.format.component))
    }

    /// Maximum of the first components as unsigned integers; `None` without elements.
    pub(super) fn max_unsigned(&self) -> Option<u32> {
        let component = self.format.component;
        match (self.dense, self.sparse) {
            (Some(dense), None) if dense.tight().is_some() => {
                let bytes = dense.tight().unwrap_or_default();
                match component {
                    ComponentType::U8 => bytes.iter().map(|byte| u32::from(*byte)).max(),
                    ComponentType::U16 => bytes.chunks_exact(2).map(|x| unsigned(x, ComponentType::U16)).max(),
                    _ => bytes.chunks_exact(4).map(|x| unsigned(x, ComponentType::U32)).max(),
                }
            }
            (Some(_), _) => (0..self.count).map(|i| self.unsigned(i, 0)).max(),
            (None, Some(sparse)) => {
                let replaced = (0..sparse.values.count).map(|i| unsigned(sparse.values.get(i), component));
                replaced.chain((self.count > 0).then_some(0)).max()
            }
            (None, None) => (self.count > 0).then_some(0),
        }
    }

    /// Whether the accessor stores no data, so that all elements are zero.
    pub(super) fn is_zero(&self) -> bool {
        self.dense.is_none() && self.sparse.is_none()
    }

    /// Element `i` as a matrix of 4 x 4 floats.
    pub(super) fn matrix(&self, i: usize) -> DMat4 {
        DMat4::from_cols_array(&std::array::from_fn(|c| f64::from(self.number(i, c))))
    }

    fn bytes(&self, i: usize) -> Option<&[u8]> {
        let replaced = self.sparse.as_ref().and_then(|sparse| sparse.get(i));
        replaced.or_else(|| self.dense.as_ref().map(|dense| dense.get(i)))
    }
}

impl<'a> Document<'a> {
    /// Decodes the compressed bufferViews. [`Self::with_primitives`] decodes compressed primitives.
    pub(super) fn new(root: &'a json::Root, buffers: Buffers<'a>) -> Read<Self> {
        let views = meshopt::decode(root, &buffers)?;
        Ok(Self { root, buffers, views, unpacked: HashMap::new() })
    }

    /// Sets the elements of the accessors of compressed primitives to those that `decode` returns.
    pub(super) fn with_primitives(mut self, decode: fn(&Self) -> Read<HashMap<usize, Unpacked>>) -> Read<Self> {
        self.unpacked = decode(&self)?;
        Ok(self)
    }

    /// Checks all views and accessors, including unused ones: ranges, references, and that floats
    /// are finite.
    pub(super) fn check(&self) -> Read<()> {
        for i in 0..self.root.buffer_views.len() {
            self.view(i, "")?;
        }
        for i in 0..self.root.accessors.len() {
            let place = format!("accessors[{i}]");
            let column = self.column(i, &place)?;
            if let Some(sparse) = column.sparse {
                check_sparse(&sparse, column.count, &place)?;
            }
            if column.format.component != ComponentType::F32 {
                continue;
            }
            let values =
                column.sparse.and_then(|sparse| Some(sparse.index(sparse.values.first_not_finite()?) as usize));
            if let Some(at) = column.dense.and_then(|dense| dense.first_not_finite()).or(values) {
                return fault(place, format!("element {at} is not finite"));
            }
        }
        Ok(())
    }

    /// Bytes of all buffers.
    pub(super) fn held(&self) -> u64 {
        self.buffers.iter().flatten().map(|bytes| bytes.len() as u64).sum()
    }

    /// Number of elements and their format.
    pub(super) fn shape(&self, index: usize, place: &str) -> Read<(usize, Format)> {
        let accessor = self.accessor(index, place)?;
        let format = match self.unpacked.get(&index) {
            Some(unpacked) => unpacked.format,
            None => Format::of(accessor, place)?,
        };
        Ok((accessor.count.0 as usize, format))
    }

    /// The elements of an accessor that `place` names.
    pub(super) fn column(&self, index: usize, place: &str) -> Read<Column<'_>> {
        let accessor = self.accessor(index, place)?;
        let place = format!("accessors[{index}]");
        let format = Format::of(accessor, &place)?;
        let count = accessor.count.0;
        if let Some(Unpacked { bytes, format }) = self.unpacked.get(&index) {
            let size = format.size();
            let dense = Some(Elements { bytes, stride: size, size, count: count as usize });
            return Ok(Column { format: *format, count: count as usize, dense, sparse: None });
        }
        let dense = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                Some(self.elements(view.value(), offset, count, format.size(), &place)?)
            }
            None if count <= MAX_ZEROS => None,
            None => {
                let problem = format!("{count} elements without a bufferView, at most {MAX_ZEROS} are read");
                return fault(place, problem);
            }
        };
        let sparse = accessor.sparse.as_ref().map(|sparse| self.sparse(sparse, format, &place)).transpose()?;
        Ok(Column { format, count: count as usize, dense, sparse })
    }

    fn sparse(&self, sparse: &json::accessor::sparse::Sparse, format: Format, place: &str) -> Read<Sparse<'_>> {
        let at = format!("{place}.sparse.indices");
        let Checked::Valid(component) = sparse.indices.component_type else {
            return fault(at, "componentType is not an unsigned integer");
        };
        let (component, count) = (component.0, sparse.count.0);
        let (indices, values) = (&sparse.indices, &sparse.values);
        Ok(Sparse {
            indices: self.elements(indices.buffer_view.value(), indices.byte_offset.0, count, component.size(), &at)?,
            component,
            values: self.elements(
                values.buffer_view.value(),
                values.byte_offset.0,
                count,
                format.size(),
                &format!("{place}.sparse.values"),
            )?,
        })
    }

    pub(super) fn accessor(&self, index: usize, place: &str) -> Read<&'a Accessor> {
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
    pub(super) fn view(&self, index: usize, place: &str) -> Read<&[u8]> {
        let Some(view) = self.root.buffer_views.get(index) else {
            return fault(format!("{place}.bufferView"), format!("{index} of {}", self.root.buffer_views.len()));
        };
        if let Some(decoded) = &self.views[index] {
            return Ok(decoded);
        }
        let (offset, length) = (view.byte_offset.map_or(0, |offset| offset.0), view.byte_length.0);
        slice(&self.buffers, view.buffer.value(), offset, length, &format!("bufferViews[{index}]"))
    }
}

/// The indices of a sparse accessor ascend and lie within its elements.
fn check_sparse(sparse: &Sparse<'_>, known: usize, place: &str) -> Read<()> {
    let place = format!("{place}.sparse.indices");
    let mut previous = None;
    for index in (0..sparse.indices.count).map(|i| sparse.index(i)) {
        if previous.replace(index).is_some_and(|previous| previous >= index) {
            return fault(place, format!("index {index} does not come after the one before it"));
        }
        if index as usize >= known {
            return fault(place, format!("index {index} of {known} elements"));
        }
    }
    Ok(())
}
