//! glTF reader, the only user of the gltf crate.
//!
//! The crate parses the JSON without validation. This module checks every value before its use as
//! an index, in this order: container, JSON, graph, buffers, accessors, skins, meshes. Then the
//! contents of the scene's nodes are decoded and transformed to the world.

use std::path::Path;

use glam::{DVec3, Vec3};
use gltf::json;
use sha2::{Digest as _, Sha256};

use super::{
    Bounds, Camera, Light, LoadOptions, Scene, Sphere,
    solids::{self, MeshRange},
};
use crate::{Error, Result};

mod accessor;
mod buffers;
mod cameras;
mod container;
mod doubled_lamps;
mod draco;
mod extensions;
mod fault;
mod files;
mod format;
mod instances;
mod lights;
mod materials;
mod memory;
mod mesh_cache;
mod meshes;
mod meshopt;
mod nodes;
mod placing;
mod primitives;
mod root;
mod skins;
mod spheres;
mod strict_json;
mod topology;

use accessor::Document;
use fault::{Notes, Read, fault};
use files::Resources;
use lights::PlacedLight;
use mesh_cache::{MeshCache, MeshInstance};
use placing::{TOO_FAR, WorldBounds};
use spheres::PlacedSphere;

/// Reads a file into a scene.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene> {
    let bytes = files::read_regular(path, u64::MAX);
    let bytes = bytes.map_err(|source| Error::Io { path: path.to_owned(), source })?;
    read(&bytes, path, options)
}

/// Reads the bytes of the file at `path`.
pub(super) fn read(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Scene> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let file_name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
    let mut notes = Notes::default();
    let root = parse(bytes, options, &mut notes);
    let (root, bin) = root.map_err(|fault| fault.of(path))?;
    let chosen = nodes::choose_scene(&root, options.scene.as_deref(), &file_name)?;
    let mut hash = Sha256::new();
    hash.update(bytes);
    if options.scene.is_some() {
        hash.update(format!("scene {chosen}"));
    }
    let resources = Resources { bin, folder, allow_outside: options.allow_outside };
    let scene = assemble(&root, chosen, &resources, hash, notes).map_err(|fault| fault.of(path))?;
    Ok(Scene { path: path.to_owned(), file_name, files: resources.named(&root), ..scene })
}

/// The JSON part, with its graph of nodes checked, and the binary chunk.
fn parse<'a>(bytes: &'a [u8], options: &LoadOptions, notes: &mut Notes) -> Read<(json::Root, Option<&'a [u8]>)> {
    let (text, bin) = container::split(bytes)?;
    let root = root::read(text, &options.ignore_required, notes)?;
    nodes::check(&root)?;
    Ok((root, bin))
}

/// Reads everything that the chosen scene shows. `hash` has taken the file's own bytes.
fn assemble(
    root: &json::Root,
    chosen: usize,
    resources: &Resources<'_>,
    mut hash: Sha256,
    mut notes: Notes,
) -> Read<Scene> {
    let document = Document::new(root, buffers::read(root, resources, &mut hash)?)?.with_primitives(draco::decode)?;
    document.check()?;
    skins::check(&document)?;
    let shapes = meshes::check(&document, &mut notes)?;

    let worlds = nodes::worlds(root)?;
    let placed = nodes::flatten(root, chosen, &worlds, &mut notes)?;
    let cache = MeshCache::read(&document, &placed.shown, &shapes, &worlds, &mut notes)?;
    let instances = cache.instances();
    let contents = NodeContents::read(root, &placed, &mut notes)?;
    let mut bounds = WorldBounds::EMPTY;
    placing::measure(&instances, &mut bounds)?;
    contents.spheres.iter().for_each(|sphere| bounds.add(sphere.center, sphere.radius));
    let center = bounds.center();
    let mut reach = bounds;
    contents
        .lights
        .iter()
        .filter_map(|(at, _)| at.as_ref())
        .chain(contents.cameras.iter().map(|(_, at, _)| at))
        .for_each(|at| reach.add(*at, 0.0));
    if !reach.fits() {
        return fault("scene", format!("a sphere, light or camera {TOO_FAR}"));
    }

    let mut scene = Scene { center, mesh_count: root.meshes.len(), ..Scene::default() };
    let slots = read_materials(root, &instances, &contents.spheres, &mut scene, &mut notes)?;
    let slot = |material: Option<usize>| slots[material.unwrap_or(root.materials.len())];
    let (mut triangles, placed_meshes) = placing::place(&instances, center, slot, &mut notes)?;
    let ranges: Vec<MeshRange> = placed_meshes.into_iter().map(|placed| mesh_range(root, placed)).collect();
    let (shells, warnings) = solids::repair(&mut triangles, &mut scene.materials, &ranges);
    warnings.into_iter().for_each(|warning| notes.add(warning));
    (scene.triangles, scene.shells) = (triangles, shells);
    doubled_lamps::remove(&mut scene, &mut notes);
    scene.spheres = contents.spheres.iter().map(|sphere| sphere.relative_to(center, &slot)).collect();
    contents.finish(&mut scene, &mut notes);
    scene.hash = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    scene.warnings = notes.into_lines();
    Ok(scene)
}

/// A copy of a mesh with its name in messages.
fn mesh_range(root: &json::Root, (triangles, node): placing::PlacedMesh) -> MeshRange {
    let mesh = root.nodes[node].mesh.map_or(0, |mesh| mesh.value());
    let name = match root.meshes.get(mesh).and_then(|mesh| mesh.name.as_deref()) {
        Some(name) if !name.is_empty() => format!("mesh {name:?}"),
        _ => format!("meshes[{mesh}]"),
    };
    MeshRange { triangles, name }
}

/// Reads the materials in use. Returns the index in the scene for each of the file's materials,
/// followed by that of the default material.
fn read_materials(
    root: &json::Root,
    instances: &[MeshInstance<'_>],
    spheres: &[PlacedSphere],
    scene: &mut Scene,
    notes: &mut Notes,
) -> Read<Vec<u32>> {
    let default = root.materials.len();
    let mut used = vec![false; default + 1];
    let of_meshes = instances.iter().flat_map(|instance| instance.primitives).map(|primitive| primitive.material);
    of_meshes.chain(spheres.iter().map(|sphere| sphere.material)).for_each(|i| used[i.unwrap_or(default)] = true);
    let mut slots = vec![0; default + 1];
    for (i, _) in used.iter().enumerate().filter(|(_, used)| **used) {
        slots[i] = scene.materials.len() as u32;
        if i == default {
            scene.materials.push(materials::default_material(notes)?);
            continue;
        }
        let material = materials::read(root, i, notes)?;
        let emits = root.materials[i].emissive_factor.0 != [0.0; 3];
        scene.names_dark_light |= emits && material.emission == Vec3::ZERO;
        scene.materials.push(material);
    }
    Ok(slots)
}

/// Lights, cameras and spheres of the nodes, in world space.
#[derive(Default)]
struct NodeContents {
    lights: Vec<PlacedLight>,
    /// A light of intensity 0 is among the nodes.
    names_dark_light: bool,
    /// With the index in the file, which determines their order.
    cameras: Vec<(usize, DVec3, Camera)>,
    spheres: Vec<PlacedSphere>,
}

impl NodeContents {
    fn read(root: &json::Root, placed: &nodes::PlacedNodes, notes: &mut Notes) -> Read<Self> {
        let mut contents = Self::default();
        for placed in &placed.shown {
            let light = lights::read(root, placed, notes)?;
            contents.names_dark_light |= light.as_ref().is_some_and(|(_, light)| light.intensity == Vec3::ZERO);
            contents.lights.extend(light.filter(|(_, light)| light.intensity != Vec3::ZERO));
            contents.spheres.extend(spheres::read(root, placed, notes)?);
        }
        for placed in &placed.cameras {
            contents.cameras.extend(cameras::read(root, placed, notes)?);
        }
        contents.cameras.sort_by_key(|(index, ..)| *index);
        Ok(contents)
    }

    /// Moves lights and cameras into the scene; without a camera, adds one that frames the scene.
    fn finish(self, scene: &mut Scene, notes: &mut Notes) {
        let center = scene.center;
        let at = |position: DVec3| (position - center).as_vec3();
        let light = |(p, light): PlacedLight| Light { position: p.map_or(Vec3::ZERO, at), ..light };
        scene.names_dark_light |= self.names_dark_light;
        scene.lights = self.lights.into_iter().map(light).collect();
        scene.cameras = self.cameras.into_iter().map(|(_, p, camera)| Camera { position: at(p), ..camera }).collect();
        let bounds = scene.bounds();
        scene.cameras.iter().for_each(|camera| cameras::note_end(camera, bounds, notes));
        if scene.cameras.is_empty() {
            if bounds != Bounds::EMPTY {
                notes.add("no camera: one is made that frames the whole scene");
            }
            scene.cameras.push(Camera::framing(bounds));
        }
    }
}

impl PlacedSphere {
    fn relative_to(&self, center: DVec3, slot: &impl Fn(Option<usize>) -> u32) -> Sphere {
        Sphere { center: (self.center - center).as_vec3(), radius: self.radius as f32, material: slot(self.material) }
    }
}
