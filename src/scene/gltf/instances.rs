//! Instances of a node's mesh (EXT_mesh_gpu_instancing).

use glam::{DMat4, DQuat, DVec3};
use gltf::json;
use json::accessor::{ComponentType, Type};
use serde_json::Value;

use super::accessor::{Column, Document};
use super::fault::{Read, fault};

const NAME: &str = "EXT_mesh_gpu_instancing";

/// Transforms of the instances of one node relative to it.
#[derive(Clone, Debug)]
pub(super) struct Instances<'d> {
    pub(super) count: usize,
    translation: Option<Column<'d>>,
    rotation: Option<Column<'d>>,
    scale: Option<Column<'d>>,
    place: String,
}

/// Instances of a node; `None` if the node does not use the extension.
pub(super) fn read<'d>(document: &'d Document<'_>, index: usize) -> Read<Option<Instances<'d>>> {
    let extensions = document.root.nodes[index].extensions.as_ref();
    let Some(extension) = extensions.and_then(|extensions| extensions.others.get(NAME)) else { return Ok(None) };
    let place = format!("nodes[{index}].extensions.{NAME}.attributes");
    let Some(attributes) = extension.get("attributes").and_then(Value::as_object) else {
        return fault(place, "is missing");
    };
    let mut count = None;
    for (name, accessor) in attributes {
        let at = format!("{place}.{name}");
        let (elements, _) = document.shape(accessor_index(accessor, &at)?, &at)?;
        if *count.get_or_insert(elements) != elements {
            let expected = count.unwrap_or_default();
            return fault(at, format!("has {elements} elements, other attributes have {expected}"));
        }
    }
    let column = |name: &str, kind: Type| -> Read<Option<Column<'d>>> {
        let Some(accessor) = attributes.get(name) else { return Ok(None) };
        let at = format!("{place}.{name}");
        let column = document.column(accessor_index(accessor, &at)?, &at)?;
        let format = column.format;
        let small = matches!(format.component, ComponentType::I8 | ComponentType::I16) && format.normalized;
        let component = format.component == ComponentType::F32 || (small && name == "ROTATION");
        if format.kind != kind || !component {
            return fault(at, format!("is {format}, not {kind:?} of F32"));
        }
        Ok(Some(column))
    };
    Ok(Some(Instances {
        count: count.unwrap_or(0),
        translation: column("TRANSLATION", Type::Vec3)?,
        rotation: column("ROTATION", Type::Vec4)?,
        scale: column("SCALE", Type::Vec3)?,
        place,
    }))
}

fn accessor_index(value: &Value, place: &str) -> Read<usize> {
    let index = value.as_u64().and_then(|index| usize::try_from(index).ok());
    index.map_or_else(|| fault(place, format!("{value} is not the number of an accessor")), Ok)
}

impl Instances<'_> {
    /// The transform of instance `i` relative to its node.
    pub(super) fn local(&self, i: usize) -> Read<DMat4> {
        let vector = |column: &Option<Column<'_>>, default: DVec3| column.map_or(default, |c| c.vector(i).as_dvec3());
        let rotation = self.rotation.map_or(DQuat::IDENTITY, |rotation| {
            DQuat::from_array(std::array::from_fn(|c| f64::from(rotation.number(i, c))))
        });
        if rotation.length() == 0.0 {
            return fault(format!("{}.ROTATION", self.place), format!("element {i} is not a rotation"));
        }
        let (translation, scale) = (vector(&self.translation, DVec3::ZERO), vector(&self.scale, DVec3::ONE));
        Ok(DMat4::from_scale_rotation_translation(scale, rotation.normalize(), translation))
    }
}
