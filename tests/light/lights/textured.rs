//! Lamps with emissive textures or opacity.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | half | a lamp that is half black, half cut out or half covered lights like the lit half, by rays and photons | no texture, all there |
//! | gradient | direct light from a gradient, with few samples and many, is the sum over small patches | the gradient turned round |
//! | wrapping | flux of the photons, power of the light table and of `info` are the texture's mean, however it is wrapped | another wrapping; the mean of the stored texels |
//! | black | a lamp whose texture is black gives no light and is told of, and its group stays known | one bright texel |

use std::f64::consts::PI;

use caustica::{
    bvh::Bvh,
    image::srgb_decode,
    scene::{Alpha, Attributes, Image, Scene, Texture, Wrap},
    settings::{Mode, Settings},
    upload::SceneBuffers,
};
use glam::{Vec2, Vec3, vec2, vec3};
use support::*;

use super::{closed_forms::irradiance_at, direct_flux, floor};

/// A square lamp of radiance 2 and 1 m², two metres above a floor, with texture coordinates from 0
/// to 1 along x and z.
fn lamp() -> Scene {
    let mut scene = floor(3.0);
    scene.materials.push(emissive("lamp", 0.0, 2.0, false));
    add_quad(&mut scene, vec3(-0.5, 2.0, -0.5), Vec3::X, Vec3::Z, 1);
    for triangle in &mut scene.triangles[2..] {
        let uvs = triangle.positions.map(|p| vec2(p.x + 0.5, p.z + 0.5));
        scene.attributes.push(Attributes { uvs: [uvs, [Vec2::ZERO; 3]], ..Attributes::default() });
        triangle.attributes = scene.attributes.len() as u32;
    }
    scene
}

fn add_image(scene: &mut Scene, width: u32, texels: Vec<[u8; 4]>) -> Texture {
    let height = texels.len() as u32 / width;
    scene.images.push(Image { name: String::new(), width, height, texels });
    Texture {
        image: scene.images.len() as u32 - 1,
        wrap: [Wrap::Clamp; 2],
        is_linear: false,
        is_mipmapped: true,
        uv_set: 0,
        transform: Texture::IDENTITY,
    }
}

fn textured(width: u32, texels: Vec<[u8; 4]>, change: impl Fn(&mut Texture)) -> Scene {
    let mut scene = lamp();
    let mut texture = add_image(&mut scene, width, texels);
    change(&mut texture);
    scene.materials[1].textures.emission = Some(texture);
    scene
}

/// Lamps that shine like the half of the lamp at x > 0.
fn half_lamps() -> Vec<(&'static str, Scene)> {
    let (black, white) = ([0, 0, 0, 255], [255; 4]);
    let plain = textured(2, vec![black, white], |_| {});
    let turned = textured(1, vec![white, black], |t| t.transform = [[0.0, 1.0, 0.0], [-1.0, 0.0, 1.0]]);
    let cut_out = |alpha: Alpha| {
        let mut scene = lamp();
        let texture = add_image(&mut scene, 2, vec![[255, 255, 255, 0], white]);
        scene.materials[1].textures.base_color = Some(texture);
        scene.materials[1].alpha = alpha;
        scene
    };
    vec![
        ("plain", plain),
        ("transformed", turned),
        ("masked", cut_out(Alpha::Mask { cutoff: 0.5 })),
        ("blended", cut_out(Alpha::Blend)),
    ]
}

/// Flux of the direct photons that fall on the floor at x > 0 and x < 0, W.
fn halves(scene: &Scene) -> [f64; 2] {
    let map = super::traced(scene, &settings(Mode::DirectPhotons, 40_000, 1)).maps.global;
    let photons = map.read(gpu()).expect("photons read back");
    [1.0, -1.0].map(|side| super::flux(photons.iter().filter(|p| side * p.position[0] > 0.0), map.emitted))
}

#[test]
fn a_half_black_lamp_lights_like_its_other_half() {
    let mut half = floor(3.0);
    half.materials.push(emissive("lamp", 0.0, 2.0, false));
    add_quad(&mut half, vec3(0.0, 2.0, -0.5), 0.5 * Vec3::X, Vec3::Z, 1);
    let points = [vec3(0.3, 0.0, 0.1), vec3(-1.2, 0.0, 0.7)];
    let rays = |scene: &Scene| points.map(|p| irradiance_at(scene, p + vec3(0.0, 0.5, 0.001), p, 64));
    let fits = |found: [f64; 2], right: [f64; 2], most| found.iter().zip(right).all(|(a, b)| within(*a, b, most));
    let (by_rays, by_photons) = (rays(&half), halves(&half));
    for (name, scene) in half_lamps() {
        let (found, flux) = (rays(&scene), halves(&scene));
        assert!(fits(found, by_rays, 0.01), "{name}: {found:?} instead of {by_rays:?}");
        assert!(fits(flux, by_photons, 0.01), "{name}: photons of {flux:?} instead of {by_photons:?}");
    }
    let (found, flux) = (rays(&lamp()), halves(&lamp()));
    assert!(!fits(found, by_rays, 0.01) && !fits(flux, by_photons, 0.01), "control: {found:?} and {flux:?}");
}

#[test]
fn half_covered_lamps_give_half_the_light() {
    let faint = |opacity: f32| {
        let mut scene = lamp();
        (scene.materials[1].alpha, scene.materials[1].opacity) = (Alpha::Blend, opacity);
        scene.spheres.push(sphere(vec3(1.5, 1.0, 0.0), 0.3, 1));
        scene
    };
    let point = vec3(0.2, 0.0, 0.3);
    let rays = |scene: &Scene| irradiance_at(scene, point + vec3(0.0, 0.4, 0.001), point, 64);
    let (whole, half) = (faint(1.0), faint(0.5));
    assert!(within(rays(&half), 0.5 * rays(&whole), 0.01), "{} of {}", rays(&half), rays(&whole));
    assert!(!within(rays(&faint(0.55)), 0.5 * rays(&whole), 0.01), "control: more of the lamp is there");
    // In a wide ball, all photons are stored.
    let flux = |opacity| {
        let mut scene = faint(opacity);
        scene.triangles.drain(..2);
        scene.spheres.push(sphere(Vec3::ZERO, 50.0, 0));
        direct_flux(&scene, 40_000)
    };
    let right = 0.5 * 2.0 * PI * (1.0 + 4.0 * PI * 0.09);
    assert!(within(flux(0.5), right, 0.01), "photons: {} W instead of {right} W", flux(0.5));
    assert!(!within(flux(0.55), right, 0.01), "control: {} W", flux(0.55));
}

/// Irradiance of the floor at a point by small patches of the lamp, with a factor of their position
/// along x.
fn by_patches(point: Vec3, factor: impl Fn(f64) -> f64) -> f64 {
    const PATCHES: usize = 400;
    let patch = |i: usize| {
        let [x, z] = [i % PATCHES, i / PATCHES].map(|i| (i as f64 + 0.5) / PATCHES as f64);
        let way = glam::dvec3(x - 0.5, 2.0, z - 0.5) - point.as_dvec3();
        2.0 * factor(x) * way.y.powi(2) / way.length_squared().powi(2)
    };
    (0..PATCHES * PATCHES).map(patch).sum::<f64>() / (PATCHES * PATCHES) as f64
}

#[test]
fn a_gradient_lights_as_the_sum_of_its_patches() {
    let (black, white) = ([0, 0, 0, 255], [255; 4]);
    // Linear between the middles of two texels, the whole lamp lies between them.
    let gradient = |texels| {
        textured(2, texels, |t| {
            t.is_linear = true;
            t.transform = [[0.5, 0.0, 0.25], [0.0, 1.0, 0.0]];
        })
    };
    let (scene, turned) = (gradient(vec![black, white]), gradient(vec![white, black]));
    for point in [vec3(0.6, 0.0, 0.1), vec3(-1.2, 0.0, 0.7)] {
        let right = by_patches(point, |x| x);
        let measured = |scene: &Scene, samples| irradiance_at(scene, point + vec3(0.0, 0.5, 0.001), point, samples);
        for samples in [16, 64] {
            let found = measured(&scene, samples);
            assert!(within(found, right, 0.015), "at {point} by {samples} samples: {found} instead of {right}");
        }
        let other = measured(&turned, 64);
        assert!(!within(other, right, 0.015), "control: {other} by the gradient turned round");
    }
}

/// Power of the only light of a table, and of the only emitter of `info`, W in the first channel.
fn told(scene: &Scene) -> [f64; 2] {
    let buffers = SceneBuffers::new(gpu(), scene, &Bvh::build(scene), &Settings::default().lights).expect("it fits");
    [buffers.lights.table.named[0].power.x, scene.describe().emitters[0].power[0]]
}

#[test]
fn power_and_photons_follow_the_mean_of_the_texture_however_it_is_wrapped() {
    let mut random = photons::Random(3);
    let texels: Vec<[u8; 4]> =
        (0..5 * 3).map(|_| [(255.0 * random.unit()) as u8, (255.0 * random.unit()) as u8, 9, 255]).collect();
    let wrapped = |wrap, is_linear| {
        let mut scene = textured(5, texels.clone(), |t| {
            (t.wrap, t.is_linear) = ([wrap; 2], is_linear);
            t.transform = [[1.1, 0.7, -0.4], [-0.5, 1.3, 0.2]];
        });
        scene.triangles.drain(..2);
        scene.spheres.push(sphere(Vec3::ZERO, 50.0, 0));
        scene
    };
    let powers = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|wrap| {
        let mut of_wrap = 0.0;
        for is_linear in [false, true] {
            let scene = wrapped(wrap, is_linear);
            let ([table, info], flux) = (told(&scene), direct_flux(&scene, 60_000));
            assert!(
                within(table, flux, 0.01),
                "{wrap:?}, linear {is_linear}: a table of {table} W, photons of {flux} W"
            );
            assert!(within(info, table, 1e-3), "{wrap:?}, linear {is_linear}: info says {info} W, the table {table} W");
            of_wrap = flux;
        }
        of_wrap
    });
    assert!(!within(powers[0], powers[1], 0.01) && !within(powers[1], powers[2], 0.01), "control: {powers:?}");
    // The image once over the lamp: the mean of its texels.
    let whole = told(&textured(5, texels.clone(), |_| {}));
    let mean = |decode: &dyn Fn(f32) -> f32| {
        texels.iter().map(|t| f64::from(decode(f32::from(t[0]) / 255.0))).sum::<f64>() / texels.len() as f64
    };
    let (right, stored) = (2.0 * PI * mean(&srgb_decode), 2.0 * PI * mean(&|x| x));
    assert!(whole.iter().all(|power| within(*power, right, 0.01)), "{whole:?} instead of {right}");
    assert!(!within(whole[0], stored, 0.01), "control: the mean of the texels as stored, {stored}");
}

#[test]
fn a_black_texture_gives_no_light_and_is_told_of() {
    let table = |texels: Vec<[u8; 4]>, weight: Option<&str>| {
        let settings = Settings::default().with(|s| {
            s.lights.photon_weights = weight.map(|name| (name.to_owned(), 2.0)).into_iter().collect();
        });
        let scene = textured(64, texels, |t| t.is_linear = true);
        SceneBuffers::new(gpu(), &scene, &Bvh::build(&scene), &settings.lights).expect("it fits").lights.table
    };
    let mut texels = vec![[0, 0, 0, 255]; 64 * 64];
    let dark = table(texels.clone(), Some("lamp"));
    assert_eq!((dark.lights.len(), dark.has_extent(), dark.has_surfaces()), (0, false, false));
    assert_eq!(dark.warnings, [r#"material "lamp" is black wherever it is seen: it gives no light"#]);
    let seen = |texels| {
        let mut scene = textured(64, texels, |t| t.is_linear = true);
        scene.cameras.push(camera(vec3(0.0, 1.0, 0.001), Vec3::ZERO, 60.0));
        mean(&render_scene(&scene, &settings(Mode::Hybrid, 1000, 8)))
    };
    assert_eq!(seen(texels.clone()), 0.0);
    texels[30 * 64 + 31] = [255; 4];
    let lit = table(texels.clone(), None);
    assert!(lit.has_extent() && lit.warnings.is_empty() && seen(texels) > 0.0, "control: a bright texel");
    let power = lit.named[0].power.x;
    assert!(within(power, 2.0 * PI / 4096.0, 0.05), "{power} W of one texel in 4096");
}
