//! Benchmark: cost and benefit of each option, as process seconds and as relMSE where the reference
//! shows the same picture.
//!
//! `cargo bench --bench options [-- ROUNDS]`, 3 rounds by default. Renders S1 at 256 x 256 with one
//! option changed at a time. Each round renders all of them, with its own seed and a warm driver
//! cache. The table gives the median time and the mean relMSE over the rounds.

use std::{path::Path, process::Command, time::Instant};

use caustica::image::{difference::rel_mse, read_exr};

/// Changed options, and whether the reference shows the same picture.
const CHANGES: [(&str, bool); 22] = [
    ("", true),
    ("--gather-spacing 1 --gather-radius 4", true),
    ("--gather-spacing 4 --gather-radius 16", true),
    ("--final-gather 32", true),
    ("--final-gather 0", true),
    ("--final-gather 0 --share 0", true),
    ("--sampler random", true),
    ("--raw-estimate", true),
    ("--raw-estimate --share 0", true),
    ("--final-gather 0 --emission unaimed", true),
    ("--final-gather 0 --kernel constant", true),
    ("--final-gather 0 --kernel epanechnikov", true),
    ("--final-gather 0 --kernel gaussian", true),
    ("--final-gather 0 --kernel silverman", true),
    ("--search radius --radius 0.06", true),
    ("--final-gather 16 --gather-spacing 0", true),
    ("--final-gather 16 --gather-spacing 0 --irradiance-cells 0", true),
    ("--spp 1", true),
    ("--spp 16", true),
    ("--pixel-filter gaussian", false),
    ("--aperture 0.2 --focus 4.5", false),
    ("--crop 0,0,16,16", false),
];

fn main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let reference = read_exr(&folder.join("S1.exr")).expect("the reference reads");
    let out = std::env::temp_dir().join(format!("caustica-options-{}.exr", std::process::id()));
    let rounds: u32 = std::env::args().find_map(|word| word.parse().ok()).unwrap_or(3);
    let run = |options: &str, size: &str, seed: u32| {
        let start = Instant::now();
        let status = Command::new(env!("CARGO_BIN_EXE_caustica"))
            .args(["render", "-q", "--size", size, "--photons", "200k", "--seed", &seed.to_string()])
            .args(options.split_whitespace())
            .arg("-o")
            .args([&out, &folder.join("S1.glb")])
            .status()
            .expect("the program starts");
        assert!(status.success(), "{options} renders");
        start.elapsed().as_secs_f64()
    };
    let mut seconds = CHANGES.map(|_| Vec::new());
    let mut errors = [0.0; CHANGES.len()];
    // Renders each once before the first round, to warm the driver cache.
    for (options, _) in CHANGES {
        run(options, "16x16", 0);
    }
    for seed in 0..rounds {
        for (i, (options, compares)) in CHANGES.iter().enumerate() {
            seconds[i].push(run(options, "256x256", seed));
            if *compares {
                let picture = read_exr(&out).expect("the program wrote a picture");
                errors[i] += rel_mse(picture.radiance(), reference.radiance(), None) / f64::from(rounds);
            }
        }
    }
    println!("{:<32} {:>8} {:>8} {:>10}", "option", "seconds", "ratio", "relMSE");
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let plain = median(&mut seconds[0]);
    for (i, (options, compares)) in CHANGES.iter().enumerate() {
        let time = median(&mut seconds[i]);
        let error = if *compares { format!("{:.5}", errors[i]) } else { "–".to_owned() };
        let name = if options.is_empty() { "none" } else { options };
        println!("{name:<32} {time:>8.3} {:>8.2} {error:>10}", time / plain);
    }
    if let Err(e) = std::fs::remove_file(&out) {
        eprintln!("{}: {e}", out.display());
    }
}
