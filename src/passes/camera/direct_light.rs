//! Direct light at visible points: shadow rays to each of few punctual lights, and samples of the
//! other lights.

use crate::{
    gpu::{Bindings, Buffer, Gpu, Kernel},
    layout::{DirectLight, EmitterSample},
    passes::lists::Lists,
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

    /// The kernel of a step, which adds direct light to the radiance of the points in the queue.
    /// `buffers` are `tile`, `points`, `radiance`, `counters`, `queues` and `lists`.
    pub fn step(&self, gpu: &Gpu, scene: &SceneBuffers, step: u32, buffers: &[(&str, &Buffer)]) -> (&Kernel, Bindings) {
        let (kernel, uniform) = self.kernel(gpu, scene, step);
        (kernel, kernel.bind(gpu, &[&scene.with(buffers)[..], &[(uniform.0, &uniform.1)]].concat()))
    }

    /// The kernel of a step that goes on with late rays.
    pub fn late(&self, gpu: &Gpu, scene: &SceneBuffers, step: u32, buffers: &[(&str, &Buffer)]) -> (Kernel, Bindings) {
        let (kernel, uniform) = self.kernel(gpu, scene, step);
        Lists::kernel(gpu, kernel, &[&scene.with(buffers)[..], &[(uniform.0, &uniform.1)]].concat())
    }

    /// The kernel of a step, and its uniform by name.
    fn kernel(&self, gpu: &Gpu, scene: &SceneBuffers, step: u32) -> (&Kernel, (&'static str, Buffer)) {
        let table = &scene.lights.table;
        match (table.summed.get(step as usize), &self.sampled) {
            (None, Some((kernel, samples))) => {
                let (sample, samples, roots) = (step - table.summed.len() as u32, *samples, table.sampled_roots);
                let sampling = EmitterSample { sample, samples, roots, pad: 0 };
                (kernel, ("sampling", gpu.uniform("emitter sample", &sampling)))
            }
            (light, _) => {
                let light = *light.expect("one of the steps");
                let direct = DirectLight { light, ..Default::default() };
                (&self.punctual, ("direct", gpu.uniform("direct light", &direct)))
            }
        }
    }
}
