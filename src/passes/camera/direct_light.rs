//! Direct light at visible points: shadow rays to each punctual light, and samples of emissive
//! surfaces and the environment.

use crate::{
    gpu::{Buffer, Commands, Gpu, Kernel},
    layout::{DirectLight, EmitterSample},
    settings::Sampler,
    upload::{SceneBuffers, sampler_constant},
};

/// Kernels of direct light.
#[derive(Debug)]
pub struct DirectLighting {
    punctual: Kernel,
    /// Kernel and number of samples for the other lights; `None` if there are none.
    emitters: Option<(Kernel, u32)>,
}

impl DirectLighting {
    /// Compiles the kernels that the scene's lights need. `samples`: samples per point of emissive
    /// surfaces and the environment.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, sampler: Sampler, samples: u32) -> Self {
        let sample = || scene.kernel_with(gpu, "sample_emitters", &[sampler_constant(sampler)]);
        let emitters = scene.lights.table.has_extent().then(|| (sample(), samples));
        Self { punctual: scene.kernel(gpu, "light_directly"), emitters }
    }

    /// Number of steps, each one dispatch: one per punctual light, then one per sample.
    pub fn steps(&self, scene: &SceneBuffers) -> u32 {
        scene.lights.table.punctual as u32 + self.emitters.as_ref().map_or(0, |(_, samples)| *samples)
    }

    /// Adds the direct light of one step to the radiance of the points. `buffers` are `tile`,
    /// `points`, `radiance` and `counters`.
    pub fn add(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        commands: &mut Commands,
        (step, points): (u32, u32),
        buffers: &[(&str, &Buffer)],
    ) {
        let table = &scene.lights.table;
        let punctual = table.punctual as u32;
        let Some(sample) = step.checked_sub(punctual) else {
            let uniform = gpu.uniform("direct light", &DirectLight { light: step, points, ..Default::default() });
            let bindings = self.punctual.bind(gpu, &[&scene.with(buffers)[..], &[("direct", &uniform)]].concat());
            return self.punctual.dispatch(commands, &bindings, u64::from(points));
        };
        let Some((kernel, samples)) = &self.emitters else { return };
        let (samples, light_count) = (*samples, table.lights.len() as u32);
        let uniform = gpu.uniform("emitter sample", &EmitterSample { points, sample, samples, light_count });
        let own = [("sampling", &uniform), ("choices", &scene.lights.direct.buffer)];
        let bindings = kernel.bind(gpu, &[&scene.with(buffers)[..], &own].concat());
        kernel.dispatch(commands, &bindings, u64::from(points));
    }
}
