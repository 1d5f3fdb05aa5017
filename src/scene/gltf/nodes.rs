//! Node graph: checked for cycles, flattened in the order of the file, with transforms accumulated
//! in f64.

use glam::{DMat4, DQuat, DVec3, DVec4};
use gltf::json;
use json::scene::Node;
use serde_json::Value;

use super::extensions::NODE_VISIBILITY;
use super::fault::{Notes, Read, fault};
use crate::{Error, Result};

/// Largest difference of the last row of a matrix from 0 0 0 1 that is taken for rounding.
const ROUNDING: f64 = 1e-4;

/// A node with its transform to the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedNode {
    pub(super) node: usize,
    pub(super) world: DMat4,
}

/// Nodes that a scene shows.
#[derive(Debug, Default)]
pub(super) struct PlacedNodes {
    /// Nodes that have contents, parents first, without those that are hidden.
    pub(super) shown: Vec<PlacedNode>,
    /// Nodes that have a camera. A hidden camera takes pictures like any other.
    pub(super) cameras: Vec<PlacedNode>,
}

/// Checks the references of nodes and scenes, and that the nodes form a forest.
pub(super) fn check(root: &json::Root) -> Read<()> {
    let known = |index: Option<usize>, count: usize, place: &dyn Fn() -> String| match index {
        Some(index) if index >= count => fault(place(), format!("{index} of {count}")),
        _ => Ok(()),
    };
    let mut parents = vec![0_u32; root.nodes.len()];
    for (i, node) in root.nodes.iter().enumerate() {
        known(node.mesh.map(|mesh| mesh.value()), root.meshes.len(), &|| format!("nodes[{i}].mesh"))?;
        known(node.camera.map(|camera| camera.value()), root.cameras.len(), &|| format!("nodes[{i}].camera"))?;
        known(node.skin.map(|skin| skin.value()), root.skins.len(), &|| format!("nodes[{i}].skin"))?;
        for (j, child) in node.children.iter().flatten().enumerate() {
            let place = || format!("nodes[{i}].children[{j}]");
            known(Some(child.value()), root.nodes.len(), &place)?;
            parents[child.value()] += 1;
            if parents[child.value()] > 1 {
                return fault(place(), format!("node {} has two parents", child.value()));
            }
        }
    }
    for (i, scene) in root.scenes.iter().enumerate() {
        for (j, node) in scene.nodes.iter().enumerate() {
            known(Some(node.value()), root.nodes.len(), &|| format!("scenes[{i}].nodes[{j}]"))?;
        }
    }
    known(root.scene.map(|scene| scene.value()), root.scenes.len(), &|| "scene".to_owned())?;

    // Nodes that no root reaches belong to cycles, as each node has at most one parent.
    let mut reached: Vec<bool> = parents.iter().map(|count| *count == 0).collect();
    let mut open: Vec<usize> = (0..root.nodes.len()).filter(|i| reached[*i]).collect();
    while let Some(node) = open.pop() {
        for child in root.nodes[node].children.iter().flatten() {
            reached[child.value()] = true;
            open.push(child.value());
        }
    }
    match reached.iter().position(|reached| !reached) {
        Some(node) => fault(format!("nodes[{node}]"), "is its own ancestor"),
        None => Ok(()),
    }
}

/// Index of the scene to show: the one of that name, else of that index. Without a choice, it is
/// the default scene, else the first. Needs [`check`]. For a file without scenes it is 0, which
/// [`flatten`] reads as all nodes.
pub(super) fn choose_scene(root: &json::Root, wanted: Option<&str>, file_name: &str) -> Result<usize> {
    let Some(wanted) = wanted else { return Ok(root.scene.map_or(0, |scene| scene.value())) };
    let named = root.scenes.iter().position(|scene| scene.name.as_deref() == Some(wanted));
    let numbered = || wanted.parse::<usize>().ok().filter(|index| *index < root.scenes.len());
    named.or_else(numbered).ok_or_else(|| {
        let name = |scene: &json::Scene| scene.name.as_ref().map_or(String::new(), |name| format!(" {name:?}"));
        let list: Vec<String> =
            root.scenes.iter().enumerate().map(|(i, scene)| format!("{i}{}", name(scene))).collect();
        let list = if list.is_empty() { "no scenes".to_owned() } else { format!("the scenes {}", list.join(", ")) };
        Error::Setting { name: "load.scene", value: wanted.to_owned(), problem: format!("{file_name} has {list}") }
    })
}

/// World transform of every node, whether a scene shows it or not. Needs [`check`].
pub(super) fn worlds(root: &json::Root, notes: &mut Notes) -> Read<Vec<DMat4>> {
    let mut worlds = vec![DMat4::IDENTITY; root.nodes.len()];
    let mut open = roots(root);
    for i in &open {
        worlds[*i] = local(&root.nodes[*i], *i, notes)?;
    }
    while let Some(node) = open.pop() {
        for child in root.nodes[node].children.iter().flatten().map(|child| child.value()) {
            worlds[child] = worlds[node] * local(&root.nodes[child], child, notes)?;
            open.push(child);
        }
    }
    Ok(worlds)
}

/// Nodes without a parent.
fn roots(root: &json::Root) -> Vec<usize> {
    let mut is_root = vec![true; root.nodes.len()];
    let children = root.nodes.iter().filter_map(|node| node.children.as_ref()).flatten();
    children.for_each(|child| is_root[child.value()] = false);
    (0..root.nodes.len()).filter(|i| is_root[*i]).collect()
}

/// Nodes of a scene; all nodes if the file has no scenes. Needs [`check`].
pub(super) fn flatten(root: &json::Root, scene: usize, worlds: &[DMat4], notes: &mut Notes) -> Read<PlacedNodes> {
    let roots = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(|node| node.value()).collect(),
        None => roots(root),
    };
    // Nodes yet to be visited, and whether all above them are visible.
    let mut open: Vec<(usize, bool)> = roots.into_iter().rev().map(|node| (node, true)).collect();
    let mut seen = vec![false; root.nodes.len()];
    let mut placed = PlacedNodes::default();
    let mut hidden = 0;
    while let Some((index, parent_visible)) = open.pop() {
        if std::mem::replace(&mut seen[index], true) {
            return fault(format!("scenes[{scene}].nodes"), format!("reach node {index} twice"));
        }
        let (node, world) = (&root.nodes[index], worlds[index]);
        if !world.is_finite() {
            return fault(format!("nodes[{index}]"), "its transform in the world is not finite");
        }
        let visible = visibility(node, index)? && parent_visible;
        hidden += usize::from(!visible);
        let placed_node = PlacedNode { node: index, world };
        placed.cameras.extend(node.camera.map(|_| placed_node));
        if visible && (node.mesh.is_some() || node.extensions.is_some()) {
            placed.shown.push(placed_node);
        }
        open.extend(node.children.iter().flatten().rev().map(|child| (child.value(), visible)));
    }
    if hidden > 0 {
        notes.add(format!("nodes that the file hides (KHR_node_visibility) are left out: {hidden}"));
    }
    Ok(placed)
}

/// Whether the node itself is visible (KHR_node_visibility).
fn visibility(node: &Node, index: usize) -> Read<bool> {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get(NODE_VISIBILITY));
    match extension.and_then(|extension| extension.get("visible")) {
        None => Ok(true),
        Some(Value::Bool(visible)) => Ok(*visible),
        Some(_) => fault(format!("nodes[{index}].extensions.{NODE_VISIBILITY}.visible"), "is not true or false"),
    }
}

/// Local transform of a node.
fn local(node: &Node, index: usize, notes: &mut Notes) -> Read<DMat4> {
    if let Some(matrix) = node.matrix {
        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        let last = matrix.row(3);
        if !last.abs_diff_eq(DVec4::W, ROUNDING) {
            let DVec4 { x, y, z, w } = last;
            let problem = format!("its last row is {x} {y} {z} {w}, not 0 0 0 1: glTF has matrices column by column");
            return fault(format!("nodes[{index}].matrix"), problem);
        }
        if node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
            let name = node.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("node {index}"));
            notes.about("node", &name, ": its matrix is read, not the translation, rotation or scale beside it");
        }
        return Ok(matrix);
    }
    let scale = node.scale.map_or(DVec3::ONE, |scale| DVec3::from_array(scale.map(f64::from)));
    let translation = node.translation.map_or(DVec3::ZERO, |by| DVec3::from_array(by.map(f64::from)));
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |quaternion| DQuat::from_array(quaternion.0.map(f64::from)));
    let length = rotation.length();
    if !(length.is_finite() && length > 0.0) {
        return fault(format!("nodes[{index}].rotation"), format!("{rotation} is not a rotation"));
    }
    Ok(DMat4::from_scale_rotation_translation(scale, rotation / length, translation))
}
