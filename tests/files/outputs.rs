//! Output files of the program, also of runs that fail or are stopped, on the real file system.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | destroys | an output over any file that is read, or over another output, is refused before the work | a path beside it is written |
//! | full | a file or output that cannot be written whole is an error, and the older one stays | without the limit it is replaced |
//! | places | folders, files as folders, names too long, and pipes to read are refused before the work | names that are only long or odd are written |
//! | closed | a closed pipe, or a full disk behind stderr, is no failure | an open pipe gets the whole output |
//! | resumable | SIGTERM is no failure of a run with a checkpoint, also while the scene is read | without a checkpoint |
//! | stops | SIGINT and SIGTERM end every stage of every command, and leave no file | a run that is not stopped goes on |
#![cfg(unix)]

use std::{
    ffi::OsStr,
    fs,
    io::{BufRead, BufReader, Read},
    os::unix::ffi::OsStrExt,
    path::Path,
    process::{Child, Command, ExitStatus, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use tempfile::TempDir;

/// A triangle below a point light and before an image, with its buffer in a file of its own.
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
  "images": [{"uri": "wood%20grain.png"}],
  "buffers": [{"byteLength": 36, "uri": "corners.json"}]
}"#;
const FILES: [&str; 4] = ["corners.json", "old.exr", "scene.gltf", "wood grain.png"];

/// A folder with the scene, its files, and an earlier picture.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("can be written");
    let corners: [f32; 9] = [-1.0, 0.0, -1.0, 0.0, 0.0, 1.0, 1.0, 0.0, -1.0];
    write("corners.json", &corners.map(f32::to_le_bytes).concat());
    write("wood grain.png", b"wood");
    write("scene.gltf", SCENE.as_bytes());
    write("old.exr", b"old");
    folder
}

/// Command `caustica` with these arguments, in the folder.
fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    command.current_dir(folder).args(line.split_whitespace()).env_remove("CAUSTICA_DEVICE");
    command
}

const QUICK: &str = "render scene.gltf --size 8x8 --spp 1 --mode direct-rays";

/// Exit code and stderr.
fn ended(command: &mut Command) -> (Option<i32>, String) {
    let output = command.output().expect("it starts");
    (output.status.code(), String::from_utf8(output.stderr).expect("messages are text"))
}

/// The error line of a run that fails before any work.
fn refusal(folder: &Path, line: &str) -> String {
    let (code, said) = ended(&mut command(folder, line));
    assert_eq!(code, Some(1), "{line}: {said}");
    let lines: Vec<_> = said.lines().filter(|l| *l != "load").collect();
    assert!(lines.len() == 1 && lines[0].starts_with("error: "), "{line}: {said}");
    assert!(!said.contains("device:"), "{line}: it had begun");
    said
}

/// All files of the folder, recursively.
fn names(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).expect("can be listed").map(|e| e.expect("can be listed")) {
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.file_type().expect("is there").is_dir() {
            names.extend(self::names(&entry.path()).into_iter().map(|inner| format!("{name}/{inner}")));
        } else {
            names.push(name);
        }
    }
    names.sort();
    names
}

#[test]
fn nothing_that_is_read_or_written_is_written_over() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    std::os::unix::fs::symlink("old.exr", path("link.exr")).expect("can be linked");
    std::os::unix::fs::symlink("scene.gltf", path("link.png")).expect("can be linked");
    for (words, said) in [
        ("-o a.exr --stats scene.gltf", "is the scene"),
        ("-o link.png", "is the scene"),
        ("-o a.exr --stats corners.json", "is a file of the scene"),
        ("-o a.exr --stats ./corners.json", "is a file of the scene"),
        ("-o a.exr -o wood_grain.png", "is a file of the scene"),
        ("-o old.exr --env old.exr", "is the environment"),
    ] {
        let mut line = command(folder.path(), QUICK);
        line.args(words.split_whitespace().map(|word| word.replace("wood_grain", "wood grain")));
        let (code, text) = ended(&mut line);
        assert_eq!(code, Some(1), "{words}: {text}");
        assert!(text.contains(said) && !text.contains("device:"), "{words}: {text}");
    }
    for words in ["-o a.exr -o a.exr", "-o a.exr -o ./a.exr", "-o old.exr -o link.exr", "-o a.exr --stats a.exr"] {
        let (code, text) = ended(command(folder.path(), QUICK).args(words.split_whitespace()));
        assert_eq!(code, Some(2), "{words}: {text}");
        assert!(text.contains("is another output"), "{words}: {text}");
    }
    // A folder of results that holds the scene under the name of a result.
    fs::copy(path("scene.gltf"), path("study.json")).expect("can be copied");
    assert!(refusal(folder.path(), "study study.json -q -o . --photons 1k -k 1").contains("study.json: is the scene"));
    fs::remove_file(path("study.json")).expect("can be removed");
    fs::write(path("corners.json"), [0; 3]).expect("can be written");
    fs::remove_file(path("link.png")).expect("can be removed");
    fs::remove_file(path("link.exr")).expect("can be removed");
    assert_eq!(names(folder.path()), FILES, "something was left");
    assert_eq!(fs::read(path("old.exr")).expect("it is there"), b"old");
}

#[test]
fn a_hard_link_of_an_input_becomes_a_file_of_its_own() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    fs::hard_link(path("scene.gltf"), path("other.exr")).expect("can be linked");
    assert_eq!(ended(&mut command(folder.path(), &format!("{QUICK} -q -o other.exr"))), (Some(0), String::new()));
    assert_eq!(fs::read_to_string(path("scene.gltf")).expect("it is there"), SCENE);
    assert!(caustica::image::read_exr(&path("other.exr")).is_ok());
}

#[test]
fn what_cannot_be_written_whole_leaves_the_older_file() {
    let folder = folder();
    let old = folder.path().join("old.exr");
    let limited = |limit: &str| {
        let mut shell = Command::new("sh");
        let line = format!("{limit} exec \"$0\" {QUICK} -q -o old.exr");
        ended(shell.current_dir(folder.path()).args(["-c", &line, env!("CARGO_BIN_EXE_caustica")]))
    };
    // A limit of one block: 512 or 1024 bytes.
    let (code, said) = limited("ulimit -f 1;");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.starts_with("error: old.exr: ") && said.lines().count() == 1, "{said}");
    assert_eq!(fs::read(&old).expect("it is there"), b"old");
    assert_eq!(names(folder.path()), FILES);
    // A device that is always full.
    std::os::unix::fs::symlink("/dev/full", folder.path().join("full.exr")).expect("can be linked");
    let (code, said) = ended(&mut command(folder.path(), &format!("{QUICK} -q -o full.exr")));
    assert!(code == Some(1) && said.starts_with("error: full.exr: No space left"), "{said}");
    fs::remove_file(folder.path().join("full.exr")).expect("can be removed");
    // What is asked for on stdout is lost as well.
    for line in ["info scene.gltf", "info scene.gltf --json"] {
        let full = fs::File::options().write(true).open("/dev/full").expect("Linux has it");
        let (code, said) = ended(command(folder.path(), line).stdout(full));
        assert!(code == Some(1) && said.starts_with("error: standard output: No space left"), "{line}: {said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    assert_eq!(limited(""), (Some(0), String::new()), "control: without the limit");
    assert!(caustica::image::read_exr(&old).is_ok());
    assert_eq!(names(folder.path()), FILES);
}

#[test]
fn places_that_cannot_be_written_are_refused_before_the_work() {
    let folder = folder();
    fs::create_dir(folder.path().join("folder.exr")).expect("can be made");
    let long = "n".repeat(255 - 4);
    for (output, said) in [
        ("folder.exr", "is a folder"),
        ("nowhere/a.exr", "the folder nowhere does not exist"),
        ("old.exr/a.exr", "Not a directory"),
        ("old.exr/", "Not a directory"),
        ("a.exr/", "a.exr/: names no file"),
        ("a.exr --stats a.json/", "a.json/: names no file"),
        ("a.exr --passes 2 --part part.exr/", "part.exr/: names no file"),
        ("a.exr --passes 2 --checkpoint kept/", "kept/: names no file"),
        ("/proc/a.exr", "the folder /proc cannot be written"),
        (&format!("{long}n.exr"), "name too long"),
    ] {
        let text = refusal(folder.path(), &format!("{QUICK} -q -o {output}"));
        assert!(text.contains(said), "{output}: {text}");
    }
    for (line, said) in [
        ("render scene.gltf --output-dir old.exr", "old.exr: old.exr is a file, not a folder"),
        ("render scene.gltf --output-dir old.exr/there", "old.exr/there: old.exr is a file, not a folder"),
        ("compare scene.gltf -o old.exr", "old.exr is a file, not a folder"),
        ("study scene.gltf -o old.exr/there --photons 1k -k 1", "old.exr is a file, not a folder"),
    ] {
        let text = refusal(folder.path(), &format!("{line} -q"));
        assert!(text.contains(said), "{line}: {text}");
    }
    // No process writes to the pipe: reading it would block for ever.
    let made = Command::new("mkfifo").arg(folder.path().join("pipe.exr")).status().expect("mkfifo runs");
    assert!(made.success());
    for line in [
        format!("{QUICK} -q -o a.exr --env pipe.exr"),
        "study scene.gltf -q -o out --photons 1k -k 1 --reference pipe.exr".to_string(),
    ] {
        let text = refusal(folder.path(), &line);
        assert!(text.contains("pipe.exr: is not a regular file"), "{line}: {text}");
    }
    // Controls: a name of maximum length, and one that is not UTF-8.
    let odd = OsStr::from_bytes(b"\xff\xfe.png");
    let mut line = command(folder.path(), &format!("{QUICK} -q -o {long}.exr -o"));
    assert_eq!(ended(line.arg(odd)), (Some(0), String::new()));
    assert!(folder.path().join(odd).is_file() && folder.path().join(format!("{long}.exr")).is_file());
}

#[test]
fn a_reader_that_has_gone_is_no_failure() {
    let folder = folder();
    let mut child = command(folder.path(), "info scene.gltf").stdout(Stdio::piped()).spawn().expect("it starts");
    drop(child.stdout.take());
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    let full = || fs::File::options().write(true).open("/dev/full").expect("Linux has it");
    let status = command(folder.path(), &format!("{QUICK} -v -o a.exr")).stderr(full()).status().expect("it starts");
    assert_eq!(status.code(), Some(0), "stderr on a full disk");
    let status = command(folder.path(), "render").stderr(full()).status().expect("it starts");
    assert_eq!(status.code(), Some(2), "wrong usage, told to a full disk");
    let (code, said) = ended(&mut command(folder.path(), &format!("{QUICK} -o a.exr")));
    assert!(code == Some(0) && said.contains("wrote a.exr"), "control: {said}");
}

/// Waits for the process to end by itself. The documented time is two seconds. The limit allows for
/// a loaded machine, but not for work that continues.
fn wait_for(child: &mut Child) -> Option<ExitStatus> {
    let deadline = Instant::now() + Duration::from_secs(30);
    while Instant::now() < deadline {
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            return Some(status);
        }
        sleep(Duration::from_millis(10));
    }
    child.kill().expect("it can be killed");
    child.wait().expect("it ends");
    None
}

/// The same command with the default action of SIGHUP, even where this test ignores it, as under
/// nohup.
fn hearing_hangups(command: &Command) -> Command {
    let mut hearing = Command::new("env");
    hearing.arg("--default-signal=HUP").arg(command.get_program()).args(command.get_args());
    if let Some(folder) = command.get_current_dir() {
        hearing.current_dir(folder);
    }
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => hearing.env(name, value),
            None => hearing.env_remove(name),
        };
    }
    hearing
}

/// Sends a signal once a line with this prefix is on stderr. Returns the exit code, and what was
/// said later.
fn stopped_at(folder: &Path, line: &str, stage: &str, signal: &str) -> (Option<i32>, String) {
    let mut child = hearing_hangups(&command(folder, line)).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("it is piped"));
    let mut said = String::new();
    let begun = loop {
        let start = said.len();
        match stderr.read_line(&mut said).expect("messages are text") {
            0 => break false,
            _ if said[start..].starts_with(stage) => break true,
            _ => {}
        }
    };
    assert!(begun, "{line} does not come to {stage}: {said}");
    Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().expect("kill runs");
    let status = wait_for(&mut child).unwrap_or_else(|| panic!("{line} goes on after SIG{signal} at {stage}"));
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).expect("messages are text");
    assert!(!rest.contains("wrote") && !rest.contains("error"), "{line}: {rest}");
    (status.code(), rest)
}

#[test]
fn signals_end_every_stage_and_leave_no_file() {
    let folder = folder();
    let made = Command::new("mkfifo").arg(folder.path().join("pipe.exr")).status().expect("mkfifo runs");
    assert!(made.success());
    let hours = "render scene.gltf --size 64x64 --spp 1000000 -k 10 -o old.exr -o a.png --stats s.json";
    // No process reads the pipe: writing to it blocks for ever.
    let write = format!("{QUICK} --stats s.json -o pipe.exr");
    let study = "study scene.gltf -o out --photons 1k,2k -k 10 --size 64x64 --spp 1000000";
    let compare = "compare scene.gltf -o out --photons 1k -k 10 --size 64x64 --spp 1000000";
    for (line, stage, signal, code) in [
        (hours, "load", "INT", 130),
        (hours, "bvh", "TERM", 143),
        (hours, "photons", "INT", 130),
        (hours, "grid", "TERM", 143),
        (hours, "camera", "INT", 130),
        (hours, "camera", "TERM", 143),
        (hours, "camera", "HUP", 129),
        (&write, "camera: 100", "TERM", 143),
        (study, "study:", "INT", 130),
        (compare, "compare", "TERM", 143),
    ] {
        assert_eq!(stopped_at(folder.path(), line, stage, signal).0, Some(code), "{line} at {stage}");
        let mut left = names(folder.path());
        left.retain(|name| name != "pipe.exr");
        assert_eq!(left, FILES, "{line} at {stage}");
        assert_eq!(fs::read(folder.path().join("old.exr")).expect("it is there"), b"old");
    }
    // Control: without a signal the run does not end at its first stage.
    let mut child = command(folder.path(), hours).stderr(Stdio::null()).spawn().expect("it starts");
    sleep(Duration::from_millis(300));
    let early = child.try_wait().expect("it can be waited for");
    child.kill().expect("it can be killed");
    child.wait().expect("it ends");
    assert_eq!(early, None, "control: it ended by itself");
}

#[test]
fn sigterm_is_no_failure_of_work_that_can_be_resumed() {
    let folder = folder();
    // It takes a second to load.
    const VERTICES: u32 = 1_500_000;
    let numbers = |i: u32| [i, i.wrapping_mul(0x9e37_79b9), i.wrapping_mul(0x85eb_ca6b)];
    let corner = |i: u32| numbers(i).map(|n| (n >> 8) as f32).map(f32::to_le_bytes);
    let corners: Vec<u8> = (0..VERTICES).flat_map(corner).flatten().collect();
    let counts = [(r#""count": 3"#, format!(r#""count": {VERTICES}"#)), ("36", corners.len().to_string())];
    let scene = counts.iter().fold(SCENE.to_owned(), |scene, (from, to)| scene.replace(from, to));
    fs::write(folder.path().join("corners.json"), corners).expect("can be written");
    fs::write(folder.path().join("scene.gltf"), scene).expect("can be written");
    let before = names(folder.path());
    for (options, code) in [("--passes 9 --checkpoint kept --resume", 0), ("--passes 9", 143)] {
        let line = format!("{QUICK} -o a.exr {options}");
        let (ended, said) = stopped_at(folder.path(), &line, "load", "TERM");
        assert_eq!(ended, Some(code), "{line}: {said}");
        assert!(!said.contains("light unit"), "it ended while the scene was read: {said}");
        assert_eq!(names(folder.path()), before);
    }
}
