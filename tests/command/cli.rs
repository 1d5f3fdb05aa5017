//! The command line: messages, exit codes and files.

use std::{fs, path::Path, process::Command};

use tempfile::TempDir;

/// One triangle below a point light; `POSITIONS` is filled in.
const SCENE: &str = r#"{
  "asset": {"version": "2.0"},
  "extensionsUsed": ["KHR_lights_punctual"],
  "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 5}]}},
  "scene": 0,
  "scenes": [{"nodes": [0, 1]}],
  "nodes": [{"mesh": 0}, {"translation": [0, 1, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
  "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
    "min": [-1, 0, -1], "max": [1, 0, 1]}],
  "bufferViews": [{"buffer": 0, "byteLength": 36}],
  "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,POSITIONS"}]
}"#;
/// (-1, 0, -1), (0, 0, 1), (1, 0, -1).
const TRIANGLE: &str = "AACAvwAAAAAAAIC/AAAAAAAAAAAAAIA/AACAPwAAAAAAAIC/";
/// The same with NaN for the first coordinate.
const NAN_TRIANGLE: &str = "AADAfwAAAAAAAIC/AAAAAAAAAAAAAIA/AACAPwAAAAAAAIC/";

/// A folder with `scene.gltf` and a few files that are not scenes.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, text: String| fs::write(folder.path().join(name), text).expect("can be written");
    let scene = SCENE.replace("POSITIONS", TRIANGLE);
    write("scene.gltf", scene.clone());
    write("nan.gltf", SCENE.replace("POSITIONS", NAN_TRIANGLE));
    write("dark.gltf", scene.replace(r#""nodes": [0, 1]"#, r#""nodes": [0]"#));
    write("empty.gltf", scene.replace(r#""nodes": [0, 1]"#, r#""nodes": [1]"#));
    write("text.gltf", "no scene at all".to_string());
    write("old.exr", "old".to_string());
    folder
}

/// Command `caustica` with these arguments, in the folder.
fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    command.current_dir(folder).args(line.split_whitespace()).env_remove("CAUSTICA_DEVICE");
    command
}

/// A process that has ended.
struct Ended {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Ended {
    /// Checks the exit code and that stderr is one line `error: …`, which is returned.
    fn failed(self) -> String {
        assert_eq!((self.code, self.stdout.as_str()), (Some(1), ""), "{}", self.stderr);
        assert!(self.stderr.starts_with("error: ") && self.stderr.lines().count() == 1, "{}", self.stderr);
        self.stderr
    }
}

fn run(command: &mut Command) -> Ended {
    let output = command.output().expect("it starts");
    let text = |bytes| String::from_utf8(bytes).expect("messages are text");
    Ended { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

fn caustica(folder: &Path, line: &str) -> Ended {
    run(&mut command(folder, line))
}

/// Runs a small render of the scene, with further arguments.
fn render(folder: &Path, words: &str) -> Ended {
    caustica(folder, &format!("render scene.gltf --size 16x16 --spp 2 --photons 1k -k 10 {words}"))
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("can be listed");
    let mut names: Vec<_> =
        entries.map(|e| e.expect("can be listed").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn wrong_usage_is_exit_code_2_and_says_what_is_right() {
    let folder = folder();
    for (words, said) in [
        ("", "Usage: caustica"),
        ("paint", "unrecognized subcommand"),
        ("render", "SCENE"),
        ("render scene.gltf", "--output"),
        ("render scene.gltf -o a.jpg", ".exr nor .png"),
        ("render scene.gltf -o a", ".exr nor .png"),
        ("render scene.gltf -o a.exr --sharpen", "--sharpen"),
        ("render scene.gltf -o a.exr --passes 0", "a number of passes, as 8"),
        ("render scene.gltf -o a.exr --passes 8..3", "a range, as 3..8"),
        ("render scene.gltf -o a.exr --passes 2 --alpha 0", "a number above 0, at most 1"),
        ("render scene.gltf -o a.exr --alpha 0.5", "--passes"),
        ("render scene.gltf -o a.exr --time 5", "90s, 10m or 2h"),
        ("render scene.gltf -o a.exr --time -5s", "90s, 10m or 2h"),
        ("render scene.gltf -o a.exr --passes 2 --checkpoint a --every -5s", "90s, 10m or 2h"),
        ("render scene.gltf -o a.exr --target-error 2", "a number above 0, at most 1"),
        ("render scene.gltf -o a.exr --passes 2 --resume", "--checkpoint"),
        ("render scene.gltf -o a.exr --passes 2 --part a.png", "does not end in .exr"),
        ("render scene.gltf -o a.exr --passes 2 --part a.exr", "another output"),
        ("merge -o a.exr", "PARTS"),
        ("merge old.exr", "--output"),
        ("render scene.gltf -o a.exr -o a.exr", "another output"),
        ("render scene.gltf -o a.exr -o ./a.exr", "another output"),
        ("render scene.gltf -o a.exr --stats a.exr", "another output"),
        ("merge old.exr -o a.exr -o ./a.exr", "another output"),
        ("render scene.gltf -o a.exr --radius 0.1", "error: --radius 0.1: goes with the search by radius only"),
        (
            "render scene.gltf -o a.exr --final-gather 4 --mode photons",
            "error: --final-gather 4: goes with the modes hybrid and indirect-photons",
        ),
        ("render scene.gltf -o a.exr --mode fast", "direct-rays"),
        ("render scene.gltf -o a.exr --mode fast", "the numbers 0 to 4"),
        ("render scene.gltf -o a.exr --mode 5", "direct-rays"),
        ("render scene.gltf -o a.exr --mode 5", "the numbers 0 to 4"),
        ("render scene.gltf -o a.exr --mode -1", "the numbers 0 to 4"),
        ("render scene.gltf -o a.exr --size 0x4", "1024x768"),
        ("render scene.gltf -o a.exr --size big", "1024x768"),
        ("render scene.gltf -o a.exr --photons 0", "at least 1"),
        ("render scene.gltf -o a.exr --photons 2G", "1.5M"),
        ("render scene.gltf -o a.exr --photons 5000M", "too large"),
        ("render scene.gltf -o a.exr --max-paths=-3", "max-paths"),
        ("render scene.gltf -o a.exr -k 0", "a whole number from 1 to 1000"),
        ("render scene.gltf -o a.exr -k 1001", "a whole number from 1 to 1000"),
        ("render scene.gltf -o a.exr --cone-constant 0.5", "at least 1"),
        ("render scene.gltf -o a.exr --max-radius 0", "above 0"),
        ("render scene.gltf -o a.exr --search radius", "--radius"),
        ("render scene.gltf -o a.exr --kernel box", "epanechnikov"),
        ("render scene.gltf -o a.exr --final-gather 65537", "65536"),
        ("render scene.gltf -o a.exr --max-bounces=-1", "max-bounces"),
        ("render scene.gltf -o a.exr --spp 0", "a whole number from 1"),
        ("render scene.gltf -o a.exr --seed x", "a whole number from 0 to 4294967295"),
        ("render scene.gltf -o a.exr --seed 18446744073709551615", "a whole number from 0 to 4294967295"),
        ("render scene.gltf -o a.exr --seed -1", "a whole number from 0 to 4294967295"),
        ("render scene.gltf -o a.exr -k 1.5", "a whole number from 1 to 1000"),
        ("render scene.gltf -o a.exr --photons -5", "a number of at least 1"),
        ("render scene.gltf -o a.exr --max-radius -1", "above 0"),
        ("render scene.gltf -o a.exr --max-radius 1e19", "at most 1e18"),
        ("render scene.gltf -o a.exr --max-bounces -1", "a whole number from 0 to 4095"),
        ("render scene.gltf -o a.exr --max-bounces 4096", "a whole number from 0 to 4095"),
        ("render scene.gltf -o a.exr --max-bounces 65535", "a whole number from 0 to 4095"),
        ("render scene.gltf -o a.exr --photons -5k", "a number of at least 1"),
        ("render scene.gltf -o a.exr --global-photons -5", "a number of at least 1"),
        ("render scene.gltf -o a.exr --caustic-photons -1.5M", "a number of at least 1"),
        ("render scene.gltf -o a.exr --max-paths -3M", "a number of at least 1"),
        ("render scene.gltf -o a.exr -k -1", "a whole number from 1 to 1000"),
        ("render scene.gltf -o a.exr --neighbors -1", "a whole number from 1 to 1000"),
        ("render scene.gltf -o a.exr --light-samples -1", "a whole number from 1 to 4096"),
        ("render scene.gltf -o a.exr --cone-constant -1", "at least 1"),
        ("render scene.gltf -o a.exr --radius -1", "above 0"),
        ("render scene.gltf -o a.exr --final-gather -1", "a whole number from 0 to 65536"),
        ("render scene.gltf -o a.exr --share -1", "a number from 0 to 2"),
        ("render scene.gltf -o a.exr --spp -1", "a whole number from 1"),
        ("render scene.gltf -o a.exr --size -4x4", "1024x768"),
        ("render scene.gltf -o a.exr --crop -1,0,4,4", "100,50,64,64"),
        ("render scene.gltf -o a.exr --focus 1 --aperture -1", "at least 0"),
        ("render scene.gltf -o a.exr --aperture 1 --focus -1", "above 0"),
        ("render scene.gltf -o a.exr --exposure -101", "stops"),
        ("render scene.gltf -o a.exr --env a.hdr --env-strength -1", "at least 0"),
        ("render scene.gltf -o a.exr --background -1,0,0", "three numbers"),
        ("render scene.gltf -o a.exr -5", "unexpected argument '-5'"),
        ("compare scene.gltf -o a --tolerance -1", "at least 0"),
        ("study scene.gltf -o a --photons -1k,2k -k 1", "a number of at least 1"),
        ("study scene.gltf -o a --photons 1k -k -1,2", "a whole number from 1 to 1000"),
        ("study scene.gltf -o a --photons 1k -k 1 --repeat -1", "a whole number from 1 to 1000"),
        ("render scene.gltf -o a.exr --light-sampling all", "uniform"),
        ("render scene.gltf -o a.exr --light-unit lumen", "photometric"),
        ("render scene.gltf -o a.exr --env a.hdr --background 1,1,1", "cannot be used with"),
        ("render scene.gltf -o a.exr --background 1,1", "three numbers"),
        ("render scene.gltf -o a.exr --background=-1,0,0", "three numbers"),
        ("render scene.gltf -o a.exr --env-strength 2", "--env <FILE>"),
        ("render scene.gltf -o a.exr --background 1,1,1 --env-rotation 2", "cannot be used with"),
        ("render scene.gltf -o a.exr --env a.hdr --env-strength=-1", "at least 0"),
        ("render scene.gltf -o a.exr --env a.hdr --env-rotation north", "degrees"),
        ("render scene.gltf -o a.exr --tonemap film", "reinhard"),
        ("render scene.gltf -o a.exr --exposure nan", "stops"),
        ("render scene.gltf -o a.exr -q -v", "cannot be used with"),
        ("info", "SCENE"),
    ] {
        let ended = caustica(folder.path(), words);
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{words}");
        assert!(ended.stderr.contains(said) && ended.stderr.contains("--help"), "{words}: {}", ended.stderr);
    }
}

#[test]
fn failures_are_exit_code_1_and_one_line_with_the_place() {
    let folder = folder();
    fs::create_dir(folder.path().join("folder.exr")).expect("can be made");
    fs::create_dir(folder.path().join("sky")).expect("can be made");
    // A file's format is known by its content.
    for name in ["grid.exr", "study.csv"] {
        let sky = b"#?RADIANCE\n\n-Y 1 +X 1\n\x80\x80\x80\x81";
        fs::write(folder.path().join("sky").join(name), sky).expect("can be written");
    }
    for (words, said) in [
        ("render none.gltf -o a.exr", "none.gltf"),
        ("render text.gltf -o a.exr", "text.gltf"),
        ("render nan.gltf -o a.exr", "nan.gltf"),
        ("render dark.gltf -o a.exr --default-light none", "file, or give --env, --background or --default-light sky"),
        ("render empty.gltf -o a.exr", "empty.gltf"),
        ("render scene.gltf -o a.exr --camera none", "error: --camera none: scene.gltf has the cameras 0"),
        (
            "render scene.gltf -o a.exr --device no-such-adapter",
            "error: no adapter is called 'no-such-adapter'; this machine has the adapters 0 \"",
        ),
        ("render scene.gltf -o folder.exr", "folder.exr: is a folder"),
        ("render scene.gltf -o nowhere/a.exr", "the folder nowhere does not exist"),
        ("render scene.gltf -o a.exr --stats scene.gltf", "scene.gltf: is the scene"),
        ("render scene.gltf -o a.exr --stats nowhere/a.json", "nowhere"),
        ("render scene.gltf -o a.exr --env none.hdr", "none.hdr: "),
        ("render scene.gltf -o a.exr --env text.gltf", "text.gltf: is neither OpenEXR nor Radiance HDR"),
        ("render scene.gltf -o old.exr --env ./old.exr", "old.exr: is the environment as well"),
        ("compare scene.gltf -o . --env none.hdr", "none.hdr: "),
        ("compare scene.gltf -o sky --env sky/grid.exr", "grid.exr: is the environment as well"),
        ("study scene.gltf -o sky --photons 1k -k 1 --env none.hdr", "none.hdr: "),
        ("study scene.gltf -o sky --photons 1k -k 1 --env sky/study.csv", "study.csv: is the environment as well"),
        ("info none.gltf", "none.gltf"),
        ("info text.gltf", "text.gltf"),
    ] {
        let quiet = if words.starts_with("info") { "" } else { "-q" };
        let message = caustica(folder.path(), &format!("{words} {quiet}")).failed();
        assert!(message.contains(said), "{words}: {message}");
    }
    let left = ["dark.gltf", "empty.gltf", "folder.exr", "nan.gltf", "old.exr", "scene.gltf", "sky", "text.gltf"];
    assert_eq!(names(folder.path()), left);
    assert_eq!(names(&folder.path().join("sky")), ["grid.exr", "study.csv"]);
}

#[test]
fn a_camera_that_sees_nothing_is_named() {
    let folder = folder();
    let camera = r#""cameras": [{"type": "perspective", "name": "away", "perspective": {"yfov": 0.6, "znear": 0.1}}],
  "scene": 0,"#;
    let scene = SCENE.replace("POSITIONS", TRIANGLE).replace(r#""scene": 0,"#, camera);
    let scene = scene.replace(r#""nodes": [0, 1]}"#, r#""nodes": [0, 1, 2]}"#);
    // It looks along -Z.
    let at = |z: i32| {
        scene.replace(
            r#""nodes": [{"mesh": 0}"#,
            &format!(r#""nodes": [{{"mesh": 0}}, {{"camera": 0, "translation": [0, 0.5, {z}]}}"#),
        )
    };
    let said = |z: i32| {
        let scene = at(z).replace(r#""nodes": [0, 1, 2]"#, r#""nodes": [0, 2, 1]"#);
        fs::write(folder.path().join("scene.gltf"), scene).expect("can be written");
        let ended = render(folder.path(), "--mode direct-rays -o a.png --stats s.json");
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ended.stderr
    };
    let warning = r#"the camera 0 "away" sees nothing of the scene: the picture is empty"#;
    let away = said(-50);
    assert!(away.lines().any(|line| line == format!("warning: {warning}")), "{away}");
    assert!(fs::read_to_string(folder.path().join("s.json")).expect("text").contains("sees nothing"), "statistics");
    assert!(!said(5).contains("sees nothing"), "control");
}

#[test]
fn help_and_version_go_to_stdout() {
    let folder = folder();
    let help = |words: &str| {
        let ended = caustica(folder.path(), words);
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{words}");
        ended.stdout
    };
    assert_eq!(help("--version"), format!("caustica {}\n", env!("CARGO_PKG_VERSION")));
    let general = help("--help");
    assert!(
        ["render", "compare", "study", "devices", "info", "Exit codes"].iter().all(|said| general.contains(said)),
        "{general}"
    );
    let of_render = help("render --help");
    for option in [
        "--mode",
        "--photons",
        "--global-photons",
        "--caustic-photons",
        "--max-paths",
        "-k, --neighbors",
        "--cone-constant",
        "--max-radius",
        "--max-bounces",
        "--spp",
        "--size",
        "--camera",
        "--seed",
        "--device",
        "CAUSTICA_DEVICE",
        "--light-sampling",
        "--light-unit",
        "--env",
        "--env-strength",
        "--env-rotation",
        "--background",
        "--exposure",
        "--tonemap",
        "--search",
        "--radius",
        "--kernel",
        "--raw-estimate",
        "--final-gather",
        "--stats",
        "-q, --quiet",
        "-v, --verbose",
        "-o, --output",
        "Examples:",
    ] {
        assert!(of_render.contains(option), "{option}");
    }
    assert!(!of_render.contains("--sharpen"));
    let words = of_render.split_whitespace().collect::<Vec<_>>().join(" ");
    let default_of = |option: &str| {
        words.split(option).nth(1).and_then(|after| after.split("--quality, ").nth(1)).expect("it says so")
    };
    assert!(
        default_of("--max-spp <N>").starts_with("64;") && default_of("--final-gather <N>").starts_with("64;"),
        "{words}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn without_an_adapter_the_error_names_what_to_install() {
    let folder = folder();
    for words in ["devices", "render scene.gltf -q -o a.exr"] {
        let mut command = command(folder.path(), words);
        let message =
            run(command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent")).failed();
        for said in ["apt install libvulkan1 mesa-vulkan-drivers", "dnf install", "Windows", "macOS"] {
            assert!(message.contains(said), "{message}");
        }
    }
}

#[test]
fn devices_lists_the_limits_and_says_nothing_else() {
    let ended = caustica(folder().path(), "devices");
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""));
    for said in ["0: ", "kind", "driver", "backend", "largest storage binding", "usable"] {
        assert!(ended.stdout.contains(said), "{}", ended.stdout);
    }
}

#[test]
fn info_says_what_the_scene_holds() {
    let ended = caustica(folder().path(), "info scene.gltf");
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""));
    assert!(ended.stdout.contains("triangle") && ended.stdout.contains("light"), "{}", ended.stdout);
    assert!(!ended.stdout.contains("photons"), "they take a device, and time: {}", ended.stdout);
}

#[test]
fn info_asks_for_a_device_with_photons_alone() {
    let folder = folder();
    let with_device = |line: &str| run(command(folder.path(), line).env("CAUSTICA_DEVICE", "no-such-adapter"));
    let ended = with_device("info scene.gltf");
    assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""));
    assert_eq!(ended.stdout, caustica(folder.path(), "info scene.gltf").stdout);
    assert!(with_device("info scene.gltf --photons").failed().contains("no-such-adapter"), "control");
}

#[test]
fn info_says_how_many_photons_the_camera_sees() {
    let folder = folder();
    let told = |scene: &str, more: &str| {
        let ended = caustica(folder.path(), &format!("info {scene} --photons{more}"));
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ended.stdout
    };
    let line = |text: &str, map: &str| {
        let found = text.lines().find(|line| line.trim_start().starts_with(map)).map(str::to_owned);
        found.unwrap_or_else(|| panic!("{map}: {text}"))
    };
    let alone = told("scene.gltf", "");
    assert!(["global", "caustic"].iter().all(|map| line(&alone, map).ends_with("none")), "one triangle: {alone}");
    let room = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/references/S1.glb");
    let text = told(room, "");
    let info: serde_json::Value = serde_json::from_str(&told(room, " --json")).expect("JSON");
    for map in ["global", "caustic"] {
        let count = |name: &str| info["photons"][map].pointer(name).and_then(serde_json::Value::as_u64).expect(name);
        let (seen, sampled) = (count("/seen/seen"), count("/seen/sampled"));
        assert!(0 < seen && seen < sampled && sampled <= count("/stored"), "{info}");
        let said = format!(", {:.1} % where the camera sees them", 100.0 * seen as f64 / sampled as f64);
        assert!(line(&text, map).ends_with(&said), "{said}: {text}");
    }
    assert_eq!(info["triangles"], 10);
}

#[test]
fn a_render_writes_all_that_was_asked_for() {
    let folder = folder();
    let ended = render(folder.path(), "-o old.exr -o b.png --stats s.json");
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), ""), "{}", ended.stderr);
    for said in ["light unit: radiometric", "camera:", "wrote old.exr", "wrote b.png"] {
        assert!(ended.stderr.contains(said), "{}", ended.stderr);
    }
    assert!(!ended.stderr.contains(['\r', '\u{1b}']), "plain lines when piped: {}", ended.stderr);
    let frame = caustica::image::read_exr(&folder.path().join("old.exr")).expect("an EXR");
    assert_eq!((frame.width, frame.height, frame.radiance().len()), (16, 16, 256));
    assert!(frame.radiance().iter().any(|p| p[0] > 0.0));
    let png = image::open(folder.path().join("b.png")).expect("a PNG").into_rgb8();
    assert_eq!(png.dimensions(), (16, 16));
    let text = fs::read_to_string(folder.path().join("s.json")).expect("statistics");
    let stats: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for pointer in [
        "/device/name",
        "/seconds/load",
        "/seconds/bvh",
        "/seconds/photons",
        "/seconds/grid",
        "/seconds/camera",
        "/seconds/direct",
        "/seconds/gather",
        "/seconds/total",
        "/photons/global/emitted",
        "/photons/global/stored",
        "/photons/caustic/emitted",
        "/photons/caustic/stored",
        "/rays",
        "/peak_device_bytes",
        "/warnings",
    ] {
        assert!(stats.pointer(pointer).is_some(), "{pointer} is not in {text}");
    }
    assert!(stats.pointer("/seconds/nothing").is_none());
}

#[test]
fn light_from_all_around_is_turned_and_scaled_as_asked() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    // Two pixels of radiance 1: red where z < 0, green where z > 0.
    let pixels: [u8; 8] = [128, 0, 0, 129, 0, 128, 0, 129];
    fs::write(path("sky.hdr"), [&b"#?RADIANCE\n\n-Y 1 +X 2\n"[..], &pixels].concat()).expect("can be written");
    let corner = |words: &str| {
        let small = "render dark.gltf --size 8x8 --spp 1 --mode direct-rays -q -o sky.exr";
        let ended = caustica(folder.path(), &format!("{small} {words}"));
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{words}");
        caustica::image::read_exr(&path("sky.exr")).expect("an EXR").radiance().to_vec()[0]
    };
    let attributes = || {
        let mut all = caustica::image::read_exr_attributes(&path("sky.exr")).expect("an EXR");
        all.retain(|name, _| name.starts_with("environment"));
        all
    };
    // The file has no camera: the one made for it looks along -Z.
    assert_eq!(corner("--background 0.5,0.25,0"), [0.5, 0.25, 0.0]);
    assert_eq!((&*attributes()["environment"], &*attributes()["environmentRadiance"]), ("background", "0.5,0.25,0"));
    let [r, g, b] = corner("--env sky.hdr --env-strength 2");
    assert!(r > 1.5 && (r + g - 2.0).abs() < 1e-5 && b == 0.0, "{r} {g} {b}");
    let found = attributes();
    assert_eq!((&*found["environment"], &*found["environmentStrength"]), ("sky.hdr", "2"));
    assert_eq!((&*found["environmentRotation"], found["environmentHash"].len()), ("0", 64));
    let [turned, behind, _] = corner("--env sky.hdr --env-rotation=-180");
    assert!(behind > 0.75 && (turned - g / 2.0).abs() < 1e-5, "{turned} {behind}");
    assert_eq!(attributes()["environmentRotation"], "180");
}

#[test]
fn light_of_nothing_gives_a_black_picture() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let dark = SCENE.replace("POSITIONS", TRIANGLE).replace(r#""intensity": 5"#, r#""intensity": 0"#);
    fs::write(path("lamp.gltf"), dark).expect("can be written");
    let lit = fs::read_to_string(path("dark.gltf")).expect("a scene");
    let strength = r#""extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 0}}"#;
    let ember = lit
        .replace(r#"{"POSITION": 0}"#, r#"{"POSITION": 0}, "material": 0"#)
        .replace(r#""meshes""#, &format!(r#""materials": [{{"emissiveFactor": [1, 1, 1], {strength}}}], "meshes""#));
    fs::write(path("ember.gltf"), ember).expect("can be written");
    fs::write(path("sky.hdr"), b"#?RADIANCE\n\n-Y 1 +X 1\n\x80\x80\x80\x81").expect("can be written");
    fs::write(path("black.hdr"), b"#?RADIANCE\n\n-Y 1 +X 1\n\0\0\0\0").expect("can be written");
    let brightest = |words: &str| {
        let ended = caustica(folder.path(), &format!("render {words} --size 8x8 --spp 1 --photons 1k -o out.exr"));
        assert_eq!(ended.code, Some(0), "{words}: {}", ended.stderr);
        let frame = caustica::image::read_exr(&path("out.exr")).expect("an EXR");
        (frame.radiance().as_flattened().iter().copied().fold(0.0, f32::max), ended.stderr)
    };
    for (words, said) in [
        ("lamp.gltf", r#"light "light 0" has no intensity: it gives no light"#),
        ("lamp.gltf", "all lights are off: the picture is black"),
        ("ember.gltf", r#"material "material 0": emissive strength 0 gives no light"#),
        ("lamp.gltf --mode photons --emission unaimed", "has no intensity"),
        ("dark.gltf --background 0,0,0", "all lights are off"),
        ("dark.gltf --env sky.hdr --env-strength 0", "all lights are off"),
        ("dark.gltf --env black.hdr", "black.hdr: is black: it gives no light"),
    ] {
        let (radiance, stderr) = brightest(words);
        assert_eq!(radiance, 0.0, "{words}");
        assert!(stderr.contains(said) && !stderr.contains("sky of radiance"), "{words}: {stderr}");
        if !words.contains("--") {
            let info = caustica(folder.path(), &format!("info {words}")).stdout;
            assert!(info.contains(said) && info.contains("all lights are off"), "info {words}: {info}");
        }
    }
    assert!(!caustica(folder.path(), "info scene.gltf").stdout.contains("lights are off"), "control");
    let (radiance, stderr) = brightest("dark.gltf");
    assert!(radiance > 0.9 && stderr.contains("no light: lit by a uniform sky"), "control: {radiance}, {stderr}");
    // Light that the surface reflects comes on top of the background.
    let lit = brightest("dark.gltf --background 0,0.25,0").0;
    assert!((0.25..0.5).contains(&lit), "control: {lit}");
}

#[test]
fn quiet_says_nothing_and_equal_runs_give_equal_files() {
    let folder = folder();
    let read = |name: &str| fs::read(folder.path().join(name)).expect("was written");
    for words in ["-q -o a.exr", "-q -o b.exr -o b.png", "-q -o c.exr --seed 1"] {
        let ended = render(folder.path(), words);
        assert_eq!((ended.code, ended.stdout.as_str(), ended.stderr.as_str()), (Some(0), "", ""));
    }
    assert!(read("a.exr") == read("b.exr"));
    let radiance =
        |name: &str| caustica::image::read_exr(&folder.path().join(name)).expect("an EXR").radiance().to_vec();
    assert!(radiance("a.exr") != radiance("c.exr"));
}

#[test]
fn many_files_are_rendered_by_one_process() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    fs::write(folder.join("broken.gltf"), "{").expect("it is written");
    let scene = |name: &str| format!("{}/scenes/{name}.gltf", env!("CARGO_MANIFEST_DIR"));
    let options = "--size 16x16 --spp 1 --photons 1k -k 20 -q";
    let many = format!(
        "render {} broken.gltf none.gltf {} --output-dir made/here {options}",
        scene("diffuse"),
        scene("area-light")
    );
    let output = command(folder, &many).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines[0].starts_with("error: broken.gltf: ") && lines[1].starts_with("error: none.gltf: "), "{said}");
    assert_eq!(lines[2..], ["error: 2 of 4 scenes were not rendered"]);
    let alone = format!("render {} -o alone.exr -o alone.png {options}", scene("area-light"));
    assert!(command(folder, &alone).output().expect("it starts").status.success());
    let bytes = |name: &str| fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    for extension in ["exr", "png"] {
        let name = |stem: &str| format!("{stem}.{extension}");
        assert!(bytes(&format!("made/here/{}", name("area-light"))) == bytes(&name("alone")), "{extension}");
        assert!(bytes(&format!("made/here/{}", name("diffuse"))) != bytes(&name("alone")), "control");
    }
    assert_eq!(fs::read_dir(folder.join("made/here")).expect("it is there").count(), 4);
    for (wrong, expected) in [
        (format!("render {0} {0} --output-dir made {options}", scene("sky")), "sky.exr is another output as well"),
        (format!("render {} {} -o a.exr", scene("sky"), scene("spot")), "2 scenes need --output-dir"),
        (format!("render {} -o a.exr --output-dir made", scene("sky")), "cannot be used with"),
    ] {
        let output = command(folder, &wrong).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(expected), "{wrong}: {said}");
    }
}
