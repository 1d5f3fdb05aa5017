//! Samples of the sky from a room with a window.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | directions | follow the density that `sky_pdf` returns, which integrates to one, and find the window | the density at another place; places that the sky is not hidden from |

use glam::Vec3;
use support::*;

use super::{
    chi_square::{Directions, SAMPLES, deviate},
    light_sampling::{probe, sky},
    probe::{Row, rows},
};

/// Number of +Y among the directions of axes.
const UP: f32 = 2.0;

#[test]
fn directions_through_a_window_follow_their_density() {
    let mut room = room_with_window(0.5);
    room.environment = Some(sky(2.0));
    let grid = Directions { rows: 24, columns: 48 };
    let drawn = |[x, y, z]: [f32; 3]| probe("probe_sky", &room, &rows(SAMPLES, [x, y, z, UP]));
    let density = |[x, y, z]: [f32; 3]| {
        let middles = grid.midpoints(32);
        let points: Vec<Row> = middles.iter().map(|d| [d.as_vec3().extend(0.0).to_array(), [x, y, z, UP]]).collect();
        probe("probe_sky_pdf", &room, &points)
    };
    let through = |place: Vec3, d: &[f32; 4]| {
        let at = place + Vec3::from_slice(d) * ((1.0 - place.x) / d[0]);
        d[0] > 0.0 && (0.1..0.7).contains(&at.y) && (-0.5..0.1).contains(&at.z)
    };
    let (place, other) = ([0.3, -1.0, 0.2], [-0.6, -1.0, -0.5]);
    let [densities, others] = [place, other].map(density);
    assert!(densities[0][1] == 1.0 && others[0][1] == 1.0, "both belong to regions");
    let probabilities =
        |found: &[[f32; 4]]| grid.probabilities(&found.iter().map(|d| f64::from(d[0])).collect::<Vec<_>>());
    let whole: f64 = probabilities(&densities).iter().sum();
    assert!((whole - 1.0).abs() < 5e-3, "the density integrates to {whole}");
    let directions = drawn(place);
    let counts = grid.counts(directions.iter().copied());
    let found = deviate(&counts, &probabilities(&densities));
    assert!(found.fits(), "{found:?}");
    let wrong = deviate(&counts, &probabilities(&others));
    assert!(!wrong.fits(), "control: the density at another place: {wrong:?}");
    // The density that comes with a direction is the one of the direction.
    let again: Vec<Row> = directions.iter().take(1000).map(|d| [*d, [place[0], place[1], place[2], UP]]).collect();
    let same = probe("probe_sky_pdf", &room, &again);
    assert!(directions.iter().zip(&same).all(|(d, same)| within(d[3].into(), same[0].into(), 1e-5)));
    let part =
        |place: [f32; 3]| drawn(place).iter().filter(|d| through(place.into(), d)).count() as f64 / SAMPLES as f64;
    let met = part(place);
    assert!(met > 0.5, "{met} of the directions go through the window");
    let unknown = part([0.3, -3.0, 0.2]);
    assert!(unknown < 0.1, "control: {unknown} from below the floor, where nothing is known");
}
