//! The kernels of the camera pass, compiled for a scene.

use super::direct_light::DirectLighting;
use crate::{
    gpu::{Gpu, Kernel},
    settings::PhotonSettings,
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
        let lobes = (scene.materials.has_rough && shows).then(|| scene.kernel_with(gpu, "light_lobes", &[sampler]));
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
