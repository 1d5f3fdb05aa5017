//! Each sampling function follows its density: chi-square at a significance of 1e-4, with fixed
//! seeds.
//!
//! | test | density | negative control |
//! |---|---|---|
//! | sphere | 1/4π | a cone that leaves a cap out |
//! | cone | 1/(2π h), narrow and wide | a wider cone |
//! | hemisphere | cos/π about any axis | a uniform one |
//! | discs | 1/π, polar and concentric (the lens) | a uniform hemisphere seen from above |
//! | linear | from a to b | from b to a |
//! | sampler | one number of a set is uniform over the seeds, alone and with another dimension | a whole set is too even; a dimension with itself |
//! | cells | host and kernels have the same hash | that of the next cell |
//! | patches | what is drawn on the rim has the density of the disc | it is at the rim |

use caustica::passes::estimate::cell_hash;
use glam::{Vec3, vec3};
use support::photons::Random;

use super::{
    chi_square::{Deviate, SAMPLES, height_and_azimuth, of_unit_square},
    probe::{Probe, Row, rows},
};

const AXES: [Vec3; 4] = [Vec3::Z, Vec3::NEG_Z, Vec3::X, vec3(0.48, -0.6, -0.64)];

#[test]
fn directions_drawn_at_the_rim_of_a_bright_patch_are_within_it() {
    let mut random = Random(3);
    let mut row = || {
        let [x, y, away] = [0; 3].map(|_| 6.0 * random.unit() - 3.0);
        let radius = 0.01 + 0.05 * random.unit();
        // Small first numbers are at the rim.
        let rim = (64.0 * random.unit()).floor() / 16_777_216.0;
        [[rim, random.unit(), x, y], [0.2, -0.1, 4.0 + away, radius]]
    };
    let densities = |rows: &[Row]| Probe::new("probe_patch").run(rows).into_iter().map(|d| d[3]).collect::<Vec<_>>();
    let at_rim: Vec<Row> = (0..100_000).map(|_| row()).collect();
    let long: Vec<Row> = at_rim.iter().map(|[a, [x, y, z, radius]]| [*a, [*x, *y, *z, -radius]]).collect();
    for rows in [&at_rim, &long] {
        let outside = densities(rows).iter().filter(|density| **density <= 0.0).count();
        assert_eq!(outside, 0, "directions without the density that they were drawn with");
    }
    let directions = Probe::new("probe_patch").run(&at_rim);
    let is_inside = |(row, d): (&Row, &[f32; 4])| {
        let to = Vec3::from_slice(&row[1]).as_dvec3() - vec3(row[0][2], row[0][3], 0.0).as_dvec3();
        let direction = Vec3::from_slice(d).as_dvec3();
        to.length() * direction.cross(to).length() / direction.dot(to) < 0.999 * f64::from(row[1][3])
    };
    assert_eq!(
        at_rim.iter().zip(&directions).filter(|pair| is_inside(*pair)).count(),
        0,
        "control: they are at the rim"
    );
}

#[test]
fn directions_over_a_long_bright_patch_have_its_solid_angle() {
    let mut random = Random(4);
    let mut rows = |away: f32, radius: f32| -> Vec<Row> {
        // In front of an ellipse, to its side.
        (0..40_000).map(|_| [[random.unit(), random.unit(), 1.5, -0.5], [0.0, 0.0, away, radius]]).collect()
    };
    let mut solid_angle = |away: f32, radius: f32| {
        let found = Probe::new("probe_patch").run(&rows(away, radius));
        found.iter().map(|d| 1.0 / f64::from(d[3])).sum::<f64>() / found.len() as f64
    };
    for (away, radius) in [(3.0_f32, 0.1_f32), (0.8, 0.02)] {
        let distance = f64::from(away).hypot(1.5).hypot(0.5);
        let projected = f64::from(away) / distance.powi(3);
        let right = std::f64::consts::PI * 0.1 * f64::from(radius).powi(2) * projected;
        let found = solid_angle(away, -radius);
        assert!((found / right - 1.0).abs() < 0.01, "{found} instead of {right}");
        assert!(solid_angle(away, radius) > 5.0 * right, "control: a disc");
    }
}

/// Directions against a density of which `fraction` is what lies below a height, 1 − cos, about
/// the axis.
fn about(axis: Vec3, directions: Vec<[f32; 4]>, fraction: impl Fn(f64) -> f64) -> Deviate {
    of_unit_square(directions.into_iter().map(|d| {
        let [height, azimuth] = height_and_azimuth(d, axis);
        [fraction(height), azimuth]
    }))
}

fn cone(axis: Vec3, height: f32) -> Vec<[f32; 4]> {
    Probe::new("probe_cone").run(&rows(SAMPLES, axis.extend(height).to_array()))
}

#[test]
fn the_sphere_is_uniform() {
    let sphere = Probe::new("probe_sphere").run(&rows(SAMPLES, [0.0; 4]));
    for axis in AXES {
        let found = about(axis, sphere.clone(), |h| h / 2.0);
        assert!(found.fits(), "about {axis}: {found:?}");
        let capped = about(axis, cone(axis, 1.98), |h| h / 2.0);
        assert!(!capped.fits(), "control: without a cap about {axis}: {capped:?}");
    }
}

#[test]
fn cones_are_uniform() {
    for (axis, height) in AXES.into_iter().zip([1e-4, 0.02, 0.5, 1.7]) {
        let found = about(axis, cone(axis, height), |h| h / f64::from(height));
        assert!(found.fits(), "of height {height}: {found:?}");
        let wider = about(axis, cone(axis, 1.03 * height), |h| h / f64::from(height));
        assert!(!wider.fits(), "control: 3 % higher than {height}: {wider:?}");
    }
}

#[test]
fn the_hemisphere_follows_the_cosine() {
    // The fraction below the height h is sin²θ.
    let fraction = |h: f64| h * (2.0 - h);
    for axis in AXES {
        let drawn = Probe::new("probe_cosine").run(&rows(SAMPLES, axis.extend(0.0).to_array()));
        let found = about(axis, drawn, fraction);
        assert!(found.fits(), "about {axis}: {found:?}");
        let uniform = about(axis, cone(axis, 1.0), fraction);
        assert!(!uniform.fits(), "control: a uniform hemisphere about {axis}: {uniform:?}");
    }
}

#[test]
fn discs_are_uniform() {
    let square = |x: f32, y: f32| {
        let (x, y) = (f64::from(x), f64::from(y));
        [x * x + y * y, y.atan2(x) / std::f64::consts::TAU + 0.5]
    };
    let discs = Probe::new("probe_discs").run(&rows(SAMPLES, [0.0; 4]));
    let polar = of_unit_square(discs.iter().map(|[x, y, ..]| square(*x, *y)));
    let concentric = of_unit_square(discs.iter().map(|[.., x, y]| square(*x, *y)));
    assert!(polar.fits() && concentric.fits(), "{polar:?} {concentric:?}");
    let hemisphere = of_unit_square(cone(Vec3::Z, 1.0).iter().map(|[x, y, ..]| square(*x, *y)));
    assert!(!hemisphere.fits(), "control: a hemisphere from above: {hemisphere:?}");
}

#[test]
fn linear_densities_are_drawn() {
    let drawn = |a: f32, b: f32| Probe::new("probe_linear").run(&rows(SAMPLES, [a, b, 0.0, 0.0]));
    for (a, b) in [(1.0, 3.0), (0.0, 2.0), (5.0, 0.0), (1.0, 1.1)] {
        let fraction = |x: f64| (f64::from(a) * x + 0.5 * f64::from(b - a) * x * x) / (0.5 * f64::from(a + b));
        let test = |drawn: Vec<[f32; 4]>| {
            // The second coordinate is the random number itself.
            of_unit_square(
                drawn.iter().zip(rows(SAMPLES, [0.0; 4])).map(|(d, r)| [fraction(d[0].into()), r[0][1].into()]),
            )
        };
        let (found, other) = (test(drawn(a, b)), test(drawn(b, a)));
        assert!(found.fits(), "from {a} to {b}: {found:?}");
        assert!(!other.fits(), "control: from {b} to {a}: {other:?}");
    }
}

/// Numbers of the sampler for each row of seed, index, set and dimension.
fn sampler(keys: impl Iterator<Item = [u32; 4]>) -> Vec<[f64; 4]> {
    let rows: Vec<Row> = keys.map(|key| [key.map(|k| k as f32), [1.0, 0.0, 0.0, 0.0]]).collect();
    Probe::new("probe_sampler").run(&rows).into_iter().map(|numbers| numbers.map(f64::from)).collect()
}

#[test]
fn scrambled_sobol_numbers_are_uniform_over_the_seeds() {
    let seeds = 0..SAMPLES as u32;
    for (index, set, dimension) in [(0, 0, 0), (1, 0, 0), (37, 5, 1), (100_001, 3, 7)] {
        let numbers = sampler(seeds.clone().map(|seed| [seed, index, set, dimension]));
        for (x, y) in [(0, 1), (0, 2), (1, 3), (2, 3)] {
            let found = of_unit_square(numbers.iter().map(|n| [n[x], n[y]]));
            assert!(found.fits(), "dimensions {x} and {y} of number {index}: {found:?}");
        }
        let one = of_unit_square(numbers.iter().map(|n| [(16.0 * n[0]).fract(), (256.0 * n[0]).fract()]));
        assert!(one.fits(), "finer digits of number {index}: {one:?}");
        let itself = of_unit_square(numbers.iter().map(|n| [n[0], n[0]]));
        assert!(!itself.fits(), "control: a dimension with itself: {itself:?}");
    }
    let [first, second] = [0, 1].map(|index| sampler(seeds.clone().map(|seed| [seed, index, 0, 0])));
    assert!(first.iter().zip(&second).all(|(a, b)| (a[0] < 0.5) != (b[0] < 0.5)), "a set has one number in each half");
    // Control: the numbers of one set are far too uniform for independent ones.
    let set = of_unit_square(sampler((0..1 << 16).map(|index| [0, index, 0, 0])).iter().map(|n| [n[0], n[1]]));
    assert!(!set.fits(), "control: a whole set: {set:?}");
}

#[test]
fn cells_have_one_hash_on_both_sides() {
    let mut random = Random(9);
    let mut coordinate = || (2e6 * random.unit() - 1e6).floor();
    let rows: Vec<Row> =
        (0..1000).map(|i| [[coordinate(), coordinate(), coordinate(), (i % 8) as f32], [0.0; 4]]).collect();
    let found = Probe::new("probe_cell_hash").run(&rows);
    let agree = |shift: i32| {
        let right = |(row, hash): (&Row, &[f32; 4])| {
            let [x, y, z, level] = row[0];
            let own = cell_hash([x as i32 + shift, y as i32, z as i32], level as u32);
            own == (hash[0] as u32) << 16 | hash[1] as u32
        };
        rows.iter().zip(&found).filter(|(row, hash)| right((row, hash))).count()
    };
    assert_eq!(agree(0), rows.len());
    assert_eq!(agree(1), 0, "control: the next cell");
}
