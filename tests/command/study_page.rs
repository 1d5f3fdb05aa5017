//! `caustica study` from the command line: messages, files, and the page in a browser.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use super::browser::Browser;

/// Command `caustica study` on the scenes of this project, with these arguments.
fn command(folder: &Path, words: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).arg("study").args(words.split_whitespace()).arg("-o").arg(folder);
    command
}

fn study(folder: &Path, words: &str) -> Output {
    command(folder, words).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const SCENE: &str = "scenes/mirror-and-glass.gltf --size 24x24 --spp 1";

#[test]
fn wrong_lists_are_exit_code_2() {
    let folder = tempfile::tempdir().expect("a folder");
    for (words, said) in [
        ("--photons 1k -k 10", "SCENE"),
        ("a.gltf --photons 1k", "--neighbors"),
        ("a.gltf -k 10", "--photons"),
        ("a.gltf --photons 1k,,2k -k 1", "1.5M"),
        ("a.gltf --photons 1k,0 -k 1", "at least 1"),
        ("a.gltf --photons 1k -k 1,1001", "a whole number from 1 to 1000"),
        ("a.gltf --photons 1k -k 1,x", "a whole number from 1 to 1000"),
        ("a.gltf --photons 1k -k 1 --modes 0,7", "direct-rays"),
        ("a.gltf --photons 1k -k 1 --repeat 0", "a whole number from 1 to 1000"),
        ("a.gltf --photons 1k -k 1 --reference a.png", ".exr"),
        ("a.gltf --photons 1k -k 1 --preset report", "cannot be used with"),
        ("--preset thesis", "report"),
    ] {
        let ended = study(folder.path(), words);
        let message = text(&ended.stderr);
        assert!(ended.status.code() == Some(2) && message.contains(said), "{words}: {message}");
    }
    assert!(fs::read_dir(folder.path()).expect("can be listed").next().is_none());
}

#[test]
fn failures_are_exit_code_1_and_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references/S1_128.exr");
    let mismatch = format!("{SCENE} --photons 1k -k 1 --reference {}", reference.display());
    for (words, said) in [
        ("none.gltf --photons 1k -k 1", "none.gltf"),
        (&format!("{SCENE} --photons 1k -k 1 --reference none.exr"), "none.exr"),
        (&mismatch, "128x128"),
        (&format!("{SCENE} --photons 1k -k 1 --camera 7"), "camera"),
        ("tests --preset report", "mirror-and-glass.gltf"),
    ] {
        let ended = study(folder.path(), &format!("{words} -q"));
        let message = text(&ended.stderr);
        assert_eq!(ended.status.code(), Some(1), "{words}: {message}");
        assert!(message.starts_with("error: ") && message.lines().count() == 1, "{words}: {message}");
        assert!(message.contains(said), "{words}: {message}");
    }
    assert!(fs::read_dir(folder.path()).expect("can be listed").next().is_none());
}

#[test]
fn the_preset_answers_every_claim_and_its_page_sorts() {
    let folder = tempfile::tempdir().expect("a folder");
    let ended = study(folder.path(), "--preset report --preset-scale 0.02 --size 16x16 --spp 1");
    let (said, asked) = (text(&ended.stderr), text(&ended.stdout));
    assert_eq!(ended.status.code(), Some(0), "{said}");
    for part in ["left; cell", "our own finer render", "0 kept from before"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(asked.contains("The total energy is constant") && asked.contains("three times the light"), "{asked}");
    let json = fs::read_to_string(folder.path().join("study.json")).expect("a report");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let figures = json["figures"].as_array().expect("figures");
    let claims: Vec<_> = figures.iter().flat_map(|f| f["claims"].as_array().expect("claims")).collect();
    let questions: std::collections::BTreeSet<_> = claims.iter().filter_map(|c| c["question"].as_str()).collect();
    assert_eq!((figures.len(), questions.len()), (8, 10), "{questions:?}");
    let light = claims.iter().find(|c| c["question"] == "three-lights").expect("asked");
    assert!(light["measured"].as_str().is_some_and(|m| m.contains("times the light in")), "{light}");
    // With so few pixels noise may hide the bias. Every other claim can be decided.
    let unknown = claims.iter().filter(|c| c["verdict"] == "unknown" && c["question"] != "noise-for-bias");
    assert_eq!(unknown.count(), 0, "{claims:?}");

    let Some(browser) = Browser::open(1000, 900) else { return };
    browser.show(&folder.path().join("report.html"));
    let column = |n: u32| {
        let script =
            format!("return [...document.querySelectorAll('#rows tbody td:nth-child({n})')].map(c => c.dataset.value)");
        let values = browser.run(&script);
        let values = values.as_array().expect("a list").iter();
        // Cells without a value are left out.
        values.filter_map(|v| v.as_str()?.parse().ok()).collect::<Vec<f64>>()
    };
    let rises = |values: &[f64]| values.windows(2).all(|w| w[0] <= w[1]);
    const NEIGHBORS: u32 = 4;
    assert!(!rises(&column(NEIGHBORS)), "the control, nobody has sorted yet: {:?}", column(NEIGHBORS));
    let button = format!("#rows th:nth-child({NEIGHBORS}) button");
    browser.click(&button);
    assert!(rises(&column(NEIGHBORS)), "{:?}", column(NEIGHBORS));
    browser.click(&button);
    let falling: Vec<f64> = column(NEIGHBORS).into_iter().rev().collect();
    assert!(rises(&falling) && falling[0] < falling[falling.len() - 1], "{falling:?}");
    let counts = browser.run(
        "return ['.sheet', '.plots svg', '.claim'].map(s => document.querySelectorAll(s).length).concat([...document.images].filter(i => i.naturalWidth == 0).length)",
    );
    assert_eq!(counts, serde_json::json!([8, 4, claims.len(), 0]));
    assert_eq!((browser.complaints(), browser.outside_requests()), (Vec::new(), Vec::new()));
}

#[test]
fn the_page_fits_a_phone() {
    let folder = tempfile::tempdir().expect("a folder");
    let ended = study(folder.path(), &format!("{SCENE} --photons 500,1k -k 1,5 -q"));
    assert_eq!((ended.status.code(), text(&ended.stdout)), (Some(0), String::new()), "{}", text(&ended.stderr));
    let Some(browser) = Browser::open(500, 900) else { return };
    browser.show(&folder.path().join("report.html"));
    assert_eq!(browser.run("return document.documentElement.scrollWidth <= window.innerWidth"), true);
    browser.run("document.body.style.width = '3000px'");
    assert_eq!(browser.run("return document.documentElement.scrollWidth <= window.innerWidth"), false, "the control");
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_finished_cells_and_leaves_no_half_file() {
    use std::{
        io::{BufRead, BufReader},
        process::Stdio,
        time::{Duration, Instant},
    };
    let folder = tempfile::tempdir().expect("a folder");
    // The first cells take milliseconds, the last an hour.
    let words = "scenes/one-light.gltf --size 24x24 --spp 200000 --photons 1k -k 1 --modes direct-rays,photons";
    let line = words.replace("--spp 200000", "--spp 1");
    assert_eq!(study(folder.path(), &format!("{line} -q")).status.code(), Some(0));
    let before: Vec<_> = fs::read_dir(folder.path().join("cells")).expect("cells").collect();
    let mut child = command(folder.path(), words).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut lines = BufReader::new(child.stderr.take().expect("it is piped")).lines();
    assert!(lines.any(|l| l.is_ok_and(|l| l.contains("cell 1 of 2"))), "the study did not begin");
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    let deadline = Instant::now() + Duration::from_secs(30);
    let code = loop {
        match child.try_wait().expect("it can be waited for") {
            Some(status) => break status.code(),
            None if Instant::now() > deadline => {
                child.kill().expect("it can be killed");
                panic!("it goes on after SIGINT");
            }
            None => std::thread::sleep(Duration::from_millis(10)),
        }
    };
    assert_eq!(code, Some(130));
    let after: Vec<_> = fs::read_dir(folder.path().join("cells")).expect("cells").collect();
    assert_eq!(after.len(), before.len());
    assert!(after.iter().all(|e| e.as_ref().is_ok_and(|e| !e.file_name().to_string_lossy().contains(".part"))));
    let again = command(folder.path(), &line).output().expect("the program starts");
    assert!(text(&again.stderr).contains("0 cells rendered, 2 kept from before"), "{}", text(&again.stderr));
}
