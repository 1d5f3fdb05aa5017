//! `caustica compare`, and rendering with the kd-tree in place of the grid.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | agree | both sides sum the same photons in every mode, with and without a bound of the radius, and all files are there | |
//! | sabotage | | one photon left out: exit code 1 and one line that says so; the files show it |
//! | tolerance | | no difference allowed: exit code 1, for rounding differs |
//! | keys | the report has these keys and no others | |
//! | usage, failures | exit codes 2 and 1, one line, nothing written | |
//! | Ctrl-C | exit code 130, no half file | |
//! | searches | both make the same picture | one more neighbour |

use std::{
    collections::BTreeSet,
    fs,
    path::Path,
    process::{Command, Output},
};

use caustica::{
    compare::{FILES, Options, compare},
    density::DensityKernel,
    image::read_exr,
    progress::Silent,
    renderer::Session,
    scene::Scene,
    settings::{Mode, Search, Settings},
};
use serde_json::Value;
use support::gpu;

const SCENE: &str = "scenes/mirror-and-glass.gltf";

/// Command `caustica` with these arguments.
fn command(line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    command.args(line.split_whitespace());
    command
}

/// Runs a small comparison into the folder, with further arguments.
fn compare_into(folder: &Path, words: &str) -> Output {
    let line = format!("compare {SCENE} --size 32x24 --spp 2 --photons 3k {words} -o");
    command(&line).arg(folder).output().expect("it starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("messages are text")
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).expect("can be listed");
    entries.map(|e| e.expect("can be listed").file_name().to_string_lossy().into_owned()).collect()
}

fn report(folder: &Path) -> Value {
    let bytes = fs::read(folder.join("report.json")).expect("the report is there");
    serde_json::from_slice(&bytes).expect("JSON")
}

/// Paths of all values of an object.
fn keys(value: &Value, path: &str, found: &mut BTreeSet<String>) {
    match value.as_object() {
        Some(object) => object.iter().for_each(|(key, value)| keys(value, &format!("{path}/{key}"), found)),
        None => drop(found.insert(path.to_string())),
    }
}

#[test]
fn a_comparison_leaves_all_files_and_a_table() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let new = folder.path().join("a/b");
    let ended = compare_into(&new, "");
    let (out, said) = (text(&ended.stdout), text(&ended.stderr));
    assert_eq!(ended.status.code(), Some(0), "{said}");
    for line in [
        "adapter",
        "driver",
        "identical neighbours",
        "tied queries",
        "queries per second",
        "build",
        "memory",
        "CPU thread",
    ] {
        assert!(out.contains(line), "{out}");
    }
    assert!(said.contains("compare: 100 %") && said.contains("device: "), "{said}");
    assert!(!said.contains(['\r', '\u{1b}']), "plain lines when piped: {said}");
    assert_eq!(names(&new), FILES.iter().map(ToString::to_string).collect());
    let picture = |name: &str| read_exr(&new.join(name)).expect("an EXR").radiance().to_vec();
    let (grid, kdtree, difference) = (picture("grid.exr"), picture("kdtree.exr"), picture("difference.exr"));
    assert_eq!(difference[100][0], grid[100][0] - kdtree[100][0]);
    assert!(grid.iter().any(|p| p[0] > 0.0) && grid.len() == 32 * 24);
    for name in FILES.iter().filter(|name| name.ends_with(".png")) {
        assert!(image::open(new.join(name)).is_ok(), "{name}");
    }
}

#[test]
fn the_report_has_these_keys_and_no_others() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    assert_eq!(compare_into(folder.path(), "-q").status.code(), Some(0));
    let report = report(folder.path());
    let mut found = BTreeSet::new();
    keys(&report, "", &mut found);
    let expected = [
        "/device/driver",
        "/device/name",
        "/grid/build_seconds",
        "/grid/bytes",
        "/grid/queries_per_second",
        "/kdtree/build_seconds",
        "/kdtree/bytes",
        "/kdtree/queries_per_second",
        "/kdtree/threads",
        "/neighbors/identical_fraction",
        "/neighbors/tied",
        "/queries",
        "/radiance/max_relative_difference",
        "/radiance/mean_relative_difference",
        "/radius/max_relative_difference",
        "/radius/mean_relative_difference",
    ];
    assert_eq!(found, expected.iter().map(ToString::to_string).collect());
    let number = |pointer: &str| report.pointer(pointer).and_then(Value::as_f64).expect("a number");
    assert!(number("/queries") > 1000.0 && number("/kdtree/threads") >= 1.0);
    for positive in &expected[2..8] {
        assert!(number(positive) > 0.0, "{positive}");
    }
    assert!(number("/neighbors/identical_fraction") > 0.999);
    assert!(number("/radiance/max_relative_difference") < 1e-4);
    assert!(number("/radiance/mean_relative_difference") <= number("/radiance/max_relative_difference"));
}

#[test]
fn one_photon_left_out_is_noticed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for words in ["--sabotage 1", "--sabotage 1 --tolerance 1e9", "--sabotage 7 --max-radius 0.3", "--sabotage 2 -k 1"]
    {
        let ended = compare_into(folder.path(), &format!("-q {words}"));
        let said = text(&ended.stderr);
        assert_eq!((ended.status.code(), said.lines().count()), (Some(1), 1), "{words}: {said}");
        assert!(said.starts_with("error: grid and kd-tree differ: ") && said.contains("queries differ"), "{said}");
        assert!(report(folder.path())["neighbors"]["identical_fraction"].as_f64().is_some_and(|f| f < 1.0));
    }
    let page = fs::read_to_string(folder.path().join("report.html")).expect("the page is there");
    assert!(page.contains("queries differ in their photons"));
}

#[test]
fn rounding_is_beyond_a_tolerance_of_none() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let ended = compare_into(folder.path(), "-q --tolerance 0");
    let said = text(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(said.contains("the radiance differs by up to"), "{said}");
}

#[test]
fn wrong_usage_and_failures_say_what_is_wrong_and_write_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("file");
    fs::write(&file, "old").expect("can be written");
    let (root, file) = (folder.path().display(), file.display());
    for (words, code, said) in [
        ("compare".to_string(), 2, "SCENE"),
        (format!("compare {SCENE}"), 2, "--output"),
        (format!("compare {SCENE} -o {root}/a --tolerance=-1"), 2, "at least 0"),
        (format!("compare {SCENE} -o {root}/a --tolerance x"), 2, "1e-4"),
        (format!("compare {SCENE} -o {root}/a --sabotage x"), 2, "invalid digit"),
        (format!("compare {SCENE} -o {root}/a --search grid"), 2, "--search"),
        (format!("compare none.gltf -o {root}/a -q"), 1, "none.gltf"),
        (format!("compare {SCENE} -o {file} -q"), 1, "file: "),
        (format!("compare {SCENE} -o {root} -q --mode direct-rays"), 1, "mode direct-rays: has no photons to compare"),
        (format!("render {SCENE} -o {root}/a.exr --search all"), 2, "kdtree"),
    ] {
        let ended = command(&words).output().expect("it starts");
        let message = text(&ended.stderr);
        assert_eq!((ended.status.code(), text(&ended.stdout).as_str()), (Some(code), ""), "{words}: {message}");
        assert!(message.contains(said), "{words}: {message}");
        assert!(code == 2 || message.lines().count() == 1, "{words}: {message}");
    }
    assert_eq!(names(folder.path()), ["file".to_string()].into());
    assert!(!text(&command("compare --help").output().expect("it starts").stdout).contains("sabotage"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_comparison_and_leaves_no_file() {
    use std::{
        io::{BufRead, BufReader},
        process::Stdio,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let line = format!("compare {SCENE} --size 64x64 --spp 1000000 --photons 3k -o");
    let mut child = command(&line).arg(folder.path()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut lines = BufReader::new(child.stderr.take().expect("it is piped")).lines();
    assert!(lines.any(|l| l.is_ok_and(|l| l.starts_with("compare"))), "the comparison did not begin");
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(names(folder.path()), BTreeSet::new());
}

fn small(mode: Mode) -> Settings {
    Settings::default().with(|s| {
        s.photons.mode = mode;
        s.photons.global = 3000;
        s.photons.caustic = 3000;
        s.estimate.neighbors = 30;
        s.picture.size = Some((24, 24));
        s.picture.spp = 1;
    })
}

#[test]
fn both_searches_agree_in_every_mode() {
    let scene = Scene::load(Path::new(SCENE)).expect("the scene loads");
    let options = Options::default();
    for kernel in DensityKernel::ALL {
        let settings = small(Mode::Photons).with(|s| s.estimate.kernel = kernel);
        let verdict = compare(gpu(), &scene, &settings, &options, &Silent).expect("the work succeeds").verdict();
        assert!(verdict.is_ok(), "{kernel:?}: {verdict:?}");
    }
    for mode in Mode::ALL.into_iter().filter(|mode| mode.traces_photons()) {
        for (neighbors, max_radius, cone_constant) in [(1, None, 2.0), (30, Some(0.2), 1.0), (1000, None, 1.5)] {
            let settings = small(mode).with(|s| {
                s.estimate.neighbors = neighbors;
                s.estimate.max_radius = max_radius;
                s.estimate.cone_constant = cone_constant;
            });
            let comparison = compare(gpu(), &scene, &settings, &options, &Silent).expect("the work succeeds");
            let verdict = comparison.verdict();
            assert!(verdict.is_ok(), "{mode:?}, k = {neighbors}, radius {max_radius:?}: {verdict:?}");
        }
    }
}

#[test]
fn both_searches_make_the_same_picture() {
    let scene = Scene::load(Path::new(SCENE)).expect("the scene loads");
    let settings = small(Mode::Hybrid).with(|s| s.estimate.raw = true);
    let session = Session::open(gpu(), &scene, &settings.lights, &Silent).expect("the scene fits");
    let maps = session.photon_maps(&settings.photons, &Silent).expect("photons");
    let picture = |settings: Settings| {
        session.picture(&maps, &settings.estimate, &settings.picture, &Silent).expect("a picture").frame
    };
    let grid = picture(settings.clone());
    let worst = |other: &caustica::image::Frame| {
        let pairs = grid.radiance().iter().flatten().zip(other.radiance().iter().flatten());
        pairs.map(|(a, b)| (a - b).abs() / a.max(*b).max(1e-12)).fold(0.0, f32::max)
    };
    let kdtree = picture(settings.clone().with(|s| s.estimate.search = Search::KdTree));
    assert!(worst(&kdtree) < 1e-5, "{}", worst(&kdtree));
    assert!(kdtree.depth() == grid.depth() && kdtree.albedo() == grid.albedo());
    let control = picture(settings.clone().with(|s| {
        s.estimate.search = Search::KdTree;
        s.estimate.neighbors += 1;
    }));
    assert!(worst(&control) > 1e-3, "the control: {}", worst(&control));
}

#[test]
fn render_takes_the_search() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let render = |name: &str, words: &str| {
        let out = folder.path().join(name);
        let line = format!("render {SCENE} -q --size 16x16 --photons 2k -k 10 --raw-estimate {words} -o");
        assert!(command(&line).arg(&out).status().expect("it starts").success());
        read_exr(&out).expect("an EXR").radiance().to_vec()
    };
    let (grid, kdtree) = (render("a.exr", "--search grid"), render("b.exr", "--search kdtree"));
    let close = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() <= 1e-5 * a.max(*b))
    };
    assert!(close(&grid, &kdtree) && close(&grid, &render("c.exr", "")));
    assert!(!close(&grid, &render("d.exr", "--search kdtree --seed 1")), "the control");
}
