//! Light through smooth panes, as of windows: it goes straight on, so that it is direct light.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | sun | a floor behind a tinted pane has the closed form of the pane's transmittance, up to the edge of a shadow | a rough pane, whose light comes by photons |
//! | lamps and skies | lamps of all kinds and a sky light through a pane what they light by photons alone, a sky without more noise | no pane |
//! | globes, instances | a globe about a bulb, and instances, keep the same of it | the bulb alone |
//! | modes | all modes that show direct light show that through a pane | the mode that does not |
//! | reflection | what a pane reflects is a caustic of the closed form | a pane of another index |
//! | coats | rough metal and coats see a lamp behind a pane once, and a bulb and the sun behind panes and plates | the lamp without a pane; a pane of half the light |
//! | plates | the same of solids between two planes, with their absorption; and of things that stand on one | a wedge; the light without absorption |

use caustica::{
    renderer::Render,
    scene::{Environment, Instance, Light, LightKind, Material, Scene, SharedMesh, Surface},
    settings::{Mode, Settings},
};
use glam::{Mat3, Vec3, vec3};
use support::*;

const TINT: Vec3 = Vec3::new(0.9, 0.6, 0.3);

fn pane(tint: Vec3) -> Surface {
    Surface::Pane { ior: 1.5, tint }
}

/// Reflectance of a pane: both faces, by Fresnel's equations.
fn reflectance(cosine: f64, ior: f64) -> f64 {
    let below = (1.0 - (1.0 - cosine * cosine) / (ior * ior)).sqrt();
    let square = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let face = 0.5 * (square(ior * cosine, below) + square(cosine, ior * below));
    2.0 * face / (1.0 + face)
}

/// A floor of 4 m, and a pane of 4 m half a metre above it; the camera looks at the floor from
/// between them.
fn floor_below(surface: Surface, roughness: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    scene.materials.push(Material { roughness, ..Material::new("pane", surface) });
    add_quad(&mut scene, vec3(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z, 0);
    add_quad(&mut scene, vec3(-2.0, 0.5, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z, 1);
    scene.cameras.push(camera(vec3(0.0, 0.45, 0.9), vec3(0.0, 0.0, 0.0), 40.0));
    scene
}

fn sun(direction: Vec3) -> Light {
    Light { kind: LightKind::Directional, direction: direction.normalize(), ..point_light(Vec3::ZERO, 3.0) }
}

/// Few samples of direct light alone.
fn direct(size: u32) -> Settings {
    settings(Mode::DirectRays, 1000, size).with(|s| s.picture.spp = 4)
}

#[test]
fn the_sun_through_a_window_has_the_closed_form_up_to_the_edge_of_a_shadow() {
    let mut scene = floor_below(pane(TINT), 0.0);
    let towards = vec3(0.4, -1.0, 0.0).normalize();
    scene.lights.push(sun(towards));
    // A board above the pane: its shadow ends at x = 0 on the floor.
    let edge = -(towards.x / -towards.y) * 0.6;
    add_quad(&mut scene, vec3(-1.9, 0.6, 1.9), (1.9 + edge) * Vec3::X, -3.8 * Vec3::Z, 0);
    let render = render_scene(&scene, &direct(64));
    let cosine = f64::from(-towards.y);
    let bare = 3.0 * cosine * 0.5 / std::f64::consts::PI * (1.0 - reflectance(cosine, 1.5));
    let at = |render: &Render, column: usize| render.frame.radiance()[40 * 64 + column].map(f64::from);
    for (found, tint) in at(&render, 34).iter().zip(TINT.to_array()) {
        assert!(within(*found, bare * f64::from(tint), 1e-3), "{found} instead of {}", bare * f64::from(tint));
    }
    assert_eq!(at(&render, 29), [0.0; 3], "in the shadow of the board");
    scene.materials[1].roughness = 0.1;
    let rough = render_scene(&scene, &direct(64));
    assert_eq!(at(&rough, 34), [0.0; 3], "control: no ray to a light passes a rough pane");
}

#[test]
fn globes_and_instances_of_panes_let_light_through() {
    let mut scene = floor_below(pane(TINT), 0.0);
    scene.lights.push(sun(vec3(0.4, -1.0, 0.3)));
    let mut shared = scene.clone();
    let (panes, floor) = scene.triangles.iter().partition(|t| t.material == 1);
    (shared.meshes, shared.triangles) = (vec![SharedMesh { triangles: panes }], floor);
    // Stretched and tilted.
    let linear = Mat3::from_rotation_z(0.2) * Mat3::from_diagonal(vec3(2.0, 0.5, 1.5));
    shared.instances.push(Instance { mesh: 0, object: 0, linear, offset: vec3(0.0, 0.4, 0.0) });
    let right = mean(&render_scene(&with_copies(&shared), &direct(16)));
    let found = mean(&render_scene(&shared, &direct(16)));
    assert!(within(found, right, 1e-4), "{found} instead of {right}");
    // A bulb in the middle of a globe, in place of the pane.
    scene.triangles.retain(|t| t.material == 0);
    scene.lights = vec![point_light(vec3(0.0, 0.6, 0.0), 1.0)];
    let bare = mean(&render_scene(&scene, &direct(16)));
    scene.spheres.push(sphere(vec3(0.0, 0.6, 0.0), 0.1, 1));
    let found = mean(&render_scene(&scene, &direct(16)));
    let kept = f64::from(TINT.element_sum() / 3.0) * (1.0 - reflectance(1.0, 1.5));
    assert!(within(found, kept * bare, 1e-3), "{found} instead of {}", kept * bare);
    assert!(found < 0.6 * bare, "control: {found}, {bare}");
    // The sun through the middle of the globe, which it passes twice.
    scene.lights = vec![sun(Vec3::NEG_Y)];
    scene.cameras = vec![camera(vec3(0.0, 0.3, 0.3), Vec3::ZERO, 2.0)];
    let found = mean(&render_scene(&scene, &direct(16)));
    let bare = 3.0 * 0.5 / std::f64::consts::PI;
    let tints = f64::from((TINT * TINT).element_sum() / 3.0);
    let right = bare * tints * (1.0 - reflectance(1.0, 1.5)).powi(2);
    assert!(within(found, right, 1e-3), "{found} instead of {right}");
}

/// A closed room, half of which a pane divides off, with a light in that half.
fn divided(pane: Option<Surface>, light: impl FnOnce(&mut Scene)) -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    add_box(&mut scene, Vec3::ONE, Vec3::NEG_ONE, 0);
    light(&mut scene);
    if let Some(pane) = pane {
        scene.materials.push(Material::new("pane", pane));
        let last = scene.materials.len() as u32 - 1;
        add_quad(&mut scene, vec3(-1.0, -1.0, 0.1), 2.0 * Vec3::X, 2.0 * Vec3::Y, last);
    }
    scene.cameras.push(camera(vec3(0.0, 0.1, 0.95), vec3(0.0, -0.6, 0.3), 70.0));
    scene
}

fn lamp(scene: &mut Scene) {
    scene.materials.push(emissive("lamp", 0.0, 20.0, true));
    let lamp = scene.materials.len() as u32 - 1;
    add_quad(scene, vec3(-0.3, 0.2, -0.5), 0.5 * Vec3::X, 0.4 * Vec3::Z, lamp);
}

#[test]
fn lamps_light_through_panes_what_their_photons_do() {
    let many = |s: &mut Scene| {
        let at = |i: u32| vec3(0.08 * (i % 20) as f32 - 0.8, 0.5, -0.1 - 0.04 * (i / 20) as f32);
        s.lights.extend((0..40).map(|i| point_light(at(i), 0.01)));
    };
    let bulb_lamp_and_ball = |s: &mut Scene| {
        s.lights.push(point_light(vec3(0.2, 0.5, -0.4), 1.0));
        lamp(s);
        s.spheres.push(sphere(vec3(0.5, 0.0, -0.5), 0.15, 1));
    };
    let lights: [fn(&mut Scene); 2] = [bulb_lamp_and_ball, many];
    for (name, light) in ["a bulb, a lamp and a ball", "many bulbs"].into_iter().zip(lights) {
        let scene = divided(Some(pane(TINT)), light);
        let rays = mean(&render_scene(&scene, &settings(Mode::Hybrid, 30_000, 24).with(|s| s.picture.spp = 4)));
        let photons = mean(&render_scene(&scene, &settings(Mode::Photons, 100_000, 24)));
        assert!(within(rays, photons, 0.01), "{name}: {rays} by rays, {photons} by photons");
        let open = divided(None, light);
        let open = mean(&render_scene(&open, &settings(Mode::Hybrid, 20_000, 24).with(|s| s.picture.spp = 4)));
        assert!(rays < 0.8 * open, "control: {rays}, without a pane {open}");
    }
}

#[test]
fn the_sky_lights_a_room_through_its_window() {
    let mut scene = divided(Some(pane(Vec3::ONE)), |_| {});
    // Without the wall behind the pane.
    scene.triangles.retain(|t| t.positions.iter().any(|p| p.z > -0.99));
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    let mut open = scene.clone();
    open.materials.pop();
    open.triangles.retain(|t| t.material == 0);
    // Photons alone are too bright in corners, with a pane and without.
    let kept = |settings: &Settings| mean(&render_scene(&scene, settings)) / mean(&render_scene(&open, settings));
    let rays = kept(&settings(Mode::Hybrid, 50_000, 24).with(|s| s.picture.spp = 16));
    let photons = kept(&settings(Mode::Photons, 200_000, 24));
    assert!(within(rays, photons, 0.01), "{rays} by rays, {photons} by photons");
    assert!(rays < 0.97, "control: {rays}");
    // With as little noise as through the open window.
    let pixels = |scene: &Scene, spp: u32| {
        let settings = settings(Mode::DirectRays, 1000, 32).with(|s| s.picture.spp = spp);
        render_scene(scene, &settings).frame.radiance().as_flattened().to_vec()
    };
    scene.materials[1].surface = Surface::Pane { ior: 1.0001, tint: Vec3::ONE };
    let right = pixels(&open, 256);
    let error = |found: Vec<f32>| found.iter().zip(&right).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    let (found, without) = (error(pixels(&scene, 4)), error(pixels(&open, 4)));
    assert!(found < 1.2 * without, "{found} with glass, {without} without");
}

#[test]
fn modes_that_show_direct_light_show_it_through_panes() {
    let mut scene = floor_below(pane(TINT), 0.0);
    scene.lights.push(sun(vec3(0.2, -1.0, 0.1)));
    let of = |mode| mean(&render_scene(&scene, &settings(mode, 100_000, 32).with(|s| s.picture.spp = 4)));
    let right = of(Mode::DirectRays);
    for mode in [Mode::DirectPhotons, Mode::Photons, Mode::Hybrid] {
        // The floor and the pane light each other a little.
        let found = of(mode);
        let most = if mode == Mode::DirectPhotons { 1.01 } else { 1.05 };
        assert!((0.99 * right..most * right).contains(&found), "{mode:?}: {found} instead of {right}");
    }
    assert!(of(Mode::IndirectPhotons) < 0.05 * right, "control");
}

#[test]
fn what_a_pane_reflects_is_a_caustic() {
    // A lamp before an upright pane, whose image lies as far behind it.
    let lit = |ior: f32| {
        let mut scene = scene(&[diffuse(0.5)]);
        scene.materials.push(Material::new("pane", Surface::Pane { ior, tint: Vec3::ONE }));
        add_quad(&mut scene, vec3(-3.0, 0.0, 3.0), 6.0 * Vec3::X, -3.0 * Vec3::Z, 0);
        add_quad(&mut scene, vec3(-3.0, -0.5, 0.0), 6.0 * Vec3::X, 3.0 * Vec3::Y, 1);
        scene.lights.push(point_light(vec3(0.0, 1.0, 0.5), 3.0));
        scene.cameras.push(camera(vec3(0.0, 2.0, 0.6), vec3(0.0, 0.0, 0.5), 5.0));
        mean(&render_scene(&scene, &settings(Mode::IndirectPhotons, 100_000, 8).with(|s| s.photons.max_bounces = 0)))
    };
    // Below the lamp, at (0, 0, 0.5): from the image at (0, 1, -0.5).
    let (squared, height, away): (f64, f64, f64) = (2.0, 1.0, 1.0);
    let found = lit(1.5);
    let right = 3.0 * height / squared.powf(1.5) * 0.5 / std::f64::consts::PI * reflectance(away / squared.sqrt(), 1.5);
    assert!(within(found, right, 0.03), "{found} instead of {right}");
    assert!(!within(lit(2.0), right, 0.3), "control");
}

#[test]
fn rough_lobes_see_a_lamp_behind_a_pane_once() {
    let surface = Surface::Layered { base: Vec3::ONE, metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
    let metal = Material { roughness: 0.4, ..Material::new("metal", surface) };
    let seen = |pane: Option<Surface>| {
        let mut scene = divided(pane, lamp);
        scene.materials.push(metal.clone());
        let last = scene.materials.len() as u32 - 1;
        // A mirror-like floor of metal, seen with the lamp in it.
        add_quad(&mut scene, vec3(-0.95, -0.9, 0.9), 1.9 * Vec3::X, -0.7 * Vec3::Z, last);
        let settings = settings(Mode::DirectRays, 1000, 32).with(|s| s.picture.spp = 256);
        let render = render_scene(&scene, &settings);
        let metal: Vec<f64> = render.frame.radiance()[20 * 32..28 * 32].iter().map(|p| f64::from(p[1])).collect();
        metal.iter().sum::<f64>() / metal.len() as f64
    };
    let (through, open) = (seen(Some(pane(Vec3::ONE))), seen(None));
    // The pane takes 8 % along its normal and somewhat more elsewhere; what it reflects is dark.
    assert!((0.8..0.95).contains(&(through / open)), "{through} of {open}");
}

/// Glass as thin as a window's.
fn window(ior: f32, tint: Vec3) -> Material {
    Material::new("window", Surface::Glass { ior, tint })
}

#[test]
fn rough_lobes_see_bulbs_and_the_sun_through_windows_once() {
    let coated = Surface::Layered { base: Vec3::splat(0.5), metallic: 0.0, f0: Vec3::splat(0.04), specular: 1.0 };
    let metal = Surface::Layered { base: Vec3::ONE, metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
    let seen = |surface: &Surface, light: &Light, window: Option<(Material, f32)>| {
        let mut scene = scene(&[diffuse(0.0)]);
        scene.materials.push(Material { roughness: 0.7, ..Material::new("floor", *surface) });
        add_quad(&mut scene, vec3(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z, 1);
        if let Some((material, thickness)) = window {
            scene.materials.push(material);
            if thickness == 0.0 {
                add_quad(&mut scene, vec3(-2.0, 0.5, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z, 2);
            } else {
                add_box(&mut scene, vec3(-2.0, 0.5, -2.0), vec3(2.0, 0.5 + thickness, 2.0), 2);
            }
        }
        scene.lights.push(light.clone());
        scene.cameras.push(camera(vec3(0.0, 0.4, 1.2), Vec3::ZERO, 30.0));
        mean(&render_scene(&scene, &settings(Mode::DirectRays, 1000, 16).with(|s| s.picture.spp = 64)))
    };
    let clear = Vec3::ONE;
    for light in [sun(vec3(0.2, -1.0, -0.3)), point_light(vec3(0.3, 1.0, -0.4), 2.0)] {
        for surface in [&coated, &metal] {
            let open = seen(surface, &light, None);
            let thin =
                seen(surface, &light, Some((Material::new("pane", Surface::Pane { ior: 1.0001, tint: clear }), 0.0)));
            let thick = seen(surface, &light, Some((window(1.0001, clear), 0.02)));
            assert!(within(thin, open, 0.005), "{thin} through a pane, {open} without");
            assert!(within(thick, open, 0.005), "{thick} through a plate, {open} without");
        }
    }
    let light = sun(vec3(0.2, -1.0, -0.3));
    let half = seen(&metal, &light, Some((window(1.0001, Vec3::splat(0.5f32.sqrt())), 0.02)));
    assert!(within(half, 0.5 * seen(&metal, &light, None), 0.02), "control: {half}");
}

#[test]
fn the_sun_through_a_solid_window_has_the_closed_form_up_to_the_edge_of_a_shadow() {
    let (thickness, absorption) = (0.02_f32, 20.0_f32);
    let towards = vec3(0.4, -1.0, 0.0).normalize();
    let edge = -(towards.x / -towards.y) * 0.6;
    let lit = |absorption: f32, tilt: f32| {
        let mut scene = floor_below(diffuse(0.0), 0.0);
        scene.triangles.retain(|t| t.material == 0);
        scene.materials[1] = Material { absorption: Vec3::splat(absorption), ..window(1.5, TINT) };
        add_box(&mut scene, vec3(-2.0, 0.5, -2.0), vec3(2.0, 0.5 + thickness, 2.0), 1);
        for corner in scene.triangles.iter_mut().flat_map(|t| &mut t.positions).filter(|p| p.y > 0.51) {
            corner.y += tilt * corner.x;
        }
        for triangle in scene.triangles.iter_mut().filter(|t| t.material == 1) {
            triangle.normals = [triangle.geometric_normal(); 3];
        }
        scene.lights.push(sun(towards));
        add_quad(&mut scene, vec3(-1.9, 0.6, 1.9), (1.9 + edge) * Vec3::X, -3.8 * Vec3::Z, 0);
        let render = render_scene(&scene, &direct(64));
        [34, 29].map(|column| render.frame.radiance()[40 * 64 + column].map(f64::from))
    };
    let [found, shadow] = lit(absorption, 0.0);
    let (cosine, ior) = (f64::from(-towards.y), 1.5_f64);
    let inside = (1.0 - (1.0 - cosine * cosine) / (ior * ior)).sqrt();
    let square = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let face = 0.5 * (square(ior * cosine, inside) + square(cosine, ior * inside));
    let kept = (1.0 - face).powi(2) * (-f64::from(absorption * thickness) / inside).exp();
    let bare = 3.0 * cosine * 0.5 / std::f64::consts::PI * kept;
    for (found, tint) in found.iter().zip(TINT.to_array()) {
        let right = bare * f64::from(tint).powi(2);
        assert!(within(*found, right, 1e-3), "{found} instead of {right}");
    }
    assert_eq!(shadow, [0.0; 3], "in the shadow of the board");
    assert!(lit(0.0, 0.0)[0][1] > 1.3 * found[1], "control: without absorption");
    assert_eq!(lit(absorption, 0.002)[0], [0.0; 3], "control: a wedge bends light");
}

#[test]
fn lamps_light_through_plates_what_their_photons_do() {
    // Coloured glass that absorbs; a ball of glass stands on it, and a bar divides it.
    let plate = |scene: &mut Scene| {
        scene.triangles.retain(|t| t.material == 0 || t.positions.iter().all(|p| p.z < 0.0));
        let glass = scene.materials.len() as u32;
        scene.materials.push(Material { absorption: vec3(3.0, 1.0, 5.0), ..window(1.5, vec3(0.95, 0.9, 0.8)) });
        add_box(scene, vec3(-1.0, -0.25, -1.0), vec3(1.0, -0.2, 1.0), glass);
        scene.spheres.push(sphere(vec3(0.5, 0.0, 0.3), 0.2, glass));
        add_box(scene, vec3(-0.5, -0.25, -0.1), vec3(-0.4, -0.1, 0.1), 0);
    };
    let mut scene = divided(None, lamp);
    plate(&mut scene);
    let rays = mean(&render_scene(&scene, &settings(Mode::Hybrid, 50_000, 24).with(|s| s.picture.spp = 4)));
    let photons = mean(&render_scene(&scene, &settings(Mode::Photons, 200_000, 24)));
    assert!(within(rays, photons, 0.01), "{rays} by rays, {photons} by photons");
    let direct = mean(&render_scene(&scene, &direct(24)));
    assert!(direct > 0.2 * rays, "control: {direct} of {rays} is direct light");
}
