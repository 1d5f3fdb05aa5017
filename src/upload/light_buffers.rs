//! The lights in bind group 0: all lights, the tables and trees by which passes choose from them,
//! targets, environment.

use rayon::prelude::*;

use crate::{
    bvh::{Bvh, MediaProbe},
    emitters::{
        entries::entries,
        environment_map::EnvironmentMap,
        importance::Importance,
        lamps_in_glass::LampsInGlass,
        light_table::{Choices, LightTable},
        openings::Openings,
        set_media,
        sight::{Seen, Sight},
        targets::{Target, scene_target, specular_targets},
    },
    error::Result,
    gpu::{Buffer, Gpu, Table},
    layout::{self, EnvironmentInfo, SceneSphere},
    scene::Scene,
    settings::LightSettings,
};

/// A table of [`Choices`] on the device, `array<LightChoice>`.
#[derive(Debug)]
pub struct ChoiceBuffer {
    pub buffer: Buffer,
    /// See [`Choices::strata`].
    pub strata: u32,
}

impl ChoiceBuffer {
    /// # Errors
    /// [`crate::Error::Limit`] if the lights exceed a binding.
    pub fn new(gpu: &Gpu, label: &str, choices: &Choices) -> Result<Self> {
        Ok(Self { buffer: gpu.storage_with(label, &choices.entries)?, strata: choices.strata })
    }
}

/// The lights on the device.
#[derive(Debug)]
pub struct LightBuffers {
    /// The lights on the host, as uploaded.
    pub table: LightTable,
    /// Tables for photon paths, and for paths aimed at mirrors and glass.
    pub photons: ChoiceBuffer,
    pub aimed: ChoiceBuffer,
    /// The table for paths aimed at what the cameras see, if spheres lie around that.
    pub towards_seen: Option<ChoiceBuffer>,
    /// Number of spheres around what the cameras see, and around mirrors and glass. In `targets`,
    /// the sphere around the scene lies between them, followed by the entries.
    pub seen_targets: u32,
    /// The smallest sphere around what the cameras see, centre and radius, metres; radius 0: none.
    pub seen: [f32; 4],
    /// Number of spheres that parallel light enters by, after that around the scene.
    pub entries: u32,
    pub specular_targets: u32,
    /// Whether photons of mirrors and glass have quite different powers.
    pub mixes_powers: bool,
    /// See [`Seen::enclosure`].
    pub enclosure: f64,
    /// See [`Seen::diffuse`].
    pub diffuse: f64,
    /// See [`Sight::importance`].
    pub importance: Option<Importance>,
    /// Settings of the tables.
    pub settings: LightSettings,
    importance_words: Table,
    pub has_environment: bool,
    /// Whether little of the environment lights a part of what is seen: see [`Openings`].
    pub has_openings: bool,
    /// Lamps in glass.
    pub lamps: LampsInGlass,
    pub warnings: Vec<String>,
    lights: Buffer,
    nodes: Table,
    targets: Buffer,
    scene_sphere: Buffer,
    environment_info: Buffer,
    environment: Table,
    environment_cells: Table,
    environment_rows: Table,
    openings: Table,
}

impl LightBuffers {
    /// Uploads all lights.
    ///
    /// # Errors
    /// As [`LightTable::new`], and [`crate::Error::Limit`] if the lights exceed a binding.
    pub fn new(gpu: &Gpu, (scene, bvh): (&Scene, &Bvh), probe: &MediaProbe, settings: &LightSettings) -> Result<Self> {
        let around = scene_target(scene);
        let targets = specular_targets(scene);
        let Seen { points: seen_points, enclosure, diffuse } = Seen::new(scene, bvh);
        let Sight { targets: seen, importance, shares } = Sight::new(scene, &seen_points, &targets);
        let most = gpu.max_binding().min(16 * gpu.max_table_texels());
        let map = scene.environment.as_ref().map(|environment| EnvironmentMap::new(environment, most));
        let openings = Openings::new(scene, bvh, &seen_points, map.as_ref());
        let mut table = LightTable::new(scene, map.as_ref(), &around, settings)?;
        table.lights.par_iter_mut().for_each(|light| set_media(light, probe));
        // Paths are aimed at what is seen, and at all, as often, whatever the size.
        let even = 1.0 / (seen.len() + 1) as f32;
        let towards_seen = seen.first().map(|seen| {
            let choices = table.for_seen_photons(seen, &around, settings);
            ChoiceBuffer::new(gpu, "light choices towards what is seen", &choices)
        });
        let entries = entries(scene, bvh, &seen_points, openings.as_ref(), &around);
        let elsewhere = 1.0 - entries.iter().map(|entry| entry.share).sum::<f32>();
        let general = seen.iter().chain([&around]).map(|sphere| (sphere, even, even * elsewhere));
        let entering = entries.iter().map(|entry| (&entry.target, 0.0, entry.share));
        let mixes_powers = shares.iter().any(|share| *share > 0.0);
        let specular = targets.iter().zip(shares).map(|(sphere, share)| (sphere, share, share));
        let spheres: Vec<layout::Target> = general
            .chain(entering)
            .chain(specular)
            .map(|(Target { center, radius }, share, parallel_share)| layout::Target {
                center: center.to_array(),
                radius: *radius,
                share,
                parallel_share,
                ..Default::default()
            })
            .collect();
        let (sine, cosine) = map.as_ref().map_or(0.0, |map| map.rotation).sin_cos();
        let scene_sphere = SceneSphere { center: around.center.to_array(), radius: around.radius };
        let environment_info = EnvironmentInfo {
            columns: map.as_ref().map_or(0, |map| map.columns),
            rows: map.as_ref().map_or(0, |map| map.rows),
            rotation_cos: cosine,
            rotation_sin: sine,
        };
        let pixels = map.as_ref().map_or(&[][..], |map| &map.pixels);
        let cells = map.as_ref().map_or(&[][..], |map| &map.cells);
        let rows = map.as_ref().map_or(&[][..], |map| &map.marginal);
        Ok(Self {
            photons: ChoiceBuffer::new(gpu, "photon light choices", &table.for_photons(settings))?,
            aimed: ChoiceBuffer::new(
                gpu,
                "aimed light choices",
                &table.for_aimed_photons(&targets, &around, settings),
            )?,
            towards_seen: towards_seen.transpose()?,
            seen_targets: seen.len() as u32,
            seen: seen.first().map_or([0.0; 4], |target| target.center.extend(target.radius).to_array()),
            entries: entries.len() as u32,
            specular_targets: targets.len() as u32,
            mixes_powers,
            enclosure,
            diffuse,
            importance_words: Table::new(
                gpu,
                "importance",
                &importance.as_ref().map_or(vec![0; 5], Importance::words),
            )?,
            importance,
            settings: settings.clone(),
            has_environment: map.is_some(),
            has_openings: openings.is_some(),
            openings: Table::new(gpu, "openings", &openings.as_ref().map_or(vec![0], Openings::words))?,
            lamps: LampsInGlass::new(scene, &table),
            warnings: reduced(scene, map.as_ref()).into_iter().chain(table.warnings.iter().cloned()).collect(),
            lights: gpu.storage_with("lights", &table.lights)?,
            nodes: Table::new(gpu, "light nodes", &table.trees.nodes)?,
            targets: gpu.storage_with("targets", &spheres)?,
            scene_sphere: gpu.uniform("scene sphere", &scene_sphere),
            environment_info: gpu.uniform("environment info", &environment_info),
            environment: Table::new(gpu, "environment", pixels)?,
            environment_cells: Table::new(gpu, "environment cells", cells)?,
            environment_rows: Table::new(gpu, "environment rows", rows)?,
            table,
        })
    }

    /// The variables that all passes share. Passes of photons also bind their own `choices`.
    #[must_use]
    pub fn bindings(&self) -> [(&'static str, &Buffer); 4] {
        [
            ("lights", &self.lights),
            ("targets", &self.targets),
            ("scene_sphere", &self.scene_sphere),
            ("environment_info", &self.environment_info),
        ]
    }

    /// The tables that all passes share.
    #[must_use]
    pub fn tables(&self) -> [(&'static str, &Table); 6] {
        [
            ("light_nodes", &self.nodes),
            ("environment", &self.environment),
            ("environment_cells", &self.environment_cells),
            ("environment_rows", &self.environment_rows),
            ("importance_table", &self.importance_words),
            ("openings", &self.openings),
        ]
    }
}

/// Warning that the environment map was reduced, if it was.
fn reduced(scene: &Scene, map: Option<&EnvironmentMap>) -> Option<String> {
    let (environment, map) = (scene.environment.as_ref()?, map?);
    let (from, to) = ((environment.width, environment.height), (map.columns, map.rows));
    (from != to).then(|| {
        format!(
            "the environment {} was averaged from {} x {} to {} x {} pixels to fit the device",
            environment.name, from.0, from.1, to.0, to.1
        )
    })
}
