//! Composes the WGSL kernels from `shaders/*.wesl` (WESL imports), validates each with naga, and
//! writes the shader table that `src/gpu/shaders.rs` includes: WGSL, overrides and bindings by
//! name. The probes in `shaders/probes`, kernels of tests and benchmarks only, become a second
//! table, which the library does not include.

use std::{env, fmt::Write, fs, path::Path};

use naga::valid::{Capabilities, ValidationFlags, Validator};

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build.rs");
    write_table("shaders", "shader_table.rs");
    write_table("shaders/probes", "probe_table.rs");
}

/// Writes the table of all kernels in a folder.
fn write_table(folder: &str, file: &str) {
    let mut stems: Vec<String> = fs::read_dir(folder)
        .expect("shaders/ lies beside build.rs")
        .map(|entry| entry.expect("shaders/ can be listed").path())
        .filter(|path| path.extension().is_some_and(|e| e == "wesl"))
        .map(|path| path.file_stem().expect("a file has a stem").to_string_lossy().into_owned())
        .collect();
    stems.sort();
    let mut table = String::from("[\n");
    for stem in &stems {
        table += &shader_entry(stem, &compose(folder, stem));
    }
    table += "]\n";
    let out = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    fs::write(Path::new(&out).join(file), table).expect("OUT_DIR can be written");
}

/// Composes a kernel with all its imports; names are not mangled.
fn compose(folder: &str, stem: &str) -> String {
    let mut compiler = wesl::Wesl::new("shaders");
    compiler.set_mangler(wesl::ManglerKind::None).use_sourcemap(true);
    let module = folder.replacen("shaders", "package", 1).replace('/', "::");
    let root = format!("{module}::{stem}").parse().expect("a file stem is a module name");
    match compiler.compile(&root) {
        Ok(composed) => composed.to_string(),
        Err(error) => fail(&format!("{folder}/{stem}.wesl: {error}")),
    }
}

/// Formats one entry of the shader table. Stops the build if naga finds the kernel invalid.
fn shader_entry(stem: &str, wgsl: &str) -> String {
    let module = naga::front::wgsl::parse_str(wgsl)
        .unwrap_or_else(|e| fail_at(stem, wgsl, e.location(wgsl), &e.emit_to_string(wgsl)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .unwrap_or_else(|e| fail_at(stem, wgsl, e.location(wgsl), &e.emit_to_string(wgsl)));
    let [entry] = module.entry_points.as_slice() else {
        fail(&format!("shaders/{stem}.wesl: a kernel file has exactly one entry point"));
    };
    assert_eq!(entry.name, stem, "shaders/{stem}.wesl: the entry point carries the file's stem");
    let mut bindings = String::new();
    for (handle, var) in module.global_variables.iter() {
        let Some(binding) = var.binding else { continue };
        if info.get_entry_point(0)[handle].is_empty() {
            continue;
        }
        let kind = match var.space {
            naga::AddressSpace::Uniform => "Uniform",
            naga::AddressSpace::Handle => {
                let layered = matches!(module.types[var.ty].inner, naga::TypeInner::Image { arrayed: true, .. });
                let words = if reads_one_word(&module, handle) { 1 } else { 4 };
                &format!("Table {{ layered: {layered}, words: {words} }}")
            }
            naga::AddressSpace::Storage { access } if access.contains(naga::StorageAccess::STORE) => "ReadWrite",
            _ => "ReadOnly",
        };
        let name = var.name.as_deref().expect("a binding has a name");
        let (group, index) = (binding.group, binding.binding);
        writeln!(
            bindings,
            "        Binding {{ group: {group}, index: {index}, name: {name:?}, kind: BindingKind::{kind} }},"
        )
        .expect("a String can be written");
    }
    let workgroup_size: u32 = entry.workgroup_size.iter().product();
    let overrides: Vec<_> = module.overrides.iter().filter_map(|(_, o)| o.name.as_deref()).collect();
    format!(
        "    Shader {{ stem: {stem:?}, wgsl: {wgsl:?}, overrides: &{overrides:?}, bindings: &[\n{bindings}    ], \
         workgroup_size: {workgroup_size} }},\n"
    )
}

/// Whether all that a kernel reads of the texels of a table is the first word.
fn reads_one_word(module: &naga::Module, table: naga::Handle<naga::GlobalVariable>) -> bool {
    use naga::Expression as E;
    let functions = module.functions.iter().map(|(_, f)| f).chain(module.entry_points.iter().map(|e| &e.function));
    functions.map(|f| &f.expressions).all(|all| {
        let is_table = |image| matches!(all[image], E::GlobalVariable(of) if of == table);
        let mut loads = all.iter().filter(|(_, e)| matches!(e, E::ImageLoad { image, .. } if is_table(*image)));
        loads.all(|(load, _)| {
            let words =
                |e: &E| matches!(e, E::AccessIndex { base: of, .. } | E::Swizzle { vector: of, .. } if *of == load);
            let mut used = all.iter().map(|(_, e)| e).filter(|e| words(e)).peekable();
            used.peek().is_some() && used.all(|e| matches!(e, E::AccessIndex { index: 0, .. }))
        })
    })
}

/// Stops the build with the message of naga and the source file and line of its location.
fn fail_at(stem: &str, wgsl: &str, location: Option<naga::SourceLocation>, message: &str) -> ! {
    let line = location.and_then(|l| source_line(wgsl, l.offset as usize)).unwrap_or_default();
    fail(&format!("{line}in kernel shaders/{stem}.wesl: {message}"))
}

/// Finds `file:line` in the sources of a location in the composed WGSL. WESL reformats declarations
/// but keeps their words, so the n-th word of a declaration in the composed text is the n-th word
/// of the declaration of that name in its file.
fn source_line(wgsl: &str, offset: usize) -> Option<String> {
    let words = |text: &str| -> Vec<(usize, String)> {
        let bare: String = blank_comments(text);
        let mut found = Vec::new();
        let mut start = None;
        for (i, c) in bare.char_indices().chain([(bare.len(), ' ')]) {
            match (c.is_alphanumeric() || c == '_', start) {
                (true, None) => start = Some(i),
                (false, Some(s)) => {
                    found.push((s, bare[s..i].to_string()));
                    start = None;
                }
                _ => {}
            }
        }
        found
    };
    let is_keyword = |w: &str| matches!(w, "fn" | "struct" | "const" | "override" | "var" | "alias");
    let composed = words(wgsl);
    let at = composed.partition_point(|(i, _)| *i <= offset).checked_sub(1)?;
    let declaration = (0..=at).rev().find(|&i| {
        is_keyword(&composed[i].1)
            && wgsl[..composed[i].0].lines().last().is_none_or(|l| l.trim_start().len() == l.len())
    })?;
    let name = &composed.get(declaration + 1)?.1;
    let lib = ["core", "transport", "gather", "camera"].map(|part| format!("shaders/lib/{part}"));
    for folder in ["shaders", "shaders/bindings", "shaders/probes"].into_iter().chain(lib.iter().map(String::as_str)) {
        for path in fs::read_dir(folder).ok()?.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.is_file()) {
            let text = fs::read_to_string(&path).ok()?;
            let source = words(&text);
            let found = source.windows(2).position(|w| is_keyword(&w[0].1) && w[1].1 == *name);
            if let Some(first) = found {
                let (i, _) = source.get(first + at - declaration)?;
                return Some(format!("{}:{}: ", path.display(), text[..*i].lines().count().max(1)));
            }
        }
    }
    None
}

/// Replaces line comments by spaces, which preserves offsets.
fn blank_comments(text: &str) -> String {
    text.split_inclusive('\n')
        .map(|line| match line.find("//") {
            Some(i) => format!("{}{}", &line[..i], line[i..].replace(|c| c != '\n', " ")),
            None => line.to_string(),
        })
        .collect()
}

fn fail(message: &str) -> ! {
    eprintln!("{message}");
    std::process::exit(1)
}
