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
use super::skins;

/// A mesh as a node shows it.
#[derive(Debug)]
pub(super) struct MeshInstance<'a> {
    pub(super) node: usize,
    pub(super) primitives: &'a [MeshPrimitive],
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
            triangles = triangles.saturating_add(copies.saturating_mul(claimed));
            if claimed == 0 || copies == 0 {
                continue;
            }
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

    /// Refuses more triangles than there is memory for, once it is known which have attributes.
    pub(super) fn check_memory(
        &self,
        document: &Document<'_>,
        shapes: &[Vec<Option<Shape>>],
        materials: &MaterialTable,
    ) -> Read<()> {
        let needs = |(primitive, _): &(&Primitive, Shape)| {
            let slot =
                materials.slot(primitive.material.map(|material| material.value()), &attributes::sets(primitive));
            attributes::are_needed(primitive, slot)
        };
        let of_mesh: Vec<[usize; 2]> = (self.keys.iter())
            .map(|(mesh, ..)| {
                let all = shown(document, *mesh, shapes).map(|(_, shape)| shape.triangles).sum();
                [all, shown(document, *mesh, shapes).filter(needs).map(|(_, shape)| shape.triangles).sum()]
            })
            .collect();
        let of_entries =
            self.entries.iter().map(|entry| of_mesh[entry.mesh].map(|count| count.saturating_mul(entry.copies())));
        let [triangles, attributes] =
            of_entries.fold([0_usize; 2], |[a, b], [c, d]| [a.saturating_add(c), b.saturating_add(d)]);
        memory::check(triangles, attributes)
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
