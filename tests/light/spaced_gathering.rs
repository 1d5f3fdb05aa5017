//! Final gathering at spaced points, whose light the samples around them take.
//!
//! | scene | right | negative control |
//! |---|---|---|
//! | a ball on the floor, a small one with its contact shadow, a torus, leaves, a slit, mirrors that face each other, a glass ball before all | final gathering with many rays at every sample | the estimate from the photons around the point |
//! | a lamp 3 cm from a wall that faces away | the same | the same |
//! | a lamp 3 cm from a wall that it faces, a strip below a shelf, a small caustic as the source of indirect light | the same, by blocks of pixels | the same |
//! | at 64 x 64: a strip along a wall behind a ledge, a spot of light beside a glass ball and beside a mirror | the same | the same |
//! | a shelf's board between a lit and a dark compartment; a slit finer than the records | gathering at every sample | the compartment without the board; the room without the slit |
//! | passes from the second on: a contact shadow | the same | the reach of the first pass |
//! | a part of a picture of 4096 x 4096 | the same | the same |
//! | a floor whose interpolated normals lean | the same | the floor without them |
//! | a floor whose normals lean from a wall, the only light | the same | the floor without them |
//! | a floor whose normals lean towards a red wall, opposite a blue one | the same, red over blue | the floor without them |
//! | a wall of rough metal | estimates at all that it shows, in place of cells | smooth metal has the same bits without cells |
//! | a crop | the bits of the whole | another seed |

use std::f32::consts::TAU;

use caustica::{
    image::{PassBlock, PassSum},
    progress::Silent,
    renderer::{Progressive, Render, Session},
    scene::{Light, LightKind, Material, Scene, Surface, Triangle},
    settings::{Crop, ExtraLayers, Mode, PassSettings, Settings},
};
use glam::{Vec3, vec3};
use support::{photons::Random, *};

const MATT: u32 = 0;
const MIRROR: u32 = 1;
const GLASS: u32 = 2;

/// A closed room of 2 m with a lamp, and a camera at one wall.
fn room() -> Scene {
    let mirror = Surface::Mirror { tint: Vec3::splat(0.9) };
    let mut scene = scene(&[diffuse(0.7), mirror, glass()]);
    scene.materials[0].double_sided = true;
    add_box(&mut scene, Vec3::ONE, Vec3::NEG_ONE, MATT);
    scene.lights.push(point_light(vec3(0.2, 0.8, 0.1), 3.0));
    scene.cameras.push(camera(vec3(0.0, 0.1, 0.95), vec3(0.0, -0.3, 0.0), 70.0));
    scene
}

fn with(change: impl FnOnce(&mut Scene)) -> Scene {
    let mut scene = room();
    change(&mut scene);
    scene
}

fn leaves(scene: &mut Scene) {
    let mut random = Random(5);
    for _ in 0..40 {
        let corner = vec3(0.6, 0.3, 0.3) * random.vector() - vec3(0.0, 0.4, 0.0);
        let along = 0.12 * random.direction();
        let across = 0.08 * along.cross(random.direction()).normalize();
        add_quad(scene, corner, along, across, MATT);
    }
}

/// A torus that lies about `middle`, with interpolated normals.
fn torus(scene: &mut Scene, middle: Vec3, (major, minor): (f32, f32)) {
    let (around, across) = (24, 12);
    let at = |i: u32, j: u32| {
        let (a, b) = (TAU * i as f32 / around as f32, TAU * j as f32 / across as f32);
        let outwards = vec3(a.cos(), 0.0, -a.sin());
        let normal = b.cos() * outwards + b.sin() * Vec3::Y;
        (middle + major * outwards + minor * normal, normal)
    };
    for (i, j) in (0..around).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        for corners in [[a, b, c], [a, c, d]] {
            scene.triangles.push(Triangle::new(corners.map(|c| c.0), corners.map(|c| c.1), MATT));
        }
    }
}

/// A plate 3 cm from the wall opposite the camera, in place of the lamp. It shines on the wall, or
/// away from it.
fn sconce(scene: &mut Scene, faces_wall: bool) {
    scene.lights.clear();
    scene.materials.push(emissive("lamp", 0.0, 300.0, false));
    let lamp = scene.materials.len() as u32 - 1;
    let (x, y) = (0.08 * Vec3::X, 0.12 * Vec3::Y);
    let corner = vec3(-0.24, 0.1, -0.97);
    let (a, b) = if faces_wall { (y, x) } else { (x, y) };
    add_quad(scene, corner, a, b, lamp);
    let behind = if faces_wall { 0.002 } else { -0.002 } * Vec3::Z;
    add_quad(scene, corner + behind, b, a, MATT);
}

fn shelf(scene: &mut Scene) {
    scene.lights.clear();
    scene.materials.push(emissive("strip", 0.0, 300.0, false));
    let strip = scene.materials.len() as u32 - 1;
    add_box(scene, vec3(-0.5, 0.2, -1.0), vec3(0.3, 0.23, -0.8), MATT);
    add_quad(scene, vec3(-0.45, 0.195, -0.97), 0.7 * Vec3::X, 0.01 * Vec3::Z, strip);
}

/// A concave mirror that throws the light of a lamp on a small part of the floor.
fn caustic(scene: &mut Scene) {
    let (rings, sides, radius, middle) = (8, 24, 0.8, vec3(0.0, 0.0, -0.3));
    let at = |i: u32, j: u32| {
        let (polar, a) = (0.5 * i as f32 / rings as f32, TAU * j as f32 / sides as f32);
        let out = vec3(polar.sin() * a.cos(), polar.cos(), polar.sin() * a.sin());
        (middle + radius * out, -out)
    };
    for (i, j) in (0..rings).flat_map(|i| (0..sides).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        for corners in [[a, b, c], [a, c, d]] {
            scene.triangles.push(Triangle::new(corners.map(|c| c.0), corners.map(|c| c.1), MIRROR));
        }
    }
    // The conjugate of the floor's height.
    scene.lights[0] = point_light(vec3(0.0, 0.26, -0.3), 3.0);
    // Keeps its light off the floor.
    add_box(scene, vec3(-0.05, 0.2, -0.35), vec3(0.05, 0.22, -0.25), MATT);
}

/// A strip that shines at the wall opposite the camera and at the ceiling, behind a ledge.
fn cove(scene: &mut Scene) {
    scene.lights.clear();
    scene.materials.push(emissive("strip", 0.0, 100.0, false));
    let strip = scene.materials.len() as u32 - 1;
    add_box(scene, vec3(-1.0, 0.82, -1.0), vec3(1.0, 0.84, -0.85), MATT);
    add_box(scene, vec3(-1.0, 0.84, -0.86), vec3(1.0, 0.91, -0.85), MATT);
    add_quad(scene, vec3(-0.95, 0.845, -0.95), 0.02 * Vec3::Z, 1.9 * Vec3::X, strip);
}

/// A spot of light on the floor, as narrow as a caustic.
fn spot(scene: &mut Scene) {
    scene.lights[0] = Light {
        kind: LightKind::Spot { inner: 0.02, outer: 0.06 },
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(200.0),
        ..point_light(vec3(-0.3, 0.9, -0.3), 1.0)
    };
}

fn scenes() -> [(&'static str, Scene); 8] {
    let ball = |center, radius, material| with(|s| s.spheres.push(sphere(center, radius, material)));
    [
        ("a ball on the floor", ball(vec3(0.1, -0.7, -0.2), 0.3, MATT)),
        ("a contact shadow of eight pixels", ball(vec3(0.1, -0.84, -0.2), 0.16, MATT)),
        ("a torus", with(|s| torus(s, vec3(0.1, -0.6, -0.2), (0.35, 0.15)))),
        ("a lamp that faces away from a wall", with(|s| sconce(s, false))),
        ("leaves", with(leaves)),
        (
            "a slit",
            with(|s| {
                // Between the lamp's half of the room and the camera's.
                add_box(s, vec3(-1.0, -1.0, -0.02), vec3(-0.05, 1.0, 0.02), MATT);
                add_box(s, vec3(0.05, -1.0, -0.02), vec3(1.0, 1.0, 0.02), MATT);
                s.lights[0].position = vec3(0.2, 0.6, -0.6);
            }),
        ),
        (
            "mirrors that face each other",
            with(|s| {
                add_quad(s, vec3(-0.9, -0.9, 0.6), vec3(0.0, 0.0, -1.2), vec3(0.0, 1.2, 0.0), MIRROR);
                add_quad(s, vec3(0.9, -0.9, -0.6), vec3(0.0, 0.0, 1.2), vec3(0.0, 1.2, 0.0), MIRROR);
            }),
        ),
        ("a glass ball before all", ball(vec3(0.0, 0.0, 0.4), 0.35, GLASS)),
    ]
}

/// Settings of a small picture by 40,000 photons, without final gathering.
fn plain() -> Settings {
    settings(Mode::Hybrid, 40_000, 64)
}

fn gathering(rays: u32, spacing: u32) -> Settings {
    plain().with(|s| {
        s.photons.final_gather = rays;
        s.estimate.neighbors = 50;
        s.estimate.irradiance_cells = 1.0;
        s.estimate.gather_spacing = spacing;
    })
}

/// Gathers at every sample with many photons.
fn converged(rays: u32) -> Settings {
    gathering(rays, 0).with(|s| {
        s.photons.global = 100_000;
        s.photons.caustic = 20_000;
    })
}

/// Mean of squared differences over squared values.
fn error(found: &Render, right: &Render) -> f64 {
    let pairs = found.frame.radiance().iter().flatten().zip(right.frame.radiance().iter().flatten());
    let errors = pairs.map(|(a, b)| f64::from((a - b).powi(2) / (b * b + 0.01)));
    errors.sum::<f64>() / (3 * right.frame.radiance().len()) as f64
}

#[test]
fn spaced_points_light_every_sample() {
    for (name, scene) in scenes() {
        // Noise of the right picture adds to both errors, which differ least in the slit.
        // Few rays find its light, so that it has as many as the default.
        let (rays, spaced_rays, side) = if name == "a slit" { (256, 64, 64) } else { (64, 32, 48) };
        let sized = |settings: Settings| settings.with(|s| s.picture.size = Some((side, side)));
        let right = render_scene(&scene, &sized(converged(rays)));
        let spaced = render_scene(&scene, &sized(gathering(spaced_rays, 2)));
        let (found, control) = (error(&spaced, &right), error(&render_scene(&scene, &sized(plain())), &right));
        assert!(found < 0.85 * control, "{name}: {found}, and {control} by the photons around each point");
        assert!(within(mean(&spaced), mean(&right), 0.03), "{name}: {} instead of {}", mean(&spaced), mean(&right));
    }
}

/// Mean of squared differences over squared values, by blocks of 8 x 8 pixels of a square
/// picture.
fn error_of_blocks(found: &Render, right: &Render) -> f64 {
    let [found, right] = [found, right].map(|render| blocks(render.frame.radiance(), 8));
    let pairs = found.iter().flatten().zip(right.iter().flatten());
    pairs.map(|(a, b)| f64::from((a - b).powi(2) / (b * b + 0.01))).sum::<f64>() / (3 * right.len()) as f64
}

#[test]
fn small_bright_places_leave_no_spots() {
    for (name, scene) in [
        ("a lamp that faces a wall", with(|s| sconce(s, true))),
        ("a strip below a shelf", with(shelf)),
        ("a small caustic", with(caustic)),
    ] {
        let sized = |settings: Settings| settings.with(|s| s.picture.size = Some((96, 96)));
        let right = render_scene(&scene, &sized(converged(64)));
        let spaced = render_scene(&scene, &sized(gathering(64, 2)));
        let classic = render_scene(&scene, &sized(plain()));
        let (found, control) = (error_of_blocks(&spaced, &right), error_of_blocks(&classic, &right));
        println!("{name}: {found} {control} {}", mean(&spaced) / mean(&right));
        assert!(found < 0.5 * control, "{name}: {found}, and {control} by the photons around each point");
        assert!(within(mean(&spaced), mean(&right), 0.02), "{name}: {} instead of {}", mean(&spaced), mean(&right));
    }
}

#[test]
fn long_and_mirrored_bright_places_leave_no_spots() {
    // The greatest error by blocks, 0.4 of the control's or that of 2.5 %.
    for (name, scene, most) in [
        ("a strip behind a ledge", with(cove), None),
        (
            "a spot of light beside a glass ball",
            with(|s| {
                spot(s);
                s.spheres.push(sphere(vec3(0.1, -0.8, -0.2), 0.2, GLASS));
            }),
            Some(6e-4),
        ),
        (
            "a spot of light beside a mirror",
            with(|s| {
                spot(s);
                add_quad(s, vec3(0.99, -0.9, -0.8), vec3(0.0, 0.0, 1.4), vec3(0.0, 1.6, 0.0), MIRROR);
            }),
            Some(6e-4),
        ),
    ] {
        let right = render_scene(&scene, &converged(128));
        let (spaced, classic) = (render_scene(&scene, &gathering(64, 2)), render_scene(&scene, &plain()));
        let (found, control) = (error_of_blocks(&spaced, &right), error_of_blocks(&classic, &right));
        println!("{name}: {found} {control} {}", mean(&spaced) / mean(&right));
        assert!(
            found < most.unwrap_or(0.4 * control),
            "{name}: {found}, and {control} by the photons around each point"
        );
        assert!(within(mean(&spaced), mean(&right), 0.05), "{name}: {} instead of {}", mean(&spaced), mean(&right));
    }
}

/// Mean of the pixels in those columns and rows of a picture of 64 x 64.
fn mean_in(render: &Render, columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> f64 {
    let pixels: Vec<f64> = rows
        .flat_map(|row| columns.clone().map(move |column| 64 * row + column))
        .map(|i| f64::from(render.frame.radiance()[i][1]))
        .collect();
    pixels.iter().sum::<f64>() / pixels.len() as f64
}

#[test]
fn light_stays_on_its_side_of_a_board() {
    let shelf = |has_board: bool| {
        with(|s| {
            s.lights[0] = point_light(vec3(-0.45, 0.0, -0.7), 1.0);
            for y in [-0.41, 0.39] {
                add_box(s, vec3(-0.8, y, -1.0), vec3(0.8, y + 0.02, -0.5), MATT);
            }
            for x in if has_board { vec![-0.8, 0.0, 0.78] } else { vec![-0.8, 0.78] } {
                add_box(s, vec3(x, -0.41, -1.0), vec3(x + 0.02, 0.41, -0.5), MATT);
            }
        })
    };
    // On the back, beside the board.
    let beside = |settings: &Settings, has_board| mean_in(&render_scene(&shelf(has_board), settings), 34..38, 26..32);
    let (right, found) = (beside(&converged(64), true), beside(&gathering(64, 2), true));
    assert!(within(found, right, 0.25), "{found} instead of {right}");
    assert!(beside(&gathering(64, 2), false) > 3.0 * right, "control: no board");
}

#[test]
fn what_shows_in_a_slit_has_its_own_light() {
    // Between the lamp's half of the room and the camera's.
    let slit = |half: f32| {
        with(|s| {
            add_box(s, vec3(-1.0, -1.0, -0.42), vec3(-half, 1.0, -0.38), MATT);
            add_box(s, vec3(half, -1.0, -0.42), vec3(1.0, 1.0, -0.38), MATT);
            s.lights[0].position = vec3(0.2, 0.6, -0.7);
        })
    };
    // The floor behind the slit, finer than a pixel.
    let floor = |settings: &Settings, half| mean_in(&render_scene(&slit(half), settings), 31..33, 39..43);
    let (right, found) = (floor(&converged(64), 0.008), floor(&gathering(64, 2), 0.008));
    assert!(within(found, right, 0.3), "{found} instead of {right}");
    assert!(floor(&gathering(64, 2), 0.0) < 0.5 * right, "control: no slit");
}

#[test]
fn later_passes_look_closer_into_contact_shadows() {
    let scene = with(|s| s.spheres.push(sphere(vec3(0.1, -0.88, -0.2), 0.12, MIRROR)));
    let passes = |settings: &Settings| {
        let session = Session::open(gpu(), &scene, &settings.lights, &Silent).expect("the scene fits");
        let passes = Progressive::new(&session, settings, PassSettings::default()).expect("passes");
        let mut sum = PassSum::default();
        for index in 1..3 {
            let (film, stats) = passes.render(index, &Silent).expect("a pass");
            sum.push(PassBlock::of_pass(index, film, &stats)).expect("of one picture");
        }
        sum.total().expect("of one picture").expect("passes").film().finish()
    };
    let sized = |settings: Settings| settings.with(|s| s.picture.spp = 4);
    let right = render_scene(&scene, &sized(converged(64)));
    let closer = sized(gathering(64, 2));
    // The reach that the first pass has.
    let as_first = closer.clone().with(|s| s.estimate.gather_reach *= 6.0);
    // Below the ball.
    let shadow = |radiance: &[[f32; 3]]| -> f32 {
        (49..53).flat_map(|row| (31..39).map(move |column| row * 64 + column)).map(|i| radiance[i][1]).sum()
    };
    let [found, control, right] =
        [shadow(passes(&closer).radiance()), shadow(passes(&as_first).radiance()), shadow(right.frame.radiance())];
    assert!((found - right).abs() < 0.5 * (control - right).abs(), "{found}, and {control}, instead of {right}");
}

#[test]
fn a_part_of_a_large_picture_is_right() {
    let scene = with(|s| s.spheres.push(sphere(vec3(0.1, -0.7, -0.2), 0.3, MATT)));
    // The floor below the ball, near where both touch.
    let part = |settings: Settings| {
        let crop = Crop { column: 2250, row: 3190, width: 24, height: 24 };
        render_scene(&scene, &settings.with(|s| (s.picture.size, s.picture.crop) = (Some((4096, 4096)), Some(crop))))
    };
    let right = part(converged(64));
    let (spaced, control) = (part(gathering(32, 2)), part(plain()));
    let (found, control) = (error(&spaced, &right), error(&control, &right));
    assert!(found < 0.75 * control, "{found}, and {control} by the photons around each point");
    assert!(within(mean(&spaced), mean(&right), 0.03), "{} instead of {}", mean(&spaced), mean(&right));
}

#[test]
fn leaning_normals_take_light_from_their_side() {
    let floor = |lean: f32| {
        with(|s| {
            s.cameras = vec![camera(vec3(0.1, 0.3, 0.001), vec3(0.1, -1.0, 0.0), 60.0)];
            // Most light comes from the lit wall, not from above.
            s.lights[0].position = vec3(-0.9, -0.2, 0.0);
            add_box(s, vec3(-0.9, -1.0, -0.9), vec3(-0.8, 0.2, 0.9), MATT);
            let first = s.triangles.len();
            add_quad(s, vec3(-0.7, -0.95, 0.9), vec3(1.6, 0.0, 0.0), vec3(0.0, 0.0, -1.8), MATT);
            let normal = vec3(lean, 1.0, 0.0).normalize();
            s.triangles[first..].iter_mut().for_each(|t| t.normals = [normal; 3]);
        })
    };
    let of = |scene: &Scene, settings: &Settings| mean(&render_scene(scene, settings));
    let flat = of(&floor(0.0), &gathering(32, 2));
    for (lean, matters) in [(0.5, true), (-0.5, false)] {
        let (right, found) = (of(&floor(lean), &converged(128)), of(&floor(lean), &gathering(32, 2)));
        assert!(within(found, right, 0.06), "{lean}: {found} instead of {right}");
        assert!(!matters || !within(flat, right, 0.15), "control: {flat} without them instead of {right}");
    }
}

#[test]
fn normals_that_lean_away_keep_the_light_above_their_horizon() {
    // A floor beside a wall that the sun lights, in the open: all light comes from one side, and
    // half of it from above the horizon of a normal that leans by 37 degrees.
    let floor = |lean: f32| {
        let mut scene = scene(&[diffuse(0.5), diffuse(0.05)]);
        add_quad(&mut scene, vec3(-0.5, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), 0);
        let first = scene.triangles.len();
        add_quad(&mut scene, vec3(-0.5, 0.0, 1.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, -1.0), 1);
        let normal = vec3(0.0, 1.0, lean).normalize();
        scene.triangles[first..].iter_mut().for_each(|t| t.normals = [normal; 3]);
        scene.lights.push(Light { kind: LightKind::Directional, ..point_light(Vec3::ZERO, 3.0) });
        scene.cameras.push(camera(vec3(0.0, 1.2, 0.501), vec3(0.0, 0.0, 0.5), 35.0));
        scene
    };
    let of = |scene: &Scene, settings: &Settings| mean(&render_scene(scene, settings));
    let flat = of(&floor(0.0), &gathering(32, 2));
    for lean in [-0.3, 0.3, 0.75] {
        let (right, found) = (of(&floor(lean), &converged(128)), of(&floor(lean), &gathering(32, 2)));
        assert!(within(found, right, 0.06), "{lean}: {found} instead of {right}");
        assert!(!within(flat, right, 0.15), "control: {flat} without it instead of {right}");
    }
}

#[test]
fn each_color_comes_from_its_own_side() {
    let floor = |lean: f32| {
        with(|s| {
            s.cameras = vec![camera(vec3(0.0, 0.6, 0.001), vec3(0.0, -1.0, 0.0), 50.0)];
            s.lights[0].position = vec3(0.0, 0.7, 0.0);
            for (side, albedo) in [(-1.0_f32, vec3(0.8, 0.1, 0.1)), (1.0, vec3(0.1, 0.1, 0.8))] {
                s.materials.push(Material::new("wall", Surface::Diffuse { albedo }));
                let wall = s.materials.len() as u32 - 1;
                add_quad(s, vec3(0.98 * side, -1.0, side), -2.0 * side * Vec3::Z, 2.0 * Vec3::Y, wall);
            }
            let first = s.triangles.len();
            add_quad(s, vec3(-0.8, -0.95, 0.9), vec3(1.6, 0.0, 0.0), vec3(0.0, 0.0, -1.8), MATT);
            let normal = vec3(lean, 1.0, 0.0).normalize();
            s.triangles[first..].iter_mut().for_each(|t| t.normals = [normal; 3]);
        })
    };
    let red_over_blue = |lean: f32, settings: &Settings| {
        let picture = render_scene(&floor(lean), settings);
        let sum = |channel: usize| picture.frame.radiance().iter().map(|p| f64::from(p[channel])).sum::<f64>();
        sum(0) / sum(2)
    };
    let flat = red_over_blue(0.0, &gathering(32, 2));
    for lean in [-0.6, 0.6] {
        let right = red_over_blue(lean, &converged(128));
        let found = red_over_blue(lean, &gathering(32, 2));
        assert!(within(found, right, 0.02), "{lean}: {found} instead of {right}");
        assert!(!within(flat, right, 0.06), "control: {flat} without them instead of {right}");
    }
}

#[test]
fn what_rough_metal_shows_takes_the_light_of_cells() {
    let walled = |roughness: f32| {
        with(|s| {
            let layered =
                Surface::Layered { base: Vec3::splat(0.9), metallic: 1.0, f0: Vec3::splat(0.04), specular: 1.0 };
            s.materials.push(Material { roughness, metallic: 1.0, ..Material::new("metal", layered) });
            add_quad(s, vec3(-0.9, -0.9, -0.9), vec3(1.8, 0.0, 0.0), vec3(0.0, 1.8, 0.0), s.materials.len() as u32 - 1);
        })
    };
    // Layers of the estimates are about each point, so that no cell speaks for one.
    let pictures = |roughness: f32| {
        let cells = gathering(16, 0);
        let estimates = cells.clone().with(|s| s.picture.layers = vec![ExtraLayers::Estimates]);
        let other = estimates.clone().with(|s| s.photons.seed = 1);
        [cells, estimates, other].map(|settings| render_scene(&walled(roughness), &settings))
    };
    let [cells, estimates, other] = pictures(0.6);
    assert!(cells.stats.rays < estimates.stats.rays * 9 / 10, "{} and {}", cells.stats.rays, estimates.stats.rays);
    assert!(within(mean(&cells), mean(&estimates), 0.01), "{} and {}", mean(&cells), mean(&estimates));
    let (off, noise) = (error(&cells, &estimates), error(&other, &estimates));
    assert!(off < 0.1 * noise, "{off}, and {noise} of two seeds");
    let [cells, estimates, _] = pictures(0.05);
    assert_eq!(cells.frame.radiance(), estimates.frame.radiance(), "control: a sharp lobe shows all");
}

#[test]
fn a_crop_has_the_bits_of_the_whole() {
    let (_, scene) = &scenes()[0];
    let settings = gathering(8, 2).with(|s| s.picture.size = Some((150, 140)));
    let whole = render_scene(scene, &settings);
    let crop = Crop { column: 70, row: 60, width: 21, height: 17 };
    let part = render_scene(scene, &settings.clone().with(|s| s.picture.crop = Some(crop)));
    let rows = whole.frame.radiance().chunks(150).skip(60).take(17);
    let expected: Vec<_> = rows.flat_map(|row| row[70..91].to_vec()).collect();
    assert_eq!(part.frame.radiance(), expected);
    let other = render_scene(scene, &settings.with(|s| s.photons.seed = 1));
    assert_ne!(other.frame.radiance(), whole.frame.radiance(), "control: another seed");
}
