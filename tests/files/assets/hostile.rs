//! Small files with one fault each. `tests/hostile/messages.txt` holds the exact error messages.

use std::{collections::BTreeMap, fs, path::Path};

use caustica::scene::Scene;

use super::{memory::peak, render_with_command};

/// Entry of the table for a file that loads.
const LOADS: &str = "loads";

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile")
}

/// Current entry of the file in the table, without the file's name.
fn now(path: &Path) -> String {
    let (most, scene) = peak(|| {
        let mut scene = Scene::load(path)?;
        scene.add_default_light();
        scene.check_renderable()
    });
    assert!(most < 20 << 20, "{}: {most} bytes at once", path.display());
    let said = scene.map_or_else(|error| error.to_string(), |_| LOADS.to_owned());
    assert!(!said.contains('\n'), "{said}");
    said.replace(&format!("{}: ", path.display()), "")
}

#[test]
fn each_fault_is_refused_in_its_words() {
    let table = fs::read_to_string(folder().join("messages.txt")).expect("the table is there");
    let mut table: BTreeMap<&str, &str> = table.lines().filter_map(|line| line.split_once(": ")).collect();
    let mut wrong = Vec::new();
    for entry in fs::read_dir(folder()).expect("can be listed") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if !name.ends_with(".gltf") && !name.ends_with(".glb") {
            continue;
        }
        let said = now(&path);
        if table.remove(name.as_str()) != Some(&said) {
            wrong.push(format!("{name}: {said}"));
        }
    }
    wrong.sort();
    assert!(wrong.is_empty(), "not as in the table:\n{}", wrong.join("\n"));
    assert!(table.is_empty(), "lines without a file: {table:?}");
}

#[test]
fn the_command_says_the_same_and_leaves_nothing() {
    for name in ["index_oob.gltf", "node_cycle.gltf", "truncated_chunk_data.glb", "handmade__huge_count.gltf"] {
        let path = folder().join(name);
        let said = render_with_command(&path).refusal(&path).unwrap_or_else(|what| panic!("{name}: {what}"));
        assert_eq!(said, format!("FILE: {}", now(&path)));
    }
}
