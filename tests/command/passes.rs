//! Pictures of several passes: parts, merging, checkpoints and signals.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | splits | parts of passes and of pixels merge to the bytes of one run, and the first pass is the single picture | fewer passes |
//! | refusals | gaps, overlaps, other settings and other scenes are refused by name, in one line | the same with what is right |
//! | ends | a run speaks of the passes, the time or the error that it is to end by, and says whether it reached the error | |
//! | lost flux | is that of one pass, however many there are | rays are counted |
//! | checkpoints | a run that goes on has the bytes of one that never stopped; other runs are refused | |
//! | parts | a part that is there is gone on with, stays if nothing is left to do, or is refused by name | without `--resume` |
//! | lost outputs | an output or a checkpoint that cannot be written costs no other one, and each is named | |
//! | killed | after SIGKILL and SIGTERM, nothing is lost but the running pass | SIGTERM without a checkpoint |

use std::{
    fs,
    io::{BufRead as _, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use caustica::image::{difference::rel_mse, read_exr, read_exr_attributes};
use serde_json::Value;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/mirror-and-glass.gltf");
const OTHER_SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/area-light.gltf");

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    command.current_dir(folder).args(line.split_whitespace()).env_remove("CAUSTICA_DEVICE");
    command
}

/// Arguments of a small render.
fn small(words: &str) -> String {
    format!("render {SCENE} --size 16x16 --spp 1 --photons 1k -k 20 -q {words}")
}

fn succeeds(folder: &Path, line: &str) -> String {
    let output = command(folder, line).output().expect("it starts");
    let text = |bytes| String::from_utf8(bytes).expect("messages are text");
    assert!(output.status.success(), "{line}: {}", text(output.stderr));
    text(output.stdout)
}

/// The one line of a failure.
fn fails(folder: &Path, line: &str) -> String {
    let output = command(folder, line).output().expect("it starts");
    let said = String::from_utf8(output.stderr).expect("messages are text");
    assert_eq!(output.status.code(), Some(1), "{line}: {said}");
    assert!(said.starts_with("error: ") && said.lines().count() == 1, "{line}: {said}");
    said
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn splits_over_passes_and_pixels_give_the_bytes_of_one_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeeds(folder, &small("--passes 5 -o one.exr -o one.png"));
    succeeds(folder, &small("--passes 2 --part a.exr -o two.exr"));
    succeeds(folder, &small("--passes 2..5 --part b.exr"));
    succeeds(folder, "merge b.exr a.exr -o merged.exr -o merged.png -q");
    assert!(bytes(folder, "merged.exr") == bytes(folder, "one.exr"), "passes");
    assert!(bytes(folder, "merged.png") == bytes(folder, "one.png"), "PNG");
    assert!(bytes(folder, "two.exr") != bytes(folder, "one.exr"), "control: two passes");
    succeeds(folder, &small("--passes 5 --crop 0,0,5,16 --part left.exr"));
    succeeds(folder, &small("--passes 5 --crop 5,0,11,16 --part right.exr"));
    succeeds(folder, "merge left.exr right.exr -o crops.exr -q");
    assert!(bytes(folder, "crops.exr") == bytes(folder, "one.exr"), "pixels");
    assert!(succeeds(folder, "status left.exr").contains("\naround this crop: no part has --crop 5,0,11,16\n"));
    assert!(!succeeds(folder, "status left.exr right.exr").contains("around"), "control");
    let attributes = read_exr_attributes(&folder.join("one.exr")).expect("it reads");
    assert_eq!((attributes["passes"].as_str(), attributes["alpha"].starts_with("0.66")), ("0..5", true));
    // Two samples a pixel: a single one of a single picture lies at the pixel's centre.
    succeeds(folder, &small("-o single.exr").replace("--spp 1", "--spp 2"));
    succeeds(folder, &small("--passes 1 -o first.exr").replace("--spp 1", "--spp 2"));
    let read = |name: &str| read_exr(&folder.join(name)).expect("it reads");
    assert_eq!(read("first.exr"), read("single.exr"), "the first pass is the single picture");
    assert!(rel_mse(read("two.exr").radiance(), read("single.exr").radiance(), None) > 0.0, "control");
    let status: Value = serde_json::from_str(&succeeds(folder, "status b.exr --passes 7 --json")).expect("JSON");
    assert_eq!(status["missing"], serde_json::json!(["--passes 0..2", "--passes 5..7"]));
    assert_eq!((&status["complete"], &status["windows"][0]["passes"][0]), (&Value::from(false), &Value::from("2..5")));
    // Parts that must not be merged.
    let gap = fails(folder, "merge b.exr -o x.exr");
    assert!(gap.contains("parts are missing: --passes 0..2;") && gap.contains("--allow-gaps"), "{gap}");
    succeeds(folder, "merge b.exr -o x.exr -q --allow-gaps");
    succeeds(folder, "merge b.exr -o x.exr -q --passes 2..5");
    let twice = fails(folder, "merge a.exr a.exr b.exr -o y.exr");
    assert!(twice.contains("the passes 0..2 are in a.exr and a.exr"), "{twice}");
    succeeds(folder, &small("--passes 5..6 --part spp.exr --seed 3 --alpha 0.5").replace("--spp 1", "--spp 2"));
    let other = fails(folder, "merge a.exr b.exr spp.exr -o y.exr");
    for part in ["spp.exr: is a part of another picture than a.exr", "--alpha is 0.5, not 0.66", "--seed is 3, not 0"] {
        assert!(other.contains(part), "{other}");
    }
    succeeds(folder, &small("--passes 5..6 --part scene.exr").replace(SCENE, OTHER_SCENE));
    let other = fails(folder, "merge a.exr b.exr scene.exr -o y.exr");
    assert!(other.contains("sceneHash is ") && other.contains(" (area-light.gltf), not "), "{other}");
    let none = fails(folder, "merge one.exr -o y.exr");
    assert!(none.contains("one.exr: is no part of a picture: render --part or --checkpoint did not"), "{none}");
    assert!(fails(folder, "merge a.exr b.exr -o a.exr").contains("is a part as well"));
    let whole = bytes(folder, "b.exr");
    fs::write(folder.join("cut.exr"), &whole[..whole.len() - 1]).expect("it is written");
    for line in ["status a.exr cut.exr", "status a.exr cut.exr --json", "merge a.exr cut.exr -o y.exr"] {
        assert!(fails(folder, line).contains("cut.exr: is a broken part: the end of the file is missing"), "{line}");
    }
    let more = fails(folder, "merge a.exr b.exr --passes 0..3 -o y.exr");
    assert!(more.contains("parts have the passes 0..5, and 0..3 are asked for"), "{more}");
    let of_three = |words: &str| succeeds(folder, &format!("status a.exr b.exr --passes 0..3 {words}"));
    let status: Value = serde_json::from_str(&of_three("--json")).expect("JSON");
    assert_eq!((&status["complete"], &status["surplus"]), (&Value::from(false), &serde_json::json!(["0..5"])));
    assert!(of_three("").contains("\nmore than asked for: passes 0..5\n"), "{}", of_three(""));
    let status: Value = serde_json::from_str(&succeeds(folder, "status a.exr b.exr --passes 5 --json")).expect("JSON");
    assert_eq!((&status["complete"], &status["surplus"]), (&Value::from(true), &serde_json::json!([])));
    assert!(succeeds(folder, "status a.exr").contains(": passes 0..2 in 1 part\n"));
    assert!(!folder.join("y.exr").exists());
}

#[test]
fn a_run_says_what_ends_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let said = |words: &str| {
        let output = command(folder, &small(&format!("-o a.exr {words}")).replace(" -q", "")).output();
        let output = output.expect("it starts");
        let said = String::from_utf8(output.stderr).expect("messages are text");
        assert!(output.status.success(), "{words}: {said}");
        said
    };
    let states =
        |said: &str| said.lines().filter(|line| line.starts_with("passes: ")).map(str::to_owned).collect::<Vec<_>>();
    let timed = said("--time 2s");
    let lines = states(&timed);
    assert!(lines.iter().all(|line| !line.contains(" of ")), "nobody asked for a number: {timed}");
    assert!(lines.last().is_some_and(|line| !line.contains("left")), "it ends here: {timed}");
    assert!(!timed.contains("--target-error"), "control");
    let reached = said("--target-error 0.9");
    let lines = states(&reached);
    assert!(lines.iter().all(|line| !line.contains(" of ") && !line.contains("left")), "{reached}");
    assert!(lines.last().is_some_and(|line| line.contains(" %, 90.00 % wanted (noise ")), "{reached}");
    assert!(reached.contains("\n--target-error 0.9 is reached after 4 passes: "), "{reached}");
    let missed = said("--target-error 0.0001 --passes 5");
    assert!(missed.contains("\nwarning: --target-error 0.0001 is not reached after 5 passes: "), "{missed}");
    assert!(states(&missed)[0].starts_with("passes: 1 of 5"), "{missed}");
}

#[test]
fn lost_flux_is_the_mean_over_passes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let lost = |words: &str| {
        succeeds(folder, &small(&format!("--max-bounces 1 --stats s.json -o a.exr {words}")));
        let stats: Value = serde_json::from_slice(&bytes(folder, "s.json")).expect("JSON");
        (stats["photons"]["lost_to_bounce_limit"].as_f64().expect("a number"), stats["rays"].as_u64().expect("rays"))
    };
    let ((one, rays), (four, more_rays)) = (lost("--passes 1"), lost("--passes 4"));
    assert!(one > 0.1 && (four / one - 1.0).abs() < 0.25, "{one}, {four}");
    assert!(more_rays > 3 * rays, "rays are counted");
}

#[test]
fn a_run_that_goes_on_has_the_bytes_of_one_that_never_stopped() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeeds(folder, &small("--passes 3 -o one.exr"));
    succeeds(folder, &small("--passes 1 --checkpoint kept --resume -o more.exr"));
    assert!(fails(folder, &small("--passes 3 --checkpoint kept -o more.exr")).contains("--resume goes on with it"));
    let other = fails(folder, &small("--passes 3 --checkpoint kept --resume -o more.exr --light-samples 2"));
    assert!(other.contains("checkpoint of another run: --light-samples is 4, not 2"), "{other}");
    assert!(
        fails(folder, &small("--passes 1..3 --checkpoint kept --resume -o more.exr")).contains("1..3 are asked for")
    );
    succeeds(folder, &small("--passes 3 --checkpoint kept --resume -o more.exr"));
    assert!(bytes(folder, "more.exr") == bytes(folder, "one.exr"));
    succeeds(folder, &small("--passes 3 --checkpoint kept --resume -o again.exr"));
    assert!(bytes(folder, "again.exr") == bytes(folder, "one.exr"), "nothing was left to do");
    fs::write(folder.join("kept"), &bytes(folder, "kept")[..2000]).expect("it can be written");
    let cut = fails(folder, &small("--passes 3 --checkpoint kept --resume -o again.exr"));
    assert!(cut.contains("kept: is ") && cut.ends_with("; without the file, it is begun anew\n"), "{cut}");
    fs::write(folder.join("kept"), "text").expect("it can be written");
    let text = fails(folder, &small("--passes 3 --checkpoint kept --resume -o again.exr"));
    assert!(text.contains("kept: is no part of a picture: "), "{text}");
}

#[test]
fn a_run_goes_on_with_a_part_that_is_there() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let part = |words: &str| small(&format!("--part p.exr --checkpoint kept {words}"));
    succeeds(folder, &small("--passes 3 --part one.exr"));
    succeeds(folder, &part("--passes 2 --resume"));
    let written = || fs::metadata(folder.join("p.exr")).and_then(|found| found.modified()).expect("it is there");
    let (two, first_written) = (bytes(folder, "p.exr"), written());
    let begin_anew = || fs::remove_file(folder.join("kept")).expect("it is there");
    begin_anew();
    succeeds(folder, &part("--passes 2 --resume"));
    assert!(bytes(folder, "p.exr") == two && written() == first_written, "nothing was left to do");
    for (words, said) in [
        ("--passes 2 --seed 3", "p.exr: is a part of another run: --seed is 0, not 3"),
        ("--passes 2 --crop 0,0,4,4", "--size or --crop differs"),
        ("--passes 1", "it has the passes 0..2, and 0..1 are asked for; without the file, it is begun anew"),
    ] {
        begin_anew();
        let problem = fails(folder, &part(&format!("{words} --resume")));
        assert!(problem.contains(said), "{problem}");
        fs::write(folder.join("kept"), &two).expect("it is written");
    }
    begin_anew();
    succeeds(folder, &small("--part alone.exr --passes 2"));
    succeeds(folder, &small("--part alone.exr --passes 3 --resume"));
    assert!(bytes(folder, "alone.exr") == bytes(folder, "one.exr"), "without a checkpoint");
    succeeds(folder, &part("--passes 3 --resume"));
    assert!(bytes(folder, "p.exr") == bytes(folder, "one.exr"));
    begin_anew();
    succeeds(folder, &part("--passes 2 --seed 3"));
    assert!(bytes(folder, "p.exr") != two, "control: without --resume it is written anew");
}

#[test]
fn a_region_lies_in_the_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let render = |words: &str| fails(folder.path(), &small(&format!("--passes 1 -o a.exr {words}")));
    for region in ["16,0,1,1", "0,0,17,1", "4294967295,0,4294967295,1"] {
        let said = render(&format!("--region {region}"));
        let expected = format!("error: --region {region}: must have pixels, all of them in the picture of 16x16\n");
        assert_eq!(said, expected);
    }
    let said = render("--region 0,0,4,4 --crop 4,0,4,4");
    assert_eq!(said, "error: --region 0,0,4,4: has no pixel of --crop\n");
    succeeds(folder.path(), &small("--passes 1 -o a.exr --region 0,0,16,16"));
}

/// A command whose files may have no more than a kilobyte: enough for a small PNG.
#[cfg(target_os = "linux")]
fn with_small_files(folder: &Path, line: &str) -> String {
    let mut shell = Command::new("bash");
    shell.args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$@\"", "bash", env!("CARGO_BIN_EXE_caustica")]);
    let output = shell.current_dir(folder).args(line.split_whitespace()).output().expect("it starts");
    let said = String::from_utf8(output.stderr).expect("messages are text");
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(!said.contains(".caustica-"), "the temporary name says nothing: {said}");
    said
}

#[cfg(target_os = "linux")]
#[test]
fn outputs_that_cannot_be_written_cost_no_other_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let too_large = "File too large (os error 27)";
    let outputs = "-o a.exr -o a.png --stats s.json";
    let said = with_small_files(folder, &small(&format!("--passes 2 --part p.exr --checkpoint kept {outputs}")));
    assert_eq!(
        said,
        format!("error: kept: {too_large}; p.exr: {too_large}; a.exr: {too_large}; s.json: {too_large}\n")
    );
    assert!(folder.join("a.png").exists());
    fs::remove_file(folder.join("a.png")).expect("it is there");
    // During a run, failures are warnings.
    let line = small("--passes 2 --checkpoint kept --every 0s -o a.png").replace(" -q", "");
    let said = with_small_files(folder, &line);
    assert!(said.contains(&format!("\nwarning: no checkpoint now: kept: {too_large}\n")), "{said}");
    assert!(said.contains("\nwrote a.png\n") && !said.contains("no picture now"), "{said}");
    fs::remove_file(folder.join("a.png")).expect("it is there");
    with_small_files(folder, &small("-o a.exr -o a.png"));
    assert!(folder.join("a.png").exists(), "without passes");
    fs::remove_file(folder.join("a.png")).expect("it is there");
    succeeds(folder, &small("--passes 1 --part p.exr"));
    let said = with_small_files(folder, "merge p.exr -o a.exr -o a.png");
    assert!(said.contains("\nmerge: 1 of 1 part\n") && said.contains("\nmerged 1 part in "), "{said}");
    assert!(folder.join("a.png").exists(), "merged");
    let left = fs::read_dir(folder).expect("it can be listed").count();
    assert_eq!(left, 2, "nothing else than part and PNG");
}

/// Starts a run without an end and waits for the file of that name.
fn started(folder: &Path, words: &str, file: &str) -> Child {
    let mut child = command(folder, &small(words)).stderr(Stdio::piped()).spawn().expect("it starts");
    let start = Instant::now();
    while !folder.join(file).exists() {
        assert!(start.elapsed() < Duration::from_secs(100) && child.try_wait().expect("it runs").is_none(), "{file}");
        thread::sleep(Duration::from_millis(10));
    }
    child
}

#[cfg(unix)]
#[test]
fn killed_runs_lose_nothing_but_the_running_pass() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let endless = "--passes 100000 --checkpoint kept --every 0s --resume -o picture.exr";
    let mut child = started(folder, endless, "picture.exr");
    child.kill().expect("it runs");
    child.wait().expect("it ended");
    let end = || {
        let status: Value = serde_json::from_str(&succeeds(folder, "status kept --json")).expect("JSON");
        let passes = status["windows"][0]["passes"][0].as_str().expect("passes").to_owned();
        passes.strip_prefix("0..").expect("from the first").parse::<u32>().expect("a number")
    };
    let killed_at = end();
    fs::remove_file(folder.join("picture.exr")).expect("a whole file");
    let mut child = started(folder, endless, "picture.exr");
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill runs");
    assert_eq!(child.wait().expect("it ended").code(), Some(0), "with a checkpoint, SIGTERM is no failure");
    let stopped_at = end();
    assert!(killed_at >= 1 && stopped_at >= killed_at, "{killed_at}, {stopped_at}");
    let all = stopped_at + 1;
    succeeds(folder, &small(&format!("--passes {all} --checkpoint kept --resume -o more.exr")));
    succeeds(folder, &small(&format!("--passes {all} -o one.exr")));
    assert!(bytes(folder, "more.exr") == bytes(folder, "one.exr"));
    assert!(bytes(folder, "picture.exr") != bytes(folder, "one.exr"), "control: fewer passes");
    // Without a checkpoint.
    let line = small("--passes 100000 -o none.exr").replace(" -q", "");
    let mut child = command(folder, &line).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut said = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    assert!(said.any(|line| line.expect("text").starts_with("passes: 1 of")), "it renders");
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill runs");
    assert_eq!(child.wait().expect("it ended").code(), Some(143));
    assert!(!folder.join("none.exr").exists());
}
