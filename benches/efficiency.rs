//! Benchmark: efficiency of whole renders, 1 / (relMSE · process seconds), against the references
//! at 256 x 256.
//!
//! `cargo bench --bench efficiency`. Runs the program as a user would, with a warm driver cache,
//! five times per setting. The table gives the median time.

use std::{path::Path, process::Command, time::Instant};

use caustica::image::{difference::rel_mse, read_exr};

const RUNS: usize = 5;
/// Options of each measurement, besides the size.
const SETTINGS: [&str; 6] = [
    "",
    "--photons 200k",
    "--final-gather 0 --photons 200k --spp 4",
    "--final-gather 0 --photons 200k --spp 4 --share 0",
    "--global-photons 100k --caustic-photons 50k --spp 2 --raw-estimate -k 90 --max-bounces 12",
    "--photons 70k --spp 2 --raw-estimate -k 70 --max-bounces 12",
];

fn main() {
    println!("{:>5} {:>10} {:>9} {:>11}  options", "scene", "relMSE", "seconds", "efficiency");
    for scene in ["S1", "S2"] {
        for setting in SETTINGS {
            measure(scene, setting);
        }
    }
}

fn measure(scene: &str, setting: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let out = std::env::temp_dir().join(format!("caustica-efficiency-{}-{scene}.exr", std::process::id()));
    let mut seconds: Vec<f64> = (0..=RUNS)
        .map(|_| {
            let start = Instant::now();
            let status = Command::new(env!("CARGO_BIN_EXE_caustica"))
                .args(["render", "-q", "--size", "256x256"])
                .args(setting.split_whitespace())
                .arg("-o")
                .args([&out, &folder.join(format!("{scene}.glb"))])
                .status()
                .expect("the program starts");
            assert!(status.success(), "{scene} renders");
            start.elapsed().as_secs_f64()
        })
        .collect();
    // The first run warms the driver's cache.
    seconds.remove(0);
    seconds.sort_by(f64::total_cmp);
    let median = seconds[RUNS / 2];
    let picture = read_exr(&out).expect("the program wrote a picture");
    let reference = read_exr(&folder.join(format!("{scene}.exr"))).expect("the reference reads");
    let error = rel_mse(picture.radiance(), reference.radiance(), None);
    let efficiency = 1.0 / (error * median);
    println!("{scene:>5} {error:>10.5} {median:>9.3} {efficiency:>11.1}  {setting}");
    if let Err(e) = std::fs::remove_file(&out) {
        eprintln!("{}: {e}", out.display());
    }
}
