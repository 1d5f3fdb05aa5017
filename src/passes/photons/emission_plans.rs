//! The emissions that fill the maps: which lights their paths start from, where they are aimed, and
//! what is stored of them.

use super::{
    photon_batch::{BatchBuffers, PhotonKernels},
    pilot::trace_pilot,
    steering::Steering,
};
use crate::{
    error::Result,
    gpu::Gpu,
    layout::{self, PhotonBatch},
    map_kind::{ByKind, MapKind},
    settings::{Emission, LightSampling, MAX_BOUNCES, PhotonSettings},
    upload::{SceneBuffers, light_buffers::ChoiceBuffer},
};

/// Fixed-point unit of lost flux, as a fraction of a path's mean flux.
pub(super) const LOST_UNIT: f64 = 1.0 / 4096.0;

/// Indices of the paths of one emission: `count` of them from `first` on; `None`: until the maps
/// are full, hardly grow, or the setting's maximum of paths is emitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathRange {
    pub first: u64,
    pub count: Option<u64>,
}

/// Indices of the paths of both emissions, by the map that they are for.
pub type PathRanges = ByKind<PathRange>;

/// One emission: paths of one kind, numbered from 0.
pub(super) struct EmissionPlan<'a> {
    pub choices: &'a ChoiceBuffer,
    stream: u32,
    first_target: u32,
    target_count: u32,
    entry_count: u32,
    /// Rules of all batches: [`layout::AIM`], [`layout::CAUSTICS_APART`], and the rules of the mode
    /// that apply to these paths.
    rules: u32,
    pub fills: &'static [MapKind],
    /// Sphere that diffuse surfaces send more photons to.
    aim: [f32; 4],
    pub paths: PathRange,
    kept_scale: f32,
    least_kept: f32,
}

/// What is changed of the general paths by what a pilot learned.
pub(super) struct Steered {
    choices: Option<ChoiceBuffer>,
    kept_scale: f32,
    least_kept: f32,
}

/// What a pilot learns about the general paths; `None` if they are spread by power, and aimed at
/// spheres.
pub(super) fn steered(
    gpu: &Gpu,
    scene: &SceneBuffers,
    (kernels, settings): (&PhotonKernels, &PhotonSettings),
    (buffers, batch_limit, max_paths): (&BatchBuffers, u64, u64),
) -> Result<Option<Steered>> {
    let lights = &scene.lights;
    let has_paths = settings.mode.stores_direct() || settings.mode.follows_diffuse();
    // An estimate of k photons about each point errs by 1/√k however many there are: more of them
    // take longer than they gain.
    let is_steered = has_paths && settings.emission == Emission::Aimed && settings.final_gather > 0;
    let Some(importance) = lights.importance.as_ref().filter(|_| is_steered) else {
        return Ok(None);
    };
    let plan = unsteered(scene, settings);
    let batch = PhotonBatch {
        staging_capacity: buffers.staging_capacity as u32,
        rules: plan.rules | layout::STORE_GLOBAL,
        stream: layout::STREAM_PILOT,
        ..plan.batch(scene, settings, &ByKind { global: false, caustic: false })
    };
    let pilot = trace_pilot(gpu, scene, kernels, (buffers, batch_limit), (importance, &batch))?;
    let Some(pilot) = pilot else { return Ok(None) };
    let per_path = pilot.photons.len() as f64 / pilot.cluster_of.len() as f64;
    let most = max_paths as f64 * per_path / f64::from(settings.global.max(1));
    let by_power = lights.settings.sampling == LightSampling::Power;
    let Some(Steering { factors, kept_scale, least_kept }) = pilot.steering(by_power, most) else {
        return Ok(None);
    };
    let choices = factors.map(|factors| {
        let mut of_lights = vec![0.0; lights.table.lights.len()];
        for (cluster, factor) in pilot.clusters.iter().zip(factors) {
            cluster.lights.iter().for_each(|light| of_lights[*light as usize] = factor);
        }
        ChoiceBuffer::new(gpu, "steered light choices", &lights.table.for_steered_photons(&of_lights, &lights.settings))
    });
    Ok(Some(Steered { choices: choices.transpose()?, kept_scale, least_kept }))
}

/// The emissions that fill the maps, without those that have no light to choose.
pub(super) fn plans<'a>(
    scene: &'a SceneBuffers,
    settings: &PhotonSettings,
    caustics: bool,
    paths: &PathRanges,
    steered: Option<&'a Steered>,
) -> Vec<EmissionPlan<'a>> {
    let lights = &scene.lights;
    let aimed = settings.emission == Emission::Aimed;
    let plain = EmissionPlan { paths: paths.global, ..unsteered(scene, settings) };
    let general = match steered {
        Some(Steered { choices, kept_scale, least_kept }) => EmissionPlan {
            choices: choices.as_ref().unwrap_or(&lights.photons),
            kept_scale: *kept_scale,
            least_kept: *least_kept,
            ..plain
        },
        None => towards_seen(scene, plain),
    };
    let caustic = EmissionPlan {
        choices: &lights.aimed,
        stream: layout::STREAM_CAUSTIC,
        first_target: lights.seen_targets + 1 + lights.entries,
        target_count: lights.specular_targets,
        entry_count: 0,
        rules: layout::AIM | layout::CAUSTICS_APART,
        fills: &[MapKind::Caustic],
        paths: paths.caustic,
        ..unsteered(scene, settings)
    };
    let wanted = [Some(general), (aimed && caustics).then_some(caustic)];
    wanted.into_iter().flatten().filter(|plan| plan.choices.strata > 0).collect()
}

/// The paths, aimed at what the cameras see where that is a small part of the scene.
fn towards_seen<'a>(scene: &'a SceneBuffers, plan: EmissionPlan<'a>) -> EmissionPlan<'a> {
    let lights = &scene.lights;
    match &lights.towards_seen {
        Some(choices) if plan.rules & layout::AIM != 0 => {
            EmissionPlan { choices, first_target: 0, target_count: lights.seen_targets + 1, aim: lights.seen, ..plan }
        }
        _ => plan,
    }
}

/// Lights and batch of a pilot's paths of all light but that of caustics, whatever the mode.
pub(super) fn pilot_of_other_light<'a>(
    scene: &'a SceneBuffers,
    settings: &PhotonSettings,
) -> (&'a ChoiceBuffer, PhotonBatch) {
    let plan = towards_seen(scene, unsteered(scene, settings));
    let batch = plan.batch(scene, settings, &ByKind { global: false, caustic: false });
    let all = layout::CAUSTICS_APART | layout::STORE_GLOBAL | layout::STORE_DIRECT | layout::FOLLOW_DIFFUSE;
    (plan.choices, PhotonBatch { rules: batch.rules | all, stream: layout::STREAM_PILOT, ..batch })
}

/// General paths, spread over the lights by power and over the scene.
fn unsteered<'a>(scene: &'a SceneBuffers, settings: &PhotonSettings) -> EmissionPlan<'a> {
    let lights = &scene.lights;
    let rule = |holds: bool, bit: u32| if holds { bit } else { 0 };
    let aimed = settings.emission == Emission::Aimed;
    EmissionPlan {
        choices: &lights.photons,
        stream: layout::STREAM_PHOTON,
        first_target: lights.seen_targets,
        target_count: 1,
        entry_count: if aimed { lights.entries } else { 0 },
        // Rays of final gathering see light that was scattered diffusely before it came through
        // glass.
        rules: rule(aimed, layout::AIM)
            | rule(aimed || settings.final_gather > 0, layout::CAUSTICS_APART)
            | rule(settings.mode.stores_direct(), layout::STORE_DIRECT)
            | rule(settings.mode.follows_diffuse(), layout::FOLLOW_DIFFUSE),
        fills: if aimed { &[MapKind::Global] } else { &MapKind::ALL },
        aim: [0.0; 4],
        paths: PathRange::default(),
        kept_scale: 0.0,
        least_kept: 0.0,
    }
}

impl EmissionPlan<'_> {
    /// Whether the map has only light over other surfaces, and nobody asks for a number of paths.
    pub fn is_for_little_light(&self, settings: &PhotonSettings) -> bool {
        settings.max_paths.is_none() && self.fills == [MapKind::Global] && !settings.mode.stores_direct()
    }

    /// Whether its paths are traced for caustics alone, as many as it takes.
    pub fn is_for_caustics(&self, settings: &PhotonSettings) -> bool {
        settings.max_paths.is_none() && self.fills == [MapKind::Caustic]
    }

    /// Settings that all batches of the emission share, and the rules for the maps that are still
    /// open.
    pub fn batch(&self, scene: &SceneBuffers, settings: &PhotonSettings, maps: &ByKind<bool>) -> PhotonBatch {
        let open = |kind: MapKind, bit: u32| {
            if self.fills.contains(&kind) && maps[kind] { bit } else { 0 }
        };
        PhotonBatch {
            seed: settings.seed,
            light_count: scene.lights.table.lights.len() as u32,
            strata: self.choices.strata,
            max_bounces: settings.bounce_limit(),
            max_surfaces: match scene.has_lobes {
                true => MAX_BOUNCES.min(settings.bounce_limit() + layout::CHAIN_LIMIT),
                false => settings.bounce_limit(),
            },
            rules: self.rules
                | open(MapKind::Global, layout::STORE_GLOBAL)
                | open(MapKind::Caustic, layout::STORE_CAUSTIC),
            lost_scale: (1.0 / (LOST_UNIT * scene.lights.table.power())) as f32,
            stream: self.stream,
            first_target: self.first_target,
            target_count: self.target_count,
            entry_count: self.entry_count,
            aim: self.aim,
            kept_scale: self.kept_scale,
            least_kept: self.least_kept,
            ..Default::default()
        }
    }
}
