//! All lights of a scene, as one list for the device, and the tables and trees by which passes
//! choose from it.
//!
//! Punctual lights come first, then emissive triangles and spheres, material by material, then the
//! environment. A named light is what a user calls one light: a punctual light, all surfaces of one
//! emissive material, or the environment.

use std::{
    collections::BTreeMap,
    f64::consts::{PI, TAU},
};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    cumulative::{MAX_CHOICES, cumulative, probabilities},
    environment_map::EnvironmentMap,
    light_bounds::{LightBounds, strength},
    light_tree::{DIRECTIONAL_ROOT, EMITTER_ROOTS, LightTrees, PUNCTUAL_ROOT},
    surface_lights::{SurfaceLight, SurfaceLights},
    targets::{Target, aimed_fraction},
};
use crate::{
    error::{Error, Result},
    layout::{self, LightChoice},
    scene::{LUMENS_PER_WATT, LightKind, Scene, hidden_backs, spot_heights},
    settings::{LightSampling, LightSettings, LightUnit},
};

/// Mean of what a clear coat takes of emission, by the cosine: Schlick's formula from 0.04 on.
const MEAN_CLEARCOAT: f64 = 0.04 + 0.96 / 21.0;

/// Least fraction that paths take of what a subtriangle would emit if nothing darkened it: its
/// mean may miss what is bright between the points by which it is taken.
const MIN_FRACTION: f64 = 1.0 / 64.0;
/// Fraction of the paths for what cameras see that choose lights by power alone.
pub const BY_POWER: f64 = 0.1;
/// Maximum number of points and spots, and of directional lights, whose direct light at a visible
/// point is the sum over all of them. Of more, light samples choose.
pub const MAX_SUMMED: usize = 16;

/// Lights of one name: what a user calls one light.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedLight {
    pub name: String,
    /// `point`, `spot`, `directional`, `surface` or `environment`.
    pub kind: &'static str,
    /// Power, W in each channel. Of directional lights and environments: the power that the
    /// bounding sphere of the scene receives.
    pub power: DVec3,
}

/// The lights of a scene.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    /// Sorted by named light.
    pub lights: Vec<layout::Light>,
    pub named: Vec<NamedLight>,
    /// The trees by which direct light chooses.
    pub trees: LightTrees,
    /// Indices of the punctual lights that visible points sum over.
    pub summed: Vec<u32>,
    /// Number of trees that light samples of visible points choose from.
    pub sampled_roots: u32,
    /// The emission of some surface varies: it has lights with a [`layout::Light::material`].
    pub is_varied: bool,
    /// Materials that shine nowhere, one line each.
    pub warnings: Vec<String>,
    /// Power of each light that may reach what is seen, W, mean of the channels.
    powers: Vec<f64>,
    /// Index of the first light of each emissive primitive, by its index in the scene.
    emitters: BTreeMap<u32, u32>,
}

/// A table from which lights are sampled.
#[derive(Clone, Debug, Default)]
pub struct Choices {
    pub entries: Vec<LightChoice>,
    /// Strata of the random number that chooses a light, assigned to the paths in turn; 0 if no
    /// light can be chosen.
    pub strata: u32,
}

impl LightTable {
    /// # Errors
    /// [`Error::Scene`] if there are more lights and emissive primitives than a table can hold.
    pub fn new(
        scene: &Scene,
        environment: Option<&EnvironmentMap>,
        around: &Target,
        settings: &LightSettings,
    ) -> Result<Self> {
        let mut table = Self::default();
        for light in &scene.lights {
            table.add_punctual(light, around.radius, settings.unit);
        }
        table.add_surfaces(scene, settings.unit);
        if let (Some(environment), Some(map)) = (&scene.environment, environment) {
            let power = DVec3::from(map.integral) * PI * f64::from(around.radius).powi(2);
            table.start_named(&environment.name, "environment");
            let light = layout::Light { kind: layout::ENVIRONMENT_LIGHT, area: 1.0, ..Default::default() };
            table.add(layout::Light { emission: [1.0; 3], ..light }, power);
        }
        if table.lights.len() > MAX_CHOICES {
            let problem = format!("{} lights and emissive triangles; at most {MAX_CHOICES}", table.lights.len());
            return Err(Error::Scene { path: scene.path.clone(), place: "materials".to_owned(), problem });
        }
        table.plant_trees(environment);
        Ok(table)
    }

    /// Divides the lights into those that visible points sum over and those that they sample, and
    /// builds the trees.
    fn plant_trees(&mut self, environment: Option<&EnvironmentMap>) {
        let count = |kinds: &[u32]| self.lights.iter().filter(|light| kinds.contains(&light.kind)).count();
        let sums_punctual = count(&[layout::POINT_LIGHT, layout::SPOT_LIGHT]) <= MAX_SUMMED;
        let sums_directions = count(&[layout::DIRECTIONAL_LIGHT]) <= MAX_SUMMED;
        let root = |light: &layout::Light| match light.kind {
            layout::POINT_LIGHT | layout::SPOT_LIGHT if sums_punctual => PUNCTUAL_ROOT,
            layout::DIRECTIONAL_LIGHT => DIRECTIONAL_ROOT,
            layout::ENVIRONMENT_LIGHT => layout::ENVIRONMENT_ROOT,
            _ => layout::EMITTER_ROOT,
        };
        self.sampled_roots = EMITTER_ROOTS + u32::from(!sums_directions);
        let is_summed = |light: &layout::Light| root(light) >= self.sampled_roots;
        self.summed = (0..).zip(&self.lights).filter(|(_, light)| is_summed(light)).map(|(i, _)| i).collect();
        // The mean irradiance of surfaces under the environment, which face it in any direction.
        let sky = environment.map_or(0.0, |map| map.integral.iter().sum::<f64>() / 12.0);
        let strengths: Vec<f64> =
            self.lights.iter().zip(&self.powers).map(|(l, power)| strength(l, *power, sky)).collect();
        let total: f64 = strengths.iter().sum();
        let bounds = self
            .lights
            .par_iter()
            .zip(strengths)
            .map(|(light, s)| LightBounds::new(light, s / total))
            .collect::<Vec<_>>();
        self.trees = LightTrees::new(&bounds, self.lights.iter().map(root).collect());
        for (light, (leaf, root)) in self.lights.iter_mut().zip(self.trees.leaves.iter().zip(&self.trees.roots)) {
            (light.leaf, light.root) = (*leaf, *root);
        }
    }

    /// Index of a primitive's first light, plus one; 0 if the primitive does not emit light.
    #[must_use]
    pub fn emitter(&self, primitive: u32) -> u32 {
        self.emitters.get(&primitive).map_or(0, |light| light + 1)
    }

    /// Some primitive emits light.
    #[must_use]
    pub fn has_surfaces(&self) -> bool {
        !self.emitters.is_empty()
    }

    /// Some light is not punctual, so that rays may meet it.
    #[must_use]
    pub fn has_extent(&self) -> bool {
        let is_met = |light: &layout::Light| light.kind >= layout::TRIANGLE_LIGHT && light.leaf != layout::NO_LEAF;
        self.lights.iter().any(is_met)
    }

    /// Visible points have lights to sample.
    #[must_use]
    pub fn is_sampled(&self) -> bool {
        self.trees.nodes.iter().take(self.sampled_roots as usize).any(|root| root.intensity() > 0.0)
    }

    /// Number of lights, from the first, among which are all that visible points sum; 0 if these
    /// are fewer than two, or do not lie together.
    #[must_use]
    pub fn weighed(&self) -> u32 {
        let trees = self.trees.roots.iter().filter(|root| **root >= layout::SUMMED_ROOT).count();
        let end = self.summed.last().map_or(0, |last| last + 1);
        let is_small = trees == self.summed.len() && end as usize <= 2 * MAX_SUMMED;
        if self.summed.len() > 1 && is_small { end } else { 0 }
    }

    /// Power of all lights that may reach what is seen, W, mean of the channels.
    #[must_use]
    pub fn power(&self) -> f64 {
        self.powers.iter().sum()
    }

    /// Power of a light that may reach what is seen, W, mean of the channels.
    #[must_use]
    pub fn power_of(&self, light: u32) -> f64 {
        self.powers[light as usize]
    }

    /// Table for photon paths as [`Self::for_photons`], with factors on the powers of the lights.
    #[must_use]
    pub fn for_steered_photons(&self, factors: &[f64], settings: &LightSettings) -> Choices {
        self.choices(self.powers.iter().zip(factors).map(|(power, factor)| power * factor).collect(), settings)
    }

    /// Table for photon paths: in proportion to power, or with equal probability for every named
    /// light, times the factors of the settings.
    #[must_use]
    pub fn for_photons(&self, settings: &LightSettings) -> Choices {
        self.choices(self.powers.clone(), settings)
    }

    /// Table for paths aimed at `targets`: as [`Self::for_photons`], with the power that goes
    /// towards the targets.
    #[must_use]
    pub fn for_aimed_photons(&self, targets: &[Target], around: &Target, settings: &LightSettings) -> Choices {
        let aimed = |(light, power): (&layout::Light, &f64)| power * aimed_fraction(light, targets, around);
        self.choices(self.lights.iter().zip(&self.powers).map(aimed).collect(), settings)
    }

    /// Table for paths aimed at what the cameras see: as [`Self::for_photons`] for a part of them,
    /// the others by the power that goes towards the sphere `seen`. The sun on a wide ground has
    /// the power of a million lamps, and a window has as much of it as of one.
    #[must_use]
    pub fn for_seen_photons(&self, seen: &Target, around: &Target, settings: &LightSettings) -> Choices {
        let fraction = |light| aimed_fraction(light, std::slice::from_ref(seen), around);
        let towards: Vec<f64> =
            self.lights.iter().zip(&self.powers).map(|(light, power)| power * fraction(light)).collect();
        let [all, all_towards] =
            [&self.powers, &towards].map(|powers| powers.iter().sum::<f64>().max(f64::MIN_POSITIVE));
        let share = |(power, towards): (&f64, &f64)| BY_POWER * power / all + (1.0 - BY_POWER) * towards / all_towards;
        self.choices(self.powers.iter().zip(&towards).map(share).collect(), settings)
    }

    fn choices(&self, powers: Vec<f64>, settings: &LightSettings) -> Choices {
        let mut of_named = vec![0.0; self.named.len()];
        for (light, power) in self.lights.iter().zip(&powers) {
            of_named[light.named as usize] += power;
        }
        let shining = of_named.iter().filter(|power| **power > 0.0).count() as u32;
        let factor = |named: usize| -> f64 {
            let asked = settings.photon_weights.iter().filter(|(name, _)| *name == self.named[named].name);
            let alike = if settings.sampling == LightSampling::Uniform { 1.0 / of_named[named] } else { 1.0 };
            asked.map(|(_, weight)| weight).product::<f64>() * alike
        };
        let factors: Vec<f64> = (0..self.named.len()).map(factor).collect();
        let weigh = |(light, power): (&layout::Light, f64)| {
            if power > 0.0 { power * factors[light.named as usize] } else { 0.0 }
        };
        let weights: Vec<f64> = self.lights.iter().zip(powers).map(weigh).collect();
        let strata = if settings.sampling == LightSampling::Uniform { shining } else { shining.min(1) };
        Choices { entries: entries(&weights), strata }
    }

    fn start_named(&mut self, name: &str, kind: &'static str) {
        self.named.push(NamedLight { name: name.to_owned(), kind, power: DVec3::ZERO });
    }

    /// Adds a light to the last named light.
    fn add(&mut self, light: layout::Light, power: DVec3) {
        let named = self.named.len() - 1;
        self.lights.push(layout::Light { named: named as u32, ..light });
        self.powers.push(power.element_sum() / 3.0);
        self.named[named].power += power;
    }

    fn add_punctual(&mut self, light: &crate::scene::Light, radius: f32, unit: LightUnit) {
        let emission = light.intensity_in(unit).to_array();
        let (kind, name, e2) = match light.kind {
            LightKind::Point => (layout::POINT_LIGHT, "point", Vec3::ZERO),
            LightKind::Spot { inner, outer } => {
                // The falloff divides by its width.
                let [height, width] = spot_heights(inner, outer).map(|x| (x as f32).max(f32::MIN_POSITIVE));
                (layout::SPOT_LIGHT, "spot", Vec3::new(height, width, 0.0))
            }
            LightKind::Directional => (layout::DIRECTIONAL_LIGHT, "directional", Vec3::ZERO),
        };
        self.start_named(&light.name, name);
        let power = crate::scene::Light { intensity: light.intensity_in(unit), ..light.clone() }.power(radius);
        let (position, e1) = (light.position.to_array(), light.direction.to_array());
        let solid_angle = light.solid_angle();
        let light = layout::Light { position, kind, e1, e2: e2.to_array(), ..Default::default() };
        self.add(layout::Light { emission, area: 1.0, solid_angle, ..light }, power);
    }

    /// Emissive triangles and spheres, material by material.
    fn add_surfaces(&mut self, scene: &Scene, unit: LightUnit) {
        let mut of_materials = BTreeMap::<u32, Vec<usize>>::new();
        let triangles = scene.triangles.iter().map(|t| t.material);
        for (primitive, material) in triangles.chain(scene.spheres.iter().map(|s| s.material)).enumerate() {
            if scene.materials[material as usize].emission.max_element() > 0.0 {
                of_materials.entry(material).or_default().push(primitive);
            }
        }
        let surfaces = SurfaceLights::new(scene);
        let hidden = hidden_backs(scene);
        for (material, primitives) in of_materials {
            let is_varied = surfaces.is_varied(material);
            let material = &scene.materials[material as usize];
            self.start_named(&material.name, "surface");
            let emission = emission_in(material.emission, unit);
            let solid_angle = if material.double_sided { TAU } else { PI };
            let clearcoat = if material.unlit { 0.0 } else { material.clearcoat };
            let uncoated = 1.0 - f64::from(clearcoat) * MEAN_CLEARCOAT;
            let first = self.lights.len();
            for primitive in primitives {
                let own = self.lights.len() as u32;
                // Nothing starts where it would stay unseen. The lamp's power is that of both
                // sides.
                let sent = if hidden.get(primitive) == Some(&true) { 0.5 } else { 1.0 };
                let sent_angle = sent * solid_angle;
                for SurfaceLight { light, emitted } in surfaces.of(primitive) {
                    let power = emission.as_dvec3() * f64::from(light.area) * solid_angle * uncoated;
                    let light = layout::Light { emission: emission.to_array(), clearcoat, ..light };
                    self.add(layout::Light { solid_angle: sent_angle as f32, ..light }, power * emitted.mean);
                    let own_power = self.powers.last_mut();
                    own_power.into_iter().for_each(|power| *power *= sent);
                    if emitted.is_lit {
                        let least = sent * MIN_FRACTION * power.element_sum() / 3.0;
                        self.powers.last_mut().into_iter().for_each(|power| *power = power.max(least));
                    }
                    self.emitters.insert(primitive as u32, own);
                }
            }
            if is_varied && self.lights.len() == first {
                self.warnings
                    .push(format!("material {:?} is black wherever it is seen: it gives no light", material.name));
            }
            self.is_varied |= is_varied && self.lights.len() > first;
        }
    }

    /// Checks that each light that the settings name is in one of the tables of a scene's lights.
    ///
    /// # Errors
    /// [`Error::Setting`] with the first that is in none.
    pub fn check_names<'t>(tables: impl Iterator<Item = &'t Self>, settings: &LightSettings) -> Result<()> {
        let named: Vec<&NamedLight> = tables.flat_map(|table| &table.named).collect();
        let is_known = |name: &String| named.iter().any(|light| light.name == *name);
        let Some((name, weight)) = settings.photon_weights.iter().find(|(name, _)| !is_known(name)) else {
            return Ok(());
        };
        let names: Vec<String> = named.iter().map(|light| format!("{:?}", light.name)).collect();
        let problem = format!("no light is called {name:?}; the scene has {}", names.join(", "));
        Err(Error::Setting { name: "lights.photon_weights", value: format!("{name}={weight}"), problem })
    }
}

/// Radiometric emission of a material whose numbers in the file are in `unit`.
pub(crate) fn emission_in(emission: Vec3, unit: LightUnit) -> Vec3 {
    match unit {
        LightUnit::Radiometric => emission,
        LightUnit::Photometric => emission / LUMENS_PER_WATT,
    }
}

fn entries(weights: &[f64]) -> Vec<LightChoice> {
    let table = cumulative(weights);
    let chosen = probabilities(&table);
    table.into_iter().zip(chosen).map(|(cdf, probability)| LightChoice { cdf, probability }).collect()
}
