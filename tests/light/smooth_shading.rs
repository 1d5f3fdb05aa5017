//! Light through normals that are not those of the faces: photons carry the factor by which flux is
//! not radiance (Veach 1997, section 5.3), so that they bring what camera paths see.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | rough glass | a floor has the same light by photons and by rays through a slab of leaning normals | upright normals |
//! | sharp glass | its photons are those of glass that is hardly rough | upright normals |
//! | metal | a floor has the same light by photons and by rays off metal of strongly leaning normals, rough or not | upright normals |
//! | cloth | sheen shows the light above the surface and its normal, none from below | half of the sheen |
//! | furnace | white metal shows all light above it, and none from below, however its normals lean | grey metal; light from below alone |

use caustica::{
    scene::{Environment, Material, Scene, Surface},
    settings::Mode,
};
use glam::{Vec3, vec3};
use serde_json::json;
use support::{
    meshes::{Mesh, glass_of, scene_of},
    *,
};

const TOP: f32 = 0.7;

/// A floor below a slab of glass, lit through it by a lamp on one side. The normals of the slab's
/// upper face lean by 22° where `leans`. `bound`: see
/// `LoadOptions::caustic_roughness`.
fn slab(roughness: f32, leans: bool, bound: f32) -> Scene {
    let mut glass = glass_of(1.5);
    glass["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
    let block = Mesh::block(vec3(-3.0, 0.5, -3.0), vec3(3.0, TOP, 3.0));
    let mut scene = scene_of(&[(block, 0)], &[glass]);
    // Where the file's origin lies now.
    let origin = -scene.center.as_vec3();
    let top = origin.y + TOP;
    for triangle in &mut scene.triangles {
        if leans && triangle.positions.iter().all(|p| (p.y - top).abs() < 1e-3) {
            triangle.normals = [vec3(-0.4, 1.0, 0.0).normalize(); 3];
        }
    }
    scene.options.caustic_roughness = bound;
    scene.materials.extend([Material::new("floor", diffuse(0.5)), emissive("lamp", 0.0, 20.0, false)]);
    add_quad(&mut scene, origin + vec3(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::Z * -4.0, 1);
    add_quad(&mut scene, origin + vec3(0.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, 2);
    // From below the slab: nothing but the floor is seen.
    scene.cameras = vec![camera(origin + vec3(0.0, 0.3, 1.2), origin, 16.0)];
    scene
}

fn brightness(scene: &Scene, photons: u32, final_gather: u32) -> f64 {
    let settings = settings(Mode::Hybrid, photons, 16).with(|s| {
        s.photons.final_gather = final_gather;
        s.photons.max_bounces = 30;
        s.picture.spp = 4;
    });
    mean(&render_scene(scene, &settings))
}

#[test]
fn photons_through_leaning_normals_of_rough_glass_are_what_rays_see() {
    // Beyond the bound, rays of final gathering follow the glass to the lamp.
    let photons = brightness(&slab(0.2, true, 0.0), 200_000, 0);
    let rays = brightness(&slab(0.2, true, 0.0), 20_000, 64);
    assert!(within(photons, rays, 0.02), "{photons} by photons, {rays} by rays");
    let upright = brightness(&slab(0.2, false, 0.0), 200_000, 0);
    assert!(!within(upright, rays, 0.06), "control: upright normals give {upright}, {rays} by rays");
}

#[test]
fn photons_through_leaning_normals_of_sharp_glass_are_those_of_hardly_rough_glass() {
    let of = |roughness: f32, leans: bool| brightness(&slab(roughness, leans, 0.45), 100_000, 0);
    let (sharp, rough) = (of(0.0, true), of(0.04, true));
    assert!(within(sharp, rough, 0.02), "{sharp} sharp, {rough} rough");
    let upright = of(0.0, false);
    assert!(!within(upright, rough, 0.06), "control: upright normals give {upright}, {rough} rough");
}

fn metal(base: f32, roughness: f32) -> Material {
    let f0 = Vec3::splat(0.04);
    let surface = Surface::Layered { base: Vec3::splat(base), metallic: 1.0, f0, specular: 1.0 };
    Material { roughness, ..Material::new("metal", surface) }
}

/// A floor below a plate of metal, lit off the plate by a lamp that faces up. The plate's normals
/// lean by that slope.
fn plate(roughness: f32, slope: f32, bound: f32) -> Scene {
    let mut scene = scene(&[]);
    scene.options.caustic_roughness = bound;
    scene.materials.extend([Material::new("floor", diffuse(0.5)), emissive("lamp", 0.0, 20.0, false)]);
    scene.materials.push(metal(0.9, roughness));
    add_quad(&mut scene, vec3(-2.0, 0.0, 2.0), Vec3::X * 4.0, Vec3::Z * -4.0, 0);
    add_quad(&mut scene, vec3(-0.2, 0.6, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 1);
    let first = scene.triangles.len();
    add_quad(&mut scene, vec3(-1.5, 1.2, -1.5), Vec3::X * 3.0, Vec3::Z * 3.0, 2);
    for triangle in &mut scene.triangles[first..] {
        triangle.normals = [vec3(slope, -1.0, 0.0).normalize(); 3];
    }
    scene.cameras = vec![camera(vec3(-0.4, 0.3, 1.9), vec3(-1.0, 0.0, -0.4), 30.0)];
    scene
}

#[test]
fn photons_off_metal_of_leaning_normals_are_what_rays_see() {
    let upright = brightness(&plate(0.4, 0.0, 0.0), 50_000, 0);
    // Photons that graze the plate carry a bounded weight, and a little less light.
    let photons = brightness(&plate(0.4, 2.0, 0.0), 100_000, 0);
    let rays = brightness(&plate(0.4, 2.0, 0.0), 20_000, 32);
    assert!(within(photons, rays, 0.04), "{photons} by photons, {rays} by rays");
    assert!(!within(upright, rays, 0.1), "control: upright normals give {upright}, {rays} by rays");
    let of = |roughness: f32| brightness(&plate(roughness, 2.0, 0.45), 100_000, 0);
    let (sharp, rough) = (of(0.0), of(0.05));
    assert!(within(sharp, rough, 0.03), "{sharp} sharp, {rough} rough");
}

/// Brightness of a plane that fills the picture, seen from 20° above it under a sky of radiance
/// `above` the horizon and `below` it. Its normals lean by that slope, away from the viewer.
fn plane(material: Material, slope: f32, above: f32, below: f32) -> f64 {
    let mut scene = Scene { materials: vec![material], ..Scene::default() };
    add_quad(&mut scene, vec3(-9.0, 0.0, 9.0), Vec3::X * 18.0, Vec3::Z * -18.0, 0);
    for triangle in &mut scene.triangles {
        triangle.normals = [vec3(0.0, 1.0, -slope).normalize(); 3];
    }
    scene.cameras = vec![camera(vec3(0.0, 1.0, 2.75), Vec3::ZERO, 10.0)];
    let (width, height) = (64_u32, 32_u32);
    let sky = |row: u32| Vec3::splat(if row < height / 2 { above } else { below });
    let pixels = (0..height).flat_map(|row| vec![sky(row).to_array(); width as usize]).collect();
    scene.environment = Some(Environment { pixels, width, height, ..Environment::uniform(Vec3::ONE) });
    let settings = settings(Mode::Hybrid, 1000, 16).with(|s| {
        s.picture.spp = 64;
        s.photons.max_paths = Some(1000);
    });
    mean(&render_scene(&scene, &settings))
}

#[test]
fn leaning_normals_show_all_light_above_the_surface_and_none_below() {
    // Upright, leaning, and so far that the viewer sees their backs.
    for (slope, roughness) in [0.0, 0.7, 2.0, 6.0].into_iter().flat_map(|s| [0.0, 0.2].map(|r| (s, r))) {
        let of = |base: f32, above: f32, below: f32| plane(metal(base, roughness), slope, above, below);
        let found = of(1.0, 1.0, 0.0);
        assert!(within(found, 1.0, 0.01), "slope {slope}, roughness {roughness}: {found}");
        let grey = of(0.7, 1.0, 0.0);
        assert!(grey < 0.99, "control: grey metal, slope {slope}, roughness {roughness}: {grey}");
        let below = of(1.0, 0.0, 1.0);
        assert!(below < 0.02, "slope {slope}, roughness {roughness}: {below} from below");
    }
}

#[test]
fn sheen_of_leaning_normals_has_the_light_above_the_surface_alone() {
    let cloth = |color: f32| {
        let surface = Surface::Layered { base: Vec3::ZERO, metallic: 0.0, f0: Vec3::ZERO, specular: 0.0 };
        Material { sheen_color: Vec3::splat(color), sheen_roughness: 0.5, ..Material::new("cloth", surface) }
    };
    // Integrals of the lobe over the directions above both, by 720,000 of them.
    for (slope, right) in [(0.0, 0.2880), (0.2, 0.4701), (2.0, 0.0710)] {
        let found = plane(cloth(1.0), slope, 1.0, 0.0);
        assert!(within(found, right, 0.03), "slope {slope}: {found} instead of {right}");
        let half = plane(cloth(0.5), slope, 1.0, 0.0);
        assert!(!within(half, right, 0.03), "control, slope {slope}: {half}");
    }
}
