//! Benchmark: photons where the camera needs them, as squared error at equal time.
//!
//! `cargo bench --bench importance [-- ROUNDS [WORD]]`, 10 rounds by default, of the scenes with
//! that word in their names. Renders the light that comes over other surfaces, with final gathering
//! and without, in scenes of which the camera sees a small part, with `--emission aimed`, which
//! knows what the cameras see, and with `--emission unaimed`, which does not. The relMSE is against
//! a picture by final gathering of another seed with twenty times the photons, eight times the rays
//! and four times the samples. That of photons is against one of the same seed and twenty times the
//! photons: its camera rays and rays of final gathering are the same, whose noise no photon
//! changes. The last columns are the squared error at equal time, the product of error and
//! seconds, over that of the same estimate with unaimed emission, from either error, and over that
//! of photons with unaimed emission. The aim is a tenth.

use caustica::{
    image::difference::rel_mse,
    progress::Silent,
    renderer::{Render, render},
    scene::{Environment, Light, LightKind, Scene},
    settings::{Emission, Mode, Quality, Settings},
};
use glam::{Vec3, vec3};
use support::{add_box, add_quad, camera, diffuse, emissive, gpu, point_light, scene};

const SIZE: u32 = 96;
const PHOTONS: u32 = 20_000;
const REFERENCE: u32 = 20 * PHOTONS;

fn main() {
    let rounds: u32 = std::env::args().find_map(|word| word.parse().ok()).unwrap_or(10);
    let word = std::env::args().skip(1).find(|word| !word.starts_with('-') && word.parse::<u32>().is_err());
    println!("{} ({})", gpu().name, gpu().driver);
    println!(
        "{:>20} {:>10} {:>9} {:>9} {:>10} {:>11} {:>14} {:>11} {:>13} {:>8}",
        "scene",
        "estimate",
        "emission",
        "seconds",
        "relMSE",
        "of photons",
        "at equal time",
        "of photons",
        "over photons",
        "seen"
    );
    let is_asked = |name: &str| word.as_ref().is_none_or(|word| name.contains(word.as_str()));
    for (name, scene) in scenes().into_iter().filter(|(name, _)| is_asked(name)) {
        let reference = render(gpu(), &scene, &fine(&settings(true, Emission::Aimed, REFERENCE, 1000)), &Silent)
            .expect("the scene renders");
        let mut by_photons = None;
        for (estimate, gathers) in [("photons", false), ("gathered", true)] {
            let rendered = |emission, photons, seed| rendered(&scene, gathers, emission, photons, seed);
            let alike: Vec<Render> = (0..rounds).map(|seed| rendered(Emission::Aimed, REFERENCE, seed)).collect();
            let mut general = None;
            for (emission, word) in [(Emission::Unaimed, "unaimed"), (Emission::Aimed, "aimed")] {
                let _ = rendered(emission, PHOTONS, 0);
                let renders: Vec<Render> = (0..rounds).map(|seed| rendered(emission, PHOTONS, seed)).collect();
                let mean = |each: &mut dyn Iterator<Item = f64>| each.sum::<f64>() / f64::from(rounds);
                let error =
                    |render: &Render, right: &Render| rel_mse(render.frame.radiance(), right.frame.radiance(), None);
                let seconds = mean(&mut renders.iter().map(|render| render.stats.seconds.total));
                let all = mean(&mut renders.iter().map(|render| error(render, &reference)));
                let of_photons = mean(&mut renders.iter().zip(&alike).map(|(render, right)| error(render, right)));
                let seen = 100.0 * mean(&mut renders.iter().map(seen));
                let [cost, cost_of_photons] = [all, of_photons].map(|error| error * seconds);
                let (first, first_of_photons) = *general.get_or_insert((cost, cost_of_photons));
                let (ratio, ratio_of_photons) = (cost / first, cost_of_photons / first_of_photons);
                let ratio_to_photons = cost / *by_photons.get_or_insert(cost);
                println!(
                    "{name:>20} {estimate:>10} {word:>9} {seconds:>9.3} {all:>10.5} {of_photons:>11.5} {ratio:>14.3} \
                     {ratio_of_photons:>11.3} {ratio_to_photons:>13.3} {seen:>6.1} %"
                );
            }
        }
    }
}

/// Fraction of the photons that the camera sees.
fn seen(render: &Render) -> f64 {
    let seen = render.stats.photons.global.seen.unwrap_or_default();
    seen.seen as f64 / seen.sampled.max(1) as f64
}

fn rendered(scene: &Scene, gathers: bool, emission: Emission, photons: u32, seed: u32) -> Render {
    render(gpu(), scene, &settings(gathers, emission, photons, seed), &Silent).expect("the scene renders")
}

/// Less noise of camera rays and of rays of final gathering.
fn fine(settings: &Settings) -> Settings {
    settings.clone().with(|s| {
        s.photons.final_gather *= 8;
        s.picture.spp *= 4;
    })
}

/// The light over other surfaces.
fn settings(gathers: bool, emission: Emission, photons: u32, seed: u32) -> Settings {
    let quality = Quality::Normal;
    let settings = if gathers { quality.settings() } else { quality.without_final_gather() };
    settings.with(|s| {
        s.photons.mode = Mode::IndirectPhotons;
        s.photons.emission = emission;
        (s.photons.global, s.photons.caustic) = (photons, 1000);
        s.photons.seed = seed;
        s.estimate.neighbors = 50;
        s.picture.size = Some((SIZE, SIZE));
        s.picture.spp = 4;
        s.counts_seen = true;
    })
}

fn scenes() -> Vec<(&'static str, Scene)> {
    let mut sunny = product();
    let direction = vec3(0.4, -1.0, -0.3).normalize();
    sunny.lights.push(Light { kind: LightKind::Directional, direction, ..point_light(Vec3::ZERO, 3.0) });
    let mut domed = product();
    domed.environment = Some(Environment::uniform(Vec3::ONE));
    vec![
        ("product under sun", sunny),
        ("product under dome", domed),
        ("corner of a hall", hall()),
        ("room of a house", house()),
    ]
}

/// A few blocks on a ground of 1 km.
fn product() -> Scene {
    let mut scene = scene(&[diffuse(0.6), diffuse(0.8)]);
    add_quad(&mut scene, vec3(-500.0, 0.0, 500.0), Vec3::X * 1000.0, Vec3::NEG_Z * 1000.0, 0);
    add_box(&mut scene, vec3(-0.2, 0.0, -0.2), vec3(0.2, 0.3, 0.2), 1);
    add_box(&mut scene, vec3(0.3, 0.0, -0.3), vec3(0.5, 0.5, 0.3), 1);
    add_box(&mut scene, vec3(-0.5, 0.0, -0.4), vec3(-0.3, 0.4, -0.1), 1);
    scene.cameras = vec![camera(vec3(-0.3, 0.9, 1.5), vec3(0.0, 0.15, 0.0), 40.0)];
    scene
}

/// A closed hall of 100 m with lamps at its ceiling, of which the camera sees a corner of 3 m.
fn hall() -> Scene {
    let mut scene = scene(&[diffuse(0.6)]);
    add_box(&mut scene, vec3(-50.0, 0.0, -50.0), vec3(50.0, 12.0, 50.0), 0);
    scene.materials.push(emissive("lamp", 0.0, 40.0, false));
    for (x, z) in (0..5).flat_map(|x| (0..5).map(move |z| (20.0 * x as f32 - 40.0, 20.0 * z as f32 - 40.0))) {
        add_quad(&mut scene, vec3(x - 1.0, 11.9, z - 1.0), Vec3::X * 2.0, Vec3::Z * 2.0, 1);
    }
    add_box(&mut scene, vec3(-49.5, 0.0, -49.5), vec3(-48.5, 1.0, -48.5), 0);
    scene.cameras = vec![camera(vec3(-46.5, 1.8, -46.0), vec3(-49.5, 0.8, -49.5), 45.0)];
    scene
}

/// Twelve rooms of 4 m with a lamp each and doors between them, of which the camera sees one.
fn house() -> Scene {
    const SIDE: f32 = 4.0;
    const WALL: f32 = 0.1;
    let (columns, rows) = (4, 3);
    let (width, depth) = (columns as f32 * SIDE, rows as f32 * SIDE);
    let mut scene = scene(&[diffuse(0.6)]);
    add_box(&mut scene, Vec3::ZERO, vec3(width, 2.5, depth), 0);
    // Each wall has a door of 1 m in its middle.
    let halves =
        |k: i32| [(k as f32 * SIDE, (k as f32 + 0.375) * SIDE), ((k as f32 + 0.625) * SIDE, (k + 1) as f32 * SIDE)];
    for (column, row) in (1..columns).flat_map(|column| (0..rows).map(move |row| (column, row))) {
        let x = column as f32 * SIDE;
        halves(row)
            .into_iter()
            .for_each(|(from, to)| add_box(&mut scene, vec3(x - WALL, 0.0, from), vec3(x + WALL, 2.5, to), 0));
    }
    for (column, row) in (0..columns).flat_map(|column| (1..rows).map(move |row| (column, row))) {
        let z = row as f32 * SIDE;
        halves(column)
            .into_iter()
            .for_each(|(from, to)| add_box(&mut scene, vec3(from, 0.0, z - WALL), vec3(to, 2.5, z + WALL), 0));
    }
    for (column, row) in (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row))) {
        let at = |k: i32| (k as f32 + 0.5) * SIDE;
        scene.lights.push(point_light(vec3(at(column), 2.2, at(row)), 5.0));
    }
    scene.cameras = vec![camera(vec3(1.0, 1.5, 3.3), vec3(2.5, 1.0, 0.5), 60.0)];
    scene
}
