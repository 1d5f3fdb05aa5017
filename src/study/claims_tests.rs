//! Each claim holds for rows that satisfy it and fails for rows that contradict it.

use super::*;
use crate::{
    settings::Mode,
    stats::Seconds,
    study::{MapRow, measure::Thumbnail},
};

fn row(photons: u32, neighbors: u32) -> Row {
    Row {
        scene: "a.gltf".to_string(),
        mode: Mode::Hybrid,
        photons,
        neighbors,
        final_gather: 0,
        seed: 0,
        repeats: 2,
        width: 8,
        height: 8,
        spp: 1,
        seconds: Seconds { gather: 1.0, total: 1.5, ..Seconds::default() },
        global: MapRow::default(),
        caustic: MapRow::default(),
        mean_radiance: [1.0; 3],
        noise: Some(0.1),
        rel_mse: Some(0.1),
        rmse: Some(0.1),
        flip: Some(0.1),
        bias: Some(0.1),
        bias_limit: Some(0.01),
        corner_ratio: Some(1.1),
        error: None,
        thumbnail: Thumbnail::default(),
    }
}

/// n of 1k and 100k by k of 1 and 100, in which every claim of a plane holds.
fn plane() -> Vec<Row> {
    let mut rows = vec![row(1000, 1), row(1000, 100), row(100_000, 1), row(100_000, 100)];
    for row in &mut rows {
        if row.neighbors == 100 {
            row.seconds = Seconds { gather: 3.0, total: 3.5, ..Seconds::default() };
            (row.noise, row.bias) = (Some(0.01), Some(0.2));
        }
        let good = (row.photons == 1000) == (row.neighbors == 1);
        row.rel_mse = Some(if good { 0.1 } else { 0.5 });
    }
    rows
}

/// Change that makes a row contradict the claim.
type Spoil = fn(&mut Row);

fn verdict(question: Question, rows: &[Row]) -> Verdict {
    answer(question, &rows.iter().collect::<Vec<_>>()).verdict
}

#[test]
fn every_claim_of_a_plane_can_hold_and_can_fail() {
    let spoil: [(Question, Spoil); 7] = [
        (Question::Energy, |row| row.mean_radiance = [1.06 + f64::from(row.neighbors) / 1000.0; 3]),
        (Question::GatherDominates, |row| row.seconds.total = 10.0),
        (Question::TimeWithNeighbors, |row| row.seconds.gather = 1.0),
        (Question::TimeWithPhotons, |row| row.seconds.gather = f64::from(row.photons)),
        (Question::Proportion, |row| row.rel_mse = Some(1.0 / f64::from(row.neighbors))),
        (Question::NoiseForBias, |row| row.noise = Some(f64::from(row.neighbors))),
        (Question::CornersBright, |row| row.corner_ratio = Some(0.99)),
    ];
    assert_eq!(spoil.map(|(question, _)| question), Question::OF_A_PLANE);
    for (question, spoil) in spoil {
        let mut rows = plane();
        assert_eq!(verdict(question, &rows), Verdict::Holds, "{question:?}");
        rows.iter_mut().for_each(spoil);
        assert_eq!(verdict(question, &rows), Verdict::DoesNotHold, "{question:?}");
        assert_eq!(verdict(question, &[]), Verdict::Unknown, "{question:?}");
    }
}

#[test]
fn a_bias_that_noise_hides_is_not_compared() {
    let mut rows = plane();
    rows.iter_mut().for_each(|row| row.bias_limit = Some(1.0));
    assert_eq!(verdict(Question::NoiseForBias, &rows), Verdict::Unknown);
}

#[test]
fn direct_light_is_judged_by_scene_and_caustics() {
    let of = |mode: Mode, mean: f64| Row { mode, mean_radiance: [mean; 3], ..row(1000, 1) };
    let rows = |ratio: f64| [of(Mode::DirectRays, 1.0), of(Mode::DirectPhotons, ratio)];
    assert_eq!(verdict(Question::DirectAgrees, &rows(1.02)), Verdict::Holds);
    assert_eq!(verdict(Question::DirectAgrees, &rows(1.2)), Verdict::DoesNotHold);
    let mut caustics = rows(1.2);
    caustics[1].caustic.stored = 5;
    assert_eq!(verdict(Question::DirectAgrees, &caustics), Verdict::Holds);
    assert_eq!(verdict(Question::DeltaShadows, &caustics), Verdict::Holds);
    assert_eq!(verdict(Question::DeltaShadows, &rows(1.0)), Verdict::DoesNotHold);
    assert_eq!(verdict(Question::DirectAgrees, &rows(1.0)[..1]), Verdict::Unknown);
}

#[test]
fn three_lights_are_judged_by_light_and_time() {
    let with = |mean: f64, total: f64| Row {
        mean_radiance: [mean; 3],
        seconds: Seconds { total, ..Seconds::default() },
        ..row(1000, 1)
    };
    assert_eq!(verdict(Question::ThreeLights, &[with(1.0, 1.0), with(2.5, 1.2)]), Verdict::Holds);
    assert_eq!(verdict(Question::ThreeLights, &[with(1.0, 1.0), with(2.0, 1.0)]), Verdict::DoesNotHold);
    assert_eq!(verdict(Question::ThreeLights, &[with(1.0, 1.0), with(3.0, 2.0)]), Verdict::DoesNotHold);
}
