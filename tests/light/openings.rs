//! Light that comes in by a window.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | direct light | of a sky through a window has the closed form, with little noise | samples of all of the sky; a smaller window |
//! | photons | of the sky and of the sun through a window bring the same light when they are aimed at where they enter, from a fraction of the paths | a smaller window; a sun that reaches all |

use caustica::{
    renderer::Render,
    scene::{Environment, Light, LightKind, Scene},
    settings::{Emission, Mode, Settings},
};
use glam::{DVec3, Vec3, dvec3, vec3};
use support::*;

/// Irradiance from a polygon of radiance 1 at a point, W/m² (Lambert 1760; Arvo 1994, "The
/// Irradiance Jacobian for Partially Occluded Polyhedral Sources", equation 1). Corners clockwise
/// as seen from the point.
fn irradiance(point: DVec3, normal: DVec3, corners: [DVec3; 4]) -> f64 {
    let to = corners.map(|corner| (corner - point).normalize());
    let edges = (0..4).map(|i| (to[i], to[(i + 1) % 4]));
    edges.map(|(a, b)| 0.5 * a.angle_between(b) * a.cross(b).normalize().dot(normal)).sum::<f64>().abs()
}

/// The room under a uniform sky of radiance 1, and a narrow look at a place on its floor.
fn under_sky(place: Vec3) -> Scene {
    let mut room = room_with_window(0.5);
    room.environment = Some(Environment::uniform(Vec3::ONE));
    // What the first camera sees is known too.
    room.cameras.insert(0, camera(place + vec3(0.0, 0.5, 0.1), place, 1.0));
    room
}

#[test]
fn the_sky_through_a_window_has_the_closed_form_and_little_noise() {
    let settings = settings(Mode::DirectRays, 1000, 96).with(|s| {
        s.picture.spp = 4;
        s.picture.light_samples = 4;
        s.picture.max_spp = Some(4);
    });
    for place in [vec3(-0.4, -1.0, 0.3), vec3(0.5, -1.0, -0.2)] {
        let render = render_scene(&under_sky(place), &settings);
        let window = |top: f64| [(0.1, -0.5), (0.1, 0.1), (top, 0.1), (top, -0.5)].map(|(y, z)| dvec3(1.0, y, z));
        let right = |top: f64| 0.5 / std::f64::consts::PI * irradiance(place.as_dvec3(), DVec3::Y, window(top));
        let found = mean(&render);
        assert!(within(found, right(0.7), 0.015), "{found} instead of {}", right(0.7));
        assert!(!within(found, right(0.66), 0.015), "control: of a smaller window {}", right(0.66));
        let radiance = render.frame.radiance();
        let variance =
            radiance.iter().map(|p| (f64::from(p[0]) / right(0.7) - 1.0).powi(2)).sum::<f64>() / radiance.len() as f64;
        // What n independent rays by the cosine have, of which a fraction meets the window: those
        // in all directions have more, and both together not less than half of it.
        let fraction = irradiance(place.as_dvec3(), DVec3::Y, window(0.7)) / std::f64::consts::PI;
        let plain = (1.0 / fraction - 1.0) / 16.0;
        assert!(variance < 0.2 * 0.5 * plain, "{variance}, without knowledge of the window {plain}");
    }
}

fn look(scene: &Scene, emission: Emission) -> Render {
    let settings = settings(Mode::IndirectPhotons, 60_000, 16).with(|s| {
        s.photons.emission = emission;
        s.photons.max_paths = Some(4_000_000);
        s.estimate.neighbors = 200;
    });
    let settings = Settings { lights: settings.lights.clone(), ..settings };
    render_scene(scene, &settings)
}

#[test]
fn photons_that_are_aimed_at_a_window_bring_the_same_light_by_fewer_paths() {
    let sun = |direction: Vec3| Light { kind: LightKind::Directional, direction, ..point_light(Vec3::ZERO, 3.0) };
    let towards = vec3(-1.0, -0.8, 0.1).normalize();
    let sky = Scene { environment: Some(Environment::uniform(Vec3::ONE)), ..room_with_window(0.5) };
    let sunny = Scene { lights: vec![sun(towards)], ..room_with_window(0.5) };
    for (name, scene) in [("sky", sky), ("sun", sunny)] {
        let [aimed, plain] = [Emission::Aimed, Emission::Unaimed].map(|emission| look(&scene, emission));
        let [found, right] = [&aimed, &plain].map(mean);
        assert!(within(found, right, 0.015), "{name}: {found} instead of {right}");
        let [few, many] = [&aimed, &plain].map(|render| render.stats.photons.global.emitted);
        assert!(2 * few < many, "{name}: {few} paths instead of {many}");
        let mut smaller = scene.clone();
        add_quad(&mut smaller, vec3(1.0, 0.66, -0.5), 0.04 * Vec3::Y, 0.6 * Vec3::Z, 0);
        let less = mean(&look(&smaller, Emission::Aimed));
        assert!(!within(less, right, 0.015), "control: {name}: {less} through a smaller window");
    }
    // An open floor.
    let mut open = scene(&[diffuse(0.5)]);
    add_quad(&mut open, vec3(-1.0, 0.0, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z, 0);
    add_quad(&mut open, vec3(-1.0, 0.0, -1.0), 2.0 * Vec3::X, 2.0 * Vec3::Y, 0);
    open.lights.push(sun(vec3(0.0, -1.0, -1.0).normalize()));
    open.cameras.push(camera(vec3(0.0, 2.0, 2.0), Vec3::ZERO, 60.0));
    let [few, many] =
        [Emission::Aimed, Emission::Unaimed].map(|emission| look(&open, emission).stats.photons.global.emitted);
    assert!(2 * few > many, "control: all is lit: {few} paths instead of {many}");
}
