//! The glossy lobe: value, density and samples agree with each other and with the formulas of glTF
//! 2.0 in f64 (`microfacets.rs`).
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | formula | value is F D G2/(4 cos cos) cos | separable masking |
//! | samples | follow the density (chi-square at 1e-4), what is below the horizon included | another roughness |
//! | reciprocity | value over cosine is symmetric | the value itself |
//! | weights | value over density is at most 1, and bounded for repeated reflections | the density of another roughness |
//! | furnace | white metal reflects all; without repeated reflections what was integrated elsewhere | separable masking; no compensation |
//! | extremes | numbers are finite at the horizon, behind the shading normal and for narrow lobes | |
//! | estimate | the mean weight is the integral in f64 | another roughness |

use glam::{DVec3, Vec3, vec3};

use super::{
    chi_square::{Deviate, SAMPLES, deviate},
    microfacets::{Facets, Masking, at_cosine, schlick},
    probe::{Probe, Row, even_numbers, rows},
};

/// A lobe as the probes take it: reflectance in red, half of it in green, a quarter in blue.
#[derive(Clone, Copy, Debug)]
struct Lobe {
    roughness: f32,
    f0: f32,
    /// Whether light is reflected more than once.
    repeated: bool,
    /// Shading normal (slope, 1, 0).
    slope: f32,
    /// Strength of the anisotropy along x.
    strength: f32,
}

impl Lobe {
    fn once(roughness: f32, f0: f32) -> Self {
        Self { roughness, f0, repeated: false, slope: 0.0, strength: 0.0 }
    }

    fn metal(roughness: f32, f0: f32) -> Self {
        Self { repeated: true, ..Self::once(roughness, f0) }
    }

    fn facets(self) -> Facets {
        let alpha = f64::from(self.roughness).powi(2);
        Facets { along: alpha + (1.0 - alpha) * f64::from(self.strength).powi(2), across: alpha }
    }

    fn row(self, a: Vec3, view: DVec3) -> Row {
        let f0 = if self.repeated { self.f0 } else { -self.f0 };
        [[a.x, a.y, a.z, self.roughness], [view.x as f32, view.z as f32, f0, self.slope - self.strength]]
    }

    fn run(self, probe: &str, view: DVec3, numbers: impl IntoIterator<Item = Vec3>) -> Vec<[f32; 4]> {
        Probe::new(probe).run(&numbers.into_iter().map(|a| self.row(a, view)).collect::<Vec<_>>())
    }

    fn values(self, view: DVec3, directions: impl IntoIterator<Item = Vec3>) -> Vec<[f32; 4]> {
        self.run("probe_gloss_values", view, directions)
    }

    fn even_samples(self, view: DVec3) -> Vec<Vec3> {
        self.run("probe_gloss", view, even_numbers(EVEN)).iter().map(|d| Vec3::from_slice(d)).collect()
    }

    /// Value over density of samples by `drawn`.
    fn weights(self, drawn: Self, view: DVec3) -> Vec<[f64; 3]> {
        let directions = drawn.even_samples(view);
        let densities = drawn.values(view, directions.iter().copied());
        let values = self.values(view, directions);
        let weight = |(v, d): (&[f32; 4], &[f32; 4])| {
            [0, 1, 2].map(|i| if d[3] > 0.0 { f64::from(v[i]) / f64::from(d[3]) } else { 0.0 })
        };
        values.iter().zip(&densities).map(weight).collect()
    }

    /// Reflected fraction of each channel.
    fn reflected(self, view: DVec3) -> [f64; 3] {
        let weights = self.weights(self, view);
        [0, 1, 2].map(|i| weights.iter().map(|w| w[i]).sum::<f64>() / weights.len() as f64)
    }
}

const EVEN: usize = 1 << 14;
const ROUGHNESSES: [f32; 7] = [0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0];
const COSINES: [f64; 6] = [0.1, 0.3, 0.5, 0.7, 0.9, 1.0];

/// Direction to the viewer at this cosine, of no special azimuth.
fn view(mu: f64) -> DVec3 {
    at_cosine(mu, 0.7)
}

#[test]
fn gloss_is_the_formula() {
    let strengths = |(roughness, mu): (f32, f64)| [0.0, 0.3, 0.8].map(|strength| (roughness, mu, strength));
    let all = ROUGHNESSES.into_iter().flat_map(|r| COSINES.map(|mu| (r, mu)));
    for (roughness, mu, strength) in all.flat_map(strengths) {
        let (lobe, v) = (Lobe { strength, ..Lobe::once(roughness, 0.3) }, view(mu));
        let directions = lobe.even_samples(v);
        let values = lobe.values(v, directions.iter().copied());
        let error = |masking: Masking| {
            let of = |(l, found): (&Vec3, &[f32; 4])| {
                let l = l.as_dvec3().normalize();
                let value = lobe.facets().reflected(v, l, masking) * schlick(0.3, v, l) * l.y.max(0.0);
                // f32 does not hold directions at the horizon to more digits.
                if l.y < 1e-3 { 0.0 } else { (f64::from(found[0]) / value - 1.0).abs() }
            };
            directions.iter().zip(&values).map(of).fold(0.0, f64::max)
        };
        let (found, wrong) = (error(Masking::Correlated), error(Masking::Separable));
        assert!(found < 3e-3, "{lobe:?}, cosine {mu}: off by {found}");
        assert!(roughness < 0.6 || mu > 0.8 || wrong > 1e-2, "control: separable masking is off by {wrong} only");
    }
}

/// Cells along each side of the square of numbers of the half vector.
const CELLS: usize = 20;
const STEPS: usize = 12;

/// Directions drawn for one lobe against the density of another, and that density's integral.
fn samples_against_density(drawn: Lobe, lobe: Lobe, v: DVec3) -> (Deviate, f64) {
    let side = CELLS * STEPS;
    let points = lobe.facets().reflections(v, side);
    let found = lobe.values(v, points.iter().map(|(l, _)| l.as_vec3()));
    let mut probabilities = vec![0.0; CELLS * CELLS];
    for (i, ((_, angle), value)) in points.iter().zip(found).enumerate() {
        probabilities[i / side / STEPS * CELLS + i % side / STEPS] += f64::from(value[3]) * angle;
    }
    let whole: f64 = probabilities.iter().sum();
    // One more cell for what falls below the horizon.
    probabilities.push((1.0 - whole).max(0.0));
    let mut counts = vec![0.0; probabilities.len()];
    let numbers = rows(SAMPLES, [0.0; 4]).into_iter().map(|row| Vec3::from_slice(&row[0]));
    for l in drawn.run("probe_gloss", v, numbers) {
        let l = Vec3::from_slice(&l).as_dvec3();
        let [s, turn] =
            lobe.facets().numbers((v + l).normalize()).map(|u| ((u * CELLS as f64) as usize).min(CELLS - 1));
        counts[if l.y > 0.0 { s * CELLS + turn } else { CELLS * CELLS }] += 1.0;
    }
    (deviate(&counts, &probabilities), whole)
}

#[test]
fn glossy_directions_follow_their_density() {
    for roughness in [0.05, 0.1, 0.3, 0.6, 1.0] {
        let cases = [(0.1, false, 0.0), (0.5, true, 0.0), (0.95, false, 0.0), (0.95, true, 0.0)];
        for (mu, repeated, strength) in cases.into_iter().chain([(0.2, false, 0.4), (0.7, false, 0.8)]) {
            let lobe = Lobe { repeated, strength, ..Lobe::once(roughness, 0.9) };
            let (found, whole) = samples_against_density(lobe, lobe, view(mu));
            assert!(found.fits(), "{lobe:?}, cosine {mu}: {found:?}, the density integrates to {whole}");
            assert!(whole < 1.001 && whole > 0.6, "{lobe:?}, cosine {mu}: the density integrates to {whole}");
            let other = Lobe { roughness: 0.93 * roughness, ..lobe };
            let (wrong, _) = samples_against_density(other, lobe, view(mu));
            assert!(!wrong.fits(), "control: {other:?}, cosine {mu}: {wrong:?}");
        }
    }
}

#[test]
fn gloss_is_reciprocal() {
    for lobe in
        [0.05, 0.3, 1.0].into_iter().flat_map(|r| [Lobe::metal(r, 0.8), Lobe { slope: 0.3, ..Lobe::metal(r, 0.8) }])
    {
        let ns = vec3(lobe.slope, 1.0, 0.0).normalize();
        let v = view(0.5).as_vec3();
        let directions: Vec<Vec3> = lobe.even_samples(view(0.5)).into_iter().filter(|l| l.y > 0.05).collect();
        let there = lobe.values(view(0.5), directions.iter().copied());
        let rows: Vec<Row> = directions.iter().map(|l| lobe.row(v, l.as_dvec3())).collect();
        let back = Probe::new("probe_gloss_values").run(&rows);
        // Largest difference with the cosines taken out, or left in.
        let difference = |power: i32| {
            let of = |((l, there), back): ((&Vec3, &[f32; 4]), &[f32; 4])| {
                let ratio = f64::from(there[1]) / f64::from(back[1]) * f64::from(v.dot(ns) / l.dot(ns)).powi(power);
                if l.dot(ns) < 0.05 { 0.0 } else { (ratio - 1.0).abs() }
            };
            directions.iter().zip(&there).zip(&back).map(of).fold(0.0, f64::max)
        };
        assert!(difference(1) < 5e-3, "{lobe:?}: {}", difference(1));
        assert!(difference(0) > 1e-2, "control: with the cosines {}", difference(0));
    }
}

#[test]
fn weights_of_gloss_are_bounded() {
    let most =
        |lobe: Lobe, drawn: Lobe, mu: f64| lobe.weights(drawn, view(mu)).iter().map(|w| w[0]).fold(0.0, f64::max);
    for (roughness, mu) in ROUGHNESSES.into_iter().flat_map(|r| COSINES.map(|mu| (r, mu))) {
        let once = Lobe::once(roughness, 1.0);
        let found = most(once, once, mu);
        assert!(found < 1.003, "roughness {roughness}, cosine {mu}: {found}");
        let narrow = Lobe::once(0.6 * roughness, 1.0);
        let wrong = most(once, narrow, mu);
        assert!(
            mu > 0.8 || wrong > 1.1,
            "control: the density of a narrower lobe, roughness {roughness}, cosine {mu}: {wrong}"
        );
        let metal = Lobe::metal(roughness, 1.0);
        let found = most(metal, metal, mu);
        assert!(found < 2.0, "with repeated reflections, roughness {roughness}, cosine {mu}: {found}");
    }
}

/// Reflected fractions of materials.md, made by another program: masking, roughness, then a
/// fraction for each of `COSINES`.
const INTEGRATED: [(Masking, f32, [f64; 6]); 6] = [
    (Masking::Separable, 0.4, [0.8669, 0.8832, 0.9259, 0.9505, 0.9635, 0.9676]),
    (Masking::Separable, 0.6, [0.8243, 0.7793, 0.7764, 0.7929, 0.8142, 0.8243]),
    (Masking::Separable, 1.0, [0.5579, 0.4721, 0.4091, 0.3610, 0.3230, 0.3072]),
    (Masking::Correlated, 0.4, [0.8884, 0.8861, 0.9264, 0.9506, 0.9635, 0.9676]),
    (Masking::Correlated, 0.6, [0.8824, 0.7963, 0.7821, 0.7947, 0.8145, 0.8243]),
    (Masking::Correlated, 1.0, [0.7602, 0.5601, 0.4507, 0.3789, 0.3275, 0.3072]),
];

#[test]
fn one_reflection_loses_what_others_integrated() {
    for (masking, roughness, fractions) in INTEGRATED {
        let lobe = Lobe::once(roughness, 1.0);
        let off = |(mu, fraction): (f64, f64)| (lobe.reflected(view(mu))[0] / fraction - 1.0).abs();
        let worst = COSINES.into_iter().zip(fractions).map(off).fold(0.0, f64::max);
        match masking {
            Masking::Correlated => assert!(worst < 5e-3, "roughness {roughness}: off by {worst}"),
            Masking::Separable => assert!(worst > 2e-2, "control: separable masking, {roughness}: off by {worst}"),
        }
    }
}

#[test]
fn white_metal_reflects_all() {
    for (roughness, mu) in ROUGHNESSES.into_iter().flat_map(|r| COSINES.map(|mu| (r, mu))) {
        let [white, half, quarter] = Lobe::metal(roughness, 1.0).reflected(view(mu));
        assert!((white - 1.0).abs() < 5e-3, "roughness {roughness}, cosine {mu}: {white}");
        assert!(half < 1.0 && quarter < half, "roughness {roughness}, cosine {mu}: {half} and {quarter}");
        let leaning = Lobe { slope: 0.4, ..Lobe::metal(roughness, 1.0) }.reflected(view(mu))[0];
        assert!(leaning < 1.005, "roughness {roughness}, cosine {mu}, with another normal: {leaning}");
        let once = Lobe::once(roughness, 1.0).reflected(view(mu))[0];
        assert!(roughness < 0.6 || once < 0.9, "control: roughness {roughness}, cosine {mu}, once: {once}");
    }
}

#[test]
fn mean_weights_are_the_albedo() {
    for (roughness, mu) in ROUGHNESSES.into_iter().flat_map(|r| COSINES.map(|mu| (r, mu))) {
        let lobe = Lobe::once(roughness, 0.1);
        let found = lobe.reflected(view(mu))[0];
        let albedo =
            |roughness: f32| Facets::of_roughness(roughness.into()).albedo(view(mu), 0.1, Masking::Correlated, 200);
        let (right, wrong) = (albedo(roughness), albedo(roughness + 0.1));
        assert!((found / right - 1.0).abs() < 1e-2, "roughness {roughness}, cosine {mu}: {found} for {right}");
        let told = |wrong: f64| (found / wrong - 1.0).abs() > 1e-2;
        assert!(mu > 0.5 || roughness < 0.2 || told(wrong), "control: roughness {roughness}, cosine {mu}: {wrong}");
        let fitted = |lobe: Lobe| f64::from(lobe.run("probe_gloss_albedo", view(mu), [Vec3::ZERO])[0][0]);
        let guess = fitted(lobe);
        assert!((guess / right - 1.0).abs() < 0.11, "roughness {roughness}, cosine {mu}: {guess} for {right}");
        let blind = fitted(Lobe { f0: 0.15, ..lobe });
        assert!(mu < 0.6 || (blind / right - 1.0).abs() > 0.11, "control: another reflectance, {roughness}, {mu}");
    }
}

#[test]
fn gloss_is_finite_at_extremes() {
    let views =
        [1e-7, 1e-4, 0.05, 1.0 - 1e-7, 1.0].into_iter().flat_map(|mu| [0.0, 3.1].map(|turn| at_cosine(mu, turn)));
    for (v, roughness) in views.flat_map(|v| [0.01, 0.05, 1.0].map(|r| (v, r))) {
        for lobe in [Lobe::metal(roughness, 1.0), Lobe { strength: 1.0, ..Lobe::once(roughness, 0.0) }] {
            // With the second azimuth the viewer can be behind the shading normal.
            for lobe in [lobe, Lobe { slope: 0.5, strength: 0.0, ..lobe }] {
                let corners = [0.0, 0.5, 1.0 - f32::EPSILON].map(|x| [0.0, 0.3, 1.0 - f32::EPSILON].map(|y| (x, y)));
                let numbers = corners.into_iter().flatten().flat_map(|(x, y)| [0.0, 0.999].map(|z| vec3(x, y, z)));
                let drawn = lobe.run("probe_gloss", v, numbers);
                let directions = drawn.iter().map(|d| Vec3::from_slice(d));
                assert!(directions.clone().all(|d| (d.length() - 1.0).abs() < 1e-4), "{lobe:?}, {v}: {drawn:?}");
                let values = lobe.values(v, directions);
                let sound = |v: &[f32; 4]| v.iter().all(|x| x.is_finite() && *x >= 0.0);
                assert!(values.iter().all(sound), "{lobe:?}, {v}: {values:?}");
            }
        }
    }
}
