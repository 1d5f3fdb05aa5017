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
    Attributes, Bounds, Camera, Light, LoadOptions, Scene, Sphere,
    solids::{self, MeshRange, Surroundings},
};
use crate::{Error, Result};

mod accessor;
mod attributes;
mod buffers;
mod cameras;
mod center;
mod container;
mod doubled_lamps;
mod draco;
mod extensions;
mod extras;
mod fault;
mod files;
mod format;
mod images;
mod instances;
mod lights;
mod material_table;
mod materials;
mod memory;
mod mesh_cache;
mod meshes;
mod meshopt;
mod nodes;
mod placing;
mod primitives;
mod root;
mod shared_meshes;
mod sharing;
mod skins;
mod spheres;
mod strict_json;
mod tangents;
mod textures;
mod topology;
mod variants;

use accessor::Document;
use fault::{Notes, Read, fault};
use files::Resources;
use lights::PlacedLight;
use material_table::{MaterialTable, Owner, Use, mesh_name};
use mesh_cache::MeshCache;
use placing::{Placed, TOO_FAR, WorldBounds};
use spheres::PlacedSphere;

/// Reads a file into a scene.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene> {
    let bytes = files::read_regular(path, u64::MAX);
    let bytes = bytes.map_err(|source| Error::Io { path: path.to_owned(), source })?;
    read(&bytes, path, options)
}

/// Reads the bytes of the file at `path`.
pub(super) fn read(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Scene> {
    options.texture_size.map_or(Ok(()), |size| LoadOptions::TEXTURE_SIZE.check("load.texture_size", size))?;
    LoadOptions::CAUSTIC_ROUGHNESS.check("load.caustic_roughness", options.caustic_roughness)?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let file_name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
    let mut notes = Notes::default();
    let root = parse(bytes, options, &mut notes);
    let (mut root, bin) = root.map_err(|fault| fault.of(path))?;
    let chosen = nodes::choose_scene(&root, options.scene.as_deref(), &file_name)?;
    let variants = variants::names(&root).map_err(|fault| fault.of(path))?;
    let variant = variants::choose(&variants, options.variant.as_deref(), &file_name)?;
    variants::apply(&mut root, variants.len(), variant).map_err(|fault| fault.of(path))?;
    let mut hash = Sha256::new();
    hash.update(bytes);
    if options.scene.is_some() {
        hash.update(format!("scene {chosen}"));
    }
    if let Some(variant) = variant {
        hash.update(format!("variant {variant}"));
    }
    if let Some(size) = options.texture_size {
        hash.update(format!("texture size {size}"));
    }
    let resources = Resources { bin, folder, allow_outside: options.allow_outside };
    let scene = assemble(&root, chosen, &resources, options, hash, notes).map_err(|fault| fault.of(path))?;
    Ok(Scene {
        path: path.to_owned(),
        file_name,
        files: resources.named(&root),
        variants,
        options: options.clone(),
        ..scene
    })
}

/// The JSON part, with its graph of nodes checked, and the binary chunk.
fn parse<'a>(bytes: &'a [u8], options: &LoadOptions, notes: &mut Notes) -> Read<(json::Root, Option<&'a [u8]>)> {
    let (text, bin) = container::split(bytes, notes)?;
    let root = root::read(text, &options.ignore_required, notes)?;
    nodes::check(&root)?;
    textures::check(&root)?;
    extras::note_unread(&root, notes);
    Ok((root, bin))
}

/// Reads everything that the chosen scene shows. `hash` has taken the file's own bytes.
fn assemble(
    root: &json::Root,
    chosen: usize,
    resources: &Resources<'_>,
    options: &LoadOptions,
    mut hash: Sha256,
    mut notes: Notes,
) -> Read<Scene> {
    let document = Document::new(root, buffers::read(root, resources, &mut hash)?)?.with_primitives(draco::decode)?;
    document.check()?;
    skins::check(&document)?;
    let shapes = meshes::check(&document, &mut notes)?;

    let worlds = nodes::worlds(root, &mut notes)?;
    let placed = nodes::flatten(root, chosen, &worlds, &mut notes)?;
    let mut cache = MeshCache::new(&document, &placed.shown, &shapes, &mut notes)?;
    let contents = NodeContents::read(root, &placed, &mut notes)?;
    let uses = [cache.uses(&document, &shapes), contents.uses()].concat();
    let materials = MaterialTable::read(root, &uses, &mut notes)?;
    cache.share(&document, &shapes, &materials, options.share_from)?;
    cache.read(&document, &shapes, &worlds, &materials)?;
    let instances = cache.instances();
    let mut bounds = WorldBounds::EMPTY;
    placing::measure(&instances, &mut bounds)?;
    contents.spheres.iter().for_each(|sphere| bounds.add(sphere.center, sphere.radius));
    let eyes: Vec<DVec3> = contents.cameras.iter().map(|(_, at, _)| *at).collect();
    let center = center::center(&bounds, &instances, &eyes)?;
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
    let Placed { mut triangles, attributes, meshes, shared } = placing::place(&instances, center, &mut notes)?;
    drop(instances);
    scene.images = materials.images.read(&document, resources, options.texture_size, &mut hash, &mut notes)?;
    let slot = |material: Option<usize>| materials.slot(material, &[]).index;
    scene.spheres = contents.spheres.iter().map(|sphere| sphere.relative_to(center, &slot)).collect();
    scene.names_dark_light = materials.names_dark_light;
    scene.materials = materials.materials;
    let ranges: Vec<MeshRange> = meshes.into_iter().map(|placed| mesh_range(root, placed)).collect();
    let eyes: Vec<Vec3> = eyes.into_iter().map(|at| (at - center).as_vec3()).collect();
    doubled_lamps::remove_spheres(&mut scene, &mut notes);
    let around =
        Surroundings { shared: &shared.meshes, instances: &shared.instances, spheres: &scene.spheres, eyes: &eyes };
    let (shells, warnings) = solids::repair(&mut triangles, &mut scene.materials, &ranges, &around);
    warnings.into_iter().for_each(|warning| notes.add(warning));
    (scene.triangles, scene.attributes, scene.shells) = (triangles, attributes, shells);
    (scene.meshes, scene.instances) = (shared.meshes, shared.instances);
    sharing::check_heights(&scene)?;
    name_objects(root, &mut scene);
    doubled_lamps::remove_triangles(&mut scene, &mut notes);
    placing::turn_tangents(&scene.triangles, &mut scene.attributes);
    placing::keep_attributes_in_use(&mut scene.triangles, &mut scene.attributes);
    add_attributes_of_meshes(shared.attributes, &mut scene);
    contents.finish(&mut scene, &mut notes);
    scene.hash = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    scene.warnings = notes.into_lines();
    Ok(scene)
}

/// Names the nodes that show something, and lets triangles and spheres refer to these names instead
/// of the nodes. A node without a name has that of its mesh.
fn name_objects(root: &json::Root, scene: &mut Scene) {
    let mut indices = vec![u32::MAX; root.nodes.len()];
    let objects = &mut scene.objects;
    let mut renumber = |object: &mut u32| {
        let node = *object as usize;
        if indices[node] == u32::MAX {
            let mesh = root.nodes[node].mesh.map(|mesh| mesh.value());
            let fallback = mesh.and_then(|mesh| root.meshes[mesh].name.clone()).filter(|name| !name.is_empty());
            let name = root.nodes[node].name.clone().filter(|name| !name.is_empty()).or(fallback);
            indices[node] = objects.len() as u32;
            objects.push(name.unwrap_or_else(|| format!("node {node}")));
        }
        *object = indices[node];
    };
    scene.triangles.iter_mut().for_each(|triangle| renumber(&mut triangle.object));
    scene.spheres.iter_mut().for_each(|sphere| renumber(&mut sphere.object));
    scene.instances.iter_mut().for_each(|instance| renumber(&mut instance.object));
}

/// Appends the attributes to which the triangles of shared meshes refer by index plus one.
fn add_attributes_of_meshes(attributes: Vec<Attributes>, scene: &mut Scene) {
    let first = scene.attributes.len() as u32;
    let triangles = scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.triangles);
    triangles.filter(|triangle| triangle.attributes > 0).for_each(|triangle| triangle.attributes += first);
    scene.attributes.extend(attributes);
}

/// A copy of a mesh with its name in messages.
fn mesh_range(root: &json::Root, (triangles, node): placing::PlacedMesh) -> MeshRange {
    let mesh = root.nodes[node].mesh.map_or(0, |mesh| mesh.value());
    MeshRange { triangles, name: mesh_name(root, mesh) }
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

    /// The materials of the spheres.
    fn uses(&self) -> Vec<Use> {
        let of = |sphere: &PlacedSphere| Use {
            owner: Owner::Sphere(sphere.node),
            material: sphere.material,
            sets: Vec::new(),
        };
        self.spheres.iter().map(of).collect()
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
        cameras::note_equal_names(&scene.cameras, notes);
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
        let (center, radius) = ((self.center - center).as_vec3(), self.radius as f32);
        Sphere { center, radius, material: slot(self.material), object: self.node as u32 }
    }
}
