//! Format of an accessor's elements, and conversion of their bytes to numbers.

use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;

use super::fault::{Read, fault};

/// Maximum number of elements in an accessor without a bufferView (zeros except for sparse
/// elements).
pub(super) const MAX_ZEROS: u64 = 1 << 24;

/// Contiguous elements of an accessor, decoded from a compressed primitive.
#[derive(Debug)]
pub(super) struct Unpacked {
    pub(super) bytes: Vec<u8>,
    pub(super) format: Format,
}

/// Shape of an accessor's elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Format {
    pub(super) kind: Type,
    pub(super) component: ComponentType,
    pub(super) normalized: bool,
}

impl Format {
    pub(super) fn of(accessor: &Accessor, place: &str) -> Read<Self> {
        let (Checked::Valid(kind), Checked::Valid(component)) = (accessor.type_, accessor.component_type) else {
            return fault(place, "type or componentType is not one of glTF's");
        };
        Ok(Self { kind, component: component.0, normalized: accessor.normalized })
    }

    /// Size of one element, bytes. Matrices of small integers, whose columns are padded, are not
    /// read.
    pub(super) fn size(self) -> usize {
        self.component.size() * self.kind.multiplicity()
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let normalized = if self.normalized { "normalized " } else { "" };
        write!(f, "{:?} of {normalized}{:?}", self.kind, self.component)
    }
}

pub(super) fn unsigned(bytes: &[u8], component: ComponentType) -> u32 {
    match component {
        ComponentType::U8 => u32::from(bytes[0]),
        ComponentType::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

pub(super) fn float32(bytes: &[u8]) -> f32 {
    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// Number of any component type; normalised integers map to 0..1 or -1..1 (glTF 2.0, 3.11).
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
