//! Emission aimed at mirrors and glass, and at what the camera sees.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | flux | aimed and unaimed caustic maps hold the same flux, everywhere in the scene, for every kind of light | one ball fewer |
//! | picture | aimed and unaimed give the same picture | general paths keep L S+ D as well |
//! | ground | a wall on a wide ground has the indirect light of one on a small ground | unaimed emission; a darker ground |
//! | paths | aimed, a caustic photon takes far fewer paths | the unaimed count |
//! | small ball | its caustic beside a wide mirror is the one that it throws alone | another index |
//! | faint caustics | take few paths, for the same flux | a lamp that lights the ball alone; a number of paths that is asked for |
//! | open figure | a figure under the sky takes few paths, for the same picture | a number of paths that is asked for; the figure in a room |

use caustica::{
    layout::Photon,
    renderer::Render,
    scene::{Environment, Light, LightKind, Material, Scene, Surface},
    settings::{Emission, Mode},
    stats::Stats,
};
use glam::{Vec3, vec3};

use support::*;

use super::{flux, spot, traced};

/// A floor with three balls of glass and mirror, two of them close to each other.
fn balls() -> Scene {
    let mut scene = scene(&[diffuse(0.5), glass(), Surface::Mirror { tint: Vec3::splat(0.9) }]);
    add_quad(&mut scene, vec3(-3.0, 0.0, 3.0), vec3(6.0, 0.0, 0.0), vec3(0.0, 0.0, -6.0), 0);
    scene.spheres.push(sphere(vec3(-1.5, 0.5, 0.0), 0.4, 1));
    scene.spheres.push(sphere(vec3(1.2, 0.5, 0.0), 0.4, 1));
    add_box(&mut scene, vec3(1.4, 0.3, -0.6), vec3(1.6, 0.5, 0.6), 2);
    scene
}

/// A point light, and a mirror of 6 m by 2.5 m behind the balls.
fn wide_mirror(scene: &mut Scene, light: Vec3) {
    scene.lights.push(point_light(light, 3.0));
    add_quad(scene, vec3(-3.0, 0.0, -2.0), vec3(6.0, 0.0, 0.0), vec3(0.0, 2.5, 0.0), 2);
}

/// The balls under each kind of light.
fn lit_balls() -> Vec<(&'static str, Scene)> {
    let lit = |change: &dyn Fn(&mut Scene)| {
        let mut scene = balls();
        change(&mut scene);
        scene
    };
    let direction = vec3(0.3, -2.0, 0.5).normalize();
    let sun = Light { kind: LightKind::Directional, direction, ..point_light(Vec3::ZERO, 3.0) };
    let lamp = |scene: &mut Scene, double_sided| {
        scene.materials.push(emissive("lamp", 0.0, 2.0, double_sided));
        add_quad(scene, vec3(-0.5, 2.0, -0.5), Vec3::X, vec3(0.0, 0.3, 0.9), 3);
    };
    vec![
        ("point", lit(&|s| s.lights.push(point_light(vec3(0.0, 2.0, 0.5), 3.0)))),
        ("point beside a wide mirror", lit(&|s| wide_mirror(s, vec3(0.0, 2.0, 0.5)))),
        ("directional beside a wide mirror", {
            let mut scene = lit(&|s| s.lights.push(sun.clone()));
            add_quad(&mut scene, vec3(-3.0, 0.0, -2.0), vec3(6.0, 0.0, 0.0), vec3(0.0, 2.5, 0.0), 2);
            scene
        }),
        ("point inside a target", lit(&|s| s.lights.push(point_light(vec3(1.3, 0.95, 0.1), 3.0)))),
        ("spot", lit(&|s| s.lights.push(spot(vec3(0.0, 2.0, 0.5), vec3(0.9, -1.5, 0.0), 3.0, 0.2, 0.5)))),
        ("directional", lit(&|s| s.lights.push(sun.clone()))),
        ("surface", lit(&|s| lamp(s, false))),
        ("double-sided surface", lit(&|s| lamp(s, true))),
        (
            "sphere",
            lit(&|s| {
                s.materials.push(emissive("bulb", 0.0, 2.0, false));
                s.spheres.push(sphere(vec3(0.0, 1.5, 0.3), 0.3, 3));
            }),
        ),
        (
            "glowing glass",
            lit(&|s| {
                s.materials.push(Material { emission: Vec3::ONE, ..s.materials[1].clone() });
                s.spheres.push(sphere(vec3(0.0, 0.6, 0.3), 0.3, 3));
            }),
        ),
        (
            "environment",
            lit(&|s| {
                let mut pixels = vec![[0.2; 3]; 16 * 8];
                pixels[2 * 16 + 3] = [90.0; 3];
                let map = Environment { width: 16, height: 8, pixels, ..Environment::uniform(Vec3::ZERO) };
                s.environment = Some(map);
            }),
        ),
    ]
}

/// Flux of the caustic map: in total, on the left and on the right side of the floor; W, each with
/// its variance.
fn caustic_flux(scene: &Scene, emission: Emission) -> [(f64, f64); 3] {
    let settings = settings(Mode::DirectPhotons, 1, 1).with(|s| {
        s.photons.emission = emission;
        s.photons.caustic = 30_000;
        s.photons.max_paths = Some(150_000);
    });
    let map = traced(scene, &settings).maps.caustic;
    let photons: Vec<Photon> = map.read(gpu()).expect("photons read back");
    let part = |wanted: &dyn Fn(f32) -> bool| {
        let part: Vec<_> = photons.iter().filter(|p| wanted(p.position[0])).collect();
        // Each path stores at most one photon, and few paths do: the variance is about the sum of
        // squares.
        let squares: f64 = part.iter().map(|p| f64::from(p.flux[0]).powi(2)).sum();
        (flux(part, map.emitted), squares / (map.emitted as f64).powi(2))
    };
    [part(&|_| true), part(&|x| x < 0.0), part(&|x| x >= 0.0)]
}

#[test]
fn aimed_paths_bring_the_flux_of_unaimed_ones() {
    let z = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() / (a.1 + b.1).sqrt();
    for (name, scene) in lit_balls() {
        let [aimed, unaimed] = [Emission::Aimed, Emission::Unaimed].map(|emission| caustic_flux(&scene, emission));
        for (part, (aimed, unaimed)) in aimed.into_iter().zip(unaimed).enumerate() {
            assert!(z(aimed, unaimed) < 3.5, "{name}, part {part}: {} W, unaimed {} W", aimed.0, unaimed.0);
        }
        let mut fewer = scene;
        fewer.spheres.remove(1);
        let [fewer, ..] = caustic_flux(&fewer, Emission::Aimed);
        assert!(
            z(fewer, unaimed[0]) > 3.5,
            "control: {name}: {} W without a ball, {} W with it",
            fewer.0,
            unaimed[0].0
        );
    }
}

/// Radiance of the first channel.
fn reds(render: &Render) -> Vec<f64> {
    render.frame.radiance().iter().map(|p| f64::from(p[0])).collect()
}

/// Means over blocks of 8 x 8 pixels of a picture 32 wide.
fn blocks(picture: &[f64]) -> Vec<f64> {
    let at = |block: usize, i: usize| (block / 4 * 8 + i / 8) * 32 + block % 4 * 8 + i % 8;
    (0..16).map(|block| (0..64).map(|i| picture[at(block, i)]).sum::<f64>() / 64.0).collect()
}

#[test]
fn aimed_paths_make_the_picture_of_unaimed_ones() {
    // A closed room, so that light also passes the balls after diffuse bounces.
    let mut scene = scene(&[diffuse(0.35), glass(), Surface::Mirror { tint: Vec3::splat(0.9) }]);
    add_box(&mut scene, vec3(-1.0, 0.0, -1.0), vec3(1.0, 2.0, 3.0), 0);
    scene.spheres.push(sphere(vec3(0.45, 0.4, 0.2), 0.4, 1));
    scene.spheres.push(sphere(vec3(-0.45, 0.4, -0.2), 0.4, 2));
    scene.materials.push(emissive("lamp", 0.5, 2.0, false));
    add_quad(&mut scene, vec3(-0.3, 1.9, -0.3), vec3(0.6, 0.0, 0.0), vec3(0.0, 0.0, 0.6), 3);
    scene.lights.push(point_light(vec3(0.7, 1.7, 0.6), 4.0));
    scene.cameras.push(camera(vec3(0.0, 1.4, 2.9), vec3(0.0, 0.2, 0.0), 40.0));
    let picture = |emission, mode| {
        let settings = settings(mode, 100_000, 32).with(|s| {
            // Unaimed, each takes dozens of paths.
            s.photons.caustic = 30_000;
            s.photons.emission = emission;
            s.estimate.neighbors = 50;
        });
        let render = render_scene(&scene, &settings);
        (reds(&render), render.stats)
    };
    let (aimed, aimed_stats) = picture(Emission::Aimed, Mode::Photons);
    let (unaimed, unaimed_stats) = picture(Emission::Unaimed, Mode::Photons);
    let mean = |picture: &[f64]| picture.iter().sum::<f64>() / picture.len() as f64;
    let worst =
        |a: &[f64], b: &[f64]| blocks(a).iter().zip(blocks(b)).map(|(a, b)| (a - b).abs() / b).fold(0.0, f64::max);
    assert!(within(mean(&aimed), mean(&unaimed), 0.01), "means {} and {}", mean(&aimed), mean(&unaimed));
    assert!(worst(&aimed, &unaimed) < 0.03, "blocks differ by up to {}", worst(&aimed, &unaimed));
    // Mode 3 minus mode 2 is L S+ D, which general paths must not store as well.
    let [(photons, _), (rays, _)] =
        [Mode::DirectPhotons, Mode::DirectRays].map(|mode| picture(Emission::Unaimed, mode));
    let both: Vec<f64> = (0..aimed.len()).map(|i| aimed[i] + photons[i] - rays[i]).collect();
    assert!(!within(mean(&both), mean(&unaimed), 0.01), "control: keeping both passes, mean {}", mean(&both));
    assert!(worst(&both, &unaimed) > 0.06, "control: keeping both passes");
    // The same statistics, far fewer paths.
    let paths = |stats: &Stats| stats.photons.caustic.emitted as f64 / stats.photons.caustic.stored as f64;
    let (few, many) = (paths(&aimed_stats), paths(&unaimed_stats));
    assert!(few < 0.4 * many, "{few} paths a caustic photon aimed, {many} unaimed");
}

#[test]
fn the_caustic_of_a_small_ball_is_that_beside_a_wide_mirror() {
    // The mirror stands behind the lamp's shade, and sends nothing to where the camera looks.
    let ball = |with_mirror: bool, photons: u32, ior: f32| {
        let mut scene = scene(&[diffuse(0.5), Surface::Glass { ior, tint: Vec3::ONE }]);
        scene.materials.push(Material::new("mirror", Surface::Mirror { tint: Vec3::ONE }));
        add_quad(&mut scene, vec3(-1.0, 0.0, 1.0), vec3(2.0, 0.0, 0.0), vec3(0.0, 0.0, -2.0), 0);
        scene.spheres.push(sphere(vec3(0.0, 0.03, 0.0), 0.03, 1));
        if with_mirror {
            add_quad(&mut scene, vec3(-4.0, 0.0, -4.0), vec3(8.0, 0.0, 0.0), vec3(0.0, 6.0, 0.0), 2);
        }
        scene.lights.push(point_light(vec3(0.3, 0.6, 0.2), 1.0));
        // What the mirror gets falls back behind it.
        add_box(&mut scene, vec3(-1.0, -0.5, -1.1), vec3(1.0, 1.2, -1.05), 0);
        scene.cameras.push(camera(vec3(0.0, 0.3, 0.25), vec3(-0.02, 0.0, -0.01), 25.0));
        let settings = settings(Mode::Hybrid, 1, 32).with(|s| {
            (s.photons.caustic, s.photons.seed) = (photons, u32::from(with_mirror));
            (s.photons.global, s.estimate.neighbors) = (100, 30);
        });
        reds(&render_scene(&scene, &settings))
    };
    let right = ball(false, 200_000, 1.5);
    let error = |picture: &[f64]| {
        let errors = blocks(picture).into_iter().zip(blocks(&right)).map(|(a, b)| ((a - b) / b).powi(2));
        (errors.sum::<f64>() / 16.0).sqrt()
    };
    let (alone, beside) = (error(&ball(false, 20_000, 1.5)), error(&ball(true, 20_000, 1.5)));
    println!("{alone} alone, {beside} beside the mirror");
    assert!(beside < 0.03 && beside < 3.0 * alone, "{alone} alone, {beside} beside the mirror");
    let other = error(&ball(true, 20_000, 1.25));
    assert!(other > 2.0 * beside, "control: another index: {other}, {beside}");
}

/// A wall of 1 m on a ground of half side `reach`, under the sun or a sky that shines from above.
fn wall_on_ground(reach: f32, albedo: f32, sky: bool) -> Scene {
    let mut scene = scene(&[diffuse(albedo), diffuse(0.7)]);
    add_quad(&mut scene, vec3(-reach, 0.0, reach), vec3(2.0 * reach, 0.0, 0.0), vec3(0.0, 0.0, -2.0 * reach), 0);
    add_box(&mut scene, vec3(-0.5, 0.0, -0.4), vec3(0.5, 1.0, 0.0), 1);
    let direction = vec3(0.2, -2.0, -0.3).normalize();
    if sky {
        scene.environment = Some(Environment::uniform(Vec3::ONE));
    } else {
        scene.lights.push(Light { kind: LightKind::Directional, direction, ..point_light(Vec3::ZERO, 3.0) });
    }
    scene.cameras.push(camera(vec3(0.0, 0.5, 1.6), vec3(0.0, 0.5, 0.0), 25.0));
    scene
}

#[test]
fn a_wall_on_a_wide_ground_has_the_indirect_light_of_one_on_a_small_ground() {
    let of = |reach: f32, albedo: f32, sky: bool, (emission, final_gather): (Emission, u32)| {
        let settings = settings(Mode::IndirectPhotons, 20_000, 12).with(|s| {
            s.photons.emission = emission;
            s.photons.final_gather = final_gather;
            s.photons.max_paths = Some(500_000);
        });
        mean(&render_scene(&wall_on_ground(reach, albedo, sky), &settings))
    };
    for sky in [false, true] {
        let right = of(20.0, 0.6, sky, (Emission::Aimed, 16));
        let wide = of(500.0, 0.6, sky, (Emission::Aimed, 16));
        assert!(within(wide, right, 0.06), "sky {sky}: {wide} instead of {right}");
        let darker = of(500.0, 0.45, sky, (Emission::Aimed, 16));
        assert!(!within(darker, right, 0.06), "control: sky {sky}: a darker ground passes");
        // Few photons of the far ground hit the wall itself, each with much flux.
        let [aimed, unaimed] = [Emission::Aimed, Emission::Unaimed].map(|emission| of(500.0, 0.6, sky, (emission, 0)));
        assert!((0.6..1.6).contains(&(aimed / right)), "sky {sky}: photons bring {aimed} instead of {right}");
        assert!(unaimed < 0.1 * right, "control: sky {sky}: unaimed paths find {unaimed} of {right}");
    }
}

#[test]
fn a_figure_under_the_sky_takes_few_paths() {
    const PHOTONS: u32 = 3000;
    let figure = |in_a_room: bool| {
        let mut scene = scene(&[diffuse(0.7)]);
        scene.spheres.push(sphere(vec3(0.0, 0.0, 0.0), 0.5, 0));
        // A block, whose light the ball's lower half gets.
        add_box(&mut scene, vec3(-0.2, -0.8, -0.2), vec3(0.2, -0.7, 0.2), 0);
        if in_a_room {
            add_box(&mut scene, vec3(-3.0, -3.0, -3.0), vec3(3.0, 3.0, 3.0), 0);
            scene.lights.push(point_light(vec3(0.5, 2.0, 1.5), 3.0));
        } else {
            scene.environment = Some(Environment::uniform(Vec3::ONE));
        }
        scene.cameras.push(camera(vec3(0.0, 0.6, 2.5), vec3(0.0, -0.1, 0.0), 40.0));
        scene
    };
    let of = |in_a_room: bool, max_paths: Option<u64>| {
        let settings = settings(Mode::Hybrid, PHOTONS, 16).with(|s| {
            s.photons.max_paths = max_paths;
            s.estimate.neighbors = 30;
        });
        let render = render_scene(&figure(in_a_room), &settings);
        (mean(&render), render.stats.photons.global)
    };
    let capacity = u64::from(PHOTONS);
    let (open, global) = of(false, None);
    assert!(global.emitted < 40 * capacity && global.stored < capacity, "{global:?}");
    let (right, asked) = of(false, Some(1_000_000));
    assert!(asked.emitted > 4 * global.emitted, "control: {asked:?}, {global:?}");
    assert!(within(open, right, 0.005), "{open} instead of {right}");
    let (_, room) = of(true, None);
    assert!(room.stored == capacity, "control: a room fills its map: {room:?}");
}

#[test]
fn faint_caustics_take_few_paths_and_bright_ones_as_many_as_they_need() {
    // A mirror ball high above a floor: few of its photons meet that.
    let mut sky = scene(&[diffuse(0.5), Surface::Mirror { tint: Vec3::ONE }]);
    add_quad(&mut sky, vec3(-1.0, 0.0, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z, 0);
    sky.spheres.push(sphere(vec3(0.0, 3.0, 0.0), 0.4, 1));
    sky.cameras.push(camera(vec3(0.0, 2.0, 2.0), Vec3::ZERO, 60.0));
    // The sky lights the floor as well, a spot the ball alone.
    let mut lamp = sky.clone();
    sky.environment = Some(Environment::uniform(Vec3::ONE));
    lamp.lights.push(spot(vec3(1.5, 1.0, 0.0), vec3(-1.5, 2.0, 0.0), 100.0, 0.1, 0.2));
    let photons = |scene: &Scene, max_paths: Option<u64>| {
        let map =
            traced(scene, &settings(Mode::Hybrid, 18_000, 16).with(|s| s.photons.max_paths = max_paths)).maps.caustic;
        (flux(&map.read(gpu()).expect("photons read back"), map.emitted), map.emitted, map.stored)
    };
    let [(few_flux, few, stored), (right, many, _)] = [None, Some(1_000_000)].map(|most| photons(&sky, most));
    println!("sky: {few_flux} by {few} paths with {stored} photons, {right} by {many}");
    assert_eq!(few, 8 * 18_000);
    assert!(many > 2 * few && stored > 1000, "{many} paths, {stored} photons");
    let error = 4.0 / (stored as f64).sqrt();
    assert!(within(few_flux, right, error), "{few_flux} instead of {right}");
    let [(_, bright, _), (_, all, _)] = [None, Some(1_000_000)].map(|most| photons(&lamp, most));
    println!("lamp: {bright} paths, {all} if they are asked for");
    assert_eq!(bright, all, "control: caustics that nothing else lights");
    assert!(bright > 2 * few, "control: {bright} paths");
}
