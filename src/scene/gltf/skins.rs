//! Skins: transforms of the joints as posed in the file.

use glam::DMat4;
use gltf::json;
use json::accessor::{ComponentType, Type};

use super::accessor::Document;
use super::fault::{Read, fault};
use super::format::Format;

/// Checks the references of all skins.
pub(super) fn check(document: &Document<'_>) -> Read<()> {
    let nodes = document.root.nodes.len();
    for (i, skin) in document.root.skins.iter().enumerate() {
        if let Some(j) = skin.joints.iter().position(|joint| joint.value() >= nodes) {
            return fault(format!("skins[{i}].joints[{j}]"), format!("{} of {nodes}", skin.joints[j].value()));
        }
        let Some(matrices) = skin.inverse_bind_matrices else { continue };
        let place = format!("skins[{i}].inverseBindMatrices");
        let (count, format) = document.shape(matrices.value(), &place)?;
        if format != (Format { kind: Type::Mat4, component: ComponentType::F32, normalized: false }) {
            return fault(place, format!("is {format}, not Mat4 of F32"));
        }
        if count < skin.joints.len() {
            return fault(place, format!("{count} matrices for {} joints", skin.joints.len()));
        }
    }
    Ok(())
}

/// Transform from the mesh to the world for each joint of a skin (glTF 2.0, 3.7.3.3), with the
/// nodes as posed in the file. Needs [`check`].
pub(super) fn pose(document: &Document<'_>, skin: usize, worlds: &[DMat4]) -> Read<Vec<DMat4>> {
    let place = format!("skins[{skin}]");
    let skin = &document.root.skins[skin];
    let inverse = skin.inverse_bind_matrices.map(|matrices| document.column(matrices.value(), &place)).transpose()?;
    let mut pose = Vec::with_capacity(skin.joints.len());
    for (j, joint) in skin.joints.iter().enumerate() {
        let to_joint = inverse.map_or(DMat4::IDENTITY, |inverse| inverse.matrix(j));
        let to_world = worlds[joint.value()] * to_joint;
        if !to_world.is_finite() {
            return fault(format!("{place}.joints[{j}]"), "its transform in the world is not finite");
        }
        pose.push(to_world);
    }
    Ok(pose)
}
