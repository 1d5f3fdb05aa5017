//! Paths through all lobes: the table of `docs/transport.md`, a scene for each row in which it
//! dominates, and the energy of every lobe.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | furnace | a ball of each material under a uniform sky is as bright as its albedo says | half of the sky |
//! | lobes | modes 0 and 1 agree on a room with a ball of each material | a ball of another material |
//! | rays | light seen in sharp and rough metal is there in all modes that show direct light | the mode that does not |
//! | parallel lamp | a flat lamp lights metal that is parallel to it as it does when it is turned a little | lamp turned away |
//! | blur | the picture of a lamp in metal keeps its energy as it blurs | a smaller lamp |
//! | final gathering | light off rough lobes counts once in it | a black ball |
//! | caustic | a rough ball's caustic is in the modes with photons | lamp turned away |
//! | bound | caustic photons above the roughness bound are those of the global map | a darker ball |
//! | trees | grid and kd-tree give the same picture of every lobe | another material |
//! | unlit | an unlit surface has its colour, whatever the sky | a lit one |
//! | transmission | a leaf lights what is behind it, and photons and rays agree | a leaf that transmits less |

use caustica::{
    scene::{Environment, LightKind, Material, Scene, Surface},
    settings::{Mode, Search},
};
use glam::{Vec3, vec3};
use support::*;

fn metal(roughness: f32) -> Material {
    let surface = Surface::Layered { base: Vec3::ONE, metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
    Material { roughness, ..Material::new("metal", surface) }
}

fn coated(roughness: f32) -> Material {
    let surface = Surface::Layered { base: Vec3::splat(0.5), metallic: 0.0, f0: Vec3::splat(0.04), specular: 1.0 };
    Material { roughness, ..Material::new("coated", surface) }
}

fn rough_glass() -> Material {
    Material { roughness: 0.3, ..Material::new("glass", glass()) }
}

/// A material of each lobe, by name.
fn lobes() -> Vec<(&'static str, Material)> {
    let leaf = Material {
        diffuse_transmission: 0.5,
        diffuse_transmission_color: Vec3::splat(0.5),
        ..Material::new("leaf", diffuse(0.5))
    };
    let cloth = Material {
        clearcoat: 0.5,
        clearcoat_roughness: 0.1,
        sheen_color: Vec3::splat(0.8),
        sheen_roughness: 0.5,
        ..coated(0.6)
    };
    vec![
        ("metal", metal(0.2)),
        ("coat", coated(0.3)),
        ("clear coat over sheen", cloth),
        ("leaf", leaf),
        ("film", Material { iridescence: 1.0, iridescence_ior: 2.0, iridescence_thickness: [300.0; 2], ..metal(0.6) }),
        ("rough glass", rough_glass()),
        ("coated glass", Material { clearcoat: 1.0, clearcoat_roughness: 0.1, ..Material::new("", glass()) }),
        ("prism", Material { dispersion: 2.0, ..Material::new("prism", glass()) }),
    ]
}

/// A ball that fills the picture, under a sky of radiance 1.
fn furnace(material: Material) -> Scene {
    let mut scene = Scene { materials: vec![material], ..Scene::default() };
    scene.spheres.push(sphere(Vec3::ZERO, 1.0, 0));
    scene.cameras.push(camera(vec3(0.0, 0.0, 4.0), Vec3::ZERO, 20.0));
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    scene
}

#[test]
fn every_lobe_reflects_what_it_gets() {
    // Rough glass loses what meets several of its microfacets. The other bounds are what is left
    // of the noise, and Schlick's weights above a coat.
    let table = [
        ("smooth metal", metal(0.0), 0.999, 1.001),
        ("metal", metal(0.2), 0.99, 1.01),
        ("rough metal", metal(1.0), 0.985, 1.015),
        ("film", Material { iridescence: 1.0, ..metal(0.3) }, 0.99, 1.01),
        ("film on glass", Material { iridescence: 1.0, ..Material::new("", glass()) }, 0.98, 1.02),
        ("film on rough glass", Material { iridescence: 1.0, ..rough_glass() }, 0.95, 1.0),
        ("glass under a clear coat", Material { clearcoat: 1.0, ..Material::new("", glass()) }, 0.98, 1.01),
        ("glass", Material { dispersion: 2.0, ..Material::new("", glass()) }, 0.98, 1.02),
        ("rough glass", rough_glass(), 0.95, 1.0),
        ("white and metal under a film", half_metal(filmed([400.0; 2])), 0.93, 1.01),
        ("white under a film", filmed([300.0; 2]), 0.85, 1.005),
        ("white under a film that reflects much", filmed([200.0; 2]), 0.8, 1.005),
        ("white under a coat", Material { surface: white_coated(), roughness: 0.5, ..coated(0.5) }, 0.985, 1.02),
    ];
    let mean_of = |material: &Material, strength: f32| {
        let mut scene = furnace(material.clone());
        // So that all have the same kernels, which take longer to compile than to run.
        scene.materials.extend(table.iter().map(|(_, material, ..)| material.clone()));
        scene.environment.as_mut().expect("a sky").strength = strength;
        mean(&render_scene(
            &scene,
            &settings(Mode::Hybrid, 1000, 16).with(|s| {
                s.picture.spp = 64;
                // None stays.
                s.photons.max_paths = Some(1000);
            }),
        ))
    };
    for (name, material, least, most) in &table {
        let found = mean_of(material, 1.0);
        assert!((*least..*most).contains(&found), "{name}: {found}");
        let half = mean_of(material, 0.5);
        assert!(half < *least, "control: {name} under half of the sky has {half}");
    }
}

/// A strong film over a white base.
fn filmed(iridescence_thickness: [f32; 2]) -> Material {
    let surface = white_coated();
    Material { surface, iridescence: 1.0, iridescence_ior: 2.4, iridescence_thickness, roughness: 0.3, ..coated(0.3) }
}

/// The same of a base that is metal in half, under a fainter film.
fn half_metal(material: Material) -> Material {
    let surface = Surface::Layered { base: Vec3::ONE, metallic: 0.5, f0: Vec3::splat(0.04), specular: 1.0 };
    Material { surface, iridescence_ior: 1.3, ..material }
}

fn white_coated() -> Surface {
    Surface::Layered { base: Vec3::ONE, metallic: 0.0, f0: Vec3::splat(0.04), specular: 1.0 }
}

/// A room with a ball of that material and a lamp of some size.
fn room(material: Material) -> Scene {
    let mut scene = Scene {
        materials: vec![Material::new("wall", diffuse(0.5)), material, emissive("lamp", 0.0, 20.0, false)],
        ..Scene::default()
    };
    add_box(&mut scene, vec3(-1.0, 0.0, -1.0), vec3(1.0, 2.0, 3.0), 0);
    scene.spheres.push(sphere(vec3(0.0, 0.7, 0.0), 0.6, 1));
    add_quad(&mut scene, vec3(-0.3, 1.95, 0.6), vec3(0.0, 0.0, -0.6), vec3(0.6, 0.0, 0.0), 2);
    scene.cameras.push(camera(vec3(0.0, 1.0, 2.9), vec3(0.0, 0.8, 0.0), 50.0));
    scene
}

#[test]
fn small_frosted_covers_cast_caustics() {
    // A lamp in a bulb of rough glass, by a bound of roughness.
    let lit = |radius: f32, bound: f32| {
        let cover = Material { roughness: 0.6, ..Material::new("bulb", Surface::Pane { ior: 1.5, tint: Vec3::ONE }) };
        let mut scene = Scene { materials: vec![Material::new("wall", diffuse(0.5)), cover], ..Scene::default() };
        scene.materials.push(emissive("lamp", 0.0, 100.0, false));
        add_box(&mut scene, vec3(-1.0, 0.0, -1.0), vec3(1.0, 2.0, 3.0), 0);
        scene.spheres.push(sphere(vec3(0.0, 1.0, 0.0), radius, 1));
        scene.spheres.push(sphere(vec3(0.0, 1.0, 0.0), 0.02, 2));
        scene.cameras.push(camera(vec3(0.0, 1.0, 2.9), vec3(0.0, 0.8, 0.0), 50.0));
        scene.options.caustic_roughness = bound;
        let render = render_scene(&scene, &settings(Mode::Hybrid, 20_000, 12));
        (render.stats.photons.caustic.stored > 0, mean(&render))
    };
    let (stored, found) = lit(0.08, 0.45);
    assert_eq!((stored, found), lit(0.08, 1.0), "the bulb casts caustics by any bound");
    assert!(!lit(0.08, 0.0).0, "but for that by which nothing does");
    assert!(!lit(0.5, 0.45).0 && lit(0.5, 1.0).0, "control: as large a cover by its roughness");
}

#[test]
fn unlit_surfaces_show_their_colour_alone() {
    let seen = |unlit: bool| {
        let mut scene = furnace(Material { unlit, ..Material::new("label", diffuse(0.5)) });
        scene.environment.as_mut().expect("a sky").strength = 0.5;
        mean(&render_scene(&scene, &settings(Mode::Hybrid, 1000, 8)))
    };
    assert!((seen(true) - 0.5).abs() < 1e-3, "{}", seen(true));
    assert!((seen(false) - 0.25).abs() < 0.05, "control: {}", seen(false));
}

#[test]
fn rays_and_photons_agree_on_every_lobe() {
    let of = |material: &Material, mode| {
        let settings = settings(mode, 40_000, 20).with(|s| {
            s.photons.caustic = 10_000;
            s.picture.spp = 4;
        });
        mean(&render_scene(&room(material.clone()), &settings))
    };
    for (name, material) in lobes() {
        let (rays, photons) = (of(&material, Mode::Hybrid), of(&material, Mode::Photons));
        assert!((photons / rays - 1.0).abs() < 0.025, "{name}: {rays} by rays, {photons} by photons");
    }
    let (black, metal) = (of(&Material::new("", diffuse(0.0)), Mode::Hybrid), of(&metal(0.2), Mode::Photons));
    assert!((metal / black - 1.0).abs() > 0.05, "control: {black} with a black ball, {metal} with one of metal");
}

#[test]
fn light_in_metal_is_seen_by_rays() {
    for roughness in [0.0, 0.3] {
        let scene = furnace(metal(roughness));
        let of = |mode| {
            let settings = settings(mode, 1000, 8).with(|s| {
                s.picture.spp = 16;
                // None stays.
                s.photons.max_paths = Some(1000);
            });
            mean(&render_scene(&scene, &settings))
        };
        for mode in [Mode::Hybrid, Mode::Photons, Mode::DirectRays, Mode::DirectPhotons] {
            assert!((of(mode) - 1.0).abs() < 0.02, "roughness {roughness}, {mode:?}: {}", of(mode));
        }
        assert_eq!(of(Mode::IndirectPhotons), 0.0, "control: roughness {roughness}");
    }
}

/// A floor that only a ball of rough metal lights: the spot light points at the ball, from below a
/// screen.
fn caustic(roughness: f32, turned: bool) -> Scene {
    let mut scene =
        Scene { materials: vec![Material::new("floor", diffuse(0.5)), metal(roughness)], ..Scene::default() };
    add_quad(&mut scene, vec3(-2.0, 0.0, 2.0), vec3(4.0, 0.0, 0.0), vec3(0.0, 0.0, -4.0), 0);
    scene.spheres.push(sphere(vec3(0.0, 1.0, 0.0), 0.5, 1));
    let mut light = point_light(vec3(2.0, 1.0, 0.0), 20.0);
    light.kind = LightKind::Spot { inner: 0.05, outer: 0.2 };
    light.direction = if turned { Vec3::Y } else { Vec3::NEG_X };
    scene.lights.push(light);
    scene.cameras.push(camera(vec3(1.4, 3.0, 0.0), vec3(1.4, 0.0, 0.0), 28.0));
    scene
}

#[test]
fn a_lamp_in_metal_keeps_its_energy_as_it_blurs() {
    // Light directions weigh most where the lobe is wider than the lamp. The metal lies far from
    // the origin, so that its rays start farther off than the lamp's surface is moved.
    let energy = |roughness: f32, side: f32| {
        let mut scene =
            Scene { materials: vec![metal(roughness), emissive("lamp", 0.0, 20.0, false)], ..Scene::default() };
        add_quad(&mut scene, vec3(-3.0, -2.0, 3.0), vec3(6.0, 0.0, 0.0), vec3(0.0, 0.0, -6.0), 0);
        add_quad(&mut scene, vec3(-0.2, 0.0, 0.2), vec3(0.0, 0.0, -side), vec3(side, 0.0, 0.0), 1);
        scene.cameras.push(camera(vec3(0.6, -0.1, 0.6), vec3(0.3, -2.0, 0.3), 70.0));
        mean(&render_scene(&scene, &settings(Mode::DirectRays, 1000, 32).with(|s| s.picture.spp = 64)))
    };
    let sharp = energy(0.0, 0.4);
    for roughness in [0.1, 0.25] {
        let blurred = energy(roughness, 0.4);
        assert!(within(blurred, sharp, 0.06), "roughness {roughness}: {blurred} instead of {sharp}");
    }
    let smaller = energy(0.25, 0.38);
    assert!(!within(smaller, sharp, 0.06), "control: a smaller lamp has {smaller}, the lamp {sharp}");
}

#[test]
fn final_gathering_counts_light_off_rough_lobes_once() {
    let of = |material: &Material, final_gather: u32| {
        let settings = settings(Mode::Hybrid, 100_000, 24).with(|s| s.photons.final_gather = final_gather);
        mean(&render_scene(&room(material.clone()), &settings))
    };
    // The first throws a caustic, the second and the coat do not.
    for material in [metal(0.2), metal(0.6), coated(0.3)] {
        let (plain, gathered) = (of(&material, 0), of(&material, 12));
        assert!(within(gathered, plain, 0.015), "{material:?}: {gathered} instead of {plain}");
    }
    let black = of(&Material::new("black", diffuse(0.0)), 12);
    assert!(!within(black, of(&metal(0.2), 0), 0.015), "control: a black ball passes");
}

#[test]
fn grid_and_tree_agree_on_every_lobe() {
    let of = |material: &Material, search| {
        let settings = settings(Mode::Photons, 5000, 16).with(|s| {
            s.estimate.search = search;
            s.estimate.raw = true;
        });
        mean(&render_scene(&room(material.clone()), &settings))
    };
    for (name, material) in lobes() {
        let (grid, tree) = (of(&material, Search::Grid), of(&material, Search::KdTree));
        assert!(within(grid, tree, 1e-4), "{name}: {grid} by the grid, {tree} by the tree");
    }
    let (coat, bare) = (of(&coated(0.3), Search::Grid), of(&Material::new("", diffuse(0.5)), Search::KdTree));
    assert!(!within(coat, bare, 1e-4), "control: the coat takes nothing");
}

#[test]
fn the_caustic_of_rough_metal_is_that_of_photons() {
    // Few paths of general light end where the floor is seen.
    let settings = |mode| settings(mode, 40_000, 24).with(|s| s.photons.max_paths = Some(250_000));
    let of = |turned, mode| mean(&render_scene(&caustic(0.2, turned), &settings(mode)));
    let hybrid = of(false, Mode::Hybrid);
    assert!(hybrid > 0.001, "{hybrid}");
    assert!(of(false, Mode::DirectRays) < 0.02 * hybrid, "rays see none of it");
    for mode in [Mode::Photons, Mode::DirectPhotons, Mode::IndirectPhotons] {
        assert!((of(false, mode) / hybrid - 1.0).abs() < 0.02, "{mode:?}: {} for {hybrid}", of(false, mode));
    }
    assert!(of(true, Mode::Hybrid) < 0.02 * hybrid, "control: the lamp turned away");
}

#[test]
fn photons_above_the_bound_are_those_of_the_global_map() {
    let of = |bound: f32, tint: f32| {
        let mut scene = caustic(0.3, false);
        if let Surface::Layered { base, .. } = &mut scene.materials[1].surface {
            *base = Vec3::splat(tint);
        }
        scene.options.caustic_roughness = bound;
        let settings = settings(Mode::Hybrid, 40_000, 24).with(|s| s.photons.max_paths = Some(250_000));
        let render = render_scene(&scene, &settings);
        (mean(&render), render.stats.photons.caustic.stored, render.stats.photons.global.stored)
    };
    let ((caustic, stored, _), (global, none, moved)) = (of(0.35, 1.0), of(0.2, 1.0));
    assert!(stored > 0 && none == 0 && moved > 0, "{stored} and {none} in the caustic map, {moved} in the global one");
    assert!((global / caustic - 1.0).abs() < 0.05, "{caustic} as a caustic, {global} as global light");
    let (darker, ..) = of(0.35, 0.8);
    assert!((darker / caustic - 1.0).abs() > 0.1, "control: {darker} by a darker ball");
}

#[test]
fn a_leaf_lights_what_is_behind_it() {
    let of = |fraction: f32, mode| {
        let leaf = Material {
            diffuse_transmission: fraction,
            diffuse_transmission_color: Vec3::ONE,
            ..Material::new("leaf", diffuse(0.0))
        };
        let mut scene = Scene { materials: vec![Material::new("floor", diffuse(0.5)), leaf], ..Scene::default() };
        add_quad(&mut scene, vec3(-3.0, 0.0, 3.0), vec3(6.0, 0.0, 0.0), vec3(0.0, 0.0, -6.0), 0);
        add_quad(&mut scene, vec3(-3.0, 1.0, 3.0), vec3(6.0, 0.0, 0.0), vec3(0.0, 0.0, -6.0), 1);
        scene.lights.push(point_light(vec3(0.0, 2.0, 0.0), 10.0));
        // Between both, to the underside of the leaf.
        scene.cameras.push(camera(vec3(0.0, 0.3, 0.5), vec3(0.0, 1.0, 0.0), 40.0));
        mean(&render_scene(&scene, &settings(mode, 60_000, 16).with(|s| s.picture.spp = 4)))
    };
    let (rays, photons) = (of(1.0, Mode::Hybrid), of(1.0, Mode::Photons));
    // I cos θ/d² through the leaf at the axis, where it is most.
    let most = 10.0 / std::f64::consts::PI;
    assert!((0.6 * most..1.1 * most).contains(&rays), "{rays} of at most {most}");
    assert!((photons / rays - 1.0).abs() < 0.03, "{rays} by rays, {photons} by photons");
    let half = of(0.5, Mode::Hybrid);
    assert!((half / rays - 0.5).abs() < 0.03, "control: {half} through a leaf of half");
}

/// Brightness of a plate of rough metal above, lit from the side by a flat lamp that faces up,
/// turned by that angle from its plane.
fn plate_beside_a_lamp(turn: f32) -> f64 {
    let mut scene = Scene { materials: vec![metal(1.0), emissive("lamp", 0.0, 20.0, false)], ..Scene::default() };
    add_quad(&mut scene, vec3(-1.5, 1.2, -1.5), Vec3::X * 1.3, Vec3::Z * 3.0, 0);
    let along = vec3(turn.cos(), turn.sin(), 0.0);
    add_quad(&mut scene, vec3(1.3, 1.0, 1.0) - 0.5 * along, along, Vec3::Z * -2.0, 1);
    scene.cameras = vec![camera(vec3(-0.8, 0.0, 0.0), vec3(-0.8, 1.2, 0.0), 40.0)];
    mean(&render_scene(
        &scene,
        &settings(Mode::DirectRays, 1000, 16).with(|s| {
            s.picture.spp = 64;
        }),
    ))
}

#[test]
fn a_lamp_parallel_to_metal_lights_it() {
    let parallel = plate_beside_a_lamp(0.0);
    let turned = 0.5 * (plate_beside_a_lamp(0.01) + plate_beside_a_lamp(-0.01));
    assert!(within(parallel, turned, 0.03), "{parallel} parallel, {turned} turned a little");
    let away = plate_beside_a_lamp(std::f32::consts::PI);
    assert!(away < 0.01 * parallel, "control: a lamp turned away gives {away}");
}
