//! Benchmark: efficiency of whole renders, 1 / (relMSE · process seconds), against the references
//! at 256 x 256.
//!
//! `cargo bench --bench efficiency [-- WORD..]`. Rows that have one of the words, or all. Runs the
//! program as a user would, with a warm driver cache, five times per setting. The table gives the
//! median time. The same follows for POV-Ray (`povray`) and Mitsuba 3 (of the Python that
//! `MITSUBA_PYTHON` names, `python3` by default) where they are installed, with the scenes in
//! `benches/others`; these take longer and run three times.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Instant,
};

use caustica::image::{difference::rel_mse, read_exr};

const SCENES: [&str; 2] = ["S1", "S2"];
const SIZE: &str = "256";
const RUNS: usize = 5;
const RUNS_OF_OTHERS: usize = 3;
/// Options of each measurement, besides the size.
const SETTINGS: [&str; 6] = [
    "",
    "--photons 200k",
    "--final-gather 0 --photons 200k --spp 4",
    "--final-gather 0 --photons 200k --spp 4 --share 0",
    "--global-photons 100k --caustic-photons 50k --spp 2 --raw-estimate -k 90 --max-bounces 12",
    "--photons 70k --spp 2 --raw-estimate -k 70 --max-bounces 12",
];
/// Antialiasing threshold and constants of `box.inc`.
const POVRAY: [&str; 2] = [
    "+A0.3 Declare=Photons=100000 Declare=Rays=100 Declare=Bound=0.7 Declare=Pretrace=0.02",
    "+A0.1 Declare=Photons=200000 Declare=Rays=200 Declare=Bound=0.5 Declare=Pretrace=0.01",
];
/// Variant, integrator and samples a pixel.
const MITSUBA: [&str; 3] = ["scalar_rgb path 64", "scalar_rgb path 256", "scalar_rgb ptracer 256"];

fn main() {
    println!("{:>5} {:>10} {:>9} {:>11}  options", "scene", "relMSE", "seconds", "efficiency");
    for scene in SCENES {
        for setting in SETTINGS {
            let label = format!("Caustica: {setting}");
            measure(scene, &label, RUNS, &|out| caustica(scene, setting, out));
        }
    }
    let others = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/others");
    if succeeds(Command::new("povray").arg("--version")) {
        for (scene, setting) in each(&POVRAY) {
            let label = format!("POV-Ray: {setting}");
            measure(scene, &label, RUNS_OF_OTHERS, &|out| povray(&others, scene, setting, out));
        }
    } else {
        println!("POV-Ray is not installed (`apt-get install povray`)");
    }
    let python = std::env::var("MITSUBA_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    if succeeds(Command::new(&python).args(["-c", "import mitsuba"])) {
        for (scene, setting) in each(&MITSUBA) {
            let label = format!("Mitsuba: {setting}");
            measure(scene, &label, RUNS_OF_OTHERS, &|out| mitsuba(&python, &others, scene, setting, out));
        }
    } else {
        println!("Mitsuba is not installed (`pip install mitsuba`, and MITSUBA_PYTHON for its Python)");
    }
}

/// Each scene with each setting.
fn each<'a>(settings: &'a [&'a str]) -> impl Iterator<Item = (&'static str, &'a str)> {
    SCENES.into_iter().flat_map(move |scene| settings.iter().map(move |setting| (scene, *setting)))
}

/// Whether a program is there and does what it is asked.
fn succeeds(command: &mut Command) -> bool {
    let ended = command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    ended.is_ok_and(|status| status.success())
}

fn references() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references")
}

fn caustica(scene: &str, setting: &str, out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    let size = format!("{SIZE}x{SIZE}");
    command.args(["render", "-q", "--size", &size]).args(setting.split_whitespace()).arg("-o");
    command.args([out, &references().join(format!("{scene}.glb"))]);
    command
}

/// Writes linear EXR: `assumed_gamma` is 1.
fn povray(others: &Path, scene: &str, setting: &str, out: &Path) -> Command {
    let mut command = Command::new("povray");
    command.current_dir(others).arg(format!("+I{scene}.pov")).arg(format!("+O{}", out.display()));
    command.args(["+FE", "-D", "-GA"]).args([format!("+W{SIZE}"), format!("+H{SIZE}")]);
    command.args(setting.split_whitespace());
    command
}

fn mitsuba(python: &str, others: &Path, scene: &str, setting: &str, out: &Path) -> Command {
    let mut command = Command::new(python);
    command.arg(others.join("mitsuba_scene.py")).arg(scene).args(setting.split_whitespace()).arg(SIZE).arg(out);
    command
}

/// Runs a command some times, and once before that to warm caches, and prints its row of the table.
fn measure(scene: &str, label: &str, runs: usize, command: &dyn Fn(&Path) -> Command) {
    let row = format!("{scene} {label}");
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    if !words.is_empty() && !words.iter().any(|word| row.contains(word.as_str())) {
        return;
    }
    let out = std::env::temp_dir().join(format!("caustica-efficiency-{}-{scene}.exr", std::process::id()));
    let run = |_| {
        let start = Instant::now();
        let mut command = command(&out);
        assert!(succeeds(&mut command), "{label}: {command:?} renders {scene}");
        start.elapsed().as_secs_f64()
    };
    let mut seconds: Vec<f64> = (0..=runs).map(run).skip(1).collect();
    seconds.sort_by(f64::total_cmp);
    let median = seconds[runs / 2];
    let picture = read_exr(&out).expect("the program wrote a picture");
    let reference = read_exr(&references().join(format!("{scene}.exr"))).expect("the reference reads");
    let error = rel_mse(picture.radiance(), reference.radiance(), None);
    let efficiency = 1.0 / (error * median);
    println!("{scene:>5} {error:>10.5} {median:>9.3} {efficiency:>11.1}  {label}");
    if let Err(e) = std::fs::remove_file(&out) {
        eprintln!("{}: {e}", out.display());
    }
}
