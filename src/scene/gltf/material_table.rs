//! Materials in use: each is read once for all meshes that have the texture coordinates it asks
//! for, and once more for those that lack the same of them.

use std::collections::{BTreeMap, HashMap};

use glam::Vec3;
use gltf::json;

use super::fault::{Notes, Read};
use super::images::ImageList;
use super::materials;
use super::textures;
use crate::scene::{Material, Texture};

/// Owners of materials.
#[derive(Clone, Copy, Debug)]
pub(super) enum Owner {
    /// Index into the file's meshes.
    Mesh(usize),
    /// Index into the file's nodes, of an exact sphere.
    Sphere(usize),
}

/// A use of a material.
#[derive(Clone, Debug)]
pub(super) struct Use {
    pub(super) owner: Owner,
    /// Valid index into the file's materials; `None` for the default material.
    pub(super) material: Option<usize>,
    /// TEXCOORD_n that the owner has, and [`textures::AXES`] if it has them.
    pub(super) sets: Vec<u32>,
}

/// A material of the scene, and what triangles need to have for it.
#[derive(Debug)]
pub(super) struct Slot {
    /// Index into the scene's materials.
    pub(super) index: u32,
    /// TEXCOORD_n of each set of texture coordinates.
    pub(super) sets: Vec<u32>,
    /// Along what tangents lie; `None` where none are needed.
    pub(super) axes: Option<Axes>,
}

/// Axes of texture coordinates, along which tangents lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    /// Index among the triangles' sets.
    pub(super) uv_set: u32,
    /// Same as in [`Texture`].
    pub(super) transform: [[f32; 3]; 2],
}

/// Materials of a scene.
#[derive(Debug, Default)]
pub(super) struct MaterialTable {
    pub(super) materials: Vec<Material>,
    pub(super) images: ImageList,
    /// A material in use has an emissive factor, but strength 0.
    pub(super) names_dark_light: bool,
    /// By material and by the TEXCOORD_n that its owner lacks.
    slots: HashMap<(Option<usize>, Vec<u32>), Slot>,
    /// TEXCOORD_n that each material asks for.
    asked: HashMap<Option<usize>, Vec<u32>>,
}

impl MaterialTable {
    /// Reads the materials in use, in the order of the file, the default material last.
    pub(super) fn read(root: &json::Root, uses: &[Use], notes: &mut Notes) -> Read<Self> {
        let mut table = Self::default();
        let mut wanted: BTreeMap<(usize, Vec<u32>), Owner> = BTreeMap::new();
        for used in uses {
            let asked = match table.asked.get(&used.material) {
                Some(asked) => asked,
                None => {
                    let (mut images, mut unsaid) = (ImageList::default(), Notes::default());
                    let read = materials::read(root, used.material, &[], &mut images, &mut unsaid)?;
                    table.asked.entry(used.material).or_insert(read.asked)
                }
            };
            let key = (used.material.unwrap_or(root.materials.len()), lacking(asked, &used.sets));
            wanted.entry(key).or_insert(used.owner);
        }
        for ((material, lacks), owner) in wanted {
            let material = Some(material).filter(|material| *material < root.materials.len());
            table.add(root, material, lacks, owner, notes)?;
        }
        Ok(table)
    }

    /// Reads a material without the textures that need the TEXCOORD_n that its owner lacks.
    fn add(
        &mut self,
        root: &json::Root,
        material: Option<usize>,
        lacks: Vec<u32>,
        owner: Owner,
        notes: &mut Notes,
    ) -> Read<()> {
        let read = materials::read(root, material, &lacks, &mut self.images, notes)?;
        if !lacks.is_empty() {
            let (owner, name) = (owner.said(root), &read.material.name);
            notes.add(format!(
                "{owner} has no {}: material {name:?} is there without what needs it",
                textures::said(&lacks)
            ));
        }
        let emits = material.is_some_and(|i| root.materials[i].emissive_factor.0 != [0.0; 3]);
        self.names_dark_light |= emits && read.material.emission == Vec3::ZERO && !read.material.unlit;
        let index = self.materials.len() as u32;
        let axes = axes(&read.material, &read.sets);
        self.slots.insert((material, lacks), Slot { index, sets: read.sets, axes });
        self.materials.push(read.material);
        Ok(())
    }

    /// The material of an owner with those TEXCOORD_n, whose use was passed to [`Self::read`].
    pub(super) fn slot(&self, material: Option<usize>, sets: &[u32]) -> &Slot {
        &self.slots[&(material, lacking(&self.asked[&material], sets))]
    }
}

/// Axes of a material's normal map, or of what it has in place of one.
fn axes(material: &Material, sets: &[u32]) -> Option<Axes> {
    let textures = &material.textures;
    let texture = textures.normal.or(textures.clearcoat_normal).or(textures.anisotropy);
    let own = texture.map(|texture| Axes { uv_set: texture.uv_set, transform: texture.transform });
    let first = sets.iter().position(|set| *set == 0).or(Some(0)).filter(|_| material.anisotropy > 0.0);
    own.or(first.map(|set| Axes { uv_set: set as u32, transform: Texture::IDENTITY }))
}

/// Those that are asked for and not there, in ascending order.
fn lacking(asked: &[u32], sets: &[u32]) -> Vec<u32> {
    let mut lacks: Vec<u32> = asked.iter().copied().filter(|set| !sets.contains(set)).collect();
    lacks.sort_unstable();
    lacks
}

impl Owner {
    fn said(self, root: &json::Root) -> String {
        match self {
            Owner::Mesh(mesh) => mesh_name(root, mesh),
            Owner::Sphere(node) => format!("the sphere of nodes[{node}]"),
        }
    }
}

/// A mesh in messages.
pub(super) fn mesh_name(root: &json::Root, mesh: usize) -> String {
    match root.meshes.get(mesh).and_then(|mesh| mesh.name.as_deref()) {
        Some(name) if !name.is_empty() => format!("mesh {name:?}"),
        _ => format!("meshes[{mesh}]"),
    }
}
