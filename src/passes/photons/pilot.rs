//! A few photon paths from each light, to learn where its light goes before the photons are traced.

use rayon::prelude::*;

use super::{
    photon_batch::{BatchBuffers, PhotonKernels},
    steering::{Pilot, PilotPhoton},
};
use crate::{
    emitters::{
        importance::Importance,
        light_clusters::{LightCluster, light_clusters},
        light_table::LightTable,
    },
    error::Result,
    gpu::Gpu,
    layout::{LightChoice, PATH_MASK, PHOTON_INDEX_MASK, PHOTON_INDEX_SHIFT, Photon, PhotonBatch},
    upload::SceneBuffers,
};

/// Paths of the pilot, and for each cluster of lights if that is less.
const PATHS: usize = 1 << 14;
const PATHS_OF_CLUSTER: usize = 1 << 12;

/// Traces the pilot of a batch's paths. `None` if nothing shines.
pub(super) fn trace_pilot(
    gpu: &Gpu,
    scene: &SceneBuffers,
    kernels: &PhotonKernels,
    (buffers, most_paths): (&BatchBuffers, u64),
    (importance, batch): (&Importance, &PhotonBatch),
) -> Result<Option<Pilot>> {
    let table = &scene.lights.table;
    let clusters = light_clusters(table, 0.5 * scene.lights.seen[3]);
    let mut paths = PATHS.min(PATHS_OF_CLUSTER * clusters.len()).min(most_paths as usize);
    loop {
        if paths < clusters.len() || clusters.is_empty() {
            return Ok(None);
        }
        let starts = starts(table, &clusters, paths);
        let entries = entries(&starts, table.lights.len());
        let choices = gpu.storage_with("pilot light choices", &entries)?;
        let batch = PhotonBatch { paths: paths as u32, strata: paths as u32, ..*batch };
        let result = kernels.run(gpu, scene, &choices, buffers, &batch)?;
        if u64::from(result.counters.staged) > buffers.staging_capacity {
            paths /= 2;
            continue;
        }
        let started = |path: usize| {
            let light = starts[path].0;
            table.power_of(light) / f64::from(entries[light as usize].probability)
        };
        let staged = buffers.staged(gpu, result.counters.staged)?;
        let cluster_of = starts.iter().map(|start| start.1).collect();
        return Ok(Some(Pilot { photons: photons(staged, importance, started), cluster_of, clusters }));
    }
}

/// Light and cluster of each path: half of the paths for all clusters alike, half by power.
fn starts(table: &LightTable, clusters: &[LightCluster], paths: usize) -> Vec<(u32, u32)> {
    let total: f64 = clusters.iter().map(|cluster| cluster.power).sum();
    let alike = (0.5 / clusters.len() as f64, 0.5 / total);
    let mut starts = Vec::with_capacity(paths);
    let mut sum = 0.0;
    for (index, cluster) in (0..).zip(clusters) {
        sum += alike.0 + alike.1 * cluster.power;
        // Each cluster has a path.
        let most = paths - (clusters.len() - 1 - index as usize);
        let end = ((sum * paths as f64).round() as usize).clamp(starts.len() + 1, most);
        let own = end - starts.len();
        let (mut light, mut before) = (0, 0.0);
        for path in 0..own {
            let at = (path as f64 + 0.5) / own as f64 * cluster.power;
            while light + 1 < cluster.lights.len() && before + table.power_of(cluster.lights[light]) <= at {
                before += table.power_of(cluster.lights[light]);
                light += 1;
            }
            starts.push((cluster.lights[light], index));
        }
    }
    starts.sort_unstable();
    starts
}

/// Table by which each stratum chooses the light of its path.
fn entries(starts: &[(u32, u32)], lights: usize) -> Vec<LightChoice> {
    let mut counts = vec![0_u32; lights];
    starts.iter().for_each(|(light, _)| counts[*light as usize] += 1);
    let mut sum = 0;
    let part = |count: u32| count as f32 / starts.len() as f32;
    let choice = |count: u32| {
        sum += count;
        LightChoice { cdf: part(sum), probability: part(count) }
    };
    counts.into_iter().map(choice).collect()
}

/// The photons by path and bounce. `started`: flux that a path starts with.
fn photons(
    staged: Vec<(u32, Photon)>,
    importance: &Importance,
    started: impl Fn(usize) -> f64 + Sync,
) -> Vec<PilotPhoton> {
    let mut staged: Vec<((u32, u32), Photon)> = staged
        .into_iter()
        .map(|(key, photon)| ((key & PATH_MASK, key >> PHOTON_INDEX_SHIFT & PHOTON_INDEX_MASK), photon))
        .collect();
    staged.par_sort_unstable_by_key(|(key, _)| *key);
    let photon = |((path, _), photon): &((u32, u32), Photon)| {
        let flux = photon.flux.iter().map(|x| f64::from(*x)).sum::<f64>() / 3.0;
        let importance = f64::from(importance.at(photon.position.into()));
        PilotPhoton { path: *path, flux: flux / started(*path as usize), importance }
    };
    staged.par_iter().map(photon).collect()
}
