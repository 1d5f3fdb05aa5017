//! The folder of public assets that `CAUSTICA_ASSETS` names. Its `assets.json` lists the expected
//! outcome of each file.
//!
//! Without the variable the test prints that it has nothing to do. `CAUSTICA_ASSETS_BYTES` is a
//! maximum size of a scene's folder, bytes; larger ones are skipped to save time.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use caustica::{
    Error,
    gpu::Gpu,
    scene::{Environment, Scene},
    settings::Mode,
};
use serde_json::Value;

use super::{Ended, render_with_command};

/// Expected outcome by the README of the assets.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Expected {
    /// A picture.
    Render,
    /// The file loads, but holds nothing to draw.
    Empty,
    /// Exit code 1 and one line.
    Refuse,
    /// A picture or a refusal.
    Either,
}

/// The folder, if the variable names one.
fn assets() -> Option<(PathBuf, Vec<Value>)> {
    let Some(folder) = std::env::var_os("CAUSTICA_ASSETS").map(PathBuf::from) else {
        println!("CAUSTICA_ASSETS names no folder: nothing is tried");
        return None;
    };
    let text = fs::read(folder.join("assets.json")).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let list: Value = serde_json::from_slice(&text).expect("assets.json is JSON");
    Some((folder, list.as_array().expect("assets.json is a list").clone()))
}

fn text<'a>(asset: &'a Value, key: &str) -> &'a str {
    asset[key].as_str().unwrap_or("")
}

fn expected(asset: &Value) -> Expected {
    // Draco is a required extension that a renderer may lack. The two files of Compatibility have
    // their outcome in prose only.
    match text(asset, "id") {
        "DracoSparseMesh" | "handmade__png_bomb_30000x30000" => return Expected::Either,
        "AG/Compatibility_04" | "AG/Compatibility_05" => return Expected::Refuse,
        _ => {}
    }
    match (text(asset, "group"), text(asset, "expect"), text(asset, "drawable"), asset["triangles"].as_u64()) {
        ("handmade", ..) | (_, "REFUSE", ..) => Expected::Refuse,
        (_, "EITHER", ..) => Expected::Either,
        (_, "LOAD", "no" | "mesh only", _) | (_, "", _, Some(0)) => Expected::Empty,
        _ => Expected::Render,
    }
}

/// Size of all files in the scene's folder, bytes.
fn size_with_neighbours(path: &Path) -> u64 {
    let entries = fs::read_dir(path.parent().expect("a folder")).expect("can be listed");
    entries.map(|entry| entry.expect("an entry").metadata().expect("its size").len()).sum()
}

/// The scene as the command reads it.
fn load(path: &Path) -> Result<Scene, String> {
    let mut scene = Scene::load(path).map_err(|error| error.to_string())?;
    scene.add_default_light();
    Ok(scene)
}

/// Renders in this process. Returns what is wrong with the picture.
fn render(gpu: &Gpu, path: &Path) -> Result<(), String> {
    let scene = load(path)?;
    let settings = support::settings(Mode::Hybrid, 500, 16).with(|s| {
        s.estimate.neighbors = 10;
        // In the open most paths leave no photon; the maps need not fill.
        s.photons.max_paths = Some(2000);
    });
    let silent = caustica::progress::Silent;
    let render = caustica::renderer::render(gpu, &scene, &settings, &silent).map_err(|e| e.to_string())?;
    let pixels = render.frame.radiance().as_flattened();
    // The colours of single wavelengths lie outside of Rec.709.
    let has_colours_outside = scene.materials.iter().any(|material| material.dispersion > 0.0);
    if !pixels.iter().all(|x| x.is_finite() && (*x >= 0.0 || has_colours_outside)) {
        return Err("a pixel is no finite number".to_owned());
    }
    if pixels.iter().all(|x| *x == 0.0) {
        return Err("the picture is black".to_owned());
    }
    Ok(())
}

/// Runs the command on a file that may be refused. Returns whether it was.
fn refused_or_rendered(gpu: &Gpu, path: &Path) -> Result<bool, String> {
    let ended: Ended = render_with_command(path);
    if ended.code == Some(0) && ended.wrote {
        return render(gpu, path)
            .map(|()| false)
            .or_else(|what| if what.contains("black") { Ok(false) } else { Err(what) });
    }
    ended.refusal(path).map(|_| true)
}

fn outcome(gpu: &Gpu, path: &Path, expected: Expected) -> Result<(), String> {
    match expected {
        Expected::Render => render(gpu, path),
        Expected::Either => refused_or_rendered(gpu, path).map(|_| ()),
        Expected::Refuse => match refused_or_rendered(gpu, path) {
            Ok(true) => Ok(()),
            Ok(false) => Err("was rendered".to_owned()),
            Err(what) => Err(what),
        },
        Expected::Empty => {
            let scene = load(path)?;
            match scene.check_renderable() {
                Err(Error::Scene { problem, .. }) if problem.contains("nothing to draw") => Ok(()),
                other => Err(format!("{other:?}")),
            }
        }
    }
}

/// Runs the test of that name in a process whose driver, if it is Lavapipe, does not optimise
/// kernels, and returns whether this is that process. Few pixels take longer to compile for than to
/// draw.
fn is_quick_to_compile(test: &str) -> bool {
    let quickly = ("GALLIVM_PERF", "nopt");
    if std::env::var(quickly.0).is_ok_and(|value| value == quickly.1) {
        return true;
    }
    let this = std::env::current_exe().expect("the program of the tests");
    let child = Command::new(this).args([test, "--exact", "--nocapture"]).env(quickly.0, quickly.1).output();
    let child = child.expect("the tests run");
    let said = String::from_utf8_lossy(&child.stdout);
    println!("{said}{}", String::from_utf8_lossy(&child.stderr));
    assert!(child.status.success() && said.contains("1 passed"), "{test}: {}", child.status);
    false
}

#[test]
fn every_scene_behaves_as_the_readme_of_the_assets_says() {
    let Some((folder, assets)) = assets() else { return };
    if !is_quick_to_compile("assets::folder::every_scene_behaves_as_the_readme_of_the_assets_says") {
        return;
    }
    let most = std::env::var("CAUSTICA_ASSETS_BYTES").map_or(u64::MAX, |n| n.parse().expect("a number of bytes"));
    let scenes = assets.iter().filter(|asset| text(asset, "group") != "image");
    let path_of = |asset| folder.join(text(asset, "file"));
    let (small, large): (Vec<_>, Vec<_>) = scenes.partition(|asset| size_with_neighbours(&path_of(asset)) <= most);
    let left_out: Vec<_> = large.into_iter().map(|asset| text(asset, "id")).collect();
    let mut counts = [0; 4];
    small.iter().for_each(|asset| counts[expected(asset) as usize] += 1);
    // Each thread takes the next scene. Most of the time goes into compiling kernels, which a
    // driver may do one after the other for each device.
    let (next, wrong) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let other = Gpu::open(std::env::var("CAUSTICA_DEVICE").ok().as_deref()).expect("the adapter opens twice");
    let work = |gpu: &Gpu| {
        while let Some(asset) = small.get(next.fetch_add(1, Ordering::Relaxed)) {
            let (path, expected, start) = (path_of(asset), expected(asset), std::time::Instant::now());
            if let Err(what) = outcome(gpu, &path, expected) {
                let what = format!("{} is to {expected:?}: {what}", path.display());
                wrong.lock().expect("no thread has failed").push(what);
            }
            println!("{:6.2} s  {expected:?}  {}", start.elapsed().as_secs_f64(), text(asset, "id"));
        }
    };
    std::thread::scope(|scope| [support::gpu(), &other].map(|gpu| drop(scope.spawn(|| work(gpu)))));
    let wrong = wrong.into_inner().expect("no thread has failed");
    println!("render, empty, refuse, either: {counts:?}; too large: {left_out:?}");
    assert!(wrong.is_empty(), "{} scenes:\n{}", wrong.len(), wrong.join("\n"));
    assert!(counts.iter().all(|count| *count > 0), "no scene of some kind: {counts:?}");
}

#[test]
fn every_environment_is_read_or_refused() {
    let Some((folder, assets)) = assets() else { return };
    let images: Vec<&Value> = assets.iter().filter(|asset| text(asset, "group") == "image").collect();
    assert!(images.len() >= 10, "{}", images.len());
    for image in images {
        let path = folder.join(text(image, "file"));
        // Damaged files are named without an extension.
        let damaged = path.extension().is_none();
        match Environment::load(&path, 1.0, 0.0) {
            Ok(map) => {
                assert!(!damaged, "{} is damaged and was read", path.display());
                assert!(map.pixels.as_flattened().iter().all(|x| x.is_finite()), "{}", path.display());
            }
            Err(error) => {
                assert!(damaged, "{error}");
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

#[test]
fn a_wrong_outcome_is_told() {
    let scene = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile").join(name);
    let wrong = [("bad_base64.gltf", Expected::Render), ("bad_base64.gltf", Expected::Empty)];
    for (name, expected) in wrong {
        assert!(outcome(support::gpu(), &scene(name), expected).is_err(), "{name} {expected:?}");
    }
    let box_ = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references/S1.glb");
    assert!(outcome(support::gpu(), &box_, Expected::Render).is_ok());
    assert!(
        outcome(support::gpu(), &box_, Expected::Refuse).is_err()
            && outcome(support::gpu(), &box_, Expected::Empty).is_err()
    );
}
