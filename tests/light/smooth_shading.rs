//! Light through interpolated normals: photons carry the factor by which flux is not radiance
//! (Veach 1997, section 5.3), so that they bring what camera paths see.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | rough glass | a floor has the same light by photons and by rays through a coarse ball | the ball with flat faces |
//! | sharp glass | its photons are those of glass that is hardly rough | the ball with flat faces |

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

const CENTER: Vec3 = vec3(0.0, 1.2, 0.0);

/// A floor that a lamp lights through a ball of few faces, whose normals are those of a sphere
/// where `smooth`. `bound`: see `LoadOptions::caustic_roughness`.
fn ball(roughness: f32, smooth: bool, bound: f32) -> Scene {
    let mut glass = glass_of(1.5);
    glass["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
    let mut scene = scene_of(&[(Mesh::ball(CENTER, 0.5, 6), 0)], &[glass]);
    // Where the file's centre lies now.
    let center = CENTER - scene.center.as_vec3();
    for triangle in &mut scene.triangles {
        if smooth {
            triangle.normals = triangle.positions.map(|p| (p - center).normalize());
        }
    }
    scene.options.caustic_roughness = bound;
    scene.materials.extend([Material::new("floor", diffuse(0.5)), emissive("lamp", 0.0, 20.0, false)]);
    let at = center - Vec3::Y * CENTER.y;
    add_quad(&mut scene, at + vec3(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -4.5, 1);
    add_quad(&mut scene, at + vec3(-0.5, 2.5, -0.5), Vec3::X, Vec3::Z, 2);
    // From the side, below the ball: nothing but the floor is seen.
    scene.cameras = vec![camera(at + vec3(0.0, 0.6, 2.0), at, 20.0)];
    scene
}

fn brightness(scene: &Scene, photons: u32, final_gather: u32) -> f64 {
    let settings = settings(Mode::Hybrid, photons, 24).with(|s| {
        s.photons.final_gather = final_gather;
        s.photons.max_bounces = 30;
        s.picture.spp = 4;
    });
    mean(&render_scene(scene, &settings))
}

#[test]
fn photons_through_smooth_rough_glass_are_what_rays_see() {
    // Beyond the bound, rays of final gathering follow the glass to the lamp.
    let photons = brightness(&ball(0.2, true, 0.0), 400_000, 0);
    let rays = brightness(&ball(0.2, true, 0.0), 50_000, 64);
    assert!(within(photons, rays, 0.02), "{photons} by photons, {rays} by rays");
    let flat = brightness(&ball(0.2, false, 0.0), 400_000, 0);
    assert!(!within(flat, rays, 0.02), "control: flat faces give {flat}, {rays} by rays");
}

#[test]
fn photons_through_smooth_glass_are_those_of_hardly_rough_glass() {
    let of = |roughness: f32, smooth: bool| brightness(&ball(roughness, smooth, 0.45), 200_000, 0);
    let (sharp, rough) = (of(0.0, true), of(0.04, true));
    assert!(within(sharp, rough, 0.03), "{sharp} sharp, {rough} rough");
    let flat = of(0.0, false);
    assert!(!within(flat, rough, 0.03), "control: flat faces give {flat}, {rough} rough");
}
