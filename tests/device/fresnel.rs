//! Fresnel's equations on the device against the closed form in f64.

use super::probe::{Probe, Row};

/// Largest error of the device's reflectance over cosines and relative indices, against the closed
/// form for the indices times `factor`.
fn error(factor: f64) -> f64 {
    let cosines = (0..=1000).map(|i| f64::from(i) / 1000.0);
    let pairs: Vec<(f64, f64)> =
        cosines.flat_map(|c| [0.4, 0.67, 0.999, 1.0, 1.33, 1.5, 2.4].map(|eta| (c, eta))).collect();
    let rows: Vec<Row> = pairs.iter().map(|&(c, eta)| [[c as f32, eta as f32, 0.0, 0.0], [0.0; 4]]).collect();
    let found = Probe::new("probe_fresnel").run(&rows);
    let off = |((c, eta), found): (&(f64, f64), &[f32; 4])| {
        // At the critical angle and at grazing incidence the curve is too steep to be compared in
        // f32.
        let steep = (1.0 - (1.0 - c * c) / (eta * eta)).abs() < 1e-3 || *c == 0.0;
        if steep { 0.0 } else { (f64::from(found[0]) - closed_form(*c, eta * factor)).abs() }
    };
    pairs.iter().zip(&found).map(off).fold(0.0, f64::max)
}

/// Reflectance of unpolarised light at the cosine of incidence, from the angles (Fresnel 1823); 1
/// where no angle exists.
pub fn closed_form(cos_i: f64, eta: f64) -> f64 {
    let angle = cos_i.acos();
    let sine = angle.sin() / eta;
    if sine >= 1.0 {
        return 1.0;
    }
    let inner = sine.asin();
    if angle < 1e-6 {
        return ((eta - 1.0) / (eta + 1.0)).powi(2);
    }
    let s = (angle - inner).sin() / (angle + inner).sin();
    let p = (angle - inner).tan() / (angle + inner).tan();
    0.5 * (s * s + p * p)
}

#[test]
fn fresnel_is_the_closed_form() {
    assert!(error(1.0) < 2e-4, "the reflectance is off by {}", error(1.0));
    assert!(error(1.01) > 1e-2, "control: with indices 1 % larger it is off by {}", error(1.01));
    let at = |cos: f32, eta: f32| Probe::new("probe_fresnel").run(&[[[cos, eta, 0.0, 0.0], [0.0; 4]]])[0][0];
    // From glass of index 1.5 into air, total internal reflection begins at 41.81°.
    assert_eq!(at(42_f32.to_radians().cos(), 1.0 / 1.5), 1.0, "total reflection");
    assert!(at(41.5_f32.to_radians().cos(), 1.0 / 1.5) < 0.8, "control: within the critical angle");
    assert!((at(1.0, 1.5) - 0.04).abs() < 1e-6 && at(0.0, 1.5) == 1.0);
}
