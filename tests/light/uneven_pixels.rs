//! Further samples in pixels whose neighbours are uneven.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | progress | tiles of further samples are counted before they are done | every pixel's samples alone have fewer |
//! | edges | edges, also in mirrors and glass, and penumbrae have the error of many samples | the samples that every pixel has alone |
//! | small lights | lights smaller than a pixel keep their mean | pixels whose own samples decide get darker |
//! | caustics | faint caustics keep their mean, though few of the further samples have them | they are there, and faint |
//! | crop | a crop has the bits of the whole | another seed |
//! | layers | mattes cover what alpha says, in finer steps than every pixel's samples make | these alone |
//! | passes | passes have further samples of their own, and merge to the same mean | one pass alone |

use std::sync::Mutex;

use caustica::{
    image::difference::rel_mse,
    progress::{Progress, Silent, Stage},
    renderer::{Progressive, Session, render},
    scene::{Scene, Surface},
    settings::{Crop, ExtraLayers, Mode, PassSettings, Settings},
};
use glam::{Vec3, vec3};
use support::{photons::Random, *};

/// Direct light alone, of four samples a pixel and at most so many.
fn sampled(size: u32, most: u32) -> Settings {
    settings(Mode::DirectRays, 1, size).with(|s| {
        s.picture.spp = 4;
        s.picture.max_spp = (most > 4).then_some(most);
    })
}

/// A room with a lamp of an extent above a ball, a mirror and a glass ball.
fn room() -> Scene {
    let mirror = Surface::Mirror { tint: Vec3::splat(0.9) };
    let mut scene = scene(&[diffuse(0.7), mirror, glass(), diffuse(0.1)]);
    add_box(&mut scene, Vec3::ONE, Vec3::NEG_ONE, 0);
    scene.materials.push(emissive("lamp", 0.5, 4.0, true));
    add_quad(&mut scene, vec3(-0.3, 0.9, -0.3), Vec3::X * 0.4, Vec3::Z * 0.4, 4);
    scene.spheres.push(sphere(vec3(-0.5, -0.6, -0.3), 0.4, 3));
    scene.spheres.push(sphere(vec3(0.5, -0.6, -0.4), 0.4, 1));
    scene.spheres.push(sphere(vec3(0.0, -0.75, 0.3), 0.25, 2));
    scene.cameras.push(camera(vec3(0.0, 0.1, 0.95), vec3(0.0, -0.3, 0.0), 70.0));
    scene
}

/// Tiles of the camera that were done, and of how many, as reported.
#[derive(Default)]
struct CameraReports(Mutex<Vec<(u64, u64)>>);

impl Progress for CameraReports {
    fn report(&self, stage: Stage, done: u64, total: u64) {
        if stage == Stage::Camera {
            self.0.lock().unwrap().push((done, total));
        }
    }
    fn stop_requested(&self) -> bool {
        false
    }
}

#[test]
fn progress_counts_the_tiles_of_further_samples() {
    let reported = |most: u32| {
        let reports = CameraReports::default();
        render(gpu(), &room(), &sampled(32, most), &reports).unwrap();
        reports.0.into_inner().unwrap()
    };
    let (even, more) = (reported(4), reported(64));
    assert!(more.len() > even.len() + 3, "{even:?}, {more:?}");
    for reports in [even, more] {
        assert!(reports.is_sorted_by_key(|(done, _)| *done), "{reports:?}");
        let (last, before) = reports.split_last().unwrap();
        assert!(last.0 == last.1 && before.iter().all(|(done, total)| done < total), "{reports:?}");
    }
}

#[test]
fn uneven_pixels_have_the_error_of_many_samples() {
    const SIDE: u32 = 96;
    let scene = room();
    let of = |spp: u32, most: u32| render_scene(&scene, &sampled(SIDE, most).with(|s| s.picture.spp = spp));
    let (even, more, many) = (of(4, 4), of(4, 64), of(64, 64));
    assert_eq!(even.stats.extra_samples, 0);
    let extra = more.stats.extra_samples as f64 / f64::from(SIDE * SIDE);
    assert!((0.3..12.0).contains(&extra), "{extra} samples more in the mean");
    let error = |render: &caustica::renderer::Render| rel_mse(render.frame.radiance(), many.frame.radiance(), None);
    println!("relMSE {:.5} with {extra:.2} samples more in the mean, {:.5} without", error(&more), error(&even));
    assert!(error(&more) < 0.35 * error(&even), "{} and {}", error(&more), error(&even));
    // Control: as many samples as those have in the mean, but in all pixels.
    let spread = of((4.0 + extra).ceil() as u32, 0);
    assert!(error(&spread) > 1.5 * error(&more), "control: {}", error(&spread));
}

/// A wall with lamps that cover a hundredth of a pixel to a quarter, at random.
fn small_lamps() -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    scene.materials.push(emissive("lamp", 0.0, 50.0, true));
    add_quad(&mut scene, vec3(-2.0, -2.0, -2.0), Vec3::X * 4.0, Vec3::Y * 4.0, 0);
    let mut random = Random(3);
    for _ in 0..150 {
        let at = 1.2 * random.vector();
        let side = 0.006 + 0.024 * random.vector().x.abs();
        add_quad(&mut scene, vec3(at.x, at.y, -1.9), Vec3::X * side, Vec3::Y * side, 1);
    }
    scene.cameras.push(camera(vec3(0.0, 0.0, 0.0), Vec3::NEG_Z, 60.0));
    scene
}

#[test]
fn small_lights_keep_their_mean() {
    let scene = small_lamps();
    let of = |seed: u32, most: u32| {
        render_scene(&scene, &sampled(48, most).with(|s| (s.photons.seed, s.picture.light_samples) = (seed, 1)))
    };
    let expected = mean(&render_scene(&scene, &sampled(48, 0).with(|s| s.picture.spp = 300)));
    let adaptive = Estimate::over_seeds(6, |seed| mean(&of(seed, 16)));
    println!("{adaptive:?}, expected {expected}");
    assert!(adaptive.z(expected) < 4.0 && within(adaptive.mean, expected, 0.01), "{adaptive:?} and {expected}");
    // Control: where a pixel's own samples decide, and are counted in.
    let own = Estimate::over_seeds(4, |seed| {
        let (few, many) =
            (of(seed, 0), render_scene(&scene, &sampled(48, 0).with(|s| (s.photons.seed, s.picture.spp) = (seed, 12))));
        let sums = few.frame.radiance().iter().zip(many.frame.radiance()).map(|(a, b)| {
            let decided = if a[0] > 1.0 { (4.0 * a[0] + 12.0 * b[0]) / 16.0 } else { a[0] };
            f64::from(decided)
        });
        sums.sum::<f64>() / f64::from(48 * 48)
    });
    assert!(own.mean < 0.9 * expected, "control: {own:?} and {expected}");
}

#[test]
fn faint_caustics_keep_their_mean() {
    // Stripes of two colours are what the further samples are for.
    let mut scene = room();
    scene.materials.push(emissive("stripe", 0.2, 0.0, true));
    for i in 0..20 {
        add_quad(&mut scene, vec3(-1.0 + 0.1 * i as f32, -0.999, -1.0), Vec3::Z * 2.0, Vec3::X * 0.05, 5);
    }
    // Light of caustics, and of the lamp itself.
    let means = |seed: u32, most: u32| {
        let settings = sampled(64, most).with(|s| {
            s.photons.mode = Mode::Hybrid;
            (s.photons.seed, s.photons.global, s.photons.caustic, s.photons.final_gather) = (seed, 2000, 2000, 4);
            s.estimate.gather_spacing = 2;
            s.picture.layers = vec![ExtraLayers::Components];
        });
        let render = render_scene(&scene, &settings);
        assert_eq!(
            render.stats.extra_samples > 2 * 64 * 64,
            most > 4,
            "{} further samples",
            render.stats.extra_samples
        );
        ["caustic.G", "direct.G"].map(|layer| {
            let (_, light) = render.frame.extras().find(|(name, _)| *name == layer).expect("a layer");
            light.iter().map(|&light| f64::from(light)).sum::<f64>() / f64::from(64 * 64)
        })
    };
    // Of the same photons.
    let ratio = Estimate::over_seeds(6, |seed| means(seed, 64)[0] / means(seed, 0)[0]);
    println!("{ratio:?} of the caustics with every pixel's samples alone");
    assert!(ratio.z(1.0) < 4.0 && within(ratio.mean, 1.0, 0.01), "{ratio:?}");
    let [caustics, direct] = means(0, 0);
    assert!(caustics > 0.0 && caustics < 0.1 * direct, "control: {caustics} of {direct} are faint");
}

#[test]
fn a_crop_has_the_bits_of_the_whole() {
    let scene = room();
    let settings = sampled(110, 20).with(|s| {
        s.photons.mode = Mode::Hybrid;
        (s.photons.global, s.photons.caustic, s.photons.final_gather) = (5000, 5000, 8);
        s.estimate.gather_spacing = 2;
    });
    let whole = render_scene(&scene, &settings);
    assert!(whole.stats.extra_samples > 0);
    let crop = Crop { column: 60, row: 70, width: 41, height: 37 };
    let part = render_scene(&scene, &settings.clone().with(|s| s.picture.crop = Some(crop)));
    let rows = whole.frame.radiance().chunks(110).skip(70).take(37);
    let expected: Vec<_> = rows.flat_map(|row| row[60..101].to_vec()).collect();
    let differ = part.frame.radiance().iter().zip(&expected).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "pixels of {}", expected.len());
    assert!((1..whole.stats.extra_samples).contains(&part.stats.extra_samples), "those of its own pixels");
    let other = render_scene(&scene, &settings.with(|s| s.photons.seed = 1));
    assert_ne!(other.frame.radiance(), whole.frame.radiance(), "control: another seed");
}

#[test]
fn mattes_and_alpha_count_samples_alike() {
    let mut scene = scene(&[diffuse(0.7), diffuse(0.1)]);
    scene.spheres.push(sphere(vec3(-0.2, 0.0, -2.0), 0.5, 0));
    scene.spheres.push(sphere(vec3(0.4, 0.1, -2.3), 0.5, 1));
    scene.lights.push(point_light(vec3(0.5, 2.0, 1.0), 30.0));
    scene.cameras.push(camera(Vec3::ZERO, Vec3::NEG_Z, 60.0));
    let covered = |most: u32| {
        let settings =
            sampled(64, most).with(|s| s.picture.layers = vec![ExtraLayers::Materials, ExtraLayers::Position]);
        let frame = render_scene(&scene, &settings).frame;
        let channel = |name: &str| frame.extras().find(|(n, _)| *n == name).expect("a channel").1.to_vec();
        let (first, second) = (channel("CryptoMaterial00.G"), channel("CryptoMaterial00.A"));
        for (pixel, alpha) in frame.alpha().iter().enumerate() {
            assert!((first[pixel] + second[pixel] - alpha).abs() < 1e-5, "pixel {pixel}: {alpha}");
            let depth = frame.depth()[pixel];
            assert!(*alpha == 0.0 || (depth + channel("position.Z")[pixel]).abs() < 1e-3, "pixel {pixel}");
        }
        let is_finer = |x: &f32| (4.0 * x - (4.0 * x).round()).abs() > 0.01;
        first.iter().filter(|x| is_finer(x)).count()
    };
    assert!(covered(20) > 50, "{} pixels have steps of less than a quarter", covered(20));
    assert_eq!(covered(4), 0, "control");
}

#[test]
fn passes_have_further_samples_of_their_own() {
    let scene = room();
    let settings = sampled(64, 12);
    let session = Session::open(gpu(), &scene, &settings.lights, &Silent).expect("the scene fits");
    let passes = Progressive::new(&session, &settings, PassSettings::default()).expect("in range");
    let film = |index: u32| passes.render(index, &Silent).expect("a pass").0;
    let (first, second) = (film(0), film(1));
    assert_ne!(first.finish().radiance(), second.finish().radiance());
    let single = render(gpu(), &scene, &settings, &Silent).expect("the scene renders");
    assert_eq!(first.finish().radiance(), single.frame.radiance(), "the first pass is the single picture");
    let mut both = first.clone();
    both.merge(&second).expect("of one picture");
    assert_eq!(both.extra_samples(), first.extra_samples() + second.extra_samples());
    let many = render_scene(&scene, &settings.clone().with(|s| (s.picture.spp, s.picture.max_spp) = (64, None)));
    let error = |film: &caustica::image::Film| rel_mse(film.finish().radiance(), many.frame.radiance(), None);
    assert!(error(&both) < 0.75 * error(&first), "{} and {}", error(&both), error(&first));
    let plain = Session::film(
        &session,
        &session.photon_maps(&settings.photons, &Silent).expect("none"),
        &settings.estimate,
        &sampled(64, 0).picture,
        &Silent,
    )
    .expect("a film")
    .0;
    assert!(both.merge(&plain).is_err(), "control: films of other numbers of samples");
}
