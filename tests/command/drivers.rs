//! Two unrelated drivers: the default adapter (Mesa lavapipe where there is no GPU) and
//! SwiftShader, which comes with Debian's Chromium. Its subgroups have 4 invocations, its kernels
//! 10 storage buffers. Left out where `CAUSTICA_NO_BROWSER` is 1.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | scenes | same photons emitted and stored, same mean, less block error than between two seeds | each fails for the other scene |
//! | compare | the grid agrees with the kd-tree on SwiftShader, and on lavapipe in subgroups of 16 | one photon left out |

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    thread,
};

use caustica::{
    image::{difference::rel_mse, read_exr},
    stats::Stats,
};

/// Pixels along each side of a picture, and of the blocks over which it is averaged.
const SIZE: usize = 32;
const BLOCK: usize = 8;
/// The largest relative differences of photon counts and of means.
const MAX_PHOTONS: f64 = 0.001;
const MAX_MEAN: f64 = 0.002;

/// Paths of SwiftShader's ICD manifest in distributions: Debian, Fedora.
const DRIVERS: [&str; 2] =
    ["/usr/lib/chromium/vk_swiftshader_icd.json", "/usr/lib64/chromium-browser/vk_swiftshader_icd.json"];

/// SwiftShader's ICD manifest; `None` with `CAUSTICA_NO_BROWSER=1`.
fn swiftshader() -> Option<PathBuf> {
    if env::var("CAUSTICA_NO_BROWSER").is_ok_and(|value| value == "1") {
        return None;
    }
    let found = DRIVERS.iter().map(PathBuf::from).find(|path| path.is_file());
    Some(found.unwrap_or_else(|| panic!("no SwiftShader in {DRIVERS:?}: run scripts/install-chromium")))
}

/// Runs `caustica` on a driver; `None` is the default one.
fn run(driver: Option<&Path>, line: &str, folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    if let Some(driver) = driver {
        command.env("VK_DRIVER_FILES", driver).env_remove("CAUSTICA_DEVICE");
    }
    command.args(line.split_whitespace()).current_dir(env!("CARGO_MANIFEST_DIR")).arg("-o").arg(folder);
    command.output().expect("it starts")
}

/// Results of a render.
struct Rendered {
    stats: Stats,
    blocks: Vec<[f32; 3]>,
}

impl Rendered {
    fn new(driver: Option<&Path>, scene: &str, seed: u32) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (picture, stats) = (folder.path().join("out.exr"), folder.path().join("stats.json"));
        let line = format!(
            "render scenes/{scene}.gltf --size {SIZE}x{SIZE} --spp 4 --photons 5k --seed {seed} -q --stats {}",
            stats.display()
        );
        let ended = run(driver, &line, &picture);
        assert!(ended.status.success(), "{scene}: {}", String::from_utf8_lossy(&ended.stderr));
        let stats = serde_json::from_slice(&fs::read(stats).expect("stats are there")).expect("JSON");
        Self { stats, blocks: blocks(read_exr(&picture).expect("the picture reads").radiance()) }
    }

    fn mean(&self) -> f64 {
        self.blocks.iter().flatten().map(|&x| f64::from(x)).sum::<f64>()
    }

    /// Paths emitted and photons stored of both maps.
    fn photons(&self) -> [u64; 4] {
        let [global, caustic] = [self.stats.photons.global, self.stats.photons.caustic];
        [global.emitted, global.stored, caustic.emitted, caustic.stored]
    }
}

/// Means over blocks of pixels.
fn blocks(picture: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let side = SIZE / BLOCK;
    let block = |i: usize| {
        let pixel = |j: usize| picture[(i / side * BLOCK + j / BLOCK) * SIZE + i % side * BLOCK + j % BLOCK];
        let sum = (0..BLOCK * BLOCK).map(pixel).fold([0.0; 3], |sum, p| [0, 1, 2].map(|c| sum[c] + p[c]));
        sum.map(|x| x / (BLOCK * BLOCK) as f32)
    };
    (0..side * side).map(block).collect()
}

fn is_close(a: f64, b: f64, most: f64) -> bool {
    (a - b).abs() <= most * b.abs()
}

fn same_photons(a: &Rendered, b: &Rendered) -> bool {
    a.photons().into_iter().zip(b.photons()).all(|(a, b)| is_close(a as f64, b as f64, MAX_PHOTONS))
}

fn same_mean(a: &Rendered, b: &Rendered) -> bool {
    is_close(a.mean(), b.mean(), MAX_MEAN)
}

/// Renders of a scene: on the default driver with two seeds, and on SwiftShader.
struct Renders {
    name: &'static str,
    here: Rendered,
    other_seed: Rendered,
    there: Rendered,
}

impl Renders {
    fn new(name: &'static str, driver: &Path) -> Self {
        let [here, other_seed, there] =
            [(None, 0), (None, 1), (Some(driver), 0)].map(|(driver, seed)| Rendered::new(driver, name, seed));
        assert!(there.stats.device.name.contains("SwiftShader"), "{}", there.stats.device.name);
        assert_ne!(here.stats.device, there.stats.device, "two drivers are needed");
        Self { name, here, other_seed, there }
    }

    /// relMSE between two seeds on one driver.
    fn noise(&self) -> f64 {
        rel_mse(&self.other_seed.blocks, &self.here.blocks, None)
    }
}

/// Renders both scenes on both drivers and compares each with itself, and with the other as a
/// control.
fn agree(names: [&'static str; 2]) {
    let Some(driver) = swiftshader() else { return };
    let renders = thread::scope(|scope| {
        let threads = names.map(|name| scope.spawn(|| Renders::new(name, &driver)));
        threads.map(|thread| thread.join().expect("it renders"))
    });
    let [a, b] = &renders;
    for (own, other) in [(a, b), (b, a)] {
        let name = own.name;
        let (counts, expected) = (own.there.photons(), own.here.photons());
        assert!(same_photons(&own.there, &own.here), "{name}: photons {counts:?} and {expected:?}");
        assert!(!same_photons(&other.there, &own.here), "control: photons of {} pass for {name}", other.name);
        let means = [&own.there, &own.here].map(Rendered::mean);
        assert!(same_mean(&own.there, &own.here), "{name}: means {means:?}");
        assert!(!same_mean(&other.there, &own.here), "control: the mean of {} passes for {name}", other.name);
        let difference = rel_mse(&own.there.blocks, &own.here.blocks, None);
        assert!(difference < own.noise(), "{name}: relMSE {difference} of blocks, {} of two seeds", own.noise());
        let wrong = rel_mse(&other.there.blocks, &own.here.blocks, None);
        assert!(wrong > own.noise(), "control: {} passes for {name}, relMSE {wrong} of blocks", other.name);
    }
}

#[test]
fn scenes_look_the_same_on_two_drivers() {
    agree(["mirror-and-glass", "sky"]);
}

/// Compares grid and tree with a command: a right report, and one of a photon left out.
fn grid_and_tree_agree(command: &dyn Fn(&str, &Path) -> Output) -> String {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let compare = |words: &str, name: &str| {
        let line = format!("compare scenes/mirror-and-glass.gltf --size 32x24 --spp 2 --photons 3k {words}");
        command(&line, &folder.path().join(name))
    };
    let ended = compare("", "right");
    assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
    assert_eq!(compare("--sabotage 1", "wrong").status.code(), Some(1), "control: a photon left out passes");
    fs::read_to_string(folder.path().join("right/report.json")).expect("the report is there")
}

#[test]
fn the_grid_agrees_with_the_tree_on_swiftshader() {
    let Some(driver) = swiftshader() else { return };
    let report = grid_and_tree_agree(&|line, folder| run(Some(&driver), line, folder));
    assert!(report.contains("SwiftShader"), "{report}");
}

#[test]
fn the_grid_agrees_with_the_tree_in_subgroups_of_16() {
    // Lavapipe's subgroups are as wide as its vectors; other drivers do not read this.
    let wide = |words: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
        command.args(words.split_whitespace()).env("LP_NATIVE_VECTOR_WIDTH", "512");
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        command
    };
    let listed = wide("devices").output().expect("it starts");
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    let has = |size: &str| {
        listed.lines().any(|line| line.trim_start().starts_with("invocations a subgroup") && line.ends_with(size))
    };
    assert!(!listed.contains("llvmpipe") || has(" 16"), "{listed}");
    assert!(!has(" 17"), "control");
    grid_and_tree_agree(&|line, folder| wide(line).arg("-o").arg(folder).output().expect("it starts"));
}
