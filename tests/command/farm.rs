//! The recipes of `deploy/`, run for real, with renders that are killed.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | manifest | `kubernetes-validate --strict` accepts the manifest | a member of another name |
//! | engines | GNU parallel, Open Job Description and Slurm give the bytes of one run, whatever is killed or requeued meanwhile | fewer passes |
//! | wrong numbers | recipes refuse passes and outputs that cannot be, before any work | |
//! | again | a recipe that is called again renders what is missing, and refuses parts of other options | |

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::LazyLock,
    thread,
    time::{Duration, Instant},
};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const PROGRAM: &str = env!("CARGO_BIN_EXE_caustica");
const OPTIONS: &str = "--size 16x16 --spp 1 --photons 1k -k 20 --every 0s";
const PASSES: u32 = 12;

fn left_out() -> bool {
    std::env::var_os("CAUSTICA_NO_FARM").is_some_and(|value| value == "1")
}

/// A folder with the pictures of one run, and of one of fewer passes.
static ONE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, passes) in [("one.exr", PASSES), ("fewer.exr", PASSES - 1)] {
        let line = format!("render {} {} --passes {passes} -q -o {name}", scene(), OPTIONS.replace("--every 0s", ""));
        let status = Command::new(PROGRAM).current_dir(&folder).args(line.split_whitespace()).status();
        assert!(status.expect("it starts").success());
    }
    folder
});

fn scene() -> String {
    format!("{ROOT}/scenes/mirror-and-glass.gltf")
}

/// A folder whose path a shell would take apart, and in which GNU parallel would replace words.
fn odd_folder() -> tempfile::TempDir {
    tempfile::Builder::new().prefix("it's here; {} {#} {= $_ = 9 =} ").tempdir().expect("a temporary folder")
}

fn assert_same(folder: &Path, name: &str) {
    let read = |path: &Path| fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let made = read(&folder.join(name));
    assert!(made == read(&ONE.path().join("one.exr")), "{name}");
    assert!(made != read(&ONE.path().join("fewer.exr")), "control: fewer passes");
}

/// Waits for something that depends on other processes.
fn waits<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        match found() {
            Some(found) => return found,
            None => assert!(start.elapsed() < Duration::from_secs(100), "{what}"),
        }
        thread::sleep(Duration::from_millis(10));
    }
}

/// A checkpoint in the folder of the parts.
fn kept(parts: &Path) -> Option<PathBuf> {
    let mut entries = fs::read_dir(parts).ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    entries.find(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("kept-")))
}

/// A render whose arguments name the folder, which no other process has.
fn render_of(parts: &Path) -> Option<String> {
    let name = parts.to_str().expect("text");
    fs::read_dir("/proc").ok()?.filter_map(|entry| Some(entry.ok()?.path())).find_map(|path| {
        let line = fs::read_to_string(path.join("cmdline")).ok()?;
        let is_render = line.starts_with(PROGRAM) && line.contains("\0render\0") && line.contains(name);
        is_render.then(|| path.file_name().map(|pid| pid.to_string_lossy().into_owned())).flatten()
    })
}

fn kill_a_render(parts: &Path) {
    waits("a checkpoint", || kept(parts));
    let pid = waits("a render", || render_of(parts));
    Command::new("kill").args(["-KILL", &pid]).status().expect("kill runs");
}

#[test]
fn recipes_refuse_what_cannot_be_rendered() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for recipe in ["parallel/render", "slurm/submit"] {
        for (words, wrong) in [
            ("scene.gltf a.exr 8 0", "PER_TASK '0'"),
            ("scene.gltf a.exr 0 2", "PASSES '0'"),
            ("scene.gltf a.exr many 2", "PASSES 'many'"),
            ("scene.gltf a.exr 8 2.5", "PER_TASK '2.5'"),
            ("scene.gltf a.exr 08 2", "PASSES '08'"),
            ("scene.gltf a.jpg 8 2", "OUT 'a.jpg' ends in neither .exr nor .png"),
        ] {
            let mut run = Command::new(format!("{ROOT}/deploy/{recipe}"));
            let ended = run.current_dir(&folder).args(words.split(' ')).env("CAUSTICA", PROGRAM).output();
            let ended = ended.expect("it starts");
            let said = String::from_utf8_lossy(&ended.stderr).into_owned();
            assert_eq!(ended.status.code(), Some(2), "{recipe} {words}: {said}");
            assert!(said.starts_with(&format!("error: {wrong}")) && said.contains("SCENE OUT.exr"), "{recipe}: {said}");
        }
    }
    assert_eq!(fs::read_dir(&folder).expect("it can be listed").count(), 0);
}

#[test]
fn gnu_parallel_renders_what_one_machine_does() {
    if left_out() {
        return;
    }
    let folder = odd_folder();
    let (out, parts) = (folder.path().join("out.exr"), folder.path().join("out.exr.parts"));
    let scene_here = folder.path().join("mirror-and-glass.gltf");
    fs::copy(scene(), &scene_here).expect("it is copied");
    let recipe = |more: &str| {
        let mut run = Command::new(format!("{ROOT}/deploy/parallel/render"));
        run.arg(&scene_here).arg(&out).args([PASSES.to_string().as_str(), "6"]).args(OPTIONS.split_whitespace());
        run.args(more.split_whitespace()).env("CAUSTICA", PROGRAM).env("JOBS", "2");
        run
    };
    let mut child = recipe("").stderr(Stdio::null()).spawn().expect("it starts");
    kill_a_render(&parts);
    assert!(child.wait().expect("it ends").success(), "scripts/install-farm-tools installs GNU parallel");
    assert_same(folder.path(), "out.exr");
    fs::remove_file(parts.join("part-0000000.exr")).expect("a part");
    fs::remove_file(parts.join("part-0000006.exr")).expect("a part");
    fs::remove_file(&out).expect("a picture");
    // A part of fewer passes is there already, as of a recipe that was to render fewer.
    let mut fewer = Command::new(PROGRAM);
    fewer
        .arg("render")
        .arg(&scene_here)
        .args(OPTIONS.replace("--every 0s", "-q --passes 6..8 --part").split_whitespace());
    assert!(fewer.arg(parts.join("part-0000006.exr")).status().expect("it starts").success());
    assert!(recipe("").status().expect("it starts").success());
    assert_same(folder.path(), "out.exr");
    let refused = recipe("--seed 3").output().expect("it starts");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains("part-0000000.exr: is a part of another run: --seed is 0, not 3"), "{said}");
    assert_same(folder.path(), "out.exr");
}

#[test]
fn open_job_description_renders_what_one_machine_does() {
    if left_out() {
        return;
    }
    let folder = odd_folder();
    let (parts, out) = (folder.path().join("parts"), folder.path().join("out.exr"));
    let scene_here = folder.path().join("mirror-and-glass.gltf");
    fs::copy(scene(), &scene_here).expect("it is copied");
    fs::create_dir(&parts).expect("a folder");
    let program = format!("{ROOT}/target/openjd/bin/openjd");
    let template = format!("{ROOT}/deploy/openjd/template.yaml");
    let check = Command::new(&program).args(["check", &template]).output();
    assert!(check.expect("scripts/install-farm-tools installs openjd").status.success());
    let job = |options: &str| {
        let mut run = Command::new(&program);
        run.args(["run", &template, "--step", "Merge", "--run-dependencies"]);
        for (name, value) in [
            ("Scene", scene_here.display().to_string()),
            ("Parts", parts.display().to_string()),
            ("Out", out.display().to_string()),
            ("LastPass", (PASSES - 1).to_string()),
            ("PassesPerTask", "5".to_string()),
            ("Options", options.to_string()),
            ("Caustica", PROGRAM.to_string()),
        ] {
            run.args(["-p", &format!("{name}={value}")]);
        }
        let output = run.output().expect("it starts");
        (output.status.success(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (is_done, said) = job(OPTIONS);
    assert!(is_done && said.contains("openjd_progress: 100.0"), "{said}");
    assert_same(folder.path(), "out.exr");
    let (is_done, said) = job(&format!("{OPTIONS} --seed '3'"));
    assert!(!is_done && said.contains("is a part of another run: --seed is 0, not 3"), "{said}");
}

#[test]
fn the_kubernetes_manifest_is_valid() {
    if left_out() {
        return;
    }
    let manifest = fs::read_to_string(format!("{ROOT}/deploy/kubernetes/job.yaml")).expect("it is there");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("job.yaml");
    let is_valid = |text: &str| {
        fs::write(&path, text).expect("it can be written");
        let mut run = Command::new(format!("{ROOT}/target/openjd/bin/kubernetes-validate"));
        let output = run.arg("--strict").arg(&path).output();
        output.expect("scripts/install-farm-tools installs kubernetes-validate").status.success()
    };
    assert!(is_valid(&manifest));
    let wrong = manifest.replace("backoffLimitPerIndex", "backoffLimitPerTask");
    assert!(wrong != manifest && !is_valid(&wrong), "control");
}

#[test]
fn slurm_renders_what_one_machine_does() {
    if left_out() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out.exr");
    let parts = folder.path().join("out.exr.parts");
    // Requeues the second task once it has a checkpoint, and waits for the picture. Then parts of
    // other options are refused, and nothing is merged.
    let script = format!(
        "set -eu; submit() {{ '{ROOT}/deploy/slurm/submit' '{scene}' '{out}' {PASSES} 6 {OPTIONS} \"$@\"; }}
         submit
         until [ -e '{parts}/kept-0000006.exr' ]; do sleep 0.02; done
         scontrol requeue 1_1 || true
         until [ -e '{out}' ]; do sleep 0.2; done
         submit --seed 3
         until grep -q 'is a part of another run: --seed is 0, not 3' '{parts}/log-1'; do sleep 0.2; done
         until [ -z \"$(squeue -h)\" ]; do sleep 0.2; done",
        scene = scene(),
        out = out.display(),
        parts = parts.display()
    );
    let mut run = Command::new("timeout");
    run.arg("100").arg(format!("{ROOT}/deploy/slurm/localhost")).arg(folder.path().join("slurm"));
    let run = run.args(["bash", "-c", &script]).env("CAUSTICA", PROGRAM).env("SBATCH_OPTIONS", "--cpus-per-task=1");
    let mut child = run.stdout(Stdio::null()).spawn().expect("it starts");
    kill_a_render(&parts);
    assert!(child.wait().expect("it ends").success(), "scripts/install-farm-tools installs Slurm");
    assert_same(folder.path(), "out.exr");
}
