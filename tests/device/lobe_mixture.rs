//! Several lobes of one surface, sampled as one, and wavelengths: samples follow the density.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | mixture | directions follow the density (chi-square at 1e-4), which is at most 1 in all | each other mixture |
//! | wavelengths | follow the density, which integrates to 1 | a uniform one |

use glam::{DVec3, Vec3};

use super::{
    chi_square::{Directions, SAMPLES, deviate},
    microfacets::at_cosine,
    probe::{Probe, Row, rows},
};

/// Lobes besides the metal: bit 0 sheen, bit 1 a clear coat, bit 2 rougher metal, bit 3 a normal
/// that leans so far that much of the light is mirrored.
const MIXTURES: [u8; 7] = [0, 1, 2, 3, 7, 8, 15];

fn directions(a: impl IntoIterator<Item = [f32; 4]>, given: bool, view: DVec3, mixture: u8) -> Vec<[f32; 4]> {
    let b = [view.x as f32, view.z as f32, f32::from(u8::from(given)), f32::from(mixture)];
    Probe::new("probe_reflecting").run(&a.into_iter().map(|a| [a, b]).collect::<Vec<Row>>())
}

#[test]
fn directions_of_several_lobes_follow_one_density() {
    let grid = Directions { rows: 24, columns: 36 };
    let midpoints: Vec<[f32; 4]> = grid.midpoints(14).iter().map(|d| d.as_vec3().extend(0.0).to_array()).collect();
    for mu in [0.25, 0.8] {
        let view = at_cosine(mu, 0.7);
        // One more cell for directions below the surface, where the value is 0.
        let probabilities = MIXTURES.map(|mixture| {
            let densities = directions(midpoints.iter().copied(), true, view, mixture);
            let above = |d: &[f32; 4]| if d[1] > 0.0 { f64::from(d[3]) } else { 0.0 };
            let mut all = grid.probabilities(&densities.iter().map(above).collect::<Vec<_>>());
            let above: f64 = all.iter().sum();
            assert!(above > 0.5 && above < 1.001, "mixture {mixture}, cosine {mu}: {above} in all");
            all.push((1.0 - above).max(0.0));
            all
        });
        let counts = MIXTURES.map(|mixture| {
            let numbers = rows(SAMPLES, [0.0; 4]).into_iter().map(|row| row[0]);
            let (above, below): (Vec<[f32; 4]>, Vec<[f32; 4]>) =
                directions(numbers, false, view, mixture).into_iter().partition(|d| d[1] > 0.0);
            assert!(above.iter().all(|d| Vec3::from_slice(d).is_normalized() && d[3] > 0.0));
            let mut counts = grid.counts(above);
            counts.push(below.len() as f64);
            counts
        });
        for (i, mixture) in MIXTURES.iter().enumerate() {
            for (j, other) in MIXTURES.iter().enumerate() {
                let found = deviate(&counts[i], &probabilities[j]);
                let what = format!("mixture {mixture} against {other}, cosine {mu}: {found:?}");
                assert_eq!(found.fits(), i == j, "{what}");
            }
        }
    }
}

#[test]
fn wavelengths_follow_their_density() {
    let (shortest, longest, cells, steps) = (380.0, 780.0, 100, 64);
    let run = |numbers: Vec<Row>| Probe::new("probe_wavelength").run(&numbers);
    let mut counts = vec![0.0; cells];
    for [wavelength, ..] in run(rows(SAMPLES, [0.0; 4])) {
        let at = (f64::from(wavelength) - shortest) / (longest - shortest);
        counts[((at * cells as f64) as usize).min(cells - 1)] += 1.0;
    }
    // The density at even numbers, as a table over wavelengths.
    let even = (0..=1 << 14).map(|i| [[i as f32 / (1 << 14) as f32, 0.0, 0.0, 0.0], [0.0; 4]]).collect();
    let table: Vec<[f64; 2]> = run(even).iter().map(|[l, pdf, ..]| [f64::from(*l), f64::from(*pdf)]).collect();
    let pdf = |wavelength: f64| {
        let after = table.partition_point(|[l, _]| *l < wavelength).clamp(1, table.len() - 1);
        let ([l0, p0], [l1, p1]) = (table[after - 1], table[after]);
        p0 + (p1 - p0) * ((wavelength - l0) / (l1 - l0).max(1e-6)).clamp(0.0, 1.0)
    };
    let width = (longest - shortest) / (cells * steps) as f64;
    let midpoint = |i: usize| shortest + (i as f64 + 0.5) * width;
    let cell = |c: usize| (c * steps..(c + 1) * steps).map(|i| pdf(midpoint(i)) * width).sum::<f64>();
    let probabilities: Vec<f64> = (0..cells).map(cell).collect();
    let whole: f64 = probabilities.iter().sum();
    assert!((whole - 1.0).abs() < 1e-3, "the density integrates to {whole}");
    let found = deviate(&counts, &probabilities);
    assert!(found.fits(), "{found:?}");
    let uniform = deviate(&counts, &vec![1.0 / cells as f64; cells]);
    assert!(!uniform.fits(), "control: a uniform density: {uniform:?}");
}
