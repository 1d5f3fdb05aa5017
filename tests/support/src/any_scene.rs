//! Invariants for arbitrary bytes given as a scene, shared by the fuzz target `scene` and the
//! replay of its corpus.

use std::path::Path;

use caustica::{
    bvh::Bvh,
    scene::{Camera, LoadOptions, Projection, Scene, Surface},
};

/// Maximum number of triangles for which the BVH is built too.
const MAX_BUILT: usize = 1000;

/// Reads the bytes and checks the scene. Returns the scene, or the error, which must be one line.
pub fn check(bytes: &[u8]) -> Result<Scene, String> {
    match Scene::read(bytes, Path::new("no-such-folder/any.gltf"), &LoadOptions::default()) {
        Ok(scene) => {
            sound(&scene);
            Ok(scene)
        }
        Err(error) => {
            let text = error.to_string();
            assert!(!text.is_empty() && !text.contains(char::is_control), "one line: {text:?}");
            Err(text)
        }
    }
}

/// Checks that all indices and numbers are in their ranges.
fn sound(scene: &Scene) {
    let materials = scene.materials.len() as u32;
    assert!(scene.center.is_finite(), "centre {}", scene.center);
    for (i, triangle) in scene.triangles.iter().enumerate() {
        assert!(triangle.material < materials, "triangle {i}: material {} of {materials}", triangle.material);
        assert!(triangle.positions.iter().all(|p| p.is_finite()), "triangle {i}: {:?}", triangle.positions);
        let unit = |n: &glam::Vec3| (n.length() - 1.0).abs() < 1e-3;
        assert!(triangle.normals.iter().all(unit), "triangle {i}: normals {:?}", triangle.normals);
    }
    for (i, sphere) in scene.spheres.iter().enumerate() {
        assert!(sphere.material < materials, "sphere {i}: material {} of {materials}", sphere.material);
        let good = sphere.center.is_finite() && sphere.radius.is_finite() && sphere.radius > 0.0;
        assert!(good, "sphere {i}: {} {}", sphere.center, sphere.radius);
    }
    for (i, material) in scene.materials.iter().enumerate() {
        let emission = material.emission;
        assert!(emission.is_finite() && emission.min_element() >= 0.0, "material {i}: emission {emission}");
        let (color, ior) = match material.surface {
            Surface::Diffuse { albedo } | Surface::Layered { base: albedo, .. } => (albedo, 1.0),
            Surface::Mirror { tint } => (tint, 1.0),
            Surface::Glass { ior, tint } | Surface::Pane { ior, tint } => (tint, ior),
        };
        assert!(color.min_element() >= 0.0 && color.max_element() <= 1.0, "material {i}: colour {color}");
        assert!(ior >= 1.0 && ior.is_finite(), "material {i}: index of refraction {ior}");
    }
    for (i, light) in scene.lights.iter().enumerate() {
        let good = light.position.is_finite() && (light.direction.length() - 1.0).abs() < 1e-3;
        assert!(good, "light {i}: at {} to {}", light.position, light.direction);
        let intensity = light.intensity;
        assert!(intensity.is_finite() && intensity.min_element() >= 0.0, "light {i}: intensity {intensity}");
    }
    assert!(!scene.cameras.is_empty(), "no camera");
    scene.cameras.iter().for_each(sound_camera);
    let description = scene.describe().to_string();
    let mut lines = scene.warnings.iter().map(String::as_str).chain(description.lines());
    assert!(lines.all(|line| !line.contains(char::is_control) && line.len() < 2500), "one line each: {description:?}");
    let bounds = scene.bounding_sphere();
    assert!(bounds.0.is_finite() && bounds.1.is_finite(), "{bounds:?}");
    let _ = scene.check_renderable();
    if scene.triangles.len() <= MAX_BUILT && scene.spheres.len() <= MAX_BUILT {
        let _ = Bvh::build(scene).max_stack_depth();
    }
}

fn sound_camera(camera: &Camera) {
    let Camera { name, position, right, up, forward, projection, aspect, near, far, keeps_width: _ } = camera;
    let frame = [right, up, forward];
    let upright = frame.iter().all(|axis| (axis.length() - 1.0).abs() < 1e-3)
        && [right.dot(*up), up.dot(*forward), forward.dot(*right)].iter().all(|cosine| cosine.abs() < 1e-3);
    assert!(position.is_finite() && upright, "camera {name}: {position} {frame:?}");
    assert!(aspect.is_none_or(|aspect| aspect.is_finite() && aspect > 0.0), "camera {name}: aspect {aspect:?}");
    assert!(near < far, "camera {name}: {near} to {far}");
    match projection {
        Projection::Perspective { yfov } => {
            assert!(*yfov > 0.0 && *yfov < std::f32::consts::PI, "camera {name}: yfov {yfov}");
        }
        Projection::Orthographic { ymag } => assert!(*ymag > 0.0 && ymag.is_finite(), "camera {name}: ymag {ymag}"),
    }
}
