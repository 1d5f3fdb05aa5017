//! The kernels of the camera pass, compiled for a scene.

use super::direct_light::DirectLighting;
use crate::{
    gpu::{Gpu, Kernel},
    settings::{PhotonSettings, Sampler},
    upload::{SceneBuffers, sampler_constant},
};

/// Kernels of the camera pass.
#[derive(Debug)]
pub struct CameraKernels {
    pub(super) start: Kernel,
    pub(super) trace: Kernel,
    /// Direct light at rough lobes; `None` if there are none, or the picture shows no emitters.
    pub(super) lobes: Option<Kernel>,
    pub(super) direct: DirectLighting,
    pub(super) resolve: Kernel,
}

impl CameraKernels {
    #[must_use]
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, photons: &PhotonSettings, light_samples: u32) -> Self {
        let sampler = sampler_constant(photons.sampler);
        let shows = photons.mode.sees_lights();
        let sees_lights = ("SEES_LIGHTS", f64::from(u8::from(shows)));
        let lobes = shows.then(|| lobe_lighting(gpu, scene, photons.sampler)).flatten();
        Self {
            start: scene.kernel_with(gpu, "start_camera", &[sampler]),
            trace: scene.kernel_with(gpu, "trace_camera", &[sampler, sees_lights]),
            lobes,
            direct: DirectLighting::new(gpu, scene, photons.sampler, light_samples),
            resolve: Kernel::new(gpu, "resolve", &[]),
        }
    }

    /// Has the kernels compiled ahead of their use.
    pub fn prefetch(gpu: &Gpu, scene: &SceneBuffers, photons: &PhotonSettings, light_samples: u32) {
        let _ = Self::new(gpu, scene, photons, light_samples);
    }
}

/// Slices of a triangle that narrow lobes see a small part of.
const LIGHT_SLICES: u32 = 16;

/// The kernel of direct light at rough lobes, if there are any.
pub(super) fn lobe_lighting(gpu: &Gpu, scene: &SceneBuffers, sampler: Sampler) -> Option<Kernel> {
    let slices = if scene.lights.table.has_surfaces() { LIGHT_SLICES } else { 0 };
    let constants = [sampler_constant(sampler), ("LIGHT_SLICES", slices.into())];
    scene.materials.has_rough.then(|| scene.kernel_with(gpu, "light_lobes", &constants))
}
