//! The kd-tree of the reference finds the photons of brute force, and those of another tree.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | sizes | same photons, order and radius as brute force, any size, k, bound and side test | a photon moved |
//! | dense, coincident | so in a dense caustic, far outside, and with thousands of photons on one spot | a photon moved; the other order of equals |
//! | kiddo | the same distances as `kiddo` | a photon moved |
//! | ties | photons nearly as far as each other are tied, others not | |
//! | fingerprint | tells sets apart and does not know order | |

use std::num::NonZero;

use caustica::{
    layout::{PhotonFlux, PhotonPosition, octahedral},
    progress::Silent,
    reference::{Found, KdMap, KdTree, brute_force, fingerprint},
    settings::EstimateSettings,
};
use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use support::photons::{Random, caustic_box, coincident, point, uniform_box};

fn positions(photons: &[caustica::layout::Photon]) -> Vec<Vec3> {
    photons.iter().map(|p| p.position.into()).collect()
}

/// Queries in and around the unit box, some of them on photons.
fn queries(random: &mut Random, positions: &[Vec3]) -> Vec<Vec3> {
    (0..60)
        .map(|i| match (i % 4, positions.is_empty()) {
            (0, false) => positions[random.bits() as usize % positions.len()],
            (1, _) => random.vector() * 1e4,
            _ => random.vector(),
        })
        .collect()
}

/// Number of queries for which the tree differs from brute force over `positions`.
fn differences(tree: &KdTree, positions: &[Vec3], queries: &[Vec3], k: u32, radius: Option<f32>) -> usize {
    // A side test that accepts two of three photons.
    let some = |i: usize| i % 3 != 1;
    let wrong = |&&query: &&Vec3| {
        let all = tree.nearest(query, k, radius, |_| true) != brute_force(positions, query, k, radius, |_| true);
        all || tree.nearest(query, k, radius, some) != brute_force(positions, query, k, radius, some)
    };
    queries.iter().filter(wrong).count()
}

/// Compares over several k and bounds. The control moves a photon that the first query uses.
fn check(random: &mut Random, positions: &[Vec3]) {
    let tree = KdTree::new(positions);
    let queries = queries(random, positions);
    for k in [1, 10, 50, 1000] {
        for radius in [None, Some(0.05), Some(2.0)] {
            let wrong = differences(&tree, positions, &queries, k, radius);
            assert_eq!(wrong, 0, "{} photons, k = {k}, radius {radius:?}", positions.len());
        }
    }
    if positions.len() > 1 {
        let nearest = brute_force(positions, queries[0], 1, None, |_| true).photons[0];
        let mut moved = positions.to_vec();
        moved[nearest as usize] += Vec3::splat(1e6);
        assert!(differences(&tree, &moved, &queries, 10, None) > 0, "the control: {} photons", positions.len());
    }
}

#[test]
fn the_tree_equals_brute_force_at_awkward_sizes() {
    let mut random = Random(1);
    for size in [0, 1, 2, 3, 4, 7, 8, 9, 31, 32, 33, 63, 64, 65, 1000, 5000] {
        let photons = uniform_box(&mut random, size);
        check(&mut random, &positions(&photons));
    }
}

#[test]
fn it_does_in_dense_caustics_and_on_one_spot() {
    let mut random = Random(2);
    // More photons than the build balances without further tasks.
    let dense = caustic_box(&mut random, 25_000, 0.8, 1e-3);
    check(&mut random, &positions(&dense));
    let spot = positions(&coincident(&mut random, 6000, 1000));
    check(&mut random, &spot);
    // All photons at one position: among equals the first are taken.
    let tree = KdTree::new(&spot[1000..]);
    let found = tree.nearest(Vec3::ZERO, 50, None, |_| true);
    assert_eq!(found.photons, (0..50).collect::<Vec<_>>());
    let after_another = KdTree::new(&spot[999..]).nearest(Vec3::ZERO, 50, None, |_| true);
    assert_ne!(after_another.photons, found.photons, "the control: behind another photon they have other numbers");
}

#[test]
fn it_finds_the_distances_that_kiddo_finds() {
    let mut random = Random(3);
    let mut positions = positions(&caustic_box(&mut random, 20_000, 0.5, 1e-2));
    let points: Vec<[f32; 3]> = positions.iter().map(|p| p.to_array()).collect();
    let theirs: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&points).unwrap();
    let queries = queries(&mut random, &positions);
    let differences = |positions: &[Vec3]| {
        let ours = KdTree::new(positions);
        let same = |query: &Vec3| {
            let found = ours.search(*query, 51, f32::INFINITY, |_| true);
            let expected =
                theirs.query(&query.to_array()).nearest_n::<SquaredEuclidean<f32>>(NonZero::new(51).unwrap()).execute();
            let close = |(a, b): (&(f32, u32), f32)| (a.0 - b).abs() <= 1e-6 * a.0.max(b);
            found.iter().zip(expected.iter().map(|n| n.distance)).all(close) && found.len() == expected.len()
        };
        queries.iter().filter(|query| !same(query)).count()
    };
    assert_eq!(differences(&positions), 0);
    let moved = brute_force(&positions, queries[0], 1, None, |_| true).photons[0];
    positions[moved as usize] += Vec3::splat(1e6);
    assert!(differences(&positions) > 0, "the control");
}

/// A map of photons on a line from the origin, all arriving from above, and a visible point at the
/// origin.
fn line(distances: &[f32]) -> (KdMap, caustica::layout::VisiblePoint) {
    let photon = |&x: &f32| PhotonPosition { position: [x, 0.0, 0.0], wi: octahedral(Vec3::Y) };
    let map = KdMap::new(distances.iter().map(photon).collect(), vec![PhotonFlux::default(); distances.len()], 1);
    let mut origin = point(&mut Random(1), false);
    (origin.position, origin.ng, origin.ns) = ([0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]);
    (map, origin)
}

#[test]
fn photons_nearly_as_far_as_each_other_are_tied() {
    let tied = |distances: &[f32], max_radius| {
        let (map, origin) = line(distances);
        map.estimate(&origin, &EstimateSettings { neighbors: 2, max_radius, ..Default::default() }).tied
    };
    let near = 2.0 * (1.0 + 2.4e-7);
    assert!(tied(&[1.0, 2.0, near], None) && tied(&[1.0, 2.0, 2.0, 2.0, 3.0], None));
    assert!(!tied(&[1.0, 2.0, 2.00001], None) && !tied(&[1.0, 1.0, 3.0], None));
    // With fewer than k photons the last one gives the radius.
    assert!(tied(&[2.0, near], None) && !tied(&[1.0, 2.0], None) && !tied(&[1.0], None) && !tied(&[], None));
    // The maximum radius lies between photons, on one, and just beyond one.
    assert!(!tied(&[1.0, 2.0], Some(1.5)) && tied(&[1.0, 2.0], Some(2.0)) && tied(&[1.0, 2.0], Some(near)));
}

#[test]
fn fingerprints_tell_sets_apart_and_do_not_know_order() {
    let all: Vec<u32> = (0..100).collect();
    let reversed: Vec<u32> = (0..100).rev().collect();
    assert_eq!(fingerprint(&all), fingerprint(&reversed));
    let others: Vec<u32> = (1..101).collect();
    assert_ne!(fingerprint(&all), fingerprint(&others));
    // 1 + 4 = 2 + 3, but the hashes differ.
    assert_ne!(fingerprint(&[1, 4]), fingerprint(&[2, 3]));
    assert_eq!(fingerprint(&[]), 0);
}

#[test]
fn photons_left_out_are_not_found() {
    let (mut map, origin) = line(&[1.0, 2.0, 3.0, 4.0]);
    let settings = EstimateSettings { neighbors: 2, ..Default::default() };
    let photons = |map: &KdMap| map.search(&origin, 3, f32::INFINITY).iter().map(|n| n.1).collect::<Vec<_>>();
    assert_eq!(photons(&map), [0, 1, 2]);
    for photon in [3, 1, 1] {
        map.leave_out(photon);
    }
    assert_eq!(photons(&map), [0, 2]);
    let estimates = map.gather(&[origin], &settings, &Silent).unwrap();
    assert_eq!(estimates, [map.estimate(&origin, &settings)]);
    assert_eq!(Found { photons: vec![0], radius_squared: 9.0 }.radius_squared, estimates[0].radius_squared);
}
