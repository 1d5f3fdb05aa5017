//! Final gathering: light at visible points from the surfaces that rays from them hit (Jensen 2001,
//! "Realistic Image Synthesis Using Photon Mapping", section 8.2). Kernels: `start_final_gather`,
//! `trace_camera`.

use super::{
    camera_tracer::CameraTracer,
    tile::{StepCount, Tile},
};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{CameraTile, FinalStep, VisiblePoint},
    passes::wavefront::Step,
    reference::mix,
    settings::Sampler,
    upload::{SceneBuffers, sampler_constant},
};

/// Kernels, and a buffer for the hits of one ray of each visible point. Memory does not grow with
/// the number of rays.
#[derive(Debug)]
pub struct FinalGather {
    start: Kernel,
    trace: Kernel,
    /// Direct light at rough lobes, if there are any.
    lobes: Option<Kernel>,
    rays: u32,
    /// Hits of the current ray: a [`VisiblePoint`] per visible point of the camera. Its weight
    /// includes the camera path. Some slots have no point.
    pub seen: Buffer,
}

impl FinalGather {
    /// `rays` per visible point, at least 1.
    ///
    /// # Errors
    /// Limits of the adapter.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, tracer: &CameraTracer, sampler: Sampler, rays: u32) -> Result<Self> {
        let sampler = sampler_constant(sampler);
        Ok(Self {
            start: scene.kernel_with(gpu, "start_final_gather", &[sampler]),
            // An emitter that a ray hits gives direct light, or a caustic by way of lobes that cast
            // one: the visible point has both already.
            trace: scene.kernel_with(gpu, "trace_camera", &[sampler, ("SEES_BEYOND_WIDE_LOBES", 1.0)]),
            lobes: (scene.materials.has_rough)
                .then(|| scene.kernel_with(gpu, "light_lobes", &[sampler, ("LIGHTS_WIDE_LOBES_ONLY", 1.0)])),
            rays,
            seen: gpu.storage::<VisiblePoint>("points seen in final gathering", tracer.room())?,
        })
    }

    /// Rays of each visible point.
    #[must_use]
    pub fn rays(&self) -> u32 {
        self.rays
    }

    /// Traces the `ray`-th ray of each visible point of the tile to the first diffuse surface.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn trace(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        tracer: &CameraTracer,
        tile: &Tile,
        ray: u32,
    ) -> Result<StepCount> {
        let view = tracer.tile_view(tile);
        let points = tracer.point_count(tile);
        let step = gpu.uniform("final step", &FinalStep { ray, rays: self.rays, points, pad: 0 });
        let camera = gpu.uniform("camera tile", &view);
        // Each visible point is a sample of its own. At glass, each of its rays chooses reflection
        // or refraction at random.
        let own = gpu.uniform(
            "final gather tile",
            &CameraTile {
                seed: mix(view.seed ^ mix(ray.wrapping_add(1))),
                branches: 1,
                samples: view.samples * view.branches,
                first_sample: view.first_sample * view.branches,
                ..view
            },
        );
        let started = [("tile", &camera), ("final_step", &step), ("points", &tracer.points), ("seen", &self.seen)];
        let followed = [("tile", &own), ("points", &self.seen)];
        let start = Step { kernel: &self.start, buffers: &started };
        tracer.follow(
            gpu,
            scene,
            (&start, points),
            &Step { kernel: &self.trace, buffers: &followed },
            self.lobes.as_ref(),
        )
    }
}
