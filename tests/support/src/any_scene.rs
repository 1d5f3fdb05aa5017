//! Invariants for arbitrary bytes given as a scene, shared by the fuzz target `scene` and the
//! replay of its corpus.

use std::path::Path;

use caustica::{
    bvh::Bvh,
    scene::{Alpha, Camera, LoadOptions, Material, Projection, Scene, Surface, UV_SETS},
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
        let attributes = triangle.attributes as usize;
        assert!(attributes <= scene.attributes.len(), "triangle {i}: attributes {attributes}");
        let maps = scene.materials[triangle.material as usize].textures.normal.is_some();
        let has_tangents = attributes > 0 && scene.attributes[attributes - 1].tangents[0].w != 0.0;
        assert!(!maps || has_tangents, "triangle {i}: no tangents for its normal map");
    }
    sound_attributes(scene);
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
        sound_material(material, scene.images.len());
    }
    for image in &scene.images {
        let texels = image.width as usize * image.height as usize;
        assert!(texels > 0 && image.texels.len() == texels, "image {}: {} of {texels}", image.name, image.texels.len());
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

fn sound_attributes(scene: &Scene) {
    let used = scene.triangles.iter().filter(|triangle| triangle.attributes > 0).count();
    assert_eq!(used, scene.attributes.len(), "each triangle has attributes of its own, and none are left over");
    for (i, attributes) in scene.attributes.iter().enumerate() {
        assert!(attributes.uvs.as_flattened().iter().all(|uv| uv.is_finite()), "attributes {i}: {:?}", attributes.uvs);
        let color = |color: &glam::Vec4| color.min_element() >= 0.0 && color.max_element() <= 1.0;
        assert!(attributes.colors.iter().all(color), "attributes {i}: {:?}", attributes.colors);
        let none = attributes.tangents == [glam::Vec4::ZERO; 3];
        let unit = |t: &glam::Vec4| t.w.abs() == 1.0 && (t.truncate().length() - 1.0).abs() < 1e-3;
        assert!(none || attributes.tangents.iter().all(unit), "attributes {i}: {:?}", attributes.tangents);
    }
}

fn sound_material(material: &Material, images: usize) {
    let Material { name, .. } = material;
    let factors = [
        material.roughness,
        material.transmission,
        material.metallic,
        material.clearcoat,
        material.clearcoat_roughness,
        material.opacity,
        material.sheen_roughness,
        material.anisotropy,
        material.iridescence,
        material.diffuse_transmission,
    ];
    assert!(factors.iter().all(|factor| (0.0..=1.0).contains(factor)), "material {name}: {factors:?}");
    for color in [material.sheen_color, material.diffuse_transmission_color] {
        assert!(color.min_element() >= 0.0 && color.max_element() <= 1.0, "material {name}: {color}");
    }
    let (absorption, [thin, thick]) = (material.absorption, material.iridescence_thickness);
    let numbers =
        [absorption.x, absorption.y, absorption.z, material.dispersion, material.iridescence_ior, thin, thick];
    assert!(numbers.iter().all(|x| *x >= 0.0 && x.is_finite()), "material {name}: {numbers:?}");
    assert!(material.normal_scale.is_finite() && material.anisotropy_rotation.is_finite(), "material {name}");
    if let Surface::Layered { metallic, f0, specular, .. } = material.surface {
        let good = (0.0..=1.0).contains(&metallic) && (0.0..=1.0).contains(&specular);
        assert!(good && f0.is_finite() && f0.min_element() >= 0.0, "material {name}: {metallic} {f0} {specular}");
    }
    if let Alpha::Mask { cutoff } = material.alpha {
        assert!(cutoff >= 0.0 && cutoff.is_finite(), "material {name}: cutoff {cutoff}");
    }
    for (property, texture) in material.textures.named() {
        let Some(texture) = texture else { continue };
        let good = (texture.image as usize) < images && (texture.uv_set as usize) < UV_SETS;
        let finite = texture.transform.as_flattened().iter().all(|x| x.is_finite());
        assert!(good && finite, "material {name}: {property} {texture:?}");
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
