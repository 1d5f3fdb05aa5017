//! Layers of files: `--layers`.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | components | emission, direct, global and caustic add up to the picture, whose bits layers do not change | one left out |
//! | lights | the layer of a light is the picture of this light alone, and a group's that of its lights | another light's layer |
//! | names | lights of any name have layers that are read, in pictures and in parts; long names are told apart | |
//! | first hits | position, depth and the planes of the room agree; texture coordinates are those of the mesh | another plane |
//! | mattes | names cover what they name, by the manifest | another name |
//! | passes | layers of merged parts have the bytes of one run | fewer passes |
//! | other readers | OpenEXR's and OpenImageIO's tools find the channels and their means | a cut file |

use std::{fs, path::Path, process::Command};

use exr::prelude::{FlatSamples, ReadChannels as _, ReadLayers as _};
use serde_json::{Value, json};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/three-lights.gltf");
const ALL: &str = "components,lights,estimates,position,uv,motion,objects,materials";
const SMALL: &str = "--size 24x24 --photons 2k -q";

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_caustica"));
    command.current_dir(folder).args(line.split_whitespace()).env_remove("CAUSTICA_DEVICE");
    command
}

fn succeeds(folder: &Path, line: &str) {
    let output = command(folder, line).output().expect("it starts");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Channels of a file by name.
fn channels(path: &Path) -> Vec<(String, Vec<f32>)> {
    let read = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = read.all_attributes().from_file(path).expect("an OpenEXR file");
    let text = |name: &[u8]| String::from_utf8(name.to_vec()).expect("names are UTF-8");
    let numbers = |samples: &FlatSamples| samples.values_as_f32().collect::<Vec<f32>>();
    image.layer_data.channel_data.list.iter().map(|c| (text(c.name.bytes()), numbers(&c.sample_data))).collect()
}

struct File(Vec<(String, Vec<f32>)>);

impl File {
    fn read(folder: &Path, name: &str) -> Self {
        Self(channels(&folder.join(name)))
    }

    fn of(&self, name: &str) -> &[f32] {
        let found = self.0.iter().find(|(other, _)| other == name);
        &found.unwrap_or_else(|| panic!("{name} is not among {:?}", self.names())).1
    }

    fn names(&self) -> Vec<&str> {
        self.0.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// Largest difference between the picture and the sum of layers.
    fn misses(&self, layers: &[&str]) -> f32 {
        let of = |channel: &str| {
            let of_layers: Vec<_> = layers.iter().map(|layer| self.of(&format!("{layer}.{channel}"))).collect();
            let sum = |i: usize| of_layers.iter().map(|numbers| numbers[i]).sum::<f32>();
            self.of(channel).iter().enumerate().map(|(i, x)| (x - sum(i)).abs()).fold(0.0, f32::max)
        };
        ["R", "G", "B"].into_iter().map(of).fold(0.0, f32::max)
    }
}

/// The scene with its JSON changed, in a folder.
fn changed(folder: &Path, name: &str, change: impl FnOnce(&mut Value)) {
    let mut scene: Value = serde_json::from_slice(&fs::read(SCENE).expect("the scene")).expect("JSON");
    change(&mut scene);
    fs::write(folder.join(name), scene.to_string()).expect("it is written");
}

fn nodes(scene: &mut Value) -> &mut Vec<Value> {
    scene["nodes"].as_array_mut().expect("nodes")
}

/// Leaves the lights of these nodes.
fn only(scene: &mut Value, lights: &[&str]) {
    for node in nodes(scene).iter_mut().filter(|node| node["name"].as_str().is_some_and(|n| n.starts_with("light "))) {
        if !lights.contains(&node["name"].as_str().expect("text")) {
            node.as_object_mut().expect("a node").remove("extensions");
        }
    }
}

#[test]
fn components_add_up_to_the_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    for (name, options) in [("gathered", ""), ("classic", "--final-gather 0"), ("photons", "--mode photons")] {
        succeeds(folder, &format!("render {SCENE} {SMALL} {options} --layers components,estimates -o {name}.exr"));
        succeeds(folder, &format!("render {SCENE} {SMALL} {options} -o plain.exr"));
        let (file, plain) = (File::read(folder, &format!("{name}.exr")), File::read(folder, "plain.exr"));
        assert!(plain.0.iter().all(|(name, numbers)| file.of(name) == numbers), "{name}: layers change the picture");
        assert!(file.misses(&["emission", "direct", "global", "caustic"]) < 1e-5, "{name}");
        assert!(file.misses(&["emission", "direct", "caustic"]) > 1e-3, "{name}, control: without the global map");
        let most = |channel: &str| file.of(channel).iter().copied().fold(0.0, f32::max);
        assert!((most("direct.R") > 0.0) == (name != "photons"), "{name}");
        // Records of final gathering stand for the estimates of the global map.
        assert!((most("globalEstimate.radius") > 0.01) == (name != "gathered"), "{name}");
        assert!(most("causticEstimate.photons") > 10.0, "{name}");
    }
}

#[test]
fn the_layer_of_a_light_is_its_picture_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeeds(folder, &format!("render {SCENE} {SMALL} --layers lights,components -o all.exr"));
    let all = File::read(folder, "all.exr");
    assert_eq!(all.misses(&["light.light 1", "light.light 2", "light.light 3"]), 0.0);
    assert!(all.misses(&["emission", "direct", "global", "caustic"]) < 1e-5);
    changed(folder, "one.gltf", |scene| only(scene, &["light 2"]));
    succeeds(folder, &format!("render one.gltf {SMALL} -o one.exr"));
    let alone = File::read(folder, "one.exr");
    assert_eq!(all.of("light.light 2.G"), alone.of("G"));
    assert_ne!(all.of("light.light 1.G"), alone.of("G"), "control: another light");

    let grouped = |scene: &mut Value| {
        let pair =
            nodes(scene).iter_mut().filter(|node| ["light 1", "light 3"].map(Value::from).contains(&node["name"]));
        pair.for_each(|node| node["extras"] = json!({"caustica": {"group": "key.lights"}}));
    };
    changed(folder, "grouped.gltf", grouped);
    succeeds(folder, &format!("render grouped.gltf {SMALL} --layers lights -o grouped.exr"));
    changed(folder, "pair.gltf", |scene| only(scene, &["light 1", "light 3"]));
    succeeds(folder, &format!("render pair.gltf {SMALL} -o pair.exr"));
    let (grouped, pair) = (File::read(folder, "grouped.exr"), File::read(folder, "pair.exr"));
    let names: Vec<_> = grouped.names().into_iter().filter(|name| name.starts_with("light.")).collect();
    assert_eq!(names.len(), 6, "{names:?}");
    assert_eq!(grouped.of("light.key_lights.R"), pair.of("R"));
    // Each session has a part of the lights alone; the name may be that of any.
    let shifted = |name: &str| {
        let mut command = command(folder, &format!("render grouped.gltf {SMALL} --layers lights -o shifted.exr"));
        let output = command.args(["--light-photons", name]).output().expect("it starts");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for name in ["light 1=4", "light 2=4"] {
        assert_eq!(shifted(name), (Some(0), String::new()));
    }
    let (code, said) = shifted("light 9=4");
    assert!(code == Some(1) && ["light 1", "light 2", "light 3"].iter().all(|name| said.contains(name)), "{said}");
    changed(folder, "wrong.gltf", |scene| nodes(scene)[7]["extras"] = json!({"caustica": {"group": 7}}));
    let refused = command(folder, "render wrong.gltf -o wrong.exr").output().expect("it starts");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        refused.status.code() == Some(1) && said.contains("nodes[7].extras.caustica.group: 7 is no name"),
        "{said}"
    );
}

#[test]
fn lights_of_any_name_have_layers() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let long = |end: &str| format!("{}{end}", "Lampe Tür ".repeat(30));
    changed(folder, "named.gltf", |scene| {
        for (name, new) in [("light 1", "Tür\u{0}☃".to_owned()), ("light 2", long("1")), ("light 3", long("2"))] {
            let node = nodes(scene).iter_mut().find(|node| node["name"] == name).expect("a light");
            node["name"] = new.into();
        }
        nodes(scene).iter_mut().find(|node| node["name"] == "floor").expect("a floor")["name"] = "Fußboden ☃".into();
    });
    let tiny = "--size 4x4 --spp 1 --photons 1k -k 20 --layers lights,objects -q";
    succeeds(folder, &format!("render named.gltf {tiny} --passes 2 --part part.exr -o one.exr"));
    succeeds(folder, "merge part.exr -o merged.exr -q");
    assert!(fs::read(folder.join("merged.exr")).expect("it is there") == fs::read(folder.join("one.exr")).expect("it"));
    let file = File::read(folder, "one.exr");
    let lights: Vec<_> = file.names().into_iter().filter(|name| name.starts_with("light.")).collect();
    assert!(lights.len() == 9 && lights.contains(&"light.Tür_☃.R"), "{lights:?}");
    assert!(lights.iter().all(|name| name.matches('.').count() == 2 && name.len() < 220), "{lights:?}");
    let layers: Vec<_> = lights.iter().filter_map(|name| name.strip_suffix(".R")).collect();
    assert!(file.misses(&layers) < 1e-6);
    let attributes = caustica::image::read_exr_attributes(&folder.join("one.exr")).expect("a file");
    assert!(attributes.values().any(|value| value.contains(r#""Fußboden ☃":"#)), "{attributes:?}");
}

#[test]
fn first_hits_tell_where_they_are_and_whose() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeeds(
        folder,
        &format!("render {SCENE} {SMALL} --mode direct-rays --layers position,motion,objects,materials -o a.exr"),
    );
    let file = File::read(folder, "a.exr");
    let attributes = caustica::image::read_exr_attributes(&folder.join("a.exr")).expect("a file");
    let manifest = |layer: &str| -> Value {
        let named = attributes.iter().find(|(name, value)| name.ends_with("/name") && *value == layer);
        let key = named.unwrap_or_else(|| panic!("no matte {layer}")).0.trim_end_matches("name").to_owned();
        assert_eq!(attributes[&format!("{key}conversion")], "uint32_to_float32");
        serde_json::from_str(&attributes[&format!("{key}manifest")]).expect("JSON")
    };
    let (objects, materials) = (manifest("CryptoObject"), manifest("CryptoMaterial"));
    let bits = |x: f32| format!("{:08x}", x.to_bits());
    let covers = |layer: &str, manifest: &Value, name: &str, pixel: usize| {
        (0..3).flat_map(|level| [("R", "G"), ("B", "A")].map(|pair| (level, pair))).any(|(level, (id, coverage))| {
            let of = |channel: &str| file.of(&format!("{layer}{level:02}.{channel}"))[pixel];
            of(coverage) == 1.0 && manifest[name] == bits(of(id))
        })
    };
    let (mut floors, mut balls) = (0, 0);
    for pixel in 0..24 * 24 {
        let sum: f32 =
            (0..3).flat_map(|level| ["G", "A"].map(|c| file.of(&format!("CryptoObject{level:02}.{c}"))[pixel])).sum();
        assert!((sum - file.of("A")[pixel]).abs() < 1e-6, "all of pixel {pixel} has a name");
        assert_eq!((file.of("motion.X")[pixel], file.of("motion.Y")[pixel]), (0.0, 0.0));
        let at = ["X", "Y", "Z"].map(|c| file.of(&format!("position.{c}"))[pixel]);
        if covers("CryptoObject", &objects, "floor", pixel) {
            floors += 1;
            assert!(at[1].abs() < 1e-5 && at[0].abs() <= 1.0 && at[2].abs() <= 1.0, "{at:?}");
            assert!(at[0] > -0.99, "control: it is not the wall");
            assert!(!covers("CryptoObject", &objects, "back", pixel));
        }
        if covers("CryptoObject", &objects, "glass ball", pixel) {
            balls += 1;
            assert!(covers("CryptoMaterial", &materials, "glass", pixel));
        }
    }
    assert!(floors > 40 && balls > 5, "{floors} pixels of the floor, {balls} of the ball");
}

#[test]
fn layers_of_parts_have_the_bytes_of_one_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let small = format!("render {SCENE} --size 12x12 --spp 2 --photons 1k -k 20 -q --layers {ALL}");
    succeeds(folder, &format!("{small} --passes 3 -o one.exr"));
    succeeds(folder, &format!("{small} --passes 0..1 --part a.exr"));
    succeeds(folder, &format!("{small} --passes 1..3 --part b.exr"));
    succeeds(folder, "merge b.exr a.exr -o merged.exr -q");
    let bytes = |name: &str| fs::read(folder.join(name)).expect("it is there");
    assert!(bytes("merged.exr") == bytes("one.exr"));
    succeeds(folder, "merge a.exr -o fewer.exr -q");
    assert!(bytes("fewer.exr") != bytes("one.exr"), "control");
    succeeds(folder, &format!("{} --passes 1..3 --part plain.exr", small.replace(ALL, "components")));
    let refused = command(folder, "merge a.exr plain.exr -o x.exr -q").output().expect("it starts");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(1) && said.contains("--layers is [\"components\"]"), "{said}");
}

#[test]
fn other_programs_read_what_is_written() {
    if std::env::var_os("CAUSTICA_NO_FARM").is_some_and(|value| value == "1") {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeeds(folder, &format!("render {SCENE} {SMALL} --mode direct-rays --passes 2 --layers {ALL} -o a.exr"));
    let file = File::read(folder, "a.exr");
    let oiiotool = concat!(env!("CARGO_MANIFEST_DIR"), "/target/openjd/bin/oiiotool");
    let runs = |program: &str, words: &[&str]| {
        let output = Command::new(program).current_dir(folder).args(words).output();
        let output = output.unwrap_or_else(|e| panic!("{program}: {e}; scripts/install-farm-tools brings it"));
        (output.status.success(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (header_is_read, header) = runs("exrheader", &["a.exr"]);
    let (is_read, listed) = runs(oiiotool, &["--info", "-v", "a.exr"]);
    assert!(header_is_read && is_read);
    let listed = listed.lines().find_map(|line| line.trim().strip_prefix("channel list: ")).expect("channels");
    let listed: Vec<&str> = listed.split(", ").map(|name| name.split(" (").next().expect("a name")).collect();
    assert_eq!(listed[..4], ["R", "G", "B", "A"], "the picture comes first");
    for name in file.names() {
        assert!(listed.contains(&name), "{name} is not in {listed:?}");
        assert!(header.contains(&format!("\n    {name}, ")), "{name} is not in {header}");
    }
    let (_, stats) = runs(oiiotool, &["a.exr", "--ch", "R,position.Y,direct.G", "--printstats"]);
    let means = stats.lines().find_map(|line| line.trim().strip_prefix("Stats Avg: ")).expect("means");
    let means: Vec<f32> = means.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    for (mean, name) in means.iter().zip(["R", "position.Y", "direct.G"]) {
        let ours = file.of(name).iter().sum::<f32>() / (24.0 * 24.0);
        assert!((mean - ours).abs() < 1e-4 * ours.abs().max(0.1), "{name}: {mean}, {ours}");
    }
    assert_eq!(means.len(), 3, "{stats}");
    let whole = fs::read(folder.join("a.exr")).expect("it is there");
    fs::write(folder.join("cut.exr"), &whole[..whole.len() / 2]).expect("it is written");
    let (cut_is_read, _) = runs(oiiotool, &["cut.exr", "--printstats"]);
    assert!(!cut_is_read, "control: a cut file");
}
