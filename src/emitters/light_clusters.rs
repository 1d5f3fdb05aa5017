//! Lights that lie near each other, for what is asked of each of many lights by few paths.

use glam::Vec3;

use super::light_table::LightTable;
use crate::{layout, scene::Bounds};

/// Maximum number of clusters.
const CLUSTERS: usize = 256;

/// Lights of a table that give light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightCluster {
    /// Indices in the table, ascending.
    pub lights: Vec<u32>,
    /// Power of all, W.
    pub power: f64,
    /// They lie at infinity.
    pub is_far: bool,
    /// Least and greatest coordinates of where they are.
    pub bounds: [Vec3; 2],
}

impl LightCluster {
    fn new(table: &LightTable, mut lights: Vec<u32>) -> Self {
        lights.sort_unstable();
        let power = lights.iter().map(|light| table.power_of(*light)).sum();
        let Bounds { min, max } = Bounds::around(lights.iter().map(|light| position(table, *light)));
        let is_far = lights.iter().any(|light| is_far(&table.lights[*light as usize]));
        Self { lights, power, is_far, bounds: [min, max] }
    }

    fn extent(&self) -> Vec3 {
        self.bounds[1] - self.bounds[0]
    }

    /// What a split of it may gain; 0 if it lies within `fine` metres.
    fn worth(&self, fine: f32) -> f64 {
        let extent = self.extent().max_element();
        if extent > fine { self.power * f64::from(extent) } else { 0.0 }
    }

    /// Halves on both sides of the middle of its longest extent.
    fn halves(&self, table: &LightTable) -> [Self; 2] {
        let axis = self.extent().max_position();
        let plane = 0.5 * (self.bounds[0][axis] + self.bounds[1][axis]);
        let (low, high): (Vec<u32>, Vec<u32>) =
            self.lights.iter().partition(|light| position(table, **light)[axis] < plane);
        [low, high].map(|lights| Self::new(table, lights))
    }
}

/// The lights of a table in at most `CLUSTERS` clusters, each at infinity for itself. What lies
/// within `fine` metres stays together.
#[must_use]
pub fn light_clusters(table: &LightTable, fine: f32) -> Vec<LightCluster> {
    let shining = (0..table.lights.len() as u32).filter(|light| table.power_of(*light) > 0.0);
    let (far, near): (Vec<u32>, Vec<u32>) = shining.partition(|light| is_far(&table.lights[*light as usize]));
    // Two halves of the clusters, if there are so many.
    let mut clusters: Vec<LightCluster> = far
        .chunks(far.len().div_ceil(CLUSTERS / 2).max(1))
        .map(|lights| LightCluster::new(table, lights.to_vec()))
        .collect();
    if !near.is_empty() {
        clusters.push(LightCluster::new(table, near));
    }
    while clusters.len() < CLUSTERS {
        let worth = |i: &usize| if clusters[*i].is_far { 0.0 } else { clusters[*i].worth(fine) };
        let Some(most) = (0..clusters.len()).max_by(|a, b| worth(a).total_cmp(&worth(b))) else { break };
        if worth(&most) <= 0.0 {
            break;
        }
        let [low, high] = clusters[most].halves(table);
        if low.lights.is_empty() || high.lights.is_empty() {
            break;
        }
        clusters[most] = low;
        clusters.push(high);
    }
    clusters
}

fn is_far(light: &layout::Light) -> bool {
    matches!(light.kind, layout::DIRECTIONAL_LIGHT | layout::ENVIRONMENT_LIGHT)
}

fn position(table: &LightTable, light: u32) -> Vec3 {
    let light = &table.lights[light as usize];
    let [position, e1, e2] = [light.position, light.e1, light.e2].map(Vec3::from_array);
    if light.kind == layout::TRIANGLE_LIGHT { position + (e1 + e2) / 3.0 } else { position }
}
