//! The repository's scenes match their generator, and can be rendered.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use caustica::scene::{Environment, LightKind, Scene, Surface};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn load(name: &str) -> Scene {
    Scene::load(&folder().join(name)).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn files_are_what_the_generator_writes() {
    for (name, bytes) in support::make_scenes::files() {
        let written = std::fs::read(folder().join(&name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(written == bytes, "{name} is outdated: cargo run --release --example make_scenes");
    }
}

#[test]
fn all_can_be_rendered_without_a_warning() {
    let rooms = ["mirror-and-glass", "diffuse", "diffuse-in-glass", "one-light", "three-lights", "area-light", "spot"];
    for name in rooms.into_iter().chain(["water", "sky"]) {
        let mut scene = load(&format!("{name}.gltf"));
        if name == "sky" {
            assert!(scene.check_renderable().is_err(), "its light is beside it");
            let sky = Environment::load(&folder().join("sky.hdr"), 1.0, 0.0).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(sky.warnings, [""; 0]);
            scene.environment = Some(sky);
        }
        assert!(scene.check_renderable().is_ok(), "{name}");
        assert_eq!(scene.warnings, [""; 0], "{name}");
        assert_eq!(scene.camera(None).expect("a camera").name, "camera", "{name}");
        assert_eq!(scene.has_specular(), name != "diffuse", "{name}");
    }
    assert_eq!((load("one-light.gltf").lights.len(), load("three-lights.gltf").lights.len()), (1, 3));
}

#[test]
fn each_kind_of_light_has_its_scene() {
    let lamp = &load("area-light.gltf").describe().emitters[0];
    assert!(lamp.triangles == 2 && (lamp.area - 0.25).abs() < 1e-6, "{lamp}");
    let spot = load("spot.gltf");
    assert!(matches!(spot.lights[0].kind, LightKind::Spot { .. }) && spot.lights[1].kind == LightKind::Directional);
    let to_ball = (spot.spheres[0].center - spot.lights[0].position).normalize();
    assert!(spot.lights[0].direction.dot(to_ball) > 0.9999, "the spot is aimed at the ball");
    let sky = Environment::load(&folder().join("sky.hdr"), 1.0, 0.0).unwrap_or_else(|error| panic!("{error}"));
    let sun = support::make_scenes::sky::sun_direction();
    assert!(sky.radiance(sun).x > 20.0 * sky.radiance(-sun.with_y(-sun.y)).x, "the sun is where it should be");
}

/// Number of edges of the water's triangles without exactly one neighbour in the opposite
/// direction.
fn open_edges(scene: &Scene) -> usize {
    let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    let is_glass = |i: u32| matches!(scene.materials[i as usize].surface, Surface::Glass { .. });
    for triangle in scene.triangles.iter().filter(|triangle| is_glass(triangle.material)) {
        // Adding zero turns -0 into +0.
        let corners = triangle.positions.map(|p| (p + 0.0).to_array().map(f32::to_bits));
        for i in 0..3 {
            let edge = [corners[i], corners[(i + 1) % 3]];
            let (key, way) = if edge[0] < edge[1] { (edge, 1) } else { ([edge[1], edge[0]], -1) };
            // Two triangles of one direction would give 2, and a third one an odd number.
            *edges.entry(key).or_default() += way;
        }
    }
    edges.values().filter(|sum| **sum != 0).count()
}

#[test]
fn the_water_is_a_closed_solid_with_its_outside_out() {
    let mut scene = load("water.gltf");
    let glass: Vec<_> =
        scene.triangles.iter().filter(|t| scene.materials[t.material as usize].surface.is_specular()).collect();
    assert!(glass.len() >= 50_000, "{}", glass.len());
    assert!(glass.iter().all(|t| t.normals.iter().all(|n| n.dot(t.geometric_normal()) > 0.9)));
    // The enclosed volume is positive if the triangles face outwards (divergence theorem).
    let volume: f32 = glass.iter().map(|t| t.positions[0].dot(t.positions[1].cross(t.positions[2])) / 6.0).sum();
    assert!((volume / (2.0 * 2.0 * 0.24) - 1.0).abs() < 0.1, "{volume}");
    assert_eq!(open_edges(&scene), 0);
    // Negative control: without one triangle three edges are open.
    let at = scene.triangles.len() - 1;
    scene.triangles.remove(at);
    assert_eq!(open_edges(&scene), 3);
}
