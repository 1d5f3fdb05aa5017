//! Dependencies of the library without the command.

use std::process::Command;

/// Crates that only the command and its reports need.
const OF_THE_COMMAND: [&str; 6] = ["clap", "colorous", "embedded-graphics", "indicatif", "plotters", "signal-hook"];

/// Names of all packages that the library links, without those of build scripts and tests.
fn packages(features: &[&str]) -> Vec<String> {
    let tree = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--edges", "normal", "--prefix", "none", "--format", "{p}"])
        .args(features)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let lines = String::from_utf8(tree.stdout).expect("names are text");
    lines.lines().filter_map(|line| line.split(' ').next()).map(str::to_string).collect()
}

#[test]
fn without_default_features_nothing_of_the_command_is_needed() {
    let (library, all) = (packages(&["--no-default-features"]), packages(&[]));
    for name in OF_THE_COMMAND {
        assert!(!library.iter().any(|package| package == name), "{name}");
        assert!(all.iter().any(|package| package == name), "control: {name}");
    }
    assert!(["glam", "gltf", "wgpu"].iter().all(|name| library.iter().any(|package| package == name)));
}
