//! The wavefront: one dispatch advances every living path by one surface, and the queue of living
//! paths is compacted between dispatches. It traces photons, camera paths and rays of final
//! gathering, and lights points. Kernels: `advance_queue`, `queue_points`.

use super::lists::Lists;
use crate::{
    error::Result,
    gpu::{Bindings, Buffer, Commands, Gpu, Kernel},
    layout::{Counters, Path},
    upload::SceneBuffers,
};

/// Surfaces of the first submission, and of a further one at most, which has as many as those
/// before it. After each, the host checks whether any path is left: mostly there is none after a
/// few surfaces, and a dispatch costs something even if it finds nothing to do.
const FIRST_SURFACES: u32 = 8;
const SURFACES_PER_SUBMISSION: u32 = 16;
/// Entries that a queue has room for at least.
pub const LEAST_QUEUE: u64 = 1 << 16;

/// Living paths, two queues of their slots, and their counters.
#[derive(Debug)]
pub struct Wavefront {
    queue_points: Kernel,
    advance: Kernel,
    /// [`Path`] per slot.
    pub paths: Buffer,
    /// Slots of living paths, two queues in one buffer. A step reads one and fills the other.
    queues: Buffer,
    /// One [`Counters`], cleared by each run.
    pub counters: Buffer,
    dispatch_arguments: Buffer,
    /// Of paths whose rays need more than one dispatch, of pixels and of keys.
    pub lists: Lists,
}

/// A kernel and the buffers that it uses besides the scene and those of the wavefront, by name.
#[derive(Debug)]
pub struct Step<'b> {
    pub kernel: &'b Kernel,
    pub buffers: &'b [(&'b str, &'b Buffer)],
}

impl Wavefront {
    /// Room for `slots` paths in a scene, and for lists of `pixels` and `keys`; `name` is in the
    /// labels of its buffers.
    ///
    /// # Errors
    /// Limits of the adapter.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers, name: &str, (slots, pixels): (u64, u64), keys: u64) -> Result<Self> {
        Ok(Self {
            queue_points: Kernel::new(gpu, "queue_points", &[]),
            advance: Kernel::new(gpu, "advance_queue", &[]),
            paths: gpu.storage::<Path>(&format!("{name} paths"), slots)?,
            queues: gpu.storage::<u32>(&format!("{name} queues"), 2 * slots.max(LEAST_QUEUE))?,
            counters: gpu.storage::<Counters>(&format!("{name} counters"), 1)?,
            dispatch_arguments: gpu.storage::<[u32; 3]>(&format!("{name} dispatch arguments"), 1)?,
            lists: Lists::new(gpu, scene, slots, (pixels, keys))?,
        })
    }

    /// Starts paths by `start` in that many invocations, then moves them on by `steps`, one after
    /// the other over the same paths, until none is left or each has met the second number of
    /// surfaces; few are expected to meet more than the first. At most `most_paths` live at once.
    /// [`Counters::unfinished`] of the result are the rays that are given up.
    ///
    /// # Errors
    /// Faults of the driver.
    pub fn run(
        &self,
        gpu: &Gpu,
        scene: &SceneBuffers,
        (start, invocations): (&Step, u64),
        steps: &[Step],
        most_paths: u64,
        (expected_surfaces, most_surfaces): (u32, u32),
    ) -> Result<Counters> {
        let bind = |bound: &Step| bound.kernel.bind(gpu, &self.bindings(scene, bound.buffers));
        let advance = self.advance.bind(gpu, &self.bindings(scene, &[]));
        let bound: Vec<_> = steps.iter().map(|step| (step.kernel, bind(step))).collect();
        let mut encoder = gpu.encoder();
        encoder.clear_buffer(&self.counters, 0, None);
        start.kernel.dispatch(&mut encoder, &bind(start), invocations);
        let (mut surfaces, mut given_up) = (0, 0);
        loop {
            let until = if surfaces < expected_surfaces { expected_surfaces } else { most_surfaces };
            let most = surfaces.clamp(FIRST_SURFACES, SURFACES_PER_SUBMISSION);
            for _ in 0..most.min(until - surfaces) {
                self.advance.dispatch(&mut encoder, &advance, 1);
                for (kernel, bindings) in &bound {
                    self.dispatch(&mut encoder, (kernel, bindings), most_paths);
                }
                surfaces += 1;
            }
            gpu.submit(encoder);
            let counters: Counters = gpu.read(&self.counters, 0, 1)?[0];
            if counters.next == 0 || surfaces >= most_surfaces {
                if counters.unfinished == 0 {
                    return Ok(Counters { unfinished: given_up, ..counters });
                }
                // Late paths go on where they are; the bound of surfaces is that of each of them.
                let late = |step: &Step| Lists::kernel(gpu, step.kernel, &self.bindings(scene, step.buffers));
                let kernels: Vec<_> = steps.iter().map(late).collect();
                given_up += self.lists.finish(gpu, &self.counters, counters.unfinished, &kernels)?;
                surfaces = 0;
            }
            encoder = gpu.encoder();
        }
    }

    /// Makes the visible points of the first `count` slots of a buffer the queue that
    /// [`Self::dispatch`] reads, and clears the counters.
    pub fn queue_points(&self, gpu: &Gpu, commands: &mut Commands, points: &Buffer, count: u32) {
        let span = gpu.uniform("points to queue", &[count, 0, 0, 0]);
        let buffers = [("span", &span), ("points", points), ("queues", &self.queues), ("counters", &self.counters)];
        commands.clear_buffer(&self.counters, 0, None);
        self.queue_points.dispatch(commands, &self.queue_points.bind(gpu, &buffers), count.into());
        let advanced = [("counters", &self.counters), ("dispatch_arguments", &self.dispatch_arguments)];
        self.advance.dispatch(commands, &self.advance.bind(gpu, &advanced), 1);
    }

    /// Runs a kernel for each entry of the queue, of which there are at most `most`.
    pub fn dispatch(&self, commands: &mut Commands, (kernel, bindings): (&Kernel, &Bindings), most: u64) {
        kernel.dispatch_indirect(commands, bindings, &self.dispatch_arguments, most);
    }

    /// The binding of kernels that read the queue.
    #[must_use]
    pub fn queues(&self) -> (&str, &Buffer) {
        ("queues", &self.queues)
    }

    /// Buffers by name.
    fn bindings<'a>(&'a self, scene: &'a SceneBuffers, others: &[(&'a str, &'a Buffer)]) -> Vec<(&'a str, &'a Buffer)> {
        let own = [
            ("paths", &self.paths),
            ("queues", &self.queues),
            ("counters", &self.counters),
            ("dispatch_arguments", &self.dispatch_arguments),
            self.lists.binding(),
        ];
        scene.with(&[&own, others].concat())
    }
}
