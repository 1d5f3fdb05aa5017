//! Light through normals that are not those of the faces: photons carry the factor by which flux is
//! not radiance (Veach 1997, section 5.3), so that they bring what camera paths see.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | rough glass | a floor has the same light by photons and by rays through a slab of leaning normals | upright normals |
//! | sharp glass | its photons are those of glass that is hardly rough | upright normals |

use caustica::{
    scene::{Material, Scene},
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
