//! Names in shaders are not mangled: functions, structs and constants of different files need
//! different names.

use std::{collections::BTreeMap, fs, path::Path};

/// Keywords that begin a declaration. Variables with a binding belong to their kernel and are left
/// out.
const DECLARATIONS: [&str; 5] = ["fn ", "struct ", "const ", "override ", "alias "];

/// Names declared at top level. Their declarations start a line.
fn declared(text: &str) -> impl Iterator<Item = &str> {
    let name = |line: &'_ str| DECLARATIONS.iter().find_map(|word| line.strip_prefix(word).map(str::len));
    text.lines().filter_map(move |line| {
        let rest = &line[line.len() - name(line)?..];
        rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()
    })
}

/// Names that several files declare, with the files.
fn duplicates<'a>(files: &[(String, &'a str)]) -> Vec<(&'a str, Vec<String>)> {
    let mut found = BTreeMap::<&str, Vec<String>>::new();
    for (file, text) in files {
        declared(text).for_each(|name| found.entry(name).or_default().push(file.clone()));
    }
    found.into_iter().filter(|(_, files)| files.len() > 1).collect()
}

fn shaders(folder: &Path, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).expect("shaders can be listed") {
        let path = entry.expect("an entry can be read").path();
        if path.is_dir() {
            shaders(&path, found);
        } else {
            found.push((path.display().to_string(), fs::read_to_string(&path).expect("a shader is text")));
        }
    }
}

#[test]
fn top_level_names_are_unique_over_all_shaders() {
    let mut files = Vec::new();
    shaders(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), &mut files);
    let texts: Vec<(String, &str)> = files.iter().map(|(file, text)| (file.clone(), text.as_str())).collect();
    assert!(texts.iter().flat_map(|(_, text)| declared(text)).count() > 200, "few names were found");
    assert_eq!(duplicates(&texts), []);
}

#[test]
fn a_name_that_two_files_declare_is_reported() {
    let files =
        [("a".to_owned(), "const PI: f32 = 3.0;\nfn f() {}"), ("b".to_owned(), "fn f(x: f32) {}\n    fn g() {}")];
    assert_eq!(duplicates(&files), [("f", vec!["a".to_owned(), "b".to_owned()])]);
}
