//! Sheen and clear coats: value, samples and albedo against the formulas of their extensions in
//! f64.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    microfacets::at_cosine,
    probe::{Probe, Row, even_numbers},
};

fn curve(x: f64, alpha: f64) -> f64 {
    let t = (1.0 - alpha).powi(2);
    let mix = |a: f64, b: f64| a * (1.0 - t) + b * t;
    let falling = mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * x.powf(mix(0.19823, 0.16801)));
    falling + mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967)
}

fn lambda(mu: f64, alpha: f64) -> f64 {
    if mu < 0.5 { curve(mu, alpha).exp() } else { (2.0 * curve(0.5, alpha) - curve(1.0 - mu, alpha)).exp() }
}

/// BRDF of white sheen.
fn sheen(v: DVec3, l: DVec3, roughness: f64) -> f64 {
    let alpha = roughness * roughness;
    let h = (v + l).normalize();
    let density = (2.0 + 1.0 / alpha) * h.x.hypot(h.z).powf(1.0 / alpha) / (2.0 * PI);
    density / ((1.0 + lambda(v.y, alpha) + lambda(l.y, alpha)) * 4.0 * v.y * l.y)
}

const EVEN: usize = 1 << 15;

/// Sampled directions and their weights.
fn weights(view: DVec3, roughness: f64) -> Vec<[f32; 4]> {
    let row = |u: Vec3| [[u.x, u.y, u.z, roughness as f32], [view.x as f32, view.z as f32, 0.0, 0.0]];
    Probe::new("probe_sheen").run(&even_numbers(EVEN).map(row).collect::<Vec<Row>>())
}

const COSINES: [f64; 6] = [0.02, 0.1, 0.3, 0.5, 0.7, 0.9];
/// Albedo of materials.md, item 6: roughness, then for each of `COSINES`.
const INTEGRATED: [(f64, [f64; 6]); 2] =
    [(0.35, [0.8058, 0.5390, 0.2476, 0.1134, 0.0458, 0.0123]), (0.8, [0.8924, 0.6940, 0.4555, 0.3157, 0.2204, 0.1477])];

/// Albedo of sheen, what it leaves below, and weight of a clear coat.
fn layers(mu: f64, other: f64, roughness: f64, colour: f64, clearcoat: f64) -> [f64; 3] {
    let row = [[mu, roughness, colour, clearcoat], [other, 0.0, 0.0, 0.0]].map(|r| r.map(|x| x as f32));
    let [albedo, left, weight, _] = Probe::new("probe_layers").run(&[row])[0].map(f64::from);
    [albedo, left, weight]
}

#[test]
fn sheen_is_the_formula_of_its_extension() {
    for (roughness, mu) in [0.1, 0.35, 0.8, 1.0].into_iter().flat_map(|r| COSINES.map(|mu| (r, mu))) {
        let v = at_cosine(mu, 0.7);
        let found = weights(v, roughness);
        let error = |roughness: f64| {
            let of = |d: &[f32; 4]| {
                let l = Vec3::from_slice(d).as_dvec3();
                let value = 2.0 * PI * sheen(v, l, roughness) * l.y;
                if l.y < 1e-2 || value < 1e-6 { 0.0 } else { (f64::from(d[3]) / value - 1.0).abs() }
            };
            found.iter().map(of).fold(0.0, f64::max)
        };
        assert!(error(roughness) < 5e-3, "roughness {roughness}, cosine {mu}: off by {}", error(roughness));
        let dark = roughness < 0.2 && mu > 0.4;
        assert!(
            dark || error(0.95 * roughness) > 2e-2,
            "control: another roughness is off by {}",
            error(0.95 * roughness)
        );
    }
}

#[test]
fn sheen_reflects_what_others_integrated() {
    for (roughness, albedos) in INTEGRATED {
        for (i, (mu, albedo)) in COSINES.into_iter().zip(albedos).enumerate() {
            let drawn = weights(at_cosine(mu, 0.7), roughness);
            let mean = drawn.iter().map(|d| f64::from(d[3])).sum::<f64>() / EVEN as f64;
            assert!((mean - albedo).abs() < 3e-3, "roughness {roughness}, cosine {mu}: {mean} for {albedo}");
            let [fitted, left, _] = layers(mu, 1.0, roughness, 0.5, 0.0);
            assert!((fitted - albedo).abs() < 8e-3, "roughness {roughness}, cosine {mu}: {fitted} for {albedo}");
            assert!((left - 1.0 + 0.5 * fitted).abs() < 1e-6, "what sheen leaves");
            assert_eq!(left, layers(1.0, mu, roughness, 0.5, 0.0)[1], "the same both ways");
            let other = albedos[(i + 1) % 6];
            assert!((fitted - other).abs() > 8e-3, "control: another cosine than {mu}, {fitted} for {other}");
        }
    }
}

#[test]
fn clear_coats_are_seen_by_schlick() {
    for mu in [0.0_f64, 0.2, 0.6, 1.0] {
        let weight = |coat: f64| layers(mu, 1.0, 0.5, 0.0, coat)[2];
        let schlick = 0.04 + 0.96 * (1.0 - mu).powi(5);
        assert!((weight(0.7) - 0.7 * schlick).abs() < 1e-6, "cosine {mu}: {}", weight(0.7));
        assert!((weight(0.6) - 0.7 * schlick).abs() > 1e-3, "control: another coat, cosine {mu}");
    }
}
