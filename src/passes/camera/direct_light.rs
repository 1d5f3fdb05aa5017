//! Direct light at visible points: shadow rays to each of few punctual lights, and samples of the
//! other lights.

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
    sampled: Option<(Kernel, u32)>,
}

impl DirectLighting {
    /// Compiles the kernels that the scene's lights need. `samples`: samples per point.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, sampler: Sampler, samples: u32) -> Self {
        let table = &scene.lights.table;
        let meets_lights = ("MEETS_LIGHTS", f64::from(u8::from(table.has_extent())));
        let kernel = || scene.kernel_with(gpu, "sample_emitters", &[sampler_constant(sampler), meets_lights]);
        let sampled = table.is_sampled().then(|| (kernel(), samples));
        Self { punctual: scene.kernel(gpu, "light_directly"), sampled }
    }

    /// Number of steps, each one dispatch: one per light that is summed, then one per sample.
    pub fn steps(&self, scene: &SceneBuffers) -> u32 {
        scene.lights.table.summed.len() as u32 + self.sampled.as_ref().map_or(0, |(_, samples)| *samples)
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
        if let Some(&light) = table.summed.get(step as usize) {
            let uniform = gpu.uniform("direct light", &DirectLight { light, points, ..Default::default() });
            let bindings = self.punctual.bind(gpu, &[&scene.with(buffers)[..], &[("direct", &uniform)]].concat());
            return self.punctual.dispatch(commands, &bindings, u64::from(points));
        }
        let Some((kernel, samples)) = &self.sampled else { return };
        let (sample, samples, roots) = (step - table.summed.len() as u32, *samples, table.sampled_roots);
        let uniform = gpu.uniform("emitter sample", &EmitterSample { points, sample, samples, roots });
        let bindings = kernel.bind(gpu, &[&scene.with(buffers)[..], &[("sampling", &uniform)]].concat());
        kernel.dispatch(commands, &bindings, u64::from(points));
    }
}
