//! Final gathering: light at visible points from the surfaces that rays from them hit (Jensen 2001,
//! "Realistic Image Synthesis Using Photon Mapping", section 8.2). Kernels: `start_final_gather`,
//! `trace_camera`, `light_lobes`, `sum_final_gather`.

use glam::Vec3;

use super::{
    camera_kernels::lobe_lighting,
    camera_tracer::CameraTracer,
    direct_light::DirectLighting,
    ray_keys::RaySets,
    tile::{StepCount, Tile},
    waiting_points::WaitingPoints,
};
use crate::{
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{ArrivingLight, CameraTile, FinalStep, SEES_GLEAMS, VisiblePoint, from_octahedral},
    passes::wavefront::Step,
    reference::mix,
    settings::Sampler,
    upload::{SceneBuffers, sampler_constant},
};

/// Kernels of final gathering.
#[derive(Debug)]
struct FinalKernels {
    start: Kernel,
    trace: Kernel,
    sum: Kernel,
    /// Direct light at rough lobes, if there are any.
    lobes: Option<Kernel>,
    direct: DirectLighting,
}

impl FinalKernels {
    fn new(gpu: &Gpu, scene: &SceneBuffers, sampler: Sampler) -> Self {
        let constant = sampler_constant(sampler);
        Self {
            start: scene.kernel_with(gpu, "start_final_gather", &[constant]),
            trace: scene.kernel_with(gpu, "trace_camera", &[constant, ("SEES_LIGHTS", 1.0)]),
            sum: Kernel::new(gpu, "sum_final_gather", &[]),
            lobes: lobe_lighting(gpu, scene, sampler),
            direct: DirectLighting::new(gpu, scene, sampler, 1),
        }
    }
}

/// Kernels, and buffers for as many rays as a tile has points. Memory does not grow with the number
/// of rays.
#[derive(Debug)]
pub struct FinalGather {
    kernels: FinalKernels,
    rays: u32,
    /// The sets of numbers that points share.
    sets: RaySets,
    /// [`CameraTile::gathers`] of the rays.
    gathers: u32,
    /// Indices of the points that rays start from.
    chosen: Buffer,
    /// Ends of rays: a [`VisiblePoint`] per ray, in the order of the chosen points. Its weight
    /// includes the camera path. Some slots have no point.
    pub ends: Buffer,
    /// Light that each ray finds, `vec4f`.
    pub found: Buffer,
    /// Direction of each ray, octahedral, and the bits of its weight.
    directions: Buffer,
    /// An [`ArrivingLight`] for each visible point. Rays add to what is there.
    pub arriving: Buffer,
    /// Those of the points and ends that nothing has lit.
    pub waiting: WaitingPoints,
}

/// Rays from each of the chosen points that are traced at once.
#[derive(Clone, Copy, Debug)]
pub struct FinalRays {
    pub first: u32,
    pub count: u32,
    /// Number of chosen points.
    pub chosen: u32,
    /// Rays of each of them in all.
    pub each: u32,
}

impl FinalRays {
    /// Rays in all.
    #[must_use]
    pub fn all(self) -> u32 {
        self.count * self.chosen
    }
}

impl FinalGather {
    /// `rays` per visible point, at least 1.
    ///
    /// # Errors
    /// Limits of the adapter.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, tracer: &CameraTracer, sampler: Sampler, rays: u32) -> Result<Self> {
        Ok(Self {
            kernels: FinalKernels::new(gpu, scene, sampler),
            rays,
            sets: RaySets::default(),
            gathers: 1,
            chosen: gpu.storage::<u32>("points of final gathering", tracer.room())?,
            ends: gpu.storage::<VisiblePoint>("ends of final-gather rays", tracer.room())?,
            found: gpu.storage::<[f32; 4]>("light of final-gather rays", tracer.room())?,
            directions: gpu.storage::<[u32; 2]>("directions of final-gather rays", tracer.room())?,
            arriving: gpu.storage::<ArrivingLight>("arriving light", tracer.room())?,
            waiting: WaitingPoints::new(gpu, tracer.room())?,
        })
    }

    /// Has the kernels compiled ahead of their use.
    pub fn prefetch(gpu: &Gpu, scene: &SceneBuffers, sampler: Sampler) {
        let _ = FinalKernels::new(gpu, scene, sampler);
    }

    /// Makes the rays of all points of the picture one set of numbers: those of neighbours are then
    /// spread as evenly as those of one point.
    #[must_use]
    pub fn joint(self) -> Self {
        Self { sets: RaySets::OfPicture, ..self }
    }

    /// Has rays see gleams, lights by way of mirrors, metal and glass.
    #[must_use]
    pub fn seeing_gleams(self) -> Self {
        Self { gathers: SEES_GLEAMS, ..self }
    }

    /// Rays of each visible point.
    #[must_use]
    pub fn rays(&self) -> u32 {
        self.rays
    }

    /// Chooses the points of the tile that rays start from, so many from each.
    pub fn choose(&self, gpu: &Gpu, tracer: &CameraTracer, tile: &Tile, (chosen, each): (&[u32], u32)) {
        gpu.write(&self.chosen, 0, chosen);
        tracer.wavefront.lists.write_keys(gpu, &tracer.ray_keys(tile, chosen, each, self.sets));
    }

    /// Traces rays of the chosen points to the first diffuse surface.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn trace(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        tracer: &CameraTracer,
        tile: &Tile,
        rays: FinalRays,
    ) -> Result<StepCount> {
        let view = tracer.tile_view(tile);
        let step = self.step(gpu, view.seed, rays);
        let own = gpu.uniform("final gather tile", &self.rays_as_samples(tracer, &view, rays));
        let started = [
            ("tile", &own),
            ("final_step", &step),
            ("points", &tracer.points),
            ("seen", &self.ends),
            ("chosen", &self.chosen),
            ("directions", &self.directions),
        ];
        let followed = [("tile", &own), ("points", &self.ends)];
        let start = Step { kernel: &self.kernels.start, buffers: &started };
        tracer.follow(
            gpu,
            scene,
            (&start, rays.all()),
            &Step { kernel: &self.kernels.trace, buffers: &followed },
            (self.kernels.lobes.as_ref(), &self.found),
        )
    }

    /// Of each ray of a step its direction, the distance to its first surface, metres, and what it
    /// has found on its way.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn legs(&self, gpu: &Gpu, rays: FinalRays) -> Result<Vec<(Vec3, f32, Vec3)>> {
        let directions: Vec<[u32; 2]> = gpu.read(&self.directions, 0, rays.all().into())?;
        let found: Vec<[f32; 4]> = gpu.read(&self.found, 0, rays.all().into())?;
        let leg = |([direction, _], [r, g, b, first]): ([u32; 2], [f32; 4])| {
            (from_octahedral(direction), first, Vec3::new(r, g, b))
        };
        Ok(directions.into_iter().zip(found).map(leg).collect())
    }

    /// Adds direct light at the ends of rays to what they found.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn light_directly(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        tracer: &CameraTracer,
        tile: &Tile,
        rays: FinalRays,
    ) -> Result<StepCount> {
        self.light(gpu, scene, tracer, (tile, rays), (&self.ends, &self.found))
    }

    /// Adds direct light at the first ends of a buffer, as if they were of the rays of one point,
    /// to what they found.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn light_ends(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        tracer: &CameraTracer,
        tile: &Tile,
        (ends, found, count): (&Buffer, &Buffer, u32),
    ) -> Result<StepCount> {
        tracer.wavefront.lists.write_keys(gpu, &[[0, 0]]);
        let rays = FinalRays { first: 0, count, chosen: 1, each: count };
        self.light(gpu, scene, tracer, (tile, rays), (ends, found))
    }

    fn light(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        tracer: &CameraTracer,
        (tile, rays): (&Tile, FinalRays),
        (ends, found): (&Buffer, &Buffer),
    ) -> Result<StepCount> {
        let view = self.rays_as_samples(tracer, &tracer.tile_view(tile), rays);
        tracer.light_points(gpu, scene, &self.kernels.direct, &view, (ends, found, rays.all()))
    }

    /// Adds what the rays of a step found to the radiance of their points.
    pub fn add(&self, gpu: &Gpu, tracer: &CameraTracer, rays: FinalRays) {
        let step = self.step(gpu, 0, rays);
        let buffers = [
            ("final_step", &step),
            ("chosen", &self.chosen),
            ("found", &self.found),
            ("directions", &self.directions),
            ("radiance", &tracer.radiance),
            ("arriving", &self.arriving),
            ("points", &tracer.points),
        ];
        let mut encoder = gpu.encoder();
        self.kernels.sum.dispatch(&mut encoder, &self.kernels.sum.bind(gpu, &buffers), rays.chosen.into());
        gpu.submit(encoder);
    }

    fn step(&self, gpu: &Gpu, seed: u32, rays: FinalRays) -> Buffer {
        let step = FinalStep {
            first_ray: rays.first,
            rays_now: rays.count,
            rays: rays.each,
            chosen: rays.chosen,
            seed,
            for_records: u32::from(self.sets == RaySets::OfPicture),
            ..Default::default()
        };
        gpu.uniform("final step", &step)
    }

    /// The rays of a step as samples of the points that they start from. At glass, a ray chooses
    /// reflection or refraction at random: its numbers are none of those of camera paths.
    fn rays_as_samples(&self, tracer: &CameraTracer, view: &CameraTile, rays: FinalRays) -> CameraTile {
        CameraTile {
            seed: mix(view.seed ^ mix(1)),
            branches: 1,
            first_sample: rays.first,
            samples: rays.count,
            gathers: self.gathers,
            listed: 0,
            listed_at: tracer.wavefront.lists.keys_at(),
            square_bits: 0,
            ..*view
        }
    }
}
