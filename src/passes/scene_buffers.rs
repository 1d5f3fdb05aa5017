//! Bind group 0: the scene on the device. Owner of `shaders/bindings/scene.wesl`.

use bytemuck::Pod;

use crate::{
    bvh::Bvh,
    error::Result,
    gpu::{Buffer, Gpu, Kernel},
    layout::{self, BvhNode, Primitive},
    scene::{Scene, Surface},
    settings::{LightSampling, Settings},
};

/// The scene's buffers.
#[derive(Debug)]
pub struct SceneBuffers {
    nodes: Windows,
    primitives: Windows,
    normals: Buffer,
    materials: Buffer,
    lights: Buffer,
    has_spheres: bool,
    /// Some surface both reflects and transmits.
    pub has_dielectrics: bool,
    /// The lights as uploaded.
    pub light_table: Vec<layout::Light>,
}

/// An array in one binding, or in two where it exceeds one.
#[derive(Debug)]
struct Windows {
    low: Buffer,
    high: Buffer,
    /// Elements in `low` if `high` is used, else 0.
    window: u64,
}

impl SceneBuffers {
    /// Uploads the scene.
    ///
    /// # Errors
    /// [`crate::Error::Limit`] if an array exceeds two bindings, or the normals one.
    pub fn new(gpu: &Gpu, scene: &Scene, bvh: &Bvh, settings: &Settings) -> Result<Self> {
        let materials: Vec<_> = scene.materials.iter().map(|m| material(&m.surface)).collect();
        let light_table = light_table(scene, settings);
        Ok(Self {
            nodes: Windows::new::<BvhNode>(gpu, "bvh nodes", &bvh.nodes)?,
            primitives: Windows::new::<Primitive>(gpu, "primitives", &bvh.primitives)?,
            normals: gpu.storage_with("normals", &bvh.normals)?,
            materials: gpu.storage_with("materials", &materials)?,
            lights: gpu.storage_with("lights", &light_table)?,
            has_dielectrics: materials.iter().any(|m| m.kind == layout::GLASS || m.kind == layout::PANE),
            has_spheres: !scene.spheres.is_empty(),
            light_table,
        })
    }

    /// Compiles a kernel that uses the scene.
    #[must_use]
    pub fn kernel(&self, gpu: &Gpu, stem: &str) -> Kernel {
        self.kernel_with(gpu, stem, &[])
    }

    /// The same with further `override` constants.
    #[must_use]
    pub fn kernel_with(&self, gpu: &Gpu, stem: &str, others: &[(&str, f64)]) -> Kernel {
        let mut overrides = vec![
            ("HAS_SPHERES", f64::from(u8::from(self.has_spheres))),
            ("SPLIT", f64::from(u8::from(self.nodes.window + self.primitives.window > 0))),
            ("NODE_WINDOW", window_or_all(self.nodes.window)),
            ("PRIMITIVE_WINDOW", window_or_all(self.primitives.window)),
        ];
        overrides.extend_from_slice(others);
        Kernel::new(gpu, stem, &overrides)
    }

    /// The scene's variables, followed by others.
    #[must_use]
    pub fn with<'a>(&'a self, others: &[(&'a str, &'a Buffer)]) -> Vec<(&'a str, &'a Buffer)> {
        let mut all = vec![
            ("nodes", &self.nodes.low),
            ("nodes_high", &self.nodes.high),
            ("primitives", &self.primitives.low),
            ("primitives_high", &self.primitives.high),
            ("normals", &self.normals),
            ("materials", &self.materials),
            ("lights", &self.lights),
        ];
        all.extend_from_slice(others);
        all
    }
}

impl Windows {
    fn new<T: Pod>(gpu: &Gpu, label: &str, data: &[T]) -> Result<Self> {
        let fits = usize::try_from(gpu.max_binding() / size_of::<T>() as u64).unwrap_or(usize::MAX);
        let (low, high) = data.split_at(data.len().min(fits));
        let window = if high.is_empty() { 0 } else { low.len() as u64 };
        Ok(Self { low: gpu.storage_with(label, low)?, high: gpu.storage_with(label, high)?, window })
    }
}

fn window_or_all(window: u64) -> f64 {
    if window == 0 { f64::from(u32::MAX) } else { window as f64 }
}

fn material(surface: &Surface) -> layout::Material {
    let (kind, color, ior) = match *surface {
        Surface::Diffuse { albedo } => (layout::DIFFUSE, albedo, 1.0),
        Surface::Mirror { tint } => (layout::MIRROR, tint, 1.0),
        Surface::Glass { ior, tint } => (layout::GLASS, tint, ior),
        Surface::Pane { ior, tint } => (layout::PANE, tint, ior),
    };
    layout::Material { kind, color: color.to_array(), ior, ..Default::default() }
}

/// Lights in the renderer's unit, with the probability that a path starts at each.
fn light_table(scene: &Scene, settings: &Settings) -> Vec<layout::Light> {
    let power = |light: &crate::scene::Light| f64::from(light.intensity.element_sum());
    let total: f64 = scene.lights.iter().map(power).sum();
    let mut sum = 0.0;
    let mut table: Vec<_> = scene
        .lights
        .iter()
        .map(|light| {
            let probability = match settings.light_sampling {
                LightSampling::Power => power(light) / total,
                LightSampling::Uniform => 1.0 / scene.lights.len() as f64,
            };
            sum += probability;
            layout::Light {
                position: light.position.to_array(),
                intensity: light.intensity_in(settings.light_unit).to_array(),
                cdf: sum as f32,
                probability: probability as f32,
            }
        })
        .collect();
    // Rounding must not leave a gap below 1 that no light covers, nor choose a dark light at the end.
    if let Some(last) = table.iter().rposition(|l| l.probability > 0.0) {
        table[last..].iter_mut().for_each(|l| l.cdf = 1.0);
    }
    table
}
