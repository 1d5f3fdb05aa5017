//! Albedos of rough reflection, by which lobes are chosen and light that meets several microfacets
//! of metal is made up for. Read by `load_albedos` in `shaders/bindings/scene.wesl`.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::layout::ALBEDO_STEPS;

/// Points over which each entry is averaged.
const SAMPLES: u32 = 4096;
/// Least cosine and width, in place of 0.
const LEAST: f64 = 1e-4;

/// The table: for the roots of the width of GGX (rows) and of the cosine of the viewer (columns),
/// each from 0 to 1, the albedo of a lobe whose microfacets reflect all, that of its part by
/// (1 − V·H)^5, and the mean of the first over all viewers by the cosine.
#[must_use]
pub fn albedos() -> Vec<[f32; 4]> {
    let steps = ALBEDO_STEPS as usize;
    let value = |i: usize| (i as f64 / (steps - 1) as f64).powi(2).max(LEAST);
    let row = |alpha: f64| {
        let pairs: Vec<_> = (0..steps).map(|i| reflected(value(i), alpha)).collect();
        let mean = mean_over_viewers(alpha);
        let entry = |(all, grazing): &(f64, f64)| [*all, *grazing, mean, 0.0];
        pairs.iter().map(entry).map(|entry| entry.map(|x| x as f32)).collect::<Vec<_>>()
    };
    (0..steps).into_par_iter().flat_map_iter(|i| row(value(i))).collect()
}

/// Points spread evenly over the unit square: equal steps along one side, those of the golden ratio
/// along the other.
fn square() -> impl Iterator<Item = (f64, f64)> {
    let at = |i: u32| f64::from(i) + 0.5;
    (0..SAMPLES).map(move |i| ((at(i) * 0.618_033_988_749_895).fract(), at(i) / f64::from(SAMPLES)))
}

fn lambda(alpha: f64, cosine: f64) -> f64 {
    ((1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)).sqrt() - 1.0) / 2.0
}

/// Albedo of the lobe towards a viewer at that cosine, and of its part by (1 − V·H)^5: means over
/// the microfacets that are seen (Dupuy and Benyoub 2023).
fn reflected(cosine: f64, alpha: f64) -> (f64, f64) {
    let view = glam::dvec3((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let stretched = glam::dvec3(alpha * view.x, 0.0, view.z).normalize();
    let (mut all, mut grazing) = (0.0, 0.0);
    for (u, v) in square() {
        let (sine, cos_phi) = (2.0 * PI * u).sin_cos();
        let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let cap = glam::dvec3(r * cos_phi, r * sine, z) + stretched;
        let h = glam::dvec3(alpha * cap.x, alpha * cap.y, cap.z.max(0.0)).normalize();
        let light = 2.0 * view.dot(h) * h.z - view.z;
        if light > 0.0 {
            let seen = lambda(alpha, cosine);
            let weight = (1.0 + seen) / (1.0 + seen + lambda(alpha, light));
            all += weight;
            grazing += weight * (1.0 - view.dot(h)).max(0.0).powi(5);
        }
    }
    let count = f64::from(SAMPLES);
    (all / count, grazing / count)
}

/// Mean of the albedo over all viewers, by the cosine.
fn mean_over_viewers(alpha: f64) -> f64 {
    const VIEWERS: u32 = 64;
    let at = |i: u32| ((f64::from(i) + 0.5) / f64::from(VIEWERS)).sqrt();
    (0..VIEWERS).map(|i| reflected(at(i), alpha).0).sum::<f64>() / f64::from(VIEWERS)
}

/// Mean of (1 − V·H)^5 over light from all directions, by its cosine.
#[cfg(test)]
fn held_back(cosine: f64) -> f64 {
    let view = glam::dvec3((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let at = |(u, v): (f64, f64)| {
        let (sine, cos_phi) = (2.0 * PI * u).sin_cos();
        let light = glam::dvec3(v.sqrt() * cos_phi, v.sqrt() * sine, (1.0 - v).sqrt());
        (1.0 - (0.5 + 0.5 * view.dot(light)).max(0.0).sqrt()).powi(5)
    };
    square().map(at).sum::<f64>() / f64::from(SAMPLES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_coat_holds_back_is_a_polynomial() {
        // That of `mean_coat_transmittance` in `shaders/lib/transport/gloss.wesl`.
        let polynomial = |terms: [f64; 5], c: f64| terms.iter().rev().fold(0.0, |sum, term| sum * c + term);
        let fitted = [8.2751e-5, 2.00958e-3, 9.36738e-3, 7.69301e-3, 9.01218e-3];
        let worst = |terms: [f64; 5]| {
            let errors = (1..=20).map(|i| f64::from(i) / 20.0);
            errors.map(|mu| (held_back(mu) - polynomial(terms, 1.0 - mu)).abs()).fold(0.0, f64::max)
        };
        assert!(worst(fitted) < 5e-5, "{}", worst(fitted));
        assert!(worst([0.0, 0.0, 0.0, 0.0, 0.028]) > 5e-4, "control: Schlick's power alone");
    }

    #[test]
    fn albedos_are_those_of_the_specification() {
        // Rows of height-correlated masking: roughness, then albedos at these cosines, then means.
        let cosines = [0.1, 0.3, 0.5, 0.7, 0.9, 1.0];
        for (roughness, expected, mean) in [
            (0.4, [0.8884, 0.8861, 0.9264, 0.9506, 0.9635, 0.9676], 0.9404),
            (0.6, [0.8824, 0.7963, 0.7821, 0.7947, 0.8145, 0.8243], 0.8029),
            (1.0, [0.7602, 0.5601, 0.4507, 0.3789, 0.3275, 0.3072], 0.4091_f64),
        ] {
            let alpha = roughness * roughness;
            for (cosine, expected) in cosines.iter().zip(expected) {
                let found = reflected(*cosine, alpha).0;
                assert!((found - expected).abs() < 0.003 * expected, "{roughness} {cosine}: {found}, not {expected}");
                let other = reflected(*cosine, 1.1 * alpha).0;
                assert!(roughness < 0.5 || (other - expected).abs() > 0.003 * expected, "control: a wider lobe");
            }
            let found = mean_over_viewers(alpha);
            assert!((found - mean).abs() < 0.002 * mean, "{roughness}: {found}, not {mean}");
        }
    }
}
