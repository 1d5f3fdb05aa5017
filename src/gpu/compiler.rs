//! Compilation of kernels ahead of their use, on threads of its own, while the device and the host
//! work.

use std::{
    collections::HashMap,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{self, Receiver, Sender},
    },
    thread::{self, JoinHandle},
};

use super::{
    program::{Program, Rewrites},
    shaders::Shader,
};

/// Maximum number of threads: there are some thirty kernels, few of them long.
const MAX_THREADS: usize = 8;

/// Stem and constants, these by their bits.
type Key = (&'static str, Vec<(&'static str, u64)>);

/// The programs of a device. Each is compiled once, in the order of the requests unless a dispatch
/// needs it earlier.
#[derive(Debug)]
pub(super) struct Compiler {
    programs: Mutex<HashMap<Key, Arc<Program>>>,
    /// `None` when the threads should end.
    requests: Option<Sender<Arc<Program>>>,
    queue: Arc<Mutex<Receiver<Arc<Program>>>>,
    threads: Vec<JoinHandle<()>>,
    rewrites: Rewrites,
}

impl Compiler {
    pub fn new(rewrites: Rewrites) -> Self {
        let (requests, queue) = mpsc::channel();
        let queue = Arc::new(Mutex::new(queue));
        let count = thread::available_parallelism().map_or(1, usize::from).min(MAX_THREADS);
        let spawn = |_| {
            let queue = Arc::clone(&queue);
            // Without a thread, the dispatch that needs a kernel compiles it.
            thread::Builder::new().name("compiler".into()).spawn(move || compile_all(&queue)).ok()
        };
        let threads = (0..count).filter_map(spawn).collect();
        Self { programs: Mutex::default(), requests: Some(requests), queue, threads, rewrites }
    }

    /// The kernel with these constants, compiled or soon to be.
    pub fn program(
        &self,
        device: &wgpu::Device,
        chunk_layout: &wgpu::BindGroupLayout,
        shader: &'static Shader,
        constants: Vec<(&'static str, f64)>,
    ) -> Arc<Program> {
        let key = (shader.stem, constants.iter().map(|(name, value)| (*name, value.to_bits())).collect());
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        let program = programs.entry(key).or_insert_with(|| {
            let program = Arc::new(Program::new(device, chunk_layout, shader, constants, self.rewrites));
            if let Some(requests) = &self.requests {
                // The receiver is a field beside this one, so sending cannot fail.
                let _ = requests.send(Arc::clone(&program));
            }
            program
        });
        Arc::clone(program)
    }
}

impl Drop for Compiler {
    /// Waits for the threads: a driver that is unloaded under them ends the process. Kernels that
    /// they have not begun stay uncompiled.
    fn drop(&mut self) {
        drop(self.requests.take());
        while self.queue.lock().is_ok_and(|queue| queue.try_recv().is_ok()) {}
        for thread in self.threads.drain(..) {
            // A panic was already reported by its thread.
            let _ = thread.join();
        }
    }
}

fn compile_all(queue: &Mutex<Receiver<Arc<Program>>>) {
    loop {
        let Ok(next) = queue.lock().map(|queue| queue.recv()) else { return };
        let Ok(program) = next else { return };
        program.compiled();
    }
}
