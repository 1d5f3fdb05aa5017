//! Fits of energy that rough surfaces lose and that coats let through, against the integrals in
//! f64.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3, vec3};

use super::{
    microfacets::{Facets, Masking, at_cosine, schlick},
    probe::{Probe, Row},
};

const ROUGHNESSES: [f64; 10] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 0.9, 1.0];

/// Lost fraction at a cosine, the mean of it, the mean of Schlick's factor, and transmittance of a
/// coat of reflectance 0 to 1.
fn fitted(points: &[(f64, f64)]) -> Vec<[f64; 4]> {
    let row = |&(mu, roughness): &(f64, f64)| [[mu as f32, (roughness * roughness) as f32, 0.0, 0.0], [0.0; 4]];
    let rows: Vec<Row> = points.iter().map(row).collect();
    Probe::new("probe_losses").run(&rows).into_iter().map(|v| v.map(f64::from)).collect()
}

fn lost(mu: f64, roughness: f64, masking: Masking) -> f64 {
    1.0 - Facets::of_roughness(roughness).albedo(at_cosine(mu, 0.0), 1.0, masking, 120)
}

#[test]
fn lost_energy_is_the_integral() {
    let cosines = [0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 1.0];
    let points: Vec<(f64, f64)> = ROUGHNESSES.iter().flat_map(|r| cosines.map(|mu| (mu, *r))).collect();
    let (mut off, mut control) = (0.0_f64, 0.0_f64);
    for (&(mu, roughness), found) in points.iter().zip(fitted(&points)) {
        off = off.max((found[0] - lost(mu, roughness, Masking::Correlated)).abs());
        control = control.max((found[0] - lost(mu, roughness, Masking::Separable)).abs());
        let of = Facets::of_roughness(roughness);
        let whole = of.albedo(at_cosine(mu, 0.0), 1.0, Masking::Correlated, 150);
        let grazing = of.albedo(at_cosine(mu, 0.0), 0.0, Masking::Correlated, 150) / whole;
        assert!((found[2] - grazing).abs() < 0.07, "Schlick's factor at {mu}, {roughness}: {} for {grazing}", found[2]);
    }
    assert!(off < 2e-3, "the lost fraction is off by {off}");
    assert!(control > 0.1, "control: with separable masking it is off by {control}");
}

#[test]
fn mean_lost_energy_is_the_mean() {
    const COUNT: usize = 64;
    // Midpoints in the cube root of the cosine, since little is lost but at grazing angles.
    let mean = |roughness: f64| -> f64 {
        let at = |i: usize| {
            let root = (i as f64 + 0.5) / COUNT as f64;
            let mu = root.powi(3);
            lost(mu, roughness, Masking::Correlated) * 2.0 * mu * 3.0 * root * root / COUNT as f64
        };
        (0..COUNT).map(at).sum()
    };
    let means = ROUGHNESSES.map(mean);
    let off = |roughness: f64, mean: f64| (fitted(&[(0.5, roughness)])[0][1] - mean).abs();
    for (i, (roughness, right)) in ROUGHNESSES.into_iter().zip(means).enumerate() {
        assert!(off(roughness, right) < 2e-3, "roughness {roughness}: off by {} of {right}", off(roughness, right));
        let other = means[if i > 3 { i - 1 } else { i + 3 }];
        assert!(off(roughness, other) > 2e-3, "control: another roughness than {roughness}: {other}");
    }
    // materials.md, item 4.
    for (roughness, average) in [(0.4, 0.9404), (0.6, 0.8029), (1.0, 0.4091)] {
        let found = 1.0 - fitted(&[(0.5, roughness)])[0][1];
        assert!((found / average - 1.0).abs() < 5e-3, "roughness {roughness}: {found} for {average}");
    }
}

#[test]
fn coats_reflect_by_the_half_vector() {
    let [wo, f0, f90] = [vec3(0.6, 0.8, 0.0), Vec3::splat(0.04), Vec3::splat(0.9)];
    for wi in [vec3(0.6, 0.8, 0.0), vec3(-0.6, 0.8, 0.0), vec3(-0.96, 0.28, 0.0), vec3(0.0, 0.6, -0.8)] {
        let row: Row = [wi.extend(f0.x).to_array(), wo.extend(f90.x).to_array()];
        let found = f64::from(Probe::new("probe_coat").run(&[row])[0][0]);
        let of = |wo: Vec3| 0.04 + 0.86 * schlick(0.0, wo.as_dvec3(), wi.as_dvec3());
        assert!((found - of(wo)).abs() < 1e-6, "{wi}: {found} for {}", of(wo));
        assert!((found - of(vec3(0.0, 0.28, 0.96))).abs() > 1e-6, "control: another viewer, {wi}");
    }
}

#[test]
fn the_transmittance_of_coats_is_the_integral() {
    const SIDE: usize = 200;
    let transmitted = |mu: f64| -> f64 {
        let at = |i: usize| {
            let [c, turn] = [i / SIDE, i % SIDE].map(|i| (i as f64 + 0.5) / SIDE as f64);
            let l: DVec3 = at_cosine(c.sqrt(), TAU * turn);
            1.0 - schlick(0.0, at_cosine(mu, 0.0), l)
        };
        (0..SIDE * SIDE).map(at).sum::<f64>() / (SIDE * SIDE) as f64
    };
    for mu in [0.0, 0.1, 0.25, 0.5, 0.75, 1.0] {
        let found = fitted(&[(mu, 0.5)])[0][3];
        assert!((found - transmitted(mu)).abs() < 2e-4, "cosine {mu}: {found} for {}", transmitted(mu));
        let wrong = transmitted((mu - 0.3_f64).abs());
        assert!((found - wrong).abs() > 2e-4, "control: another cosine than {mu}");
    }
}
