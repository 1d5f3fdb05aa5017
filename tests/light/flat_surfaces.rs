//! The estimate where the surface around a point is not a full flat disc, against closed forms.
//!
//! | surface | negative control |
//! |---|---|
//! | box corner, table edge, both sides of a thin wall, small spheres | the raw estimate, rejection alone, correction alone |
//! | a ball that touches a floor: few photons against many | k = 2; light 10 % stronger |

use std::path::Path;

use caustica::{renderer::Render, scene::Scene, settings::Mode};
use support::surfaces::{bias, cases, estimates};
use support::{gpu, mean, render_scene, settings};

#[test]
fn rejection_and_correction_are_right_together_and_wrong_alone() {
    for case in cases(400) {
        let [raw, rejects, corrects, both] = estimates(gpu(), &case, 3).map(|found| bias(&case, &found));
        let found =
            format!("{}: raw {raw:.3}, rejection {rejects:.3}, correction {corrects:.3}, both {both:.3}", case.name);
        assert!(both.abs() < 0.06, "{found}");
        assert!(raw.abs() > 0.15, "control: {found}");
        assert!(rejects.abs().max(corrects.abs()) > 0.15, "control: {found}");
    }
}

/// Difference of a picture's mean and maximum from a reference picture, if it is too large.
fn amiss(found: &Render, right: &Render) -> Option<String> {
    let largest = |r: &Render| r.frame.radiance().iter().flatten().copied().fold(0.0, f32::max);
    let ratios = [mean(found) / mean(right), f64::from(largest(found) / largest(right))];
    let plausible = (ratios[0] - 1.0).abs() < 0.06 && ratios[1] < 1.5;
    (!plausible).then(|| format!("mean and largest pixel, over those of many photons: {ratios:.3?}"))
}

/// Discs of a few photons reach through the floor that the ball stands on.
#[test]
fn where_solids_touch_few_photons_are_as_bright_as_many() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/diffuse.gltf");
    let scene = Scene::load(&file).unwrap_or_else(|error| panic!("{error}"));
    let asked = |photons, neighbors, seed| {
        settings(Mode::IndirectPhotons, photons, 64).with(|s| {
            s.estimate.neighbors = neighbors;
            s.photons.seed = seed;
        })
    };
    let picture = |photons, neighbors, seed| render_scene(&scene, &asked(photons, neighbors, seed));
    let right = picture(400_000, 100, 0);
    for (photons, neighbors) in [(2000, 50), (2000, 100), (5000, 100), (20_000, 500)] {
        for seed in [0, 1] {
            let found = picture(photons, neighbors, seed);
            let amiss = amiss(&found, &right);
            assert!(amiss.is_none(), "{photons} photons, k = {neighbors}, seed {seed}: {amiss:?}");
        }
    }
    let noisy = picture(5000, 2, 0);
    assert!(amiss(&noisy, &right).is_some(), "control: estimates from two photons pass");
    let mut brighter = scene.clone();
    brighter.lights.iter_mut().for_each(|light| light.intensity *= 1.1);
    let brighter = render_scene(&brighter, &asked(5000, 100, 0));
    assert!(amiss(&brighter, &right).is_some(), "control: light a tenth stronger passes");
}
