//! Parts of a picture: put side by side, they are the whole.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | defaults | parts with borders anywhere have the bits of the whole, with glass, rough metal, rays of points without records and further samples | another seed; one pixel aside |
//! | every sample | the same where each sample has rays of its own | another seed |

use caustica::{
    image::Frame,
    progress::Silent,
    renderer::{PhotonMaps, Session},
    scene::{Material, Scene, Surface},
    settings::{Crop, PictureSettings, Quality, Settings},
};
use glam::{Vec3, vec3};
use support::*;

const SIZE: (u32, u32) = (140, 71);

/// A room with a lamp of an extent, a ball of glass, one of rough metal and one of coated colour.
fn room() -> Scene {
    let layered = |base, metallic| Surface::Layered { base, metallic, f0: Vec3::splat(0.04), specular: 1.0 };
    let mut scene = scene(&[diffuse(0.7), glass()]);
    scene.materials.push(emissive("lamp", 0.5, 6.0, true));
    let metal = layered(Vec3::splat(0.9), 1.0);
    scene.materials.push(Material { roughness: 0.35, metallic: 1.0, ..Material::new("metal", metal) });
    let coated = layered(vec3(0.2, 0.4, 0.7), 0.0);
    scene.materials.push(Material { roughness: 0.2, ..Material::new("coated", coated) });
    add_box(&mut scene, Vec3::NEG_ONE, Vec3::ONE, 0);
    add_quad(&mut scene, vec3(-0.3, 0.9, -0.3), Vec3::X * 0.4, Vec3::Z * 0.4, 2);
    scene.spheres.push(sphere(vec3(0.35, -0.6, 0.1), 0.4, 1));
    scene.spheres.push(sphere(vec3(-0.5, -0.6, -0.3), 0.4, 3));
    scene.spheres.push(sphere(vec3(0.0, -0.8, 0.5), 0.2, 4));
    scene.cameras.push(camera(vec3(0.0, 0.1, 0.95), vec3(0.0, -0.3, 0.0), 75.0));
    scene
}

fn rendered(session: &Session, maps: &PhotonMaps, settings: &Settings, crop: Option<Crop>) -> Frame {
    let picture = PictureSettings { crop, ..settings.picture.clone() };
    session.picture(maps, &settings.estimate, &picture, &Silent).expect("a picture").frame
}

/// Pixels of a part that are not those of the whole, that many columns aside.
fn differing(part: &Frame, whole: &Frame, crop: Crop, aside: u32) -> usize {
    let there = |i: usize| {
        let (row, column) = (i as u32 / crop.width, i as u32 % crop.width);
        ((row + crop.row) * SIZE.0 + column + crop.column + aside) as usize
    };
    part.radiance().iter().enumerate().filter(|(i, pixel)| **pixel != whole.radiance()[there(*i)]).count()
}

fn parts_are_the_whole(settings: &Settings, crops: &[Crop]) {
    let scene = room();
    let session = Session::open(gpu(), &scene, &settings.lights, &Silent).expect("the scene fits");
    let maps = session.photon_maps(&settings.photons, &Silent).expect("photons");
    let whole = rendered(&session, &maps, settings, None);
    for crop in crops {
        let part = rendered(&session, &maps, settings, Some(*crop));
        assert_eq!(differing(&part, &whole, *crop, 0), 0, "pixels of {crop:?}");
        if crop.column + crop.width < SIZE.0 {
            let aside = differing(&part, &whole, *crop, 1);
            assert!(2 * aside > part.pixels(), "control: one pixel aside, {aside} differ");
        }
    }
    let other = settings.clone().with(|s| s.photons.seed = 1);
    let maps = session.photon_maps(&other.photons, &Silent).expect("photons");
    let crop = crops[0];
    let part = rendered(&session, &maps, &other, Some(crop));
    assert!(2 * differing(&part, &whole, crop, 0) > part.pixels(), "control: another seed");
}

#[test]
fn parts_side_by_side_are_the_whole() {
    let settings = Quality::Normal.settings_for(SIZE).with(|s| {
        s.picture.size = Some(SIZE);
        (s.photons.global, s.photons.caustic, s.photons.final_gather) = (10_000, 10_000, 8);
        s.picture.max_spp = Some(8);
    });
    assert!(settings.photons.final_gather > 0 && settings.picture.max_spp.is_some(), "defaults");
    // Odd borders, that cut balls and tiles.
    let (column, row) = (77, 53);
    let crop = |column, row, width, height| Crop { column, row, width, height };
    parts_are_the_whole(
        &settings,
        &[crop(column, 0, SIZE.0 - column, row), crop(0, row, column, SIZE.1 - row), crop(61, 33, 1, 3)],
    );
}

#[test]
fn parts_with_rays_at_every_sample_are_the_whole() {
    let settings = Quality::Draft.settings_for(SIZE).with(|s| {
        s.picture.size = Some(SIZE);
        (s.photons.global, s.photons.caustic, s.photons.final_gather) = (10_000, 10_000, 2);
        s.estimate.gather_spacing = 0;
        s.estimate.irradiance_cells = 0.0;
        (s.picture.spp, s.picture.max_spp) = (2, Some(3));
    });
    parts_are_the_whole(&settings, &[Crop { column: 31, row: 17, width: 99, height: 50 }]);
}
