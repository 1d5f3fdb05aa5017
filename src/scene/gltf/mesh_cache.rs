//! Meshes shown by nodes: each is read once for all nodes with the same deformation. First it is
//! settled which meshes are shown, then what has which material, then they are read.

use std::collections::{HashMap, hash_map::Entry::Vacant};

use glam::DMat4;
use gltf::json::mesh::Primitive;
use rayon::prelude::*;

use super::accessor::Document;
use super::attributes;
use super::fault::{Notes, Read};
use super::instances::{self, Instances};
use super::material_table::{MaterialTable, Owner, Use};
use super::memory;
use super::meshes::{self, Deformation, MeshPrimitive};
use super::nodes::PlacedNode;
use super::primitives::Shape;
use super::sharing;
use super::skins;

/// A mesh as a node shows it.
#[derive(Debug)]
pub(super) struct MeshInstance<'a> {
    pub(super) node: usize,
    /// Index of the mesh among those that are read.
    pub(super) mesh: usize,
    pub(super) primitives: &'a [MeshPrimitive],
    /// Those of them that are held once for all copies.
    pub(super) shared: &'a [bool],
    world: DMat4,
    instances: Option<&'a Instances<'a>>,
    /// For each joint of the node's skin the transform from the mesh to the world.
    pose: &'a [DMat4],
}

impl MeshInstance<'_> {
    /// Number of copies of the mesh.
    pub(super) fn copies(&self) -> usize {
        self.instances.map_or(1, |instances| instances.count)
    }

    /// World transform of copy `i`, unless it has a skin.
    pub(super) fn world(&self, i: usize) -> Read<DMat4> {
        self.instances.map_or(Ok(self.world), |instances| Ok(self.world * instances.local(i)?))
    }

    /// World transform of a vertex of a primitive: `otherwise` without a skin.
    pub(super) fn matrix(&self, primitive: &MeshPrimitive, vertex: usize, otherwise: DMat4) -> DMat4 {
        let Some(influences) = primitive.influences.get(vertex) else { return otherwise };
        influences.iter().fold(DMat4::ZERO, |sum, held| sum + self.pose[held.joint as usize] * held.weight)
    }
}

/// Meshes, instances and skin poses of all nodes of a scene; a mesh that several nodes deform
/// equally is read once.
#[derive(Debug, Default)]
pub(super) struct MeshCache<'d> {
    entries: Vec<Entry<'d>>,
    keys: Vec<MeshKey>,
    /// In the order of the keys.
    meshes: Vec<Vec<MeshPrimitive>>,
    /// For each primitive of each mesh, whether it is held once for all copies.
    shared: Vec<Vec<bool>>,
    poses: HashMap<usize, Vec<DMat4>>,
}

#[derive(Debug)]
struct Entry<'d> {
    placed: PlacedNode,
    /// Index into the meshes.
    mesh: usize,
    instances: Option<Instances<'d>>,
    skin: Option<usize>,
}

impl Entry<'_> {
    /// Number of copies of the mesh.
    fn copies(&self) -> usize {
        self.instances.as_ref().map_or(1, |instances| instances.count)
    }
}

/// Key of a mesh: its index, the node whose own weights it has, and the number of joints of its
/// skin.
type MeshKey = (usize, Option<usize>, Option<usize>);

impl<'d> MeshCache<'d> {
    /// Cache of the meshes that the nodes show, none of them read yet. Needs [`meshes::check`],
    /// whose `shapes` these are, and [`skins::check`].
    pub(super) fn new(
        document: &'d Document<'_>,
        placed: &[PlacedNode],
        shapes: &[Vec<Option<Shape>>],
        notes: &mut Notes,
    ) -> Read<Self> {
        let mut cache = Self::default();
        let mut known: HashMap<MeshKey, usize> = HashMap::new();
        let mut triangles = 0_usize;
        for placed in placed {
            let node = &document.root.nodes[placed.node];
            let Some(mesh) = node.mesh.map(|mesh| mesh.value()) else { continue };
            for primitive in &document.root.meshes[mesh].primitives {
                meshes::check_weights(primitive, node.weights.as_deref(), &format!("nodes[{}].weights", placed.node))?;
            }
            let skin = node.skin.map(|skin| skin.value());
            let mut instances = instances::read(document, placed.node)?;
            if skin.is_some() && instances.take().is_some() {
                notes.add("instances of meshes that a skin moves are not drawn, but for one");
            }
            let copies = instances.as_ref().map_or(1, |instances| instances.count);
            let claimed: usize = shapes[mesh].iter().flatten().map(|shape| shape.triangles).sum();
            if claimed == 0 || copies == 0 {
                continue;
            }
            triangles = triangles.saturating_add(copies);
            let joints = skin.map(|skin| document.root.skins[skin].joints.len());
            let key = (mesh, node.weights.as_ref().map(|_| placed.node), joints);
            let mesh = *known.entry(key).or_insert_with(|| {
                cache.keys.push(key);
                cache.keys.len() - 1
            });
            cache.entries.push(Entry { placed: *placed, mesh, instances, skin });
        }
        memory::check(triangles, 0)?;
        Ok(cache)
    }

    /// The materials of the meshes.
    pub(super) fn uses(&self, document: &Document<'_>, shapes: &[Vec<Option<Shape>>]) -> Vec<Use> {
        let mut uses = Vec::new();
        for &(mesh, ..) in &self.keys {
            for (primitive, _) in shown(document, mesh, shapes) {
                let material = primitive.material.map(|material| material.value());
                uses.push(Use { owner: Owner::Mesh(mesh), material, sets: attributes::sets(primitive) });
            }
        }
        uses
    }

    /// Chooses the meshes that are held once for all copies: those whose copies have `share_from`
    /// triangles together. Refuses more triangles than there is memory for, now that it is known
    /// which have attributes.
    pub(super) fn share(
        &mut self,
        document: &Document<'_>,
        shapes: &[Vec<Option<Shape>>],
        materials: &MaterialTable,
        share_from: usize,
    ) -> Read<()> {
        let mut copies = vec![0_usize; self.keys.len()];
        self.entries.iter().for_each(|e| copies[e.mesh] = copies[e.mesh].saturating_add(e.copies()));
        // For each primitive its triangles, whether they have attributes, and may be shared.
        let primitive = |(primitive, shape): (&Primitive, Shape)| {
            let slot =
                materials.slot(primitive.material.map(|material| material.value()), &attributes::sets(primitive));
            let may_share = sharing::is_sharable(&materials.materials[slot.index as usize]);
            (shape.triangles, attributes::are_needed(primitive, slot), may_share)
        };
        let of_mesh = |(mesh, _, joints): &MeshKey| -> Vec<(usize, bool, bool)> {
            let rigid = |(triangles, needs, may)| (triangles, needs, may && joints.is_none());
            shown(document, *mesh, shapes).map(primitive).map(rigid).collect()
        };
        let meshes: Vec<Vec<(usize, bool, bool)>> = self.keys.iter().map(of_mesh).collect();
        let once: usize = meshes.iter().flatten().map(|(triangles, ..)| triangles).fold(0, |a, b| a.saturating_add(*b));
        let [mut triangles, mut with_attributes, mut shown] = [0_usize; 3];
        for (mesh, copies) in meshes.iter().zip(&copies) {
            let sharable = mesh.iter().filter(|(.., may)| *may).map(|(triangles, ..)| *triangles).sum();
            let is_shared = sharing::is_worth_it(sharable, *copies, once, share_from);
            for (count, needs, may) in mesh {
                let held = if is_shared && *may { 1 } else { *copies };
                triangles = triangles.saturating_add(count.saturating_mul(held));
                with_attributes = with_attributes.saturating_add(if *needs { count.saturating_mul(held) } else { 0 });
            }
            if is_shared {
                triangles = triangles.saturating_add(*copies);
                shown = shown.saturating_add(sharable.saturating_mul(*copies));
            }
            self.shared.push(mesh.iter().map(|(.., may)| is_shared && *may).collect());
        }
        memory::check(triangles, with_attributes)?;
        memory::check_shown(triangles.saturating_add(shown))
    }

    /// Reads the meshes.
    pub(super) fn read(
        &mut self,
        document: &'d Document<'_>,
        shapes: &[Vec<Option<Shape>>],
        worlds: &[DMat4],
        materials: &MaterialTable,
    ) -> Read<()> {
        let read = |&(mesh, weighted, joints): &MeshKey| {
            let weights = match weighted {
                Some(node) => document.root.nodes[node].weights.as_deref(),
                None => document.root.meshes[mesh].weights.as_deref(),
            };
            let deformation = Deformation { weights: weights.unwrap_or_default(), joints };
            meshes::read(document, mesh, &shapes[mesh], deformation, materials)
        };
        let meshes: Vec<Read<Vec<MeshPrimitive>>> = self.keys.par_iter().map(read).collect();
        // The first of several faults counts.
        self.meshes = meshes.into_iter().collect::<Read<_>>()?;
        for skin in self.entries.iter().filter_map(|entry| entry.skin) {
            if let Vacant(place) = self.poses.entry(skin) {
                place.insert(skins::pose(document, skin, worlds)?);
            }
        }
        Ok(())
    }

    /// All mesh instances, in the order of the nodes.
    pub(super) fn instances(&self) -> Vec<MeshInstance<'_>> {
        let instances = self.entries.iter().map(|entry| MeshInstance {
            node: entry.placed.node,
            mesh: entry.mesh,
            shared: &self.shared[entry.mesh],
            primitives: &self.meshes[entry.mesh],
            world: entry.placed.world,
            instances: entry.instances.as_ref(),
            pose: entry.skin.and_then(|skin| self.poses.get(&skin)).map_or(&[], Vec::as_slice),
        });
        instances.collect()
    }
}

/// Primitives of a mesh that have triangles.
fn shown<'r>(
    document: &Document<'r>,
    mesh: usize,
    shapes: &[Vec<Option<Shape>>],
) -> impl Iterator<Item = (&'r Primitive, Shape)> {
    let primitives = document.root.meshes[mesh].primitives.iter();
    primitives.zip(&shapes[mesh]).filter_map(|(primitive, shape)| Some((primitive, (*shape)?)))
}
