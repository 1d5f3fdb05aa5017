//! Circles of `use` between the source files, and the order of folders within a layer.
//!
//! An edge leads from a file to the file that defines what one of its paths names: `crate::`,
//! `super::`, `self::` and paths that begin with a child module, groups included. A re-export
//! resolves to the file behind it, so a `mod.rs` that only re-exports is on no circle. Unit tests
//! are left out: they use whatever they test.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use super::layers::{files, is_name, tokens};

/// Module path of a file of `src/`: `study/mod.rs` is `[study]`, `lib.rs` is `[]`.
fn module_of(path: &str) -> Vec<String> {
    let stem = path.trim_end_matches(".rs");
    let stem = stem.strip_suffix("/mod").unwrap_or(stem);
    stem.split('/').filter(|s| *s != "lib").map(str::to_string).collect()
}

/// A path that a file names. `name` is what a `use` calls it afterwards.
struct Named {
    segments: Vec<String>,
    name: Option<String>,
}

/// All paths of a file, without those of its `mod tests`.
fn named_paths(source: &str) -> Vec<Named> {
    let tokens = without_tests(tokens(source));
    let (mut found, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        let begins = is_name(&tokens[at]) && (at == 0 || tokens[at - 1] != "::");
        if tokens[at] == "use" {
            at = use_tree(&tokens, at + 1, &[], &mut found);
        } else if begins && tokens.get(at + 1).is_some_and(|t| t == "::") {
            let mut segments = vec![tokens[at].clone()];
            while tokens.get(at + 1).is_some_and(|t| t == "::") && tokens.get(at + 2).is_some_and(|t| is_name(t)) {
                segments.push(tokens[at + 2].clone());
                at += 2;
            }
            found.push(Named { segments, name: None });
            at += 1;
        } else {
            at += 1;
        }
    }
    found
}

/// Reads one tree of a `use` below `base`, and returns the position after it.
fn use_tree(tokens: &[String], mut at: usize, base: &[String], found: &mut Vec<Named>) -> usize {
    let mut segments = base.to_vec();
    while let Some(token) = tokens.get(at) {
        match token.as_str() {
            "::" => at += 1,
            "{" => {
                at += 1;
                while tokens.get(at).is_some_and(|t| t != "}") {
                    at = use_tree(tokens, at, &segments, found);
                    at += usize::from(tokens.get(at).is_some_and(|t| t == ","));
                }
                return at + 1;
            }
            "as" => {
                found.push(Named { segments, name: tokens.get(at + 1).cloned() });
                return at + 2;
            }
            name if is_name(name) || name == "*" => {
                segments.push(name.to_string());
                at += 1;
            }
            _ => break,
        }
    }
    // `{self, ..}` names the module itself.
    if segments.len() > 1 && segments.last().is_some_and(|s| s == "self") {
        segments.pop();
    }
    let name = segments.last().cloned();
    found.push(Named { segments, name });
    at
}

/// The tokens outside of `mod tests { .. }`.
fn without_tests(tokens: Vec<String>) -> Vec<String> {
    let Some(start) = tokens.windows(3).position(|t| t[0] == "mod" && t[1] == "tests" && t[2] == "{") else {
        return tokens;
    };
    let mut depth = 0;
    let close = tokens[start..].iter().position(|t| {
        depth += i32::from(t == "{") - i32::from(t == "}");
        t == "}" && depth == 0
    });
    let end = close.map_or(tokens.len(), |offset| start + offset + 1);
    [&tokens[..start], &tokens[end..]].concat()
}

/// The files of a crate by their module path, with what each one names.
struct Sources<'a> {
    files: BTreeMap<Vec<String>, (&'a str, Vec<Named>)>,
}

impl<'a> Sources<'a> {
    fn new(sources: &[(&'a str, String)]) -> Self {
        let kept = sources.iter().filter(|(path, _)| !path.ends_with("tests.rs") && *path != "main.rs");
        Self { files: kept.map(|(path, source)| (module_of(path), (*path, named_paths(source)))).collect() }
    }

    /// The file that defines what a path names from within a module; `None` outside of the crate.
    fn defines(&self, module: &[String], segments: &[String], depth: u32) -> Option<&'a str> {
        let mut at = module.to_vec();
        for (i, segment) in segments.iter().enumerate() {
            let child = [at.as_slice(), std::slice::from_ref(segment)].concat();
            match segment.as_str() {
                "crate" => at.clear(),
                "self" => {}
                "super" => drop(at.pop()),
                _ if self.files.contains_key(&child) => at = child,
                // The first name is another crate's, or an item's.
                _ if i == 0 => return None,
                name => {
                    let (path, named) = self.files.get(&at)?;
                    let exported = named.iter().find(|n| n.name.as_deref() == Some(name) && depth < 8);
                    let behind = exported.and_then(|n| self.defines(&at, &n.segments, depth + 1));
                    return behind.or(Some(path));
                }
            }
        }
        self.files.get(&at).map(|(path, _)| *path)
    }

    /// The files that each file uses, itself left out.
    fn uses(&self) -> BTreeMap<&'a str, BTreeSet<&'a str>> {
        let of = |(module, (path, named)): (&Vec<String>, &(&'a str, Vec<Named>))| {
            let targets = named.iter().filter_map(|n| self.defines(module, &n.segments, 0));
            (*path, targets.filter(|target| target != path).collect())
        };
        self.files.iter().map(of).collect()
    }
}

type Uses<'a> = BTreeMap<&'a str, BTreeSet<&'a str>>;

/// Files that lead back to themselves, grouped: each group is one knot of circles.
fn circles<'a>(uses: &Uses<'a>) -> Vec<Vec<&'a str>> {
    let reached = |from: &'a str| {
        let (mut open, mut seen) = (vec![from], BTreeSet::new());
        while let Some(file) = open.pop() {
            open.extend(uses[file].iter().filter(|target| seen.insert(**target)));
        }
        seen
    };
    let reach: BTreeMap<&str, BTreeSet<&str>> = uses.keys().map(|file| (*file, reached(file))).collect();
    let knot = |file: &'a str| -> Vec<&'a str> {
        reach[file].iter().copied().filter(|other| reach[other].contains(file)).collect()
    };
    let knots: BTreeSet<_> = uses.keys().map(|file| knot(file)).filter(|knot| !knot.is_empty()).collect();
    knots.into_iter().collect()
}

#[test]
fn no_circle_of_files() {
    let texts = read_sources();
    let sources: Vec<(&str, String)> = texts.iter().map(|(path, text)| (path.as_str(), text.clone())).collect();
    let uses = Sources::new(&sources).uses();
    assert!(uses.values().map(BTreeSet::len).sum::<usize>() > 300, "paths are resolved");
    let found = circles(&uses);
    let knots: Vec<String> = found.iter().map(|knot| told(knot, &uses)).collect();
    assert!(knots.is_empty(), "{}", knots.join("\n"));
}

/// Circles among example files, one line each.
fn knots(sources: &[(&str, &str)]) -> Vec<String> {
    let sources: Vec<(&str, String)> = sources.iter().map(|(path, text)| (*path, (*text).to_string())).collect();
    let uses = Sources::new(&sources).uses();
    circles(&uses).iter().map(|knot| knot.join(" ")).collect()
}

#[test]
fn circles_are_found() {
    let two = "a/x.rs a/y.rs";
    for (parent, x, y, expected) in [
        ("mod x; mod y;", "use super::y::Y;", "use super::x::X;", &[two][..]),
        ("mod x; mod y;", "use super::y::Y;", "fn f() { super::x::g() }", &[two]),
        ("mod x; mod y;", "use crate::{b::B, a::{y::{self, Y}}};", "use super::x;", &[two]),
        ("mod x; mod y; pub use x::X; pub use y::Y;", "use super::Y;", "use crate::a::X;", &[two]),
        ("mod x; mod y; pub use x::f as g;", "use super::y::Y;", "use super::g;", &[two]),
        // The parent defines what its child uses, and uses the child.
        ("mod x; mod y; use x::X; struct A;", "use super::A;", "", &["a/mod.rs a/x.rs"]),
        ("mod x; mod y; struct A; fn f() { x::g() }", "use super::{A, y::Y};", "", &["a/mod.rs a/x.rs"]),
        // None.
        ("mod x; mod y; pub use x::X; pub use y::Y;", "use super::Y;", "", &[]),
        ("mod x; mod y;", "use super::y::Y;", "#[cfg(test)] mod tests { use super::super::x::X; }", &[]),
        ("mod x; mod y;", "use super::y::Y;", "// use super::x::X;\nuse std::x::X;", &[]),
    ] {
        let found = knots(&[("lib.rs", "mod a;"), ("a/mod.rs", parent), ("a/x.rs", x), ("a/y.rs", y)]);
        assert_eq!(found, expected, "{parent} | {x} | {y}");
    }
}

/// The files and folders of a folder from the lowest to the highest: each uses those before it
/// only. Its `mod.rs` may use all.
const ORDERS: [(&str, &[&str]); 5] = [
    (
        "renderer",
        &[
            "size",
            "ray_start",
            "tally",
            "obstacles",
            "seen",
            "power_classes",
            "maps",
            "unevenness",
            "tiles",
            "film_layers",
            "preview",
            "searches",
            "gatherer",
            "session",
            "light_groups",
            "render",
            "progressive",
        ],
    ),
    ("passes", &["maps", "lists", "wavefront", "photons", "estimate", "camera"]),
    (
        "passes/estimate",
        &[
            "query_order",
            "gather_kernels",
            "gather",
            "share_estimates",
            "cell_table",
            "thin_queries",
            "irradiance_cache",
            "record_walls",
            "irradiance_records",
        ],
    ),
    (
        "study",
        &[
            // Plan.
            "numbers", "question", "plan", "grid", "preset", //
            // Run.
            "cost", "radii", "cells", "job", "picture", "corners", "spread", "measure", "run", //
            // Report.
            "findings", "claims", "chart", "plots", "sheet", "page", "summary", "table", "write",
        ],
    ),
    (
        "scene/gltf",
        &[
            // The file and its bytes.
            "fault",
            "topology",
            "container",
            "extensions",
            "extras",
            "files",
            "memory",
            "strict_json",
            "root", //
            "format",
            "buffers",
            "meshopt",
            "accessor",
            "draco", //
            // Its contents.
            "textures",
            "images",
            "materials",
            "variants",
            "nodes",
            "cameras",
            "lights",
            "spheres",
            "instances",
            "primitives",
            "skins",
            "material_table",
            "tangents",
            "attributes",
            "meshes", //
            // The scene.
            "sharing",
            "mesh_cache",
            "shared_meshes",
            "placing",
            "center",
            "doubled_lamps",
        ],
    ),
];

/// Uses of a later file of the same folder, and files without a rank, one line each.
fn against_order(folder: &str, order: &[&str], uses: &Uses) -> Vec<String> {
    let entry = |file: &str| {
        let below = file.strip_prefix(folder)?.strip_prefix('/')?;
        Some(below.split('/').next()?.trim_end_matches(".rs").to_string()).filter(|name| name != "mod")
    };
    let rank = |name: &str| order.iter().position(|n| *n == name);
    let mut found = Vec::new();
    for (file, targets) in uses {
        let Some(name) = entry(file) else { continue };
        let Some(own) = rank(&name) else {
            found.push(format!("{file}: {name} has no rank within {folder}; give it one here"));
            continue;
        };
        let later = targets.iter().filter(|t| entry(t).and_then(|name| rank(&name)).is_some_and(|r| r > own));
        found.extend(later.map(|target| format!("{file} uses {target}, which comes later")));
    }
    found
}

#[test]
fn files_of_a_folder_use_earlier_ones() {
    let texts = read_sources();
    let sources: Vec<(&str, String)> = texts.iter().map(|(path, text)| (path.as_str(), text.clone())).collect();
    let uses = Sources::new(&sources).uses();
    let found: Vec<String> = ORDERS.iter().flat_map(|(folder, order)| against_order(folder, order, &uses)).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn uses_of_later_files_are_found() {
    let of = |maps: &str, camera: &str| {
        let sources = [
            ("passes/mod.rs", "pub mod maps; pub mod camera;"),
            ("passes/maps/mod.rs", "pub mod sort; pub use sort::Sort;"),
            ("passes/maps/sort.rs", maps),
            ("passes/camera.rs", camera),
        ];
        let sources: Vec<(&str, String)> = sources.iter().map(|(path, text)| (*path, (*text).to_string())).collect();
        against_order("passes", &["maps", "camera"], &Sources::new(&sources).uses())
    };
    assert_eq!(of("use crate::layout::X;", "use super::maps::Sort;"), Vec::<String>::new());
    let wrong = ["passes/maps/sort.rs uses passes/camera.rs, which comes later"];
    assert_eq!(of("use super::super::camera::Camera;", ""), wrong);
    assert_eq!(of("use crate::passes::{self, camera};", ""), wrong);
    let unknown = Sources::new(&[("passes/new.rs", String::new())]).uses();
    assert_eq!(against_order("passes", &["maps"], &unknown).len(), 1);
}

fn told(knot: &[&str], uses: &Uses) -> String {
    let of = |file: &&str| {
        let targets: Vec<&str> = uses[file].iter().copied().filter(|target| knot.contains(target)).collect();
        format!("  {file} uses {}", targets.join(", "))
    };
    format!("circle:\n{}", knot.iter().map(of).collect::<Vec<_>>().join("\n"))
}

/// Path relative to `src/` and text of each file.
fn read_sources() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&root, &root, &mut paths);
    let read = |path: String| {
        let text = fs::read_to_string(root.join(&path)).expect("the file can be read");
        (path, text)
    };
    paths.into_iter().map(read).collect()
}
