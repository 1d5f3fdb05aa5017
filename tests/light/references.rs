//! The references S1 and S2 at 256 x 256 and 128 x 128, made by other renderers; see
//! `tests/references/README.md`.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | S1, S2 | relMSE and mean of the picture | the other scene's reference |
//! | errors of passes | the estimated error of eight passes is within 1.3 of the true one | their noise alone |
//! | means | the mean over 2 seeds is within 0.5 % at k = 100 and k = 10 | at most 6 bounces |

use std::path::Path;

use caustica::{
    image::{ErrorEstimate, PassBlock, PassSum, difference::rel_mse, read_exr},
    progress::Silent,
    renderer::{Progressive, Session},
    scene::Scene,
    settings::{EstimateSettings, Mode, PassSettings, Quality, Settings},
};
use support::*;

/// relMSE, and relative error of the mean, of a default render against the reference of the same
/// name.
fn errors(name: &str, other: &str, size: u32, most: f64) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let suffix = if size == 256 { "" } else { "_128" };
    let scene = Scene::load(&folder.join(format!("{name}.glb"))).expect("the scene loads");
    let picture = render_scene(&scene, &settings(Mode::Hybrid, 200_000, size).with(|s| s.picture.spp = 4))
        .frame
        .radiance()
        .to_vec();
    let reference = |name: &str| {
        read_exr(&folder.join(format!("{name}{suffix}.exr"))).expect("the reference reads").radiance().to_vec()
    };
    let right = rel_mse(&picture, &reference(name), None);
    assert!(right < most, "{name}: relMSE {right}");
    let wrong = rel_mse(&picture, &reference(other), None);
    assert!(wrong > 0.1, "control: the picture of {name} passes for {other}, relMSE {wrong}");
    let sum = |image: &[[f32; 3]]| image.iter().flatten().map(|&x| f64::from(x)).sum::<f64>();
    let ratio = |name: &str| sum(&picture) / sum(&reference(name));
    assert!((ratio(name) - 1.0).abs() < 0.01, "{name}: mean {} of the reference's", ratio(name));
    assert!((ratio(other) - 1.0).abs() > 0.01, "control: the mean of {name} passes for {other}'s");
}

/// Seeds of a mean.
const SEEDS: u32 = 2;

/// Means over the seeds of renders of that name against the reference's.
fn means(name: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let sum = |image: &[[f32; 3]]| image.iter().flatten().map(|&x| f64::from(x)).sum::<f64>();
    let scene = Scene::load(&folder.join(format!("{name}.glb"))).expect("the scene loads");
    let reference = sum(read_exr(&folder.join(format!("{name}_128.exr"))).expect("the reference reads").radiance());
    let mut ratios = [0.0; 2];
    for seed in 0..SEEDS {
        let settings = settings(Mode::Hybrid, 200_000, 128).with(|s| {
            s.photons.seed = seed;
            s.picture.spp = 2;
        });
        let session = Session::open(gpu(), &scene, &settings.lights, &Silent).expect("the scene fits");
        let maps = session.photon_maps(&settings.photons, &Silent).expect("photons");
        for (ratio, neighbors) in ratios.iter_mut().zip([100, 10]) {
            let estimate = EstimateSettings { neighbors, ..settings.estimate.clone() };
            let picture = session.picture(&maps, &estimate, &settings.picture, &Silent);
            *ratio += sum(picture.expect("a picture").frame.radiance()) / reference / f64::from(SEEDS);
        }
    }
    for (ratio, neighbors) in ratios.into_iter().zip([100, 10]) {
        assert!((ratio - 1.0).abs() < 0.005, "{name}, k = {neighbors}: mean {ratio} of the reference's");
    }
    let short = settings(Mode::Hybrid, 200_000, 128).with(|s| {
        s.photons.max_bounces = 6;
        s.estimate.neighbors = 10;
    });
    let ratio = sum(render_scene(&scene, &short).frame.radiance()) / reference;
    assert!((ratio - 1.0).abs() > 0.005, "control: {name} with at most 6 bounces has the mean {ratio}");
}

#[test]
fn means_of_mirror_and_glass() {
    means("S1");
}

#[test]
fn means_of_diffuse_only() {
    means("S2");
}

#[test]
fn mirror_and_glass() {
    errors("S1", "S2", 128, 0.007);
}

#[test]
fn diffuse_only() {
    errors("S2", "S1", 256, 0.0045);
}

/// Eight passes of a picture of S2: their estimated error against the true one.
fn error_of_passes(estimate: Settings) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let scene = Scene::load(&folder.join("S2.glb")).expect("the scene loads");
    let reference = read_exr(&folder.join("S2_128.exr")).expect("the reference reads");
    let reference = blocks(reference.radiance(), 2);
    let settings = estimate.with(|s| {
        (s.photons.global, s.photons.caustic) = (50_000, 50_000);
        s.picture.size = Some((64, 64));
    });
    let rays = settings.photons.final_gather;
    let session = Session::open(gpu(), &scene, &settings.lights, &Silent).expect("the scene fits");
    let passes = Progressive::new(&session, &settings, PassSettings::default()).expect("passes");
    let mut sum = PassSum::default();
    for index in 0..8 {
        let (film, stats) = passes.render(index, &Silent).expect("a pass");
        sum.push(PassBlock::of_pass(index, film, &stats)).expect("of one picture");
    }
    let total = sum.total().expect("of one picture").expect("passes");
    let estimate = ErrorEstimate::of(total.film(), None).expect("passes");
    let right = || reference.iter().flatten().map(|x| f64::from(*x));
    let floor = (0.1 * right().sum::<f64>() / right().count() as f64).powi(2);
    let frame = total.film().finish();
    let terms =
        frame.radiance().iter().flatten().zip(right()).map(|(x, y)| (f64::from(*x) - y).powi(2) / (y * y + floor));
    let truth = (terms.sum::<f64>() / right().count() as f64).sqrt();
    let ratio = estimate.total() / truth;
    assert!((1.0 / 1.3..1.3).contains(&ratio), "{rays} rays: {estimate:?} of {truth}");
    assert!(estimate.noise / truth < 1.0 / 1.3, "control: {rays} rays: {estimate:?} of {truth}");
}

#[test]
fn errors_of_passes_by_photons_alone() {
    error_of_passes(Settings::default());
}

#[test]
fn errors_of_passes_with_final_gathering() {
    error_of_passes(Quality::Normal.settings());
}
