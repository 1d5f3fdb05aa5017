//! Light that reaches visible points straight from what shines: shadow rays to each light without extent, and samples of
//! emissive surfaces and the environment.

use super::SceneBuffers;
use crate::{
    gpu::{Buffer, Gpu, Kernel},
    layout::{DirectLight, EmitterSample},
};

/// Kernels of direct light.
#[derive(Debug)]
pub struct DirectLighting {
    punctual: Kernel,
    /// With the number of samples; `None` if nothing with an extent shines.
    emitters: Option<(Kernel, u32)>,
}

impl DirectLighting {
    /// Compiles what the scene's lights need; `samples` of each point for those with an extent.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, samples: u32) -> Self {
        let emitters = scene.lights.table.has_extent().then(|| (scene.kernel(gpu, "sample_emitters"), samples));
        Self { punctual: scene.kernel(gpu, "light_directly"), emitters }
    }

    /// Adds the light to the radiance of the points. `buffers` are `tile`, `points`, `radiance` and `counters`.
    pub fn add(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        encoder: &mut wgpu::CommandEncoder,
        points: u32,
        buffers: &[(&str, &Buffer)],
    ) {
        let table = &scene.lights.table;
        for light in 0..table.punctual as u32 {
            let uniform = gpu.uniform("direct light", &DirectLight { light, points, ..Default::default() });
            let bindings = self.punctual.bind(gpu, &[&scene.with(buffers)[..], &[("direct", &uniform)]].concat());
            self.punctual.dispatch(encoder, &bindings, u64::from(points));
        }
        let Some((kernel, samples)) = &self.emitters else { return };
        let (samples, light_count) = (*samples, table.lights.len() as u32);
        for sample in 0..samples {
            let uniform = gpu.uniform("emitter sample", &EmitterSample { points, sample, samples, light_count });
            let own = [("sampling", &uniform), ("choices", &scene.lights.direct.buffer)];
            let bindings = kernel.bind(gpu, &[&scene.with(buffers)[..], &own].concat());
            kernel.dispatch(encoder, &bindings, u64::from(points));
        }
    }
}
