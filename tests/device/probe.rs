//! Probes: kernels of `shaders/probes` that call one function of the shaders for each row of a
//! table.

use caustica::{
    gpu::{
        Kernel,
        shaders::{Binding, BindingKind, Shader},
    },
    upload::{SceneBuffers, light_buffers::ChoiceBuffer},
};
use glam::Vec3;
use support::{gpu, photons::Random};

/// Input row of a probe, `a` and `b` in the shader.
pub type Row = [[f32; 4]; 2];

const PROBES: &[Shader] = &include!(concat!(env!("OUT_DIR"), "/probe_table.rs"));

/// A probe, with a scene's buffers if its function reads them.
pub struct Probe<'s> {
    kernel: Kernel,
    scene: Option<(&'s SceneBuffers, &'s ChoiceBuffer)>,
}

impl<'s> Probe<'s> {
    pub fn new(stem: &str) -> Self {
        Self { kernel: Kernel::of(gpu(), find(stem), &[]), scene: None }
    }

    pub fn of_scene(stem: &str, buffers: &'s SceneBuffers, choices: &'s ChoiceBuffer) -> Self {
        Self::with_constants(stem, &[], (buffers, choices))
    }

    /// With values of constants of the shader.
    pub fn with_constants(stem: &str, constants: &[(&str, f64)], scene: (&'s SceneBuffers, &'s ChoiceBuffer)) -> Self {
        Self { kernel: scene.0.kernel_of(gpu(), find(stem), constants), scene: Some(scene) }
    }

    pub fn run(&self, rows: &[Row]) -> Vec<[f32; 4]> {
        let (gpu, count) = (gpu(), rows.len() as u64);
        let inputs = gpu.storage_with("inputs", rows).expect("fits");
        let outputs = gpu.storage::<[f32; 4]>("outputs", count).expect("fits");
        let mut own = vec![("inputs", &inputs), ("outputs", &outputs)];
        if let Some((buffers, choices)) = self.scene {
            own.push(("choices", &choices.buffer));
            own = buffers.with(&own);
        }
        let mut commands = gpu.encoder();
        self.kernel.dispatch(&mut commands, &self.kernel.bind(gpu, &own), count);
        gpu.submit(commands);
        gpu.read(&outputs, 0, count).expect("results read back")
    }
}

fn find(stem: &str) -> &'static Shader {
    PROBES.iter().find(|shader| shader.stem == stem).unwrap_or_else(|| panic!("no probe {stem}"))
}

/// Rows of independent numbers, `a` in [0, 1) and `b` as given.
pub fn rows(count: usize, b: [f32; 4]) -> Vec<Row> {
    let mut random = Random(77);
    (0..count).map(|_| [[0; 4].map(|_| random.unit()), b]).collect()
}

/// Numbers in [0, 1)³ that are more even than independent ones (Roberts 2018).
pub fn even_numbers(count: usize) -> impl Iterator<Item = Vec3> {
    let steps = [0.819_172_513_4, 0.671_043_606_7, 0.549_700_477_9];
    (1..=count).map(move |i| Vec3::from(steps.map(|step: f64| (i as f64 * step).fract() as f32)))
}
