//! Bind group 0: the scene on the device. Owner of `shaders/bindings/scene.wesl`.

use std::sync::Arc;

use bytemuck::Pod;
use glam::Vec3;
use rayon::prelude::*;

use super::{light_buffers::LightBuffers, material_buffers::MaterialBuffers};
use crate::{
    bvh::{Bvh, Contacts, FILLER, MediaProbe, contacts},
    emitters::light_table::LightTable,
    error::Result,
    gpu::{
        Buffer, Gpu, Kernel, SHORT_LOOPS, Table,
        shaders::{Shader, shader},
    },
    layout::{
        self, ALPHA_BIT, CLEAR_BIT, CONTACT_BIT, INSTANCE, INSTANCED_STACK, Primitive, RANK_SHIFT, SLOT_SHIFT,
        SPHERE_BIT, TRANSMITS_BIT,
    },
    scene::{Alpha, Material, Medium, Scene, Solids},
    settings::{LightSettings, Sampler},
};

/// Kernels of which an invocation traces two rays, each by half of the loops.
const TWO_RAYS: [&str; 2] = ["light_lobes", "sample_emitters"];

/// The scene's buffers.
#[derive(Debug)]
pub struct SceneBuffers {
    nodes: Arc<Split>,
    primitives: Split,
    normals: Table,
    pub materials: MaterialBuffers,
    media: Table,
    instances: Table,
    has_instances: bool,
    has_spheres: bool,
    /// Maximum number of deferred children in a traversal.
    stack: usize,
    /// Nodes and primitives: no ray visits more.
    visits: u32,
    /// No primitive is listed several times.
    is_listed_once: bool,
    no_lists: Arc<Buffer>,
    /// Ranks of primitives that lie in each other.
    contacts: Arc<Contacts>,
    /// Some solid absorbs light.
    has_absorption: bool,
    has_dispersion: bool,
    caustic_roughness: f32,
    single_scattering: bool,
    /// Some surface has another lobe than a diffuse one.
    pub has_lobes: bool,
    /// Some surface sends light on in two ways: it reflects and transmits, or has a coat above its
    /// diffuse base.
    pub splits: bool,
    /// The environment is a picture.
    pub has_environment_map: bool,
    pub lights: LightBuffers,
    /// Solids and the surfaces that bound them.
    pub solids: Solids,
    /// Some surface has a diffuse lobe.
    pub has_diffuse: bool,
    /// Nothing but panes and plates that rays to lights pass casts caustics.
    pub only_clear_surfaces_cast: bool,
}

/// The `override` constant that selects a kernel's sampler: the source of its sample numbers.
#[must_use]
pub fn sampler_constant(sampler: Sampler) -> (&'static str, f64) {
    let number = match sampler {
        Sampler::Sobol => layout::SAMPLER_SOBOL,
        Sampler::Random => layout::SAMPLER_RANDOM,
    };
    ("SAMPLER", f64::from(number))
}

/// An array in a storage buffer, and what exceeds one binding in a table; or all of it in that.
#[derive(Debug)]
struct Split {
    low: Buffer,
    high: Table,
    /// First element in `high`, or [`NOT_SPLIT`].
    at: u64,
}

/// No array is so long.
const NOT_SPLIT: u64 = u32::MAX as u64;

impl SceneBuffers {
    /// Uploads the scene.
    ///
    /// # Errors
    /// [`crate::Error::Limit`] if normals, materials or media exceed a table; as
    /// [`LightBuffers::new`].
    pub fn new(gpu: &Gpu, scene: &Scene, bvh: &Bvh, settings: &LightSettings) -> Result<Self> {
        Self::with_contacts(gpu, (scene, bvh), Arc::new(contacts(scene, bvh)), settings)
    }

    /// As [`Self::new`], with contacts that were found before: those of the scene in its whole
    /// light.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_contacts(
        gpu: &Gpu,
        (scene, bvh): (&Scene, &Bvh),
        contacts: Arc<Contacts>,
        settings: &LightSettings,
    ) -> Result<Self> {
        let solids = Solids::new(scene);
        let row = |m: &Medium| layout::Medium {
            tint: m.tint.to_array(),
            ior: m.ior,
            absorption: m.absorption.to_array(),
            dispersion: m.dispersion,
        };
        let media: Vec<_> = solids.media.iter().map(row).collect();
        let lights = LightBuffers::new(gpu, (scene, bvh), &MediaProbe::new(scene, bvh, &solids), settings)?;
        Ok(Self {
            nodes: Arc::new(Split::new(gpu, "bvh nodes", &bvh.nodes)?),
            primitives: Split::new::<Primitive>(
                gpu,
                "primitives",
                &marked(&bvh.primitives, scene, &solids, &contacts.ranks, &lights.table),
            )?,
            normals: Table::new(gpu, "normals", &bvh.normals)?,
            materials: MaterialBuffers::new(gpu, scene, settings.unit)?,
            has_absorption: solids.media.iter().any(|m| m.absorption != Vec3::ZERO),
            caustic_roughness: scene.options.caustic_roughness,
            single_scattering: scene.options.single_scattering,
            has_dispersion: solids.media.iter().any(|m| m.dispersion > 0.0),
            media: Table::new(gpu, "media", &media)?,
            instances: Table::new(gpu, "instances", &bvh.instances)?,
            has_instances: !bvh.instances.is_empty(),
            visits: visits(bvh),
            is_listed_once: is_listed_once(scene, bvh),
            no_lists: Arc::new(gpu.storage::<u32>("no lists", 1)?),
            contacts,
            only_clear_surfaces_cast: only_clear_surfaces_cast(scene, &solids),
            has_diffuse: scene.has_diffuse(),
            has_lobes: scene.has_lobes(),
            splits: scene
                .materials
                .iter()
                .any(|m| m.surface.ior().is_some() || m.surface.is_coated() || m.is_finished()),
            has_environment_map: scene.environment.as_ref().is_some_and(|sky| sky.pixels.len() > 1),
            has_spheres: !scene.spheres.is_empty(),
            stack: rounded_stack(gpu, bvh.max_stack_depth()),
            solids,
            lights,
        })
    }

    /// The buffers of the same scene in another light; it shares what does not depend on the light.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn relit(&self, gpu: &Gpu, scene: &Scene, bvh: &Bvh, settings: &LightSettings) -> Result<Self> {
        let lights = LightBuffers::new(gpu, (scene, bvh), &MediaProbe::new(scene, bvh, &self.solids), settings)?;
        let primitives = marked(&bvh.primitives, scene, &self.solids, &self.contacts.ranks, &lights.table);
        Ok(Self {
            nodes: Arc::clone(&self.nodes),
            primitives: Split::new::<Primitive>(gpu, "primitives", &primitives)?,
            normals: self.normals.clone(),
            materials: self.materials.relit(gpu, scene, settings.unit)?,
            media: self.media.clone(),
            instances: self.instances.clone(),
            solids: self.solids.clone(),
            contacts: Arc::clone(&self.contacts),
            no_lists: Arc::clone(&self.no_lists),
            lights,
            ..*self
        })
    }

    /// Whether some surface is there in part.
    #[must_use]
    pub fn has_veils(&self) -> bool {
        self.materials.has_veils
    }

    /// Whether rays to lights pass some panes or plates: they would lose light at each listing of
    /// one.
    #[must_use]
    pub fn has_clear_surfaces(&self) -> bool {
        (self.materials.has_clear_panes || self.solids.has_plates()) && self.is_listed_once
    }

    /// Whether a ray may visit more than an invocation can.
    #[must_use]
    pub fn has_late_rays(&self, gpu: &Gpu) -> bool {
        self.visits > gpu.trace_budget / 4
    }

    /// Whether rays may meet surfaces at which they wait for one another: `settle` in
    /// `lib/transport/intersect.wesl`.
    fn has_waiting_rays(&self) -> bool {
        self.materials.has_alpha || self.has_contacts() || self.has_clear_surfaces()
    }

    /// Whether some surfaces lie in each other.
    fn has_contacts(&self) -> bool {
        self.contacts.ranks.iter().any(Option::is_some)
    }

    /// Compiles a kernel that uses the scene.
    #[must_use]
    pub fn kernel(&self, gpu: &Gpu, stem: &str) -> Kernel {
        self.kernel_with(gpu, stem, &[])
    }

    /// Variant of [`Self::kernel`] with further `override` constants.
    #[must_use]
    pub fn kernel_with(&self, gpu: &Gpu, stem: &str, others: &[(&str, f64)]) -> Kernel {
        self.kernel_of(gpu, shader(stem), others)
    }

    /// Variant of [`Self::kernel_with`] for a shader of another table: the probes of the tests.
    #[doc(hidden)]
    #[must_use]
    pub fn kernel_of(&self, gpu: &Gpu, shader: &'static Shader, others: &[(&str, f64)]) -> Kernel {
        let mut overrides = vec![
            ("HAS_SPHERES", f64::from(u8::from(self.has_spheres))),
            ("HAS_CONTACTS", f64::from(u8::from(self.has_contacts()))),
            ("HAS_INSTANCES", f64::from(u8::from(self.has_instances))),
            ("STACK_WORDS", (self.stack + 1) as f64 * f64::from(layout::WORKGROUP_SIZE)),
            ("HAS_LAYERS", f64::from(u8::from(self.materials.has_layers))),
            ("HAS_FINISHES", f64::from(u8::from(self.materials.has_finishes))),
            ("HAS_FILMS", f64::from(u8::from(self.materials.has_films))),
            ("CAUSTIC_ROUGHNESS", f64::from(self.caustic_roughness)),
            ("COMPENSATES", f64::from(u8::from(!self.single_scattering))),
            ("HAS_DISPERSION", f64::from(u8::from(self.has_dispersion))),
            ("HAS_TEXTURES", f64::from(u8::from(self.materials.has_textures))),
            ("HAS_ALPHA", f64::from(u8::from(self.materials.has_alpha))),
            ("HAS_VEILS", f64::from(u8::from(self.has_veils()))),
            ("WEIGHS_VEILS", f64::from(u8::from(self.is_listed_once))),
            ("HAS_CLEAR_SURFACES", f64::from(u8::from(self.has_clear_surfaces()))),
            ("HAS_ABSORPTION", f64::from(u8::from(self.has_absorption))),
            ("HAS_VARIED_LIGHTS", f64::from(u8::from(self.lights.table.is_varied))),
            ("WEIGHED_LIGHTS", f64::from(self.lights.table.weighed())),
            ("HAS_ENVIRONMENT", f64::from(u8::from(self.lights.has_environment))),
            ("HAS_OPENINGS", f64::from(u8::from(self.lights.has_openings))),
            ("NODE_SPLIT", self.nodes.at as f64),
            ("PRIMITIVE_SPLIT", self.primitives.at as f64),
        ];
        overrides.extend_from_slice(others);
        // After those of the caller, which has the say. Few values, so that few kernels are
        // compiled.
        let budget = self.visits.next_power_of_two().max(SHORT_LOOPS).min(gpu.trace_budget);
        let rays = if TWO_RAYS.contains(&shader.stem) { 2 } else { 1 };
        // Rays that wait for one another take more loops together than each alone.
        let waits = if self.has_waiting_rays() { 2 } else { 1 };
        overrides.push(("TRACE_BUDGET", f64::from(budget / (rays * waits))));
        let lights = self.lights.tables();
        let own = [("normals", &self.normals), ("media_table", &self.media), ("instances", &self.instances)];
        let high = [("nodes_high", &self.nodes.high), ("primitives_high", &self.primitives.high)];
        let own = [&own[..], &high, &lights].concat();
        let tables = [&own[..], &self.materials.tables()].concat();
        Kernel::of(gpu, shader, &overrides).with_tables(&tables)
    }

    /// The scene's variables, followed by others. Kernels of which nobody finishes late rays list
    /// them nowhere.
    #[must_use]
    pub fn with<'a>(&'a self, others: &[(&'a str, &'a Buffer)]) -> Vec<(&'a str, &'a Buffer)> {
        let mut all = vec![("nodes", &self.nodes.low), ("primitives", &self.primitives.low)];
        all.extend(self.lights.bindings());
        all.extend_from_slice(others);
        // The first of a name is bound.
        all.push(("lists", &self.no_lists));
        all
    }
}

/// Size of the stack of a traversal, rounded up, so that few variants of a kernel are compiled:
/// more so where it takes no memory of workgroups that would let fewer of them run at once.
fn rounded_stack(gpu: &Gpu, depth: usize) -> usize {
    let step = if gpu.is_software { 32 } else { 16 };
    depth.max(1).next_multiple_of(step).min(INSTANCED_STACK)
}

impl Split {
    fn new<T: Pod>(gpu: &Gpu, label: &str, data: &[T]) -> Result<Self> {
        let fits = usize::try_from(gpu.max_binding() / size_of::<T>() as u64).unwrap_or(usize::MAX);
        let (low, high) = data.split_at(if gpu.reads_images { 0 } else { data.len().min(fits) });
        let at = if high.is_empty() { NOT_SPLIT } else { low.len() as u64 };
        Ok(Self { low: gpu.storage_with(label, low)?, high: Table::layered(gpu, label, high)?, at })
    }
}

fn only_clear_surfaces_cast(scene: &Scene, solids: &Solids) -> bool {
    let casting = scene.caustic_materials().into_iter().zip(&scene.materials).filter(|(casts, _)| *casts);
    let are_plates = solids.are_plates() && scene.spheres.is_empty();
    casting.map(|(_, material)| material).all(|m| m.is_clear_pane() || (are_plates && m.medium().is_some()))
}

/// Whether the hierarchy lists each of the scene's primitives once.
fn is_listed_once(scene: &Scene, bvh: &Bvh) -> bool {
    let of_meshes: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let all = scene.triangles.len() + scene.spheres.len() + of_meshes;
    bvh.primitives.iter().filter(|p| p.id != FILLER && p.emitter != INSTANCE).count() <= all
}

/// Nodes and primitives that a ray may visit, those of each instance counted.
fn visits(bvh: &Bvh) -> u32 {
    let all = bvh.nodes.len() + bvh.primitives.len();
    // A tree has fewer nodes than primitives.
    let of_instance = |from: &layout::Instance, to: u32| 2 * (to - from.first) as usize;
    let firsts = bvh.instances.iter().skip(2).map(|instance| instance.first);
    let between: usize = bvh.instances.iter().skip(1).zip(firsts).map(|(from, to)| of_instance(from, to)).sum();
    // The last may be as large as all that are stored.
    let last = if bvh.instances.is_empty() { 0 } else { all };
    u32::try_from(all + between + last).unwrap_or(u32::MAX >> 1)
}

/// The primitives, each with the light that it is, and marked as [`Primitive::material`] says.
fn marked(
    primitives: &[Primitive],
    scene: &Scene,
    solids: &Solids,
    contacts: &[Option<u32>],
    lights: &LightTable,
) -> Vec<Primitive> {
    let transmits: Vec<bool> = scene.materials.iter().map(|m| m.surface.transmits()).collect();
    let is_clear_pane: Vec<bool> = scene.materials.iter().map(Material::is_clear_pane).collect();
    let has_alpha: Vec<bool> = scene.materials.iter().map(|m| m.alpha != Alpha::Opaque).collect();
    let mark = |(p, rank): (&Primitive, &Option<u32>)| {
        if p.emitter == INSTANCE {
            return *p;
        }
        let of = |marks: &[bool]| marks.get((p.material & !SPHERE_BIT) as usize) == Some(&true);
        let alpha = if of(&has_alpha) { ALPHA_BIT } else { 0 };
        // A pane in contact with other surfaces is a part of what it makes with them.
        let is_clear = (of(&is_clear_pane) && rank.is_none()) || solids.is_face_of_plate(p.id);
        let clear = if is_clear { CLEAR_BIT } else { 0 };
        let transmits = if of(&transmits) { TRANSMITS_BIT } else { 0 };
        let bits = alpha | clear | transmits | if rank.is_some() { CONTACT_BIT } else { 0 };
        let material = p.material | bits | (solids.slot(p.id) << SLOT_SHIFT);
        let id = p.id | rank.unwrap_or(0) << RANK_SHIFT;
        Primitive { emitter: lights.emitter(p.id), material, id, ..*p }
    };
    primitives.par_iter().zip(contacts).map(mark).collect()
}
