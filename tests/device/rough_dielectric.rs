//! Rough glass, and rough sheets of it: value, density and samples agree with each other and with
//! Walter et al. 2007 in f64 (`microfacets.rs`).
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | formula | value is Walter's, as radiance and as flux | another index; flux for radiance |
//! | samples | follow the density (chi-square at 1e-4), what is lost included | another roughness |
//! | reciprocity | flux one way is radiance the other way | radiance both ways |
//! | energy | what is reflected and what goes through are the integrals in f64, at most 1 together | another index |
//! | sheet | loses what separable masking does, and reflects as a pane | height-correlated masking; one face |
//! | film | gives its colours what glass without it reflects and lets through together | no film |
//! | coat and normals | flux one way is radiance the other way, also with a film, under a coat and with a mapped normal | another normal |

use glam::{DVec3, Vec3};

use super::{
    chi_square::{Deviate, SAMPLES, deviate},
    fresnel::closed_form,
    microfacets::{Facets, Masking, at_cosine},
    probe::{Probe, Row, even_numbers, rows},
};

const EVEN: usize = 1 << 14;

/// A lobe as the probes take it; what goes through keeps its red, half of its green and no blue.
#[derive(Clone, Copy, Debug)]
struct Glass {
    roughness: f32,
    eta: f32,
    thin: bool,
    /// Whether values are those of flux.
    flux: bool,
    /// Sum of [`FILM`], [`COAT`], one of [`LEANING`] and [`MORE`].
    has: u8,
}

const FILM: u8 = 2;
const COAT: u8 = 4;
/// Shading normals that lean to +x and to -x.
const LEANING: [u8; 2] = [8, 16];
/// They lean by 50° in place of 17°.
const MORE: u8 = 32;

impl Glass {
    fn solid(roughness: f32, eta: f32) -> Self {
        Self { roughness, eta, thin: false, flux: false, has: 0 }
    }

    fn facets(self) -> Facets {
        Facets::of_roughness(self.roughness.into())
    }

    fn row(self, a: Vec3, view: DVec3) -> Row {
        let eta = if self.thin { -self.eta } else { self.eta };
        let has = f32::from(self.has | u8::from(self.flux));
        [[a.x, a.y, a.z, self.roughness], [view.x as f32, view.z as f32, eta, has]]
    }

    fn values(self, view: DVec3, directions: &[Vec3]) -> Vec<[f32; 4]> {
        let rows: Vec<Row> = directions.iter().map(|l| self.row(*l, view)).collect();
        Probe::new("probe_rough_dielectric_values").run(&rows)
    }

    fn samples(self, view: DVec3, numbers: impl IntoIterator<Item = Vec3>) -> Vec<Vec3> {
        let rows: Vec<Row> = numbers.into_iter().map(|u| self.row(u, view)).collect();
        let drawn = Probe::new("probe_rough_dielectric").run(&rows);
        drawn.iter().map(|d| Vec3::from_slice(d)).collect()
    }

    /// Mean of value over density of each channel: blue is reflected, red less blue goes through.
    fn means(self, view: DVec3) -> [f64; 3] {
        let directions = self.samples(view, even_numbers(EVEN));
        let values = self.values(view, &directions);
        let weight = |v: &[f32; 4], i: usize| if v[3] > 0.0 { f64::from(v[i]) / f64::from(v[3]) } else { 0.0 };
        [0, 1, 2].map(|i| values.iter().map(|v| weight(v, i)).sum::<f64>() / EVEN as f64)
    }
}

fn view(mu: f64) -> DVec3 {
    at_cosine(mu, 0.7)
}

/// Roughness, index and cosine of the viewer.
fn cases() -> impl Iterator<Item = (f32, f32, f64)> {
    let lobes = [0.05, 0.1, 0.3, 0.6, 1.0].into_iter().flat_map(|r| [1.5, 1.0 / 1.5, 1.2].map(|eta| (r, eta)));
    lobes.flat_map(|(roughness, eta)| [0.15, 0.8, 0.95].map(|mu| (roughness, eta, mu)))
}

/// Whether a smooth surface lets light through, well within the critical angle.
fn refracts(eta: f32, mu: f64) -> bool {
    (1.0 - mu * mu) / f64::from(eta * eta) < 0.9
}

#[test]
fn rough_glass_is_walters() {
    for (roughness, eta, mu) in cases() {
        let (glass, v) = (Glass::solid(roughness, eta), view(mu));
        let directions = glass.samples(v, even_numbers(EVEN));
        let error = |glass: Glass, eta: f32| {
            let of = |(l, found): (&Vec3, &[f32; 4])| {
                let (l, eta) = (l.as_dvec3().normalize_or_zero(), f64::from(eta));
                // At the horizon, at grazing microfacets and at their critical angle f32 has fewer
                // digits.
                let h = if l.y > 0.0 { v + l } else { v + eta * l };
                let cosine = v.dot(h.normalize_or_zero()).abs();
                let steep = (1.0 - (1.0 - cosine * cosine) / (eta * eta)).abs() < 2e-2;
                if l.y.abs() < 1e-2 || cosine < 1e-2 || steep {
                    return 0.0;
                }
                (f64::from(found[0]) / (glass.facets().walter(v, l, eta) * l.y.abs()) - 1.0).abs()
            };
            directions.iter().zip(&glass.values(v, &directions)).map(of).fold(0.0, f64::max)
        };
        let found = error(glass, eta);
        assert!(found < 1e-2, "{glass:?}, cosine {mu}: off by {found}");
        assert!(!refracts(eta, mu) || error(glass, 1.1 * eta) > 5e-2, "control: another index than {glass:?}");
        let of_flux = error(Glass { flux: true, ..glass }, eta);
        assert!(!refracts(eta, mu) || of_flux > 5e-2, "control: flux, {glass:?}");
    }
}

const CELLS: usize = 16;
const STEPS: usize = 16;

/// Directions drawn for one lobe against the density of another, and that density's integral.
fn samples_against_density(drawn: Glass, glass: Glass, v: DVec3) -> (Deviate, f64) {
    let (facets, side, eta) = (glass.facets(), CELLS * STEPS, f64::from(glass.eta));
    let mut points = facets.reflections(v, side);
    let image = |l: DVec3| l * DVec3::new(1.0, -1.0, 1.0);
    points.extend(match glass.thin {
        true => points.iter().map(|&(l, angle)| (image(l), angle)).collect(),
        false => facets.refractions(v, eta, side),
    });
    let found = glass.values(v, &points.iter().map(|(l, _)| l.as_vec3()).collect::<Vec<_>>());
    let mut probabilities = vec![0.0; 2 * CELLS * CELLS];
    for (i, ((l, angle), value)) in points.iter().zip(found).enumerate() {
        let (through, i) = (i / (side * side), i % (side * side));
        // A microfacet can send light to the wrong side.
        if (l.y < 0.0) == (through == 1) {
            let cell = (through * CELLS + i / side / STEPS) * CELLS + i % side / STEPS;
            probabilities[cell] += f64::from(value[3]) * angle;
        }
    }
    let whole: f64 = probabilities.iter().sum();
    probabilities.push((1.0 - whole).max(0.0));
    let mut counts = vec![0.0; probabilities.len()];
    for l in drawn.samples(v, rows(SAMPLES, [0.0; 4]).into_iter().map(|row| Vec3::from_slice(&row[0]))) {
        let l = l.as_dvec3();
        let h = match (l.y < 0.0, glass.thin) {
            (false, _) => v + l,
            (true, true) => v + image(l),
            (true, false) => v + eta * l,
        };
        let [s, turn] = facets.numbers((h * h.y.signum()).normalize());
        let [s, turn] = [s, turn].map(|u| ((u * CELLS as f64) as usize).min(CELLS - 1));
        let through = usize::from(l.y < 0.0);
        counts[if l == DVec3::ZERO { 2 * CELLS * CELLS } else { (through * CELLS + s) * CELLS + turn }] += 1.0;
    }
    (deviate(&counts, &probabilities), whole)
}

#[test]
fn rough_glass_directions_follow_their_density() {
    let sheets = [0.1, 0.6].map(|r| (Glass { thin: true, ..Glass::solid(r, 1.5) }, 0.5));
    let solids = cases().filter(|(_, eta, _)| *eta != 1.2).map(|(r, eta, mu)| (Glass::solid(r, eta), mu));
    let more = [FILM, COAT, FILM | COAT].map(|has| (Glass { has, ..Glass::solid(0.3, 1.5) }, 0.8));
    for (glass, mu) in solids.chain(sheets).chain(more) {
        let (found, whole) = samples_against_density(glass, glass, view(mu));
        assert!(found.fits(), "{glass:?}, cosine {mu}: {found:?}, the density integrates to {whole}");
        assert!(whole < 1.001 && whole > 0.5, "{glass:?}, cosine {mu}: the density integrates to {whole}");
        let other = Glass { roughness: 0.93 * glass.roughness, ..glass };
        let (wrong, _) = samples_against_density(other, glass, view(mu));
        assert!(!wrong.fits(), "control: {other:?}, cosine {mu}: {wrong:?}");
    }
}

#[test]
fn flux_through_rough_glass_is_radiance_the_other_way() {
    for (roughness, eta, mu) in cases().filter(|(_, eta, mu)| refracts(*eta, *mu)) {
        let (glass, v) = (Glass { flux: true, ..Glass::solid(roughness, eta) }, view(mu));
        let directions: Vec<Vec3> =
            glass.samples(v, even_numbers(EVEN / 4)).into_iter().filter(|l| l.y < -0.1).collect();
        let there = glass.values(v, &directions);
        let turned = |w: Vec3| Vec3::new(w.x, -w.y, w.z);
        let difference = |back: Glass| {
            let rows: Vec<Row> =
                directions.iter().map(|l| back.row(turned(v.as_vec3()), turned(*l).as_dvec3())).collect();
            let back = Probe::new("probe_rough_dielectric_values").run(&rows);
            let of = |((l, there), back): ((&Vec3, &[f32; 4]), &[f32; 4])| {
                (f64::from(there[0]) * v.y / (f64::from(back[0]) * f64::from(-l.y)) - 1.0).abs()
            };
            directions.iter().zip(&there).zip(&back).map(of).fold(0.0, f64::max)
        };
        let back = Glass::solid(roughness, 1.0 / eta);
        assert!(difference(back) < 3e-2, "{glass:?}: {}", difference(back));
        assert!(difference(Glass { flux: true, ..back }) > 0.2, "control: flux both ways, {glass:?}");
    }
}

#[test]
fn rough_glass_keeps_the_energy_of_walters_integrals() {
    for (roughness, eta, mu) in cases() {
        let (glass, v) = (Glass { flux: true, ..Glass::solid(roughness, eta) }, view(mu));
        let [all, half, reflected] = glass.means(v);
        let integral = |eta: f64, through: bool| -> f64 {
            let side = 250;
            let points = match through {
                true => glass.facets().refractions(v, eta, side),
                false => glass.facets().reflections(v, side),
            };
            let of = |(l, angle): (DVec3, f64)| glass.facets().walter(v, l, eta) * l.y.abs() * angle;
            points.into_iter().filter(|(l, angle)| *angle > 0.0 && (l.y < 0.0) == through).map(of).sum()
        };
        let eta = f64::from(eta);
        let (expected, passed) = (integral(eta, false), integral(eta, true) * eta * eta);
        assert!((reflected - expected).abs() < 4e-3, "{glass:?}, {mu}: {reflected} is reflected for {expected}");
        assert!(
            (all - reflected - passed).abs() < 4e-3,
            "{glass:?}, {mu}: {} goes through for {passed}",
            all - reflected
        );
        assert!(all < 1.001, "{glass:?}, {mu}: {all}");
        assert!((2.0 * half - all - reflected).abs() < 1e-4, "{glass:?}, {mu}: half is tinted, {half} of {all}");
        let other = (integral(1.6 * eta, false) - expected, integral(1.6 * eta, true) * (1.6 * eta).powi(2) - passed);
        assert!(other.0.abs().max(other.1.abs()) > 1e-2, "control: another index, {glass:?}, {mu}: {other:?}");
        let radiance = Glass { flux: false, ..glass }.means(v);
        let scaled = (radiance[0] - radiance[2]) * eta * eta;
        assert!((scaled - passed).abs() < 8e-3, "{glass:?}, {mu}: radiance {scaled}");
    }
}

#[test]
fn rough_sheets_reflect_as_panes() {
    for (roughness, mu) in [0.1, 0.4, 0.6, 1.0].into_iter().flat_map(|r| [0.1, 0.5, 0.9].map(|mu| (r, mu))) {
        let (sheet, v) = (Glass { thin: true, ..Glass::solid(roughness, 1.5) }, view(mu));
        let [all, _, reflected] = sheet.means(v);
        let whole = |masking: Masking| sheet.facets().albedo(v, 1.0, masking, 200);
        let right = whole(Masking::Separable);
        assert!((all - right).abs() < 4e-3, "{sheet:?}, {mu}: {all} for {right}");
        let wrong = whole(Masking::Correlated);
        assert!(roughness < 0.5 || mu > 0.4 || (all - wrong).abs() > 1e-2, "control: {sheet:?}, {mu}: {wrong}");
        let of = |faces: fn(f64) -> f64| -> f64 {
            let value = |(l, angle): (DVec3, f64)| {
                let fresnel = closed_form(v.dot((v + l).normalize()), 1.5);
                sheet.facets().reflected(v, l, Masking::Separable) * l.y.max(0.0) * angle * faces(fresnel)
            };
            sheet.facets().reflections(v, 200).into_iter().map(value).sum()
        };
        let (both, one) = (of(|f| 2.0 * f / (1.0 + f)), of(|f| f));
        assert!((reflected - both).abs() < 4e-3, "{sheet:?}, {mu}: {reflected} is reflected for {both}");
        assert!((reflected - one).abs() > 8e-3, "control: one face, {sheet:?}, {mu}: {one}");
    }
}

#[test]
fn rough_glass_is_finite_at_extremes() {
    let corners = [0.0, 0.5, 1.0 - f32::EPSILON].map(|x| [0.0, 0.3, 1.0 - f32::EPSILON].map(|y| (x, y)));
    for (mu, roughness) in [1e-7, 1e-4, 0.05, 1.0].into_iter().flat_map(|mu| [0.01, 0.05, 1.0].map(|r| (mu, r))) {
        for eta in [1.0 / 2.4, 0.99, 1.0, 1.01, 2.4] {
            let glass = Glass::solid(roughness, eta);
            for glass in [glass, Glass { thin: true, ..glass }] {
                let numbers = corners.into_iter().flatten().flat_map(|(x, y)| [0.0, 0.999].map(|z| Vec3::new(x, y, z)));
                let directions = glass.samples(view(mu), numbers);
                let sound = |l: &Vec3| *l == Vec3::ZERO || (l.length() - 1.0).abs() < 1e-4;
                assert!(directions.iter().all(sound), "{glass:?}, {mu}: {directions:?}");
                let values = glass.values(view(mu), &directions);
                let sound = |v: &[f32; 4]| v.iter().all(|x| x.is_finite() && *x >= 0.0);
                assert!(values.iter().all(sound), "{glass:?}, {mu}: {values:?}");
            }
        }
    }
}

#[test]
fn a_film_divides_light_between_both_sides() {
    for (roughness, eta, mu) in [(0.1, 1.5, 0.9), (0.4, 1.5, 0.5), (0.3, 1.0 / 1.5, 0.95)] {
        let bare = Glass { flux: true, ..Glass::solid(roughness, eta) };
        for thin in [false, true] {
            let bare = Glass { thin, eta: if thin { 1.5 } else { eta }, ..bare };
            let [all, _, reflected] = bare.means(view(mu));
            let [filmed, half, colour] = Glass { has: FILM, ..bare }.means(view(mu));
            // The channels have other colours; none gains or loses.
            assert!((filmed - all).abs() < 0.02, "{bare:?}, {mu}: {filmed} in all for {all}");
            assert!(filmed < 1.003 && half < filmed, "{bare:?}, {mu}: {filmed}");
            assert!((colour - reflected).abs() > 0.01, "control: {bare:?}, {mu}: {colour} with and without a film");
        }
    }
}

/// Largest relative difference between flux of `there` and radiance of `back` the other way.
fn asymmetry(there: Glass, back: Glass, v: DVec3) -> f64 {
    let directions = there.samples(v, even_numbers(EVEN / 4));
    let directions: Vec<Vec3> = directions.into_iter().filter(|l| l.y.abs() > 0.15).collect();
    let found = there.values(v, &directions);
    // The side of the viewer is up.
    let turned = |w: Vec3, l: Vec3| if l.y < 0.0 { Vec3::new(w.x, -w.y, w.z) } else { w };
    let of = |l: &Vec3| {
        // Seen from below the normal leans the other way, and so does the index.
        let glass = if l.y < 0.0 { back } else { Glass { has: there.has, eta: there.eta, ..back } };
        glass.row(turned(v.as_vec3(), *l), turned(*l, *l).as_dvec3())
    };
    let others = Probe::new("probe_rough_dielectric_values").run(&directions.iter().map(of).collect::<Vec<_>>());
    let of = |((l, there), back): ((&Vec3, &[f32; 4]), &[f32; 4])| {
        let (there, back) = (f64::from(there[0]) * v.y, f64::from(back[0]) * f64::from(l.y.abs()));
        if there.max(back) < 1e-3 { 0.0 } else { (there - back).abs() / there.max(back) }
    };
    directions.iter().zip(&found).zip(&others).map(of).fold(0.0, f64::max)
}

#[test]
fn coats_films_and_mapped_normals_keep_both_ways_equal() {
    for has in [FILM, COAT, LEANING[0], LEANING[1] | MORE, FILM | COAT | LEANING[0] | MORE] {
        for eta in [1.5, 1.0 / 1.5] {
            let there = Glass { flux: true, has, ..Glass::solid(0.4, eta) };
            let leans = has & (LEANING[0] | LEANING[1]);
            let turned = if leans == 0 { has } else { has ^ (LEANING[0] | LEANING[1]) };
            let back = Glass { has: turned, ..Glass::solid(0.4, 1.0 / eta) };
            let found = asymmetry(there, back, view(0.8));
            assert!(found < 3e-2, "{there:?}: {found}");
            let other = if leans == 0 { turned | LEANING[1] } else { has };
            let other = Glass { has: other, ..back };
            assert!(asymmetry(there, other, view(0.8)) > 0.1, "control: another normal than that of {there:?}");
        }
    }
}
