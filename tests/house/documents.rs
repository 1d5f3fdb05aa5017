//! Links and paths of the documents lead to files of the repository. Tables name all kernels and
//! pages.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Folders: a word in backquotes that begins with one of them is a path from the root.
const FOLDERS: [&str; 9] = ["src", "deploy", "shaders", "tests", "docs", "scripts", "scenes", "examples", "benches"];

/// Targets of links that are not URLs, without their anchors.
fn links(text: &str) -> impl Iterator<Item = &str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.map(|target| target.split('#').next().unwrap_or_default()).filter(|t| !t.is_empty() && !t.contains("://"))
}

/// Words in backquotes that are paths from the root, without patterns and placeholders (`NAME`).
fn paths(text: &str) -> impl Iterator<Item = &str> {
    let words = text.split('`').skip(1).step_by(2).map(|word| word.split("::").next().unwrap_or_default());
    words.filter(|word| {
        let in_folder = word.split_once('/').is_some_and(|(first, _)| FOLDERS.contains(&first));
        in_folder && !word.contains(['*', ' ', '|', '…', '{']) && !word.contains("NAME")
    })
}

/// Broken links and paths of a document. Links are relative to its folder.
fn dead(root: &Path, document: &Path, text: &str) -> Vec<String> {
    let folder = document.parent().unwrap_or(root);
    // Fenced blocks have three backquotes and are left out.
    let prose: String = text.split("```").step_by(2).collect();
    let missing = |base: &Path, names: Vec<&str>| -> Vec<String> {
        names.into_iter().filter(|name| !base.join(name).exists()).map(str::to_owned).collect()
    };
    [missing(folder, links(&prose).collect()), missing(root, paths(&prose).collect())].concat()
}

#[test]
fn links_and_paths_lead_to_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed =
        fs::read_dir(root.join("docs")).expect("docs/ can be listed").map(|entry| entry.expect("an entry").path());
    let top = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "scenes/README.md"].map(|name| root.join(name));
    let documents: Vec<PathBuf> = listed.filter(|p| p.extension().is_some_and(|e| e == "md")).chain(top).collect();
    let mut named = 0;
    let found: Vec<String> = documents
        .iter()
        .flat_map(|document| {
            let text = fs::read_to_string(document).expect("the document can be read");
            named += links(&text).count() + paths(&text).count();
            let name = document.strip_prefix(root).expect("below the root").display().to_string();
            dead(root, document, &text).into_iter().map(move |word| format!("{name}: {word}"))
        })
        .collect();
    assert!(named > 100, "{named} links and paths");
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn dead_links_and_paths_are_found() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = "[a](search.md#states) [b](nothing.md) [c](https://example.org/x) `src/lib.rs` `src/nothing.rs::f` `src/*.rs`\n\
                ```\n`src/in/a/block.rs`\n```\n";
    assert_eq!(dead(root, &root.join("docs/a.md"), text), ["nothing.md", "src/nothing.rs"]);
}

/// Names of the files of a folder with that extension, without it.
fn stems(folder: &Path, extension: &str) -> Vec<String> {
    let paths = fs::read_dir(folder).expect("the folder can be listed").map(|entry| entry.expect("an entry").path());
    let found = paths.filter(|path| path.extension().is_some_and(|e| e == extension));
    found.map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned()).collect()
}

/// Kernels that no table of the text names, and pages that it has no link to.
fn unlisted(kernels: &[String], pages: &[String], text: &str) -> Vec<String> {
    let rows: String = text.lines().filter(|line| line.starts_with("| `")).collect();
    let kernels = kernels.iter().filter(|kernel| !rows.contains(&format!("`{kernel}`")));
    let pages = pages.iter().filter(|page| !text.contains(&format!("]({page}.md)")));
    kernels.chain(pages).cloned().collect()
}

#[test]
fn internals_has_all_kernels_and_pages() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(root.join("docs/internals.md")).expect("the document can be read");
    let (kernels, mut pages) = (stems(&root.join("shaders"), "wesl"), stems(&root.join("docs"), "md"));
    pages.retain(|page| page != "internals");
    assert!(kernels.len() > 30 && pages.len() > 10, "{kernels:?} {pages:?}");
    assert_eq!(unlisted(&kernels, &pages, &text), [""; 0]);
    let without = text.replace("`light_lobes`, ", "").replace("](glass.md)", "](gloss.md)");
    assert_eq!(unlisted(&kernels, &pages, &without), ["light_lobes", "glass"], "control");
}
