//! Compiles kernels ahead of their use, on threads of its own, while the device and others work.

use std::{
    collections::HashMap,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{self, Receiver, Sender},
    },
    thread::{self, JoinHandle},
};

use super::{kernel::Program, shaders::Shader};

/// Threads at most: there are some thirty kernels, few of them long.
const MOST_THREADS: usize = 8;

/// Stem and constants, these by their bits.
type Key = (&'static str, Vec<(&'static str, u64)>);

/// The programs of a device. Each is compiled once, in the order in which they are asked for,
/// unless somebody needs it before.
#[derive(Debug)]
pub(super) struct Compiler {
    programs: Mutex<HashMap<Key, Arc<Program>>>,
    /// Gone when the threads should end.
    asked: Option<Sender<Arc<Program>>>,
    waiting: Arc<Mutex<Receiver<Arc<Program>>>>,
    threads: Vec<JoinHandle<()>>,
}

impl Compiler {
    pub fn new() -> Self {
        let (asked, waiting) = mpsc::channel();
        let waiting = Arc::new(Mutex::new(waiting));
        let count = thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS);
        let spawn = |_| {
            let waiting = Arc::clone(&waiting);
            // Without a thread who needs a kernel compiles it.
            thread::Builder::new().name("compiler".into()).spawn(move || compile_all(&waiting)).ok()
        };
        let threads = (0..count).filter_map(spawn).collect();
        Self { programs: Mutex::default(), asked: Some(asked), waiting, threads }
    }

    /// The kernel with these constants, compiled or soon to be.
    pub fn program(
        &self,
        device: &wgpu::Device,
        part_layout: &wgpu::BindGroupLayout,
        shader: &'static Shader,
        constants: Vec<(&'static str, f64)>,
    ) -> Arc<Program> {
        let key = (shader.stem, constants.iter().map(|(name, value)| (*name, value.to_bits())).collect());
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        let program = programs.entry(key).or_insert_with(|| {
            let program = Arc::new(Program::new(device, part_layout, shader, constants));
            if let Some(asked) = &self.asked {
                // The receiver is a field beside this one, so somebody listens.
                let _ = asked.send(Arc::clone(&program));
            }
            program
        });
        Arc::clone(program)
    }
}

impl Drop for Compiler {
    /// Waits for the threads, for a driver that is unloaded under them ends the process; what they
    /// have not begun is left.
    fn drop(&mut self) {
        drop(self.asked.take());
        while self.waiting.lock().is_ok_and(|waiting| waiting.try_recv().is_ok()) {}
        for thread in self.threads.drain(..) {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
}

fn compile_all(waiting: &Mutex<Receiver<Arc<Program>>>) {
    loop {
        let Ok(next) = waiting.lock().map(|waiting| waiting.recv()) else { return };
        let Ok(program) = next else { return };
        program.compile();
    }
}
