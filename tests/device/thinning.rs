//! Fewer queries of maps at further samples.
//!
//! | test | right | negative control |
//! |---|---|---|
//! | thinning | few samples have the light of the maps, the sum is that of all, and what was there stays | none are left out |

use caustica::{
    layout::{Gathered, VisiblePoint},
    passes::{QueryThinning, SharedPoints},
};
use support::*;

const PIXELS: u32 = 4096;
const SAMPLES: u32 = 8;
const BRANCHES: u32 = 2;
const SLOTS: usize = (PIXELS * SAMPLES * BRANCHES) as usize;
/// Light before the maps, and of all maps.
const BEFORE: f32 = 0.1;
const OF_MAPS: f32 = 0.03;

/// Sums of the samples of each pixel, and the number of points that had light of maps.
fn thinned(one_in: u32) -> (Vec<f32>, usize) {
    let gpu = gpu();
    // Every second slot has a point.
    let point = |slot: usize| VisiblePoint { next_map: (slot % 2) as u32, ..VisiblePoint::default() };
    let points = gpu.storage_with("points", &(0..SLOTS).map(point).collect::<Vec<_>>()).unwrap();
    let radiance = gpu.storage_with("radiance", &vec![[BEFORE; 4]; SLOTS]).unwrap();
    let gathered = gpu.storage::<Gathered>("gathered", 1).unwrap();
    let tile = SharedPoints {
        points: &points,
        pixels: PIXELS,
        samples: SAMPLES,
        branches: BRANCHES,
        margin: 0,
        is_square: false,
        radiance: &radiance,
        gathered: &gathered,
    };
    let keys: Vec<[u32; 4]> = (0..PIXELS).map(|pixel| [pixel % 64, pixel / 64, 4, 7]).collect();
    let mut lit = 0;
    let mut gather = || {
        let waiting: Vec<VisiblePoint> = gpu.read(&points, 0, SLOTS as u64)?;
        let mut light: Vec<[f32; 4]> = gpu.read(&radiance, 0, SLOTS as u64)?;
        for (_, light) in waiting.iter().zip(&mut light).filter(|(p, _)| (1..=2).contains(&p.next_map)) {
            light[0] += OF_MAPS;
            lit += 1;
        }
        gpu.write(&radiance, 0, &light);
        Ok(())
    };
    let one_in = vec![one_in; PIXELS as usize];
    QueryThinning::new(gpu).run(gpu, &tile, (&one_in, &keys), 2, &mut gather).unwrap();
    let light: Vec<[f32; 4]> = gpu.read(&radiance, 0, SLOTS as u64).unwrap();
    assert!(light.iter().all(|light| light[1] == BEFORE), "what was there is the same");
    let waiting: Vec<VisiblePoint> = gpu.read(&points, 0, SLOTS as u64).unwrap();
    assert!(waiting.iter().enumerate().all(|(slot, point)| (point.next_map > 0) == (slot % 2 == 1)), "and waits on");
    let of_pixel = |slots: &[[f32; 4]]| slots.iter().map(|light| light[0] - BEFORE).sum();
    (light.chunks((SAMPLES * BRANCHES) as usize).map(of_pixel).collect(), lit)
}

#[test]
fn few_queries_stand_for_all_samples() {
    let all = (PIXELS * SAMPLES) as usize;
    for one_in in [1, 2, 8, 32] {
        let (sums, lit) = thinned(one_in);
        let expected = SAMPLES as f32 * OF_MAPS;
        let mean = sums.iter().map(|&sum| f64::from(sum)).sum::<f64>() / f64::from(PIXELS);
        // Of fewer samples than that, a quarter of the pixels has one: 4 standard deviations.
        let fits = if one_in <= SAMPLES { 1e-5 } else { 4.0 * (3.0 / f64::from(PIXELS)).sqrt() };
        assert!(within(mean, f64::from(expected), fits), "1 in {one_in}: {mean}, {expected}");
        let share = lit as f64 / all as f64 * f64::from(one_in);
        assert!(within(share, 1.0, fits), "1 in {one_in}: {lit} of {all} queries");
        if one_in <= SAMPLES {
            assert!(sums.iter().all(|&sum| (sum - expected).abs() < 1e-4), "1 in {one_in}: in each pixel");
        }
    }
    let (_, lit) = thinned(1);
    assert_eq!(lit, all, "control: none are left out");
}
