//! The layer rule, checked on the source: a file uses its own layer and lower ones.

use std::{fs, path::Path};

/// Layer of a module of the crate's root, by name.
fn layer_of(module: &str) -> Option<u32> {
    Some(match module {
        "density" | "pixel_filter" | "error" | "html" | "settings" | "image" | "layout" | "map_kind" | "memory"
        | "stats" | "progress" => 0,
        // Names of `error` that lib.rs re-exports.
        "Error" | "Result" => 0,
        "scene" | "bvh" => 1,
        "emitters" | "reference" => 2,
        "gpu" => 3,
        "upload" => 4,
        "passes" => 5,
        "renderer" | "compare" | "study" => 6,
        "lib" | "main" | "cli" => 7,
        _ => return None,
    })
}

const FIRST_LAYER_WITH_WGPU: u32 = 3;

/// Violations of the rule by a file, one line each. `path` is relative to `src/`, with `/`.
fn violations(path: &str, source: &str) -> Vec<String> {
    let module: Vec<&str> = path.trim_end_matches(".rs").trim_end_matches("/mod").split('/').collect();
    let Some(own) = layer_of(module[0]) else {
        return vec![format!("{path}: the module {} has no layer; give it one here", module[0])];
    };
    let tokens = tokens(source);
    let mut found = Vec::new();
    for used in used_modules(&tokens, &module) {
        match layer_of(&used) {
            None => found.push(format!("{path}: crate::{used} has no layer; give it one here")),
            Some(layer) if layer > own => found.push(format!("{path}: layer {own} uses {used} of layer {layer}")),
            Some(_) if module[0] == "cli" && used != "cli" => {
                found.push(format!("{path}: the command line uses crate::{used}, not the public library"));
            }
            Some(_) => {}
        }
    }
    if own < FIRST_LAYER_WITH_WGPU && starts_a_path(&tokens, "wgpu") {
        found.push(format!("{path}: layer {own} uses wgpu"));
    }
    let declares_gltf = tokens.windows(2).any(|t| t[0] == "mod" && t[1] == "gltf");
    if !path.starts_with("scene/gltf") && !declares_gltf && starts_a_path(&tokens, "gltf") {
        found.push(format!("{path}: only scene/gltf may use the gltf crate"));
    }
    found
}

/// Whether a path begins with the name of a crate.
fn starts_a_path(tokens: &[String], name: &str) -> bool {
    (0..tokens.len().saturating_sub(1)).any(|i| {
        let inside = i >= 2 && tokens[i - 1] == "::" && is_name(&tokens[i - 2]);
        tokens[i] == name && tokens[i + 1] == "::" && !inside
    })
}

pub(super) fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Modules of the crate's root that `crate::` and `super::` paths lead to.
fn used_modules(tokens: &[String], module: &[&str]) -> Vec<String> {
    let mut used = Vec::new();
    for i in 0..tokens.len().saturating_sub(1) {
        let starts = tokens[i + 1] == "::" && (i == 0 || tokens[i - 1] != "::");
        match tokens[i].as_str() {
            "crate" if starts => follow(tokens, i + 2, &[], &mut used),
            "super" if starts => follow(tokens, i + 2, &module[..module.len() - 1], &mut used),
            _ => {}
        }
    }
    used.sort();
    used.dedup();
    used
}

/// Follows the path, or the tree of paths, at `at` below the module `base`.
fn follow(tokens: &[String], mut at: usize, base: &[&str], used: &mut Vec<String>) {
    let Some(token) = tokens.get(at).map(String::as_str) else { return };
    match (token, base) {
        ("super", _) => follow(tokens, at + 2, &base[..base.len().saturating_sub(1)], used),
        (_, [top, ..]) => used.push((*top).to_string()),
        ("{", []) => {
            // The items of the group: each follows `{` or a `,` at the group's own depth.
            let mut depth = 0;
            while at < tokens.len() {
                match tokens[at].as_str() {
                    "{" => depth += 1,
                    "}" => depth -= 1,
                    _ => {}
                }
                if depth == 0 {
                    return;
                }
                if depth == 1 && matches!(tokens[at].as_str(), "{" | ",") {
                    follow(tokens, at + 1, &[], used);
                }
                at += 1;
            }
        }
        // `use super::*` in a file's own tests.
        (name, []) if is_name(name) => used.push(name.to_string()),
        _ => {}
    }
}

/// Names, `::` and single signs of the code; no comments, no literals.
pub(super) fn tokens(source: &str) -> Vec<String> {
    let chars: Vec<char> = source.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let (mut tokens, mut i) = (Vec::new(), 0);
    while i < chars.len() {
        match (at(i), at(i + 1)) {
            ('/', '/') => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1
                }
            }
            ('/', '*') => {
                i += 2;
                while i < chars.len() && (at(i), at(i + 1)) != ('*', '/') {
                    i += 1
                }
                i += 2;
            }
            ('r', '"' | '#') if raw_string_end(&chars, i).is_some() => i = raw_string_end(&chars, i).unwrap_or(i),
            ('"', _) => {
                i += 1;
                while i < chars.len() && at(i) != '"' {
                    i += if at(i) == '\\' { 2 } else { 1 }
                }
                i += 1;
            }
            ('\'', '\\') => {
                i += 3;
                while i < chars.len() && at(i) != '\'' {
                    i += 1
                }
                i += 1;
            }
            ('\'', _) if at(i + 2) == '\'' => i += 3,
            (':', ':') => {
                tokens.push("::".to_string());
                i += 2;
            }
            (c, _) if c.is_alphanumeric() || c == '_' => {
                let start = i;
                while at(i).is_alphanumeric() || at(i) == '_' {
                    i += 1
                }
                tokens.push(chars[start..i].iter().collect());
            }
            (c, _) => {
                if !c.is_whitespace() {
                    tokens.push(c.to_string());
                }
                i += 1;
            }
        }
    }
    tokens
}

/// End of the raw string that begins at `start`, if there is one.
fn raw_string_end(chars: &[char], start: usize) -> Option<usize> {
    let hashes = chars[start + 1..].iter().take_while(|c| **c == '#').count();
    let open = start + 1 + hashes;
    if chars.get(open) != Some(&'"') {
        return None;
    }
    let closes =
        |i: &usize| chars[*i] == '"' && chars[i + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes;
    (open + 1..chars.len()).find(closes).map(|i| i + 1 + hashes)
}

/// All Rust files below a folder, as paths relative to `root`.
pub(super) fn files(root: &Path, folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("src/ can be listed") {
        let path = entry.expect("src/ can be listed").path();
        if path.is_dir() {
            files(root, &path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let relative = path.strip_prefix(root).expect("below the root");
            found.push(relative.to_string_lossy().replace('\\', "/"));
        }
    }
}

#[test]
fn every_file_uses_its_own_layer_and_lower_ones() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&root, &root, &mut paths);
    assert!(paths.iter().any(|p| p == "lib.rs") && paths.len() > 10, "{paths:?}");
    let found: Vec<_> = paths
        .iter()
        .flat_map(|path| violations(path, &fs::read_to_string(root.join(path)).expect("the file can be read")))
        .collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn bad_sources_are_reported() {
    let bad = [
        ("image/png.rs", "use crate::gpu::Gpu;"),
        ("image/png.rs", "use super::super::gpu;"),
        ("image/mod.rs", "use super::{error::Error, scene::{Scene, Light}};"),
        ("scene/mod.rs", "fn f() { let x = crate::renderer::render; }"),
        ("scene/mod.rs", "use crate::{error::{Error, Result}, passes::gather};"),
        ("bvh.rs", "use wgpu::Buffer;"),
        ("bvh.rs", "fn f(b: &wgpu::Buffer) {}"),
        ("reference/kd_tree.rs", "use crate::gpu::Gpu;"),
        ("scene/mesh.rs", "use gltf::Document;"),
        ("passes/gather.rs", "fn f(d: gltf::Document) {}"),
        ("passes/gather.rs", "use crate::renderer;"),
        ("cli/render.rs", "use crate::renderer::render;"),
        ("cli/render.rs", "use super::super::scene::Scene;"),
        ("strange.rs", ""),
        ("gpu/mod.rs", "use crate::strange::X;"),
    ];
    for (path, source) in bad {
        assert_eq!(violations(path, source).len(), 1, "{path}: {source}: {:?}", violations(path, source));
    }
}

#[test]
fn good_sources_are_not() {
    let good = [
        ("layout.rs", "/// See [`crate::bvh`].\nuse crate::error::{Error, Result};\n/* crate::gpu */ fn f<'a>() {}"),
        ("image/png.rs", "use super::{Frame, write_file}; use image::codecs; const S: &str = \"crate::gpu wgpu::X\";"),
        ("scene/mod.rs", "mod gltf; pub(crate) fn f() { gltf::load('\"', '\\'') } mod tests { use super::*; }"),
        ("scene/gltf/mesh.rs", "use gltf::Mesh; use super::super::Triangle; use crate::scene::Light;"),
        ("passes/gather.rs", "use crate::{gpu::{Gpu, Kernel}, layout::Photon}; use wgpu::CommandEncoder;"),
        ("cli/render.rs", "use super::say::say; use caustica::renderer; const R: &str = r#\"crate::gpu\"#;"),
    ];
    for (path, source) in good {
        assert_eq!(violations(path, source), Vec::<String>::new(), "{path}");
    }
}

/// File and word of each `unsafe` in the code, of each lifted lint against it, and of each shader
/// compiled without its checks.
fn untrusted(path: &str, source: &str) -> Vec<String> {
    let tokens = tokens(source);
    let lifts = |i: usize| {
        let before: Vec<&str> = tokens[i.saturating_sub(2)..i].iter().map(String::as_str).collect();
        tokens[i] == "unsafe_code" && before != ["deny", "("]
    };
    let unchecked =
        |token: &str| matches!(token, "unsafe" | "create_shader_module_trusted" | "create_shader_module_passthrough");
    let found = (0..tokens.len()).filter(|i| unchecked(&tokens[*i]) || lifts(*i));
    found.map(|i| format!("{path}: {}", tokens[i])).collect()
}

#[test]
fn one_place_is_unsafe_and_no_shader_goes_unchecked() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&root, &root, &mut paths);
    let source = |path: &str| fs::read_to_string(root.join(path)).expect("the file can be read");
    let lints = source("../Cargo.toml");
    let lints = lints.split("\n[").find(|table| table.starts_with("lints.rust]")).expect("there are lints");
    assert!(lints.contains("unsafe_code = \"deny\""), "{lints}");
    let found: Vec<String> = paths.iter().flat_map(|path| untrusted(path, &source(path))).collect();
    // The one exception: an environment variable that is set before a second thread starts.
    assert_eq!(found, ["main.rs: unsafe_code", "main.rs: unsafe"]);
    assert!(source("main.rs").contains("// SAFETY: "), "it says why");
}

#[test]
fn unsafe_code_is_found() {
    for (source, count) in [
        ("#![deny(unsafe_code)] // unsafe\nfn f() { let s = \"unsafe\"; }", 0),
        ("#[allow(unsafe_code)] fn f() { unsafe { g() } }", 2),
        ("#[expect(dead_code, unsafe_code)] mod a;", 1),
        ("unsafe impl Send for X {}", 1),
        ("device.create_shader_module_trusted(d, c)", 1),
    ] {
        assert_eq!(untrusted("a.rs", source).len(), count, "{source}");
    }
}

/// Names of the packages of a lock file that do not come from the registry, or have no checksum.
/// The workspace's own packages have neither.
fn strangers(lock: &str) -> Vec<&str> {
    let is_known = |package: &&str| {
        package.contains("\nsource = \"registry+https://github.com/rust-lang/crates.io-index\"\nchecksum = \"")
    };
    let unknown = lock.split("[[package]]\n").skip(1).filter(|package| !is_known(package));
    unknown.map(|package| package.split('"').nth(1).unwrap_or_default()).collect()
}

#[test]
fn dependencies_come_from_the_registry() {
    let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.lock");
    let lock = fs::read_to_string(lock).expect("the lock file can be read");
    assert!(lock.matches("[[package]]").count() > 100);
    assert_eq!(strangers(&lock), ["caustica", "caustica-test-support"]);
    let elsewhere = lock.replacen("registry+https://github.com/rust-lang", "git+https://example.org", 1);
    assert_eq!(strangers(&elsewhere).len(), 3, "control");
}
