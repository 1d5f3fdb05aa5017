//! Veils: surfaces of an opacity between 0 and 1 (`alphaMode` BLEND), before and between others.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | unlit cards | Σ a c Π (1 − a), in each sample; alpha is 1 − Π (1 − a), depth the mean by weights | the cards in another order |
//! | glowing cards | the same for lamps; of more than are followed, in the mean | one card fewer |
//! | shadows | Π (1 − a) of the light of a lamp, in each sample | one card fewer |
//! | in one place | a card on a wall, two on it, and a doubled one | the doubled card once |
//! | glass and metal | all is as bright as the sky | the sky without the cards |
//! | modes | those of rays and of photons agree | cards of another opacity |
//! | many faint veils | before white, all is as bright as the sky, by photons | the raw estimate |
//! | mattes | each object has its part, in the mean | – |

use caustica::{
    renderer::Render,
    scene::{Alpha, Environment, Material, Scene, Surface},
    settings::{ExtraLayers, Mode},
};
use glam::{Vec3, vec3};
use support::*;

/// A card before the camera: opacity, colour, height above the plane z = 0.
type Card = (f32, [f32; 3], f32);

const CARDS: [Card; 4] =
    [(0.3, [0.9, 0.1, 0.2], 0.8), (0.5, [0.1, 0.8, 0.3], 0.6), (0.07, [0.2, 0.3, 0.9], 0.5), (0.7, [0.6; 3], 0.2)];

fn veil(opacity: f32, material: Material) -> Material {
    Material { alpha: Alpha::Blend, opacity, double_sided: true, ..material }
}

fn unlit(color: [f32; 3]) -> Material {
    Material { unlit: true, ..Material::new("label", Surface::Diffuse { albedo: color.into() }) }
}

fn glowing(color: [f32; 3]) -> Material {
    Material { emission: color.into(), ..Material::new("lamp", diffuse(0.0)) }
}

/// Adds a card that is larger than what the camera sees.
fn add_card(scene: &mut Scene, material: Material, height: f32) {
    let index = scene.materials.len() as u32;
    scene.materials.push(material);
    let first = scene.triangles.len();
    add_quad(scene, vec3(-1.5, -1.4, height), Vec3::X * 3.0, Vec3::Y * 3.0, index);
    scene.objects.push(format!("card {index}"));
    let object = scene.objects.len() as u32 - 1;
    scene.triangles[first..].iter_mut().for_each(|triangle| triangle.object = object);
}

/// A camera that looks down at cards, in a constant sky.
fn scene_of(cards: &[Card], material: impl Fn([f32; 3]) -> Material, sky: f32) -> Scene {
    let mut scene = Scene { cameras: vec![camera(vec3(0.1, 0.2, 2.0), Vec3::ZERO, 30.0)], ..Scene::default() };
    for &(opacity, color, height) in cards {
        add_card(&mut scene, veil(opacity, material(color)), height);
    }
    scene.environment = Some(Environment::uniform(Vec3::splat(sky)));
    scene
}

/// Colour over the cards, from the nearest on, before a background.
fn composed(cards: &[Card], background: f32) -> [f32; 3] {
    let over = |behind: Vec3, (opacity, color, _): &Card| *opacity * Vec3::from(*color) + (1.0 - opacity) * behind;
    cards.iter().rev().fold(Vec3::splat(background), over).to_array()
}

/// Largest distance of a channel of a pixel from that colour.
fn farthest(render: &Render, color: [f32; 3]) -> f32 {
    let apart = |pixel: &[f32; 3]| (Vec3::from(*pixel) - Vec3::from(color)).abs().max_element();
    render.frame.radiance().iter().map(apart).fold(0.0, f32::max)
}

#[test]
fn unlit_cards_are_composed_in_each_sample() {
    let settings = settings(Mode::DirectRays, 1, 16);
    // More than there are slots for, as these need none.
    let many: Vec<Card> = (0..16).map(|i| (0.1, [0.05 * i as f32, 1.0, 0.5], 0.9 - 0.04 * i as f32)).collect();
    for cards in [&CARDS[..], &many] {
        let picture = render_scene(&scene_of(cards, unlit, 2.0), &settings);
        let apart = farthest(&picture, composed(cards, 2.0));
        assert!(apart < 1e-5, "{apart}");
        let mut turned = cards.to_vec();
        turned.reverse();
        assert!(farthest(&picture, composed(&turned, 2.0)) > 0.05, "control: another order");
    }
    let picture = render_scene(&scene_of(&CARDS, unlit, 1.0), &settings);
    let weights = composed(&CARDS.map(|(opacity, _, height)| (opacity, [1.0, 2.0 - height, 0.0], 0.0)), 0.0);
    let [alpha, depth, _] = weights;
    let forward = vec3(0.1, 0.2, 2.0).normalize().z;
    for (pixel, (a, z)) in picture.frame.alpha().iter().zip(picture.frame.depth()).enumerate() {
        assert!((a - alpha).abs() < 1e-5, "{a} instead of {alpha}");
        // Planes across a leaning axis: the middle of the picture has the mean depth.
        let is_middle = [7, 8].contains(&(pixel % 16)) && [7, 8].contains(&(pixel / 16));
        assert!(!is_middle || (z * forward * alpha - depth).abs() < 0.02, "{z} {depth}");
    }
}

#[test]
fn glowing_cards_are_composed() {
    let settings = settings(Mode::DirectRays, 1, 64);
    let apart = farthest(&render_scene(&scene_of(&CARDS[..3], glowing, 1.5), &settings), composed(&CARDS[..3], 1.5));
    assert!(apart < 1e-5, "{apart}");
    let many: Vec<Card> =
        (0..16).map(|i| (0.2, [if i % 2 == 0 { 1.0 } else { 3.0 }; 3], 0.9 - 0.05 * i as f32)).collect();
    let [right, ..] = composed(&many, 3.0);
    let seen = |cards: &[Card]| mean(&render_scene(&scene_of(cards, glowing, 3.0), &settings));
    assert!(within(seen(&many), right.into(), 0.01), "{} instead of {right}", seen(&many));
    assert!(!within(seen(&many[1..]), right.into(), 0.05), "control: one fewer");
}

#[test]
fn veils_take_their_part_of_a_lamps_light() {
    let lit = |cards: &[Card]| {
        let mut scene = scene_of(&[], unlit, 0.0);
        add_card(&mut scene, Material::new("floor", diffuse(0.8)), 0.0);
        scene.cameras = vec![camera(vec3(0.0, -0.2, 0.15), vec3(0.0, -0.1, 0.0), 40.0)];
        for &(opacity, color, height) in cards {
            add_card(&mut scene, veil(opacity, Material::new("", Surface::Diffuse { albedo: color.into() })), height);
        }
        scene.lights.push(point_light(vec3(0.2, 0.1, 1.0), 3.0));
        // Rays of either kind: to few lamps, and to drawn ones.
        scene.environment = None;
        let all = [0, 20].map(|others| {
            let mut scene = scene.clone();
            scene.lights.extend((0..others).map(|i| point_light(vec3(-0.1 * i as f32, 0.1, 1.1), 2.0)));
            let settings = settings(Mode::DirectRays, 1, 16);
            render_scene(&scene, &settings).frame.radiance().to_vec()
        });
        all.concat()
    };
    let (alone, behind, fewer) = (lit(&[]), lit(&CARDS), lit(&CARDS[1..]));
    let left: f32 = CARDS.iter().map(|(opacity, ..)| 1.0 - opacity).product();
    // A ray through the edge between two triangles meets both.
    let is_right = |seen: &[[f32; 3]]| {
        let wrong =
            seen.iter().flatten().zip(alone.iter().flatten()).filter(|(a, b)| (**a - left * **b).abs() > 1e-4 * **b);
        wrong.count() <= seen.len() / 100
    };
    assert!(alone.iter().all(|[r, ..]| *r > 0.0));
    assert!(is_right(&behind));
    assert!(!is_right(&fewer), "control: one fewer");
}

#[test]
fn veils_in_one_place_are_all_met() {
    let settings = settings(Mode::DirectRays, 1, 16);
    let seen = |cards: &[Card], wall: Option<f32>, smaller: f32| {
        let mut scene = scene_of(&[], unlit, 0.0);
        for (i, &(opacity, color, height)) in cards.iter().enumerate() {
            let index = scene.materials.len() as u32;
            scene.materials.push(veil(opacity, unlit(color)));
            let half = 1.0 + smaller * i as f32;
            add_quad(&mut scene, vec3(-half, -half, height), Vec3::X * 2.0 * half, Vec3::Y * 2.0 * half, index);
        }
        if let Some(light) = wall {
            scene.materials.push(unlit([light; 3]));
            let index = scene.materials.len() as u32 - 1;
            add_quad(&mut scene, vec3(-3.0, -3.1, 0.5), Vec3::X * 6.0, Vec3::Y * 6.0, index);
        }
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        render_scene(&scene, &settings)
    };
    // The smaller of those in one place is met first.
    let [a, b] = [(0.4, [0.2, 0.9, 0.1], 0.5), (0.7, [0.6, 0.3, 0.8], 0.5)];
    for cards in [&[a][..], &[a, b], &[b, a]] {
        let apart = farthest(&seen(cards, Some(3.0), 0.3), composed(cards, 3.0));
        assert!(apart < 1e-5, "{apart}");
    }
    let twice = seen(&[a, a], None, 0.0);
    assert!(farthest(&twice, composed(&[a, a], 1.0)) < 1e-5);
    assert!(farthest(&twice, composed(&[a], 1.0)) > 0.05, "control: once");
}

#[test]
fn what_veils_show_of_an_even_world_is_even() {
    let white = |color: [f32; 3]| unlit(color.map(|_| 1.0));
    let mut scene = scene_of(&CARDS[..2], white, 1.0);
    scene.materials.push(veil(0.6, Material::new("glass", glass())));
    scene.materials.push(Material {
        roughness: 0.5,
        metallic: 1.0,
        ..Material::new(
            "metal",
            Surface::Layered { base: Vec3::ONE, metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 },
        )
    });
    scene.spheres.push(sphere(vec3(0.1, 0.1, 0.3), 0.2, 2));
    scene.spheres.push(sphere(vec3(-0.2, -0.1, 0.3), 0.2, 3));
    let settings = settings(Mode::DirectRays, 1, 32).with(|s| s.picture.spp = 4);
    let seen = mean(&render_scene(&scene, &settings));
    assert!(within(seen, 1.0, 0.01), "{seen}");
    scene.materials[..2].iter_mut().for_each(|card| *card = veil(card.opacity, unlit([0.0; 3])));
    assert!(mean(&render_scene(&scene, &settings)) < 0.7, "control: black cards");
}

#[test]
fn faint_veils_have_the_light_of_their_photons() {
    // A tenth of the light stays at each, and so does a tenth of the photons.
    let cards: Vec<Card> =
        (0..20).map(|i| (0.1, [1.0; 3], 0.05 * (20 - i) as f32)).chain([(1.0, [1.0; 3], -0.1)]).collect();
    let white = |color: [f32; 3]| Material::new("veil", Surface::Diffuse { albedo: color.into() });
    let scene = scene_of(&cards, white, 1.0);
    let seen = |raw| {
        let settings = settings(Mode::Hybrid, 100_000, 8).with(|s| {
            s.estimate.raw = raw;
            s.picture.spp = 16;
        });
        mean(&render_scene(&scene, &settings))
    };
    assert!(within(seen(false), 1.0, 0.02), "{}", seen(false));
    assert!(!within(seen(true), 1.0, 0.05), "control: {} as if all of each disc were there", seen(true));
}

#[test]
fn photons_and_rays_agree_behind_veils() {
    let scene = |opacity: f32| {
        let paint = |color| Material::new("card", Surface::Diffuse { albedo: color });
        let mut scene = scene_of(&[], unlit, 0.0);
        add_card(&mut scene, paint(Vec3::splat(0.7)), 0.0);
        add_card(&mut scene, veil(0.3, paint(vec3(0.8, 0.3, 0.2))), 0.3);
        add_card(&mut scene, veil(opacity, paint(vec3(0.1, 0.1, 0.3))), 0.6);
        scene.lights.push(point_light(vec3(0.2, -0.3, 1.0), 3.0));
        scene.environment = None;
        scene
    };
    let light = |mode, opacity| mean(&render_scene(&scene(opacity), &settings(mode, 100_000, 16)));
    let [rays, photons] = [Mode::Hybrid, Mode::Photons].map(|mode| light(mode, 0.3));
    assert!(within(rays, photons, 0.02), "{rays} {photons}");
    let other = light(Mode::Hybrid, 0.6);
    assert!(!within(other, photons, 0.04), "control: another opacity, {other}");
}

#[test]
fn mattes_have_their_parts_in_the_mean() {
    let settings = settings(Mode::DirectRays, 1, 32).with(|s| {
        s.picture.spp = 4;
        s.picture.layers = vec![ExtraLayers::Objects];
    });
    let picture = render_scene(&scene_of(&CARDS[..2], unlit, 1.0), &settings);
    let channels: Vec<_> = picture.frame.extras().filter(|(name, _)| name.starts_with("CryptoObject0")).collect();
    let of = |end: &str| channels.iter().filter(|(name, _)| name.ends_with(end)).map(|(_, c)| *c).collect::<Vec<_>>();
    // Ranks follow the parts; all parts together are the coverage.
    let covered: f32 = ["G", "A"].iter().flat_map(|end| of(end)).flatten().sum::<f32>() / 1024.0;
    assert!((covered - 0.65).abs() < 0.02, "{covered}");
}
