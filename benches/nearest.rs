//! Benchmark: exact search for the k nearest photons, the grid on the device against the immutable
//! tree of kiddo with rayon on the same machine.
//!
//! `cargo bench --bench nearest [-- PHOTONS ...]`, 100000 and 1000000 by default. Photons: 70 % on
//! the walls of a box, 30 % in a caustic of a thousand times the density. Queries: points on the
//! same surfaces, in Morton order for both. Construction is excluded on both sides; the time of the
//! grid includes the sum over the photons found. Reports medians of rounds, in each of which both
//! sides run.

use std::{num::NonZero, time::Instant};

use caustica::{
    gpu::Gpu,
    layout::{Gathered, VisiblePoint},
    passes::{
        estimate::gather::{Gather, GatherOptions, GatherSettings, gathered_buffer},
        maps::{MapKernels, PhotonMap, PhotonStore},
    },
    progress::Silent,
    settings::Settings,
};
use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;
use support::photons::{Random, caustic_box, in_caustic, on_walls};

const QUERIES: usize = 262_144;
const ROUNDS: usize = 5;
/// Fraction of the photons in the caustic, and its width for a thousand times the density of the
/// six walls.
const IN_CAUSTIC: f32 = 0.3;
const WIDTH: f32 = 0.0507;

fn main() {
    let gpu = Gpu::open(None).expect("an adapter");
    println!("{} ({}), {} CPU threads", gpu.name, gpu.driver, rayon::current_num_threads());
    println!("{:>9} {:>5} {:>14} {:>14} {:>7} {:>10}", "photons", "k", "grid q/s", "kiddo q/s", "ratio", "differing");
    let kernels = MapKernels::new(&gpu);
    let mut gather = Gather::new(&gpu, GatherOptions { side_test: false, ..GatherOptions::default() });
    let points = queries();
    let device_points = gpu.storage_with("points", &points).expect("points fit");
    let asked: Vec<usize> = std::env::args().filter_map(|word| word.parse().ok()).collect();
    for count in if asked.is_empty() { vec![100_000, 1_000_000] } else { asked } {
        let photons = caustic_box(&mut Random(1), count, IN_CAUSTIC, WIDTH);
        let positions: Vec<[f32; 3]> = photons.iter().map(|p| p.position).collect();
        let tree: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&positions).expect("a tree");
        let build = || {
            let store = PhotonStore::with(&gpu, &photons).expect("photons fit");
            gpu.wait().expect("the device works");
            let start = Instant::now();
            let map = PhotonMap::build(&gpu, &kernels, store, count as u32, 1).expect("a map");
            (map, start.elapsed().as_secs_f64())
        };
        build();
        let (map, seconds) = build();
        println!("{count:>9} sorted and gridded in {:.1} ms", seconds * 1e3);
        for k in [10, 50, 500] {
            // Alternates both sides: the speed of the machine changes during the run.
            let mut rounds = Vec::new();
            let mut differing = 0;
            grid_rate(&gpu, &mut gather, &map, &device_points, k);
            for _ in 0..ROUNDS {
                let (ours, radii) = grid_rate(&gpu, &mut gather, &map, &device_points, k);
                let (theirs, expected) = kiddo_rate(&tree, &points, k);
                differing = radii.iter().zip(&expected).filter(|(a, b)| (**a - **b).abs() > 1e-6 * **b).count();
                rounds.push([ours, theirs, ours / theirs]);
            }
            let [ours, theirs, ratio] = [0, 1, 2].map(|i| median(rounds.iter().map(|round| round[i]).collect()));
            println!("{count:>9} {k:>5} {ours:>14.0} {theirs:>14.0} {ratio:>7.2} {differing:>10}");
        }
    }
}

/// Points on the surfaces of the photons, 30 % of them in the caustic, in Morton order.
fn queries() -> Vec<VisiblePoint> {
    let mut random = Random(2);
    let mut positions: Vec<Vec3> =
        (0..QUERIES).map(|i| if i % 10 < 3 { in_caustic(&mut random, WIDTH) } else { on_walls(&mut random) }).collect();
    let spread =
        |x: f32| (0..16).fold(0u64, |code, bit| code | (u64::from((x * 65535.0) as u32 >> bit & 1) << (3 * bit)));
    positions.sort_by_key(|p| spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2);
    let point = |p: Vec3| VisiblePoint { position: p.into(), next_map: 1, weight: [1.0; 3], ..VisiblePoint::default() };
    positions.into_iter().map(point).collect()
}

/// Runs the grid: queries per second, and squared radii.
fn grid_rate(
    gpu: &Gpu,
    gather: &mut Gather,
    map: &PhotonMap,
    points: &caustica::gpu::Buffer,
    k: u32,
) -> (f64, Vec<f32>) {
    let count = QUERIES as u32;
    let settings = GatherSettings {
        neighbors: k,
        radius: None,
        max_radius: None,
        density: Settings::default().estimate.density(),
        softness: 0,
    };
    let radiance = gpu.storage::<[f32; 4]>("radiance", count.into()).expect("it fits");
    let gathered = gathered_buffer(gpu, count).expect("it fits");
    let start = Instant::now();
    gather.run(gpu, map, points, count, &settings, (&radiance, &gathered), &Silent).expect("a gather");
    let seconds = start.elapsed().as_secs_f64();
    let found: Vec<Gathered> = gpu.read(&gathered, 0, count.into()).expect("results");
    (f64::from(count) / seconds, found.iter().map(|g| g.radius_squared).collect())
}

/// Runs kiddo: queries per second, and squared distances of the (k+1)-th photon.
fn kiddo_rate(tree: &ImmutableKdTree<f32, 3>, points: &[VisiblePoint], k: u32) -> (f64, Vec<f32>) {
    let n = NonZero::new(k as usize + 1).expect("k + 1 > 0");
    let start = Instant::now();
    let radii = points
        .par_iter()
        .map(|p| {
            tree.query(&p.position).nearest_n::<SquaredEuclidean<f32>>(n).execute().last().map_or(0.0, |l| l.distance)
        })
        .collect();
    (points.len() as f64 / start.elapsed().as_secs_f64(), radii)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
