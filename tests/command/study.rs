//! Studies: measurements, stored cells, output files.

use std::{fs, path::Path};

use caustica::{
    image::{Frame, difference, flip, read_exr},
    progress::Silent,
    scene::{Environment, Scene},
    settings::{Mode, Quality, Settings},
    study::{self, Combination, Finer, Look, Plan, Reference, Results, Subject},
};
use glam::Vec3;
use support::{add_box, camera, diffuse, glass, gpu, point_light, render_scene, scene, sphere};

/// A glass ball in a closed room.
fn room() -> Scene {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.spheres.push(sphere(Vec3::new(0.0, -0.4, 0.0), 0.3, 1));
    scene.lights.push(point_light(Vec3::new(0.0, 0.7, 0.0), 5.0));
    scene.cameras.push(camera(Vec3::new(0.0, 0.0, 0.95), Vec3::ZERO, 60.0));
    scene.file_name = "room.gltf".to_string();
    scene.hash = "1".to_string();
    scene
}

fn settings() -> Settings {
    Settings::default().with(|s| {
        s.picture.size = Some((24, 16));
        s.picture.spp = 1;
        s.estimate.share_reach = 0.0;
    })
}

fn plan(reference: Reference, modes: &[Mode], repeats: u32) -> Plan {
    let subject = Subject { scene: room(), reference };
    study::grid(subject, &settings(), modes, &[500, 2000], &[5, 20], repeats, Look::default())
}

fn small() -> Plan {
    plan(Reference::None, &[Mode::Hybrid], 1)
}

fn run(plan: &Plan, folder: &Path) -> Results {
    study::run(gpu(), plan, folder, &Silent).expect("the study runs")
}

/// Numbers of cells rendered now and reused.
fn counts(results: &Results) -> (usize, usize) {
    (results.rendered, results.kept)
}

#[test]
fn rays_of_final_gathering_are_studied_against_photons() {
    let folder = tempfile::tempdir().expect("a folder");
    let finer = Reference::Finer(Finer { photons: 50_000, neighbors: 20, spp: 16, passes: 4 });
    let subject = Subject { scene: room(), reference: finer };
    let settings = Quality::Normal.settings().with(|s| s.picture.size = Some((24, 16)));
    let modes = [Mode::Hybrid];
    let plan = study::gather_grid(subject, &settings, &modes, &[2000, 10_000], &[0, 1, 64], 1, Look::default());
    let results = run(&plan, folder.path());
    assert_eq!((counts(&results), results.rows.len()), ((10, 0), 6));
    let error = |n, rays| {
        let row = results.rows.iter().find(|row| (row.photons, row.final_gather) == (n, rays)).expect("a row");
        assert!(row.error.is_none() && row.seconds.gather > 0.0, "{row:?}");
        row.rel_mse.expect("measured")
    };
    for n in [2000, 10_000] {
        assert!(error(n, 64) < 0.7 * error(n, 0), "{n} photons: {} of {}", error(n, 64), error(n, 0));
        assert!(error(n, 1) > 1.5 * error(n, 64), "control: one ray: {}", error(n, 1));
    }
    let written = study::write(&plan, &results, folder.path()).expect("it can be written");
    for name in ["cost-against-rays.svg", "error-over-n-and-rays.svg", "report.html"] {
        assert!(written.iter().any(|path| path.ends_with(name)), "{name} of {written:?}");
    }
    let csv = fs::read_to_string(folder.path().join("study.csv")).expect("it is there");
    assert!(csv.lines().next().is_some_and(|line| line.contains(",final_gather,")), "{csv}");
}

/// Files of the cells with that extension, sorted.
fn cells(folder: &Path, extension: &str) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folder.join("cells")).expect("there are cells").map(|e| e.expect("an entry").path());
    let mut paths: Vec<_> = entries.filter(|p| p.extension().is_some_and(|e| e == extension)).collect();
    paths.sort();
    paths
}

#[test]
fn a_study_measures_every_combination_and_writes_all_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let finer = Reference::Finer(Finer { photons: 5000, neighbors: 20, spp: 2, passes: 2 });
    let plan = plan(finer, &[Mode::Hybrid, Mode::Photons], 2);
    let results = run(&plan, folder.path());
    // Eight combinations twice, and one reference of two passes for both modes.
    assert_eq!((counts(&results), results.rows.len()), ((18, 0), 8));
    assert!(results.references[0].contains("our own finer render"), "{:?}", results.references);
    for row in &results.rows {
        let radii = row.global.radius.expect("photons lie near");
        assert!(0.0 < radii.min && radii.min <= radii.median && radii.median <= radii.max, "{radii:?}");
        assert!(row.caustic.radius.is_some() && row.caustic.stored > 0);
        // A full map ends at a path's end.
        let full = row.global.stored as f64 / f64::from(row.photons);
        assert!(full > 0.9 && full <= 1.0, "{full}");
        assert!(row.noise > Some(0.0) && row.rel_mse > Some(0.0) && row.flip > Some(0.0) && row.error.is_none());
        assert!(row.seconds.gather > 0.0 && row.mean() > 0.0);
    }
    let median = |n, k| {
        let row = results.rows.iter().find(|r| (r.photons, r.neighbors, r.mode) == (n, k, Mode::Hybrid));
        row.and_then(|r| r.global.radius).expect("is there").median
    };
    assert!(median(500, 5) < median(500, 20) && median(2000, 20) < median(500, 20));

    let written = study::write(&plan, &results, folder.path()).expect("can be written");
    assert!(written.iter().all(|path| path.exists()));
    let csv = fs::read_to_string(folder.path().join("study.csv")).expect("a table");
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), 9);
    assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{csv}");
    for column in ["seconds_gather", "global_stored", "global_radius_median", "noise", "rel_mse", "rmse", "flip"] {
        let at = lines[0].iter().position(|name| *name == column).unwrap_or_else(|| panic!("no {column}"));
        assert!(lines[1..].iter().all(|line| line[at].parse::<f64>().is_ok_and(|x| x > 0.0)), "{column}: {csv}");
    }
    let json = fs::read_to_string(folder.path().join("study.json")).expect("a report");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    for pointer in ["/device/driver", "/references/0", "/rows/7/global/radius/median", "/figures/1/claims/0/verdict"] {
        assert!(json.pointer(pointer).is_some(), "{pointer}");
    }
    assert!(json.pointer("/rows/8").is_none());
    let sheet = image::open(folder.path().join("contact-sheet.png")).expect("a picture").into_rgb8();
    assert!(sheet.width() >= 2 * 148 && sheet.height() > 2 * 2 * 32, "{:?}", sheet.dimensions());
}

#[test]
fn what_is_finished_is_kept_and_what_is_not_is_rendered() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let first = run(&small(), path);
    assert_eq!(counts(&first), (4, 0));
    let second = run(&small(), path);
    assert_eq!((counts(&second), &second.rows), ((0, 4), &first.rows));

    fs::remove_file(&cells(path, "json")[1]).expect("can be removed");
    assert_eq!(counts(&run(&small(), path)), (1, 3), "one record is missing");
    fs::write(&cells(path, "exr")[2], b"half a file").expect("can be written");
    let third = run(&small(), path);
    assert_eq!(counts(&third), (1, 3), "one picture is damaged");
    let means = |results: &Results| results.rows.iter().map(|row| row.mean_radiance).collect::<Vec<_>>();
    assert_eq!(means(&third), means(&first), "what is rendered again is the same");

    let mut other = small();
    other.combinations.iter_mut().for_each(|c| c.settings.photons.seed = 1);
    let other_seed = run(&other, path);
    assert_eq!(counts(&other_seed), (4, 0), "another seed");
    assert_ne!(means(&other_seed), means(&first));
    let mut other = small();
    other.subjects[0].scene.hash = "2".to_string();
    assert_eq!(counts(&run(&other, path)), (4, 0), "another scene");
    let mut sky = Environment::uniform(Vec3::ONE);
    for (what, strength) in [("the room opened to a sky", 1.0), ("a sky of another strength", 2.0)] {
        let mut other = small();
        sky.strength = strength;
        other.subjects[0].scene.environment = Some(sky.clone());
        assert_eq!(counts(&run(&other, path)), (4, 0), "{what}");
    }
    let mut other = small();
    other.combinations[0].settings.estimate.max_radius = Some(0.3);
    assert_eq!(counts(&run(&other, path)), (1, 3), "another radius of one");
}

#[test]
fn a_cell_is_the_picture_that_render_makes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut plan = small();
    plan.combinations.retain(|c| c.settings.photons.global == 2000);
    plan.figures.clear();
    run(&plan, folder.path());
    let found: Vec<Frame> = cells(folder.path(), "exr").iter().map(|p| read_exr(p).expect("a picture")).collect();
    let renders: Vec<Frame> = plan.combinations.iter().map(|c| render_scene(&room(), &c.settings).frame).collect();
    assert_eq!((found.len(), renders.len()), (2, 2));
    assert!(renders.iter().all(|frame| found.contains(frame)));
    assert!(renders[0] != renders[1], "the control");
}

#[test]
fn errors_are_those_of_the_measures() {
    let folder = tempfile::tempdir().expect("a folder");
    let frame = |k| {
        let settings = settings().with(|s| {
            s.photons.global = 500;
            s.photons.caustic = 500;
            s.estimate.neighbors = k;
        });
        render_scene(&room(), &settings).frame
    };
    let (reference, other) = (frame(5), frame(20));
    let picture = Reference::Picture { name: "right.exr".to_string(), frame: Box::new(reference.clone()) };
    let results = run(&plan(picture, &[Mode::Hybrid], 1), folder.path());
    let [same, apart] = [&results.rows[0], &results.rows[1]];
    assert_eq!((same.rel_mse, same.rmse, same.flip), (Some(0.0), Some(0.0), Some(0.0)));
    let (a, b) = (&other.radiance(), &reference.radiance());
    assert_eq!(apart.rel_mse, Some(difference::rel_mse(a, b, None)));
    assert!((apart.rmse.expect("measured") - difference::rmse(a, b, None)).abs() < 1e-12);
    let look = Look::default();
    assert_eq!(apart.flip, Some(flip::flip(a, b, 24, look.exposure, look.tonemap)));
    assert!(apart.rel_mse > Some(0.0) && apart.noise.is_none() && apart.bias.is_none());
}

#[test]
fn a_reference_of_another_size_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let frame = Frame::new(4, 4, &[[0.0; 3]; 16]);
    let picture = Reference::Picture { name: "right.exr".to_string(), frame: Box::new(frame) };
    let plan = plan(picture, &[Mode::Hybrid], 1);
    let error = study::run(gpu(), &plan, folder.path(), &Silent).expect_err("the sizes differ").to_string();
    assert!(error.contains("right.exr") && error.contains("4x4") && error.contains("24x16"), "{error}");
}

#[test]
fn one_cell_that_fails_does_not_lose_the_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    assert!(run(&small(), path).failures.is_empty());
    // A folder with a picture's name cannot be replaced.
    let picture = &cells(path, "exr")[0];
    fs::remove_file(picture).expect("can be removed");
    fs::create_dir(picture).expect("can be made");
    let plan = small();
    let results = run(&plan, path);
    assert_eq!((counts(&results), results.failures.len()), ((0, 3), 1));
    assert!(results.failures[0].contains("room.gltf, hybrid") && results.failures[0].contains("is a folder"));
    let failed: Vec<bool> = results.rows.iter().map(|row| row.error.is_some()).collect();
    assert_eq!(failed.iter().filter(|f| **f).count(), 1);
    study::write(&plan, &results, path).expect("the others can be written");
    let csv = fs::read_to_string(path.join("study.csv")).expect("a table");
    assert_eq!(csv.lines().filter(|line| line.contains(",false,")).count(), 1, "{csv}");
    assert_eq!(csv.lines().filter(|line| line.contains(",true,")).count(), 3, "{csv}");
    fs::remove_dir(picture).expect("can be removed");
    assert_eq!(counts(&run(&small(), path)), (1, 3));
}

#[test]
fn combinations_are_planned_once() {
    let mut plan = small();
    let known = plan.combinations[0].clone();
    let at = plan.add(Combination { repeats: 3, ..known.clone() });
    assert_eq!((at, plan.combinations.len(), plan.combinations[0].repeats), (0, 4, 3));
    let at = plan.add(Combination { settings: known.settings.clone().with(|s| s.photons.seed = 9), ..known });
    assert_eq!((at, plan.combinations.len()), (4, 5));
    // Without photons n and k make no difference.
    assert_eq!(self::plan(Reference::None, &[Mode::DirectRays], 1).combinations.len(), 1);
}
