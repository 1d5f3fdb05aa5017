//! The README's two commands are those of `.ci/run` and work as written. The tests that
//! `docs/reliability.md` names exist.

const README: &str = include_str!("../../README.md");
const CI: &str = include_str!("../../.ci/run");
const RELIABILITY: &str = include_str!("../../docs/reliability.md");

const TEST_COMMAND: &str =
    "scripts/install-vulkan && scripts/install-chromium && scripts/install-farm-tools && cargo test --release --locked";

/// Lines of the n-th fenced block.
fn block(text: &str, n: usize) -> Vec<&str> {
    let inside = text.split("\n```").nth(2 * n + 1).expect("the README has that many code blocks");
    inside.lines().skip(1).collect()
}

/// The scene and the outputs of a line that renders, if it does.
fn rendered(line: &str) -> Option<(&str, Vec<&str>)> {
    let words: Vec<_> = line.strip_prefix("scripts/install-vulkan && ")?.split_whitespace().collect();
    let at = words.iter().position(|w| *w == "render")?;
    let outputs = words.windows(2).filter(|w| w[0] == "-o").map(|w| w[1]).collect();
    Some((words.get(at + 1)?, outputs))
}

#[test]
fn the_first_line_of_the_first_block_renders_mirror_and_glass() {
    let first = block(README, 0)[0];
    let expected = ("scenes/mirror-and-glass.gltf", vec!["out.exr", "out.png"]);
    assert_eq!(rendered(first), Some(expected), "{first}");
    assert_eq!(rendered("cargo run --release"), None);
}

#[test]
fn ci_runs_the_readme_test_command() {
    let has = |text: &str| text.lines().any(|line| line.trim() == TEST_COMMAND);
    assert!(has(README) && has(CI));
    assert!(!has(&CI.replace("cargo test", "cargo build")));
}

/// Tests that a text names as `file.rs::test`; `…` stands for the previous file.
fn named_tests(text: &str) -> Vec<(&str, &str)> {
    let mut file = "";
    let names = text.split('`').filter_map(|word| {
        let (written, name) = word.split_once("::")?;
        if written != "…" {
            file = written;
        }
        (written == "…" || written.ends_with(".rs")).then_some((file, name))
    });
    names.collect()
}

/// Whether the file has that test, or any test if the name is `tests`, its module.
fn exists((file, name): (&str, &str)) -> bool {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.contains("#[test]") && (name == "tests" || text.contains(&format!("fn {name}(")))
}

#[test]
fn the_tests_of_each_fault_are_there() {
    let named = named_tests(RELIABILITY);
    assert!(named.len() > 80, "{} tests are named", named.len());
    let missing: Vec<_> = named.into_iter().filter(|test| !exists(*test)).collect();
    assert!(missing.is_empty(), "{missing:?}");
    assert!(!exists(("tests/house/readme.rs", "no_such_test")) && !exists(("tests/nothing.rs", "tests")), "control");
}
