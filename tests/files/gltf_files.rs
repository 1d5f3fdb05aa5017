//! Files that a scene names, and files that it must not open.

use caustica::scene::{LoadOptions, Scene};

use support::gltf::{floats, message, triangle};

#[test]
fn the_hash_covers_the_files_beside_the_scene() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut gltf = triangle();
    gltf["buffers"][0]["uri"] = "my%20data.bin".into();
    let path = folder.path().join("test.gltf");
    std::fs::write(&path, gltf.to_string()).expect("a temporary file");
    let hash = |last: u8| {
        let mut bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        bytes.extend([0, 0, 1, 0, 2, 0, 0, last]);
        std::fs::write(folder.path().join("my data.bin"), bytes).expect("a temporary file");
        Scene::load(&path).unwrap_or_else(|error| panic!("{error}")).hash
    };
    assert_eq!(hash(0), hash(0));
    assert_ne!(hash(0), hash(1));
}

/// A scene in a folder of its own. A file next to that folder must not be read.
#[cfg(unix)]
#[test]
fn buffers_lie_in_the_folder_of_the_scene_unless_all_is_allowed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = folder.path().canonicalize().expect("it is there");
    let scene_folder = root.join("in");
    std::fs::create_dir_all(scene_folder.join("sub")).expect("a folder");
    let mut gltf = triangle();
    let bytes = [floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]), vec![0, 0, 1, 0, 2, 0, 0, 0]].concat();
    std::fs::write(root.join("secret.bin"), &bytes).expect("a file");
    std::fs::write(scene_folder.join("sub/a b.bin"), &bytes).expect("a file");
    std::os::unix::fs::symlink(root.join("secret.bin"), scene_folder.join("link.bin")).expect("a link");
    let mut read = |uri: &str, allow_outside: bool| {
        gltf["buffers"][0]["uri"] = uri.into();
        let options = LoadOptions { allow_outside, ..LoadOptions::default() };
        Scene::read(gltf.to_string().as_bytes(), &scene_folder.join("test.gltf"), &options)
    };
    let ways =
        ["sub/a%20b.bin", "./sub/a b.bin", "sub/a%20%62.bin", "sub/../sub/a b.bin", "sub\\a b.bin", "sub%5ca b.bin"];
    for inside in ways {
        assert!(read(inside, false).is_ok(), "{inside}");
    }
    let absolute = root.join("secret.bin").display().to_string();
    for outside in [
        "../secret.bin",
        "%2e%2e/secret.bin",
        "sub/../../secret.bin",
        "link.bin",
        &absolute,
        &format!("file://{absolute}"),
    ] {
        let said = message(read(outside, false));
        let expected = "leads out of the scene's folder, which only `load.allow_outside` permits";
        assert_eq!(said, format!("buffers[0].uri: {outside:?} {expected}"));
        assert!(read(outside, true).is_ok(), "{outside}: {said}");
    }
    for windows in ["C:/secret.bin", "..\\secret.bin", "sub\\..\\..\\secret.bin", "sub%5c..%5c..%5csecret.bin"] {
        assert!(message(read(windows, false)).contains("leads out of the scene's folder"), "{windows}");
    }
    let web = message(read("https://a.example/b.bin", true));
    assert_eq!(web, r#"buffers[0].uri: "https://a.example/b.bin": only data URIs and files are read"#);
    // Files that never end, or that block on opening, are not opened.
    let pipe = scene_folder.join("pipe.bin");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs").success());
    assert_eq!(message(read("pipe.bin", false)), r#"buffers[0].uri: "pipe.bin": is not a regular file"#);
    assert_eq!(message(read("/dev/zero", true)), r#"buffers[0].uri: "/dev/zero": is not a regular file"#);
    assert_eq!(message(read("sub", false)), r#"buffers[0].uri: "sub": is a folder"#);
    for (path, expected) in [(pipe.as_path(), "is not a regular file"), (root.as_path(), "is a folder")] {
        let said = Scene::load(path).expect_err("it is no scene").to_string();
        assert_eq!(said, format!("{}: {expected}", path.display()));
    }
}
