//! Lights against closed forms.
//!
//! | test | closed form | negative control |
//! |---|---|---|
//! | spot | E = I f cos³θ/h², f the specification's falloff, in narrow cones too; flux I Ω | another inner cone; a larger floor |
//! | directional | E = I cos θ | straight from above |
//! | uniform sky | E = π L on an open floor | 2 % stronger |
//! | square emitter | Lambert's formula for polygons, facing and askew | the back side; an emitter 5 cm higher |
//! | spherical emitter | E = π L (r/d)² cos θ | 2 % larger |
//! | rays to a lamp | one a sample where the lamp is small, two where it is large | the other lamp |
//! | small lamp | the same far from a small lamp amid a wide scene, of each shape | a lamp 2 % stronger |
//! | lamp under a clear coat | what its camera, its rays and its photons have is less by the coat's reflectance | half the coat |
//! | furnace | closed objects of albedo 1 in radiance L look L | albedo 0.9 |
//! | bright pixel | E = the sum over the map; the camera sees it in its direction | the map rotated by 20° |

use std::f64::consts::PI;

use caustica::{
    scene::{Environment, Light, LightKind, Material, Scene, Surface},
    settings::Mode,
};
use glam::{Vec3, vec3};

use support::*;

use super::{direct_flux, floor, spot};

/// Irradiance of the surface of albedo 1/2 that a camera sees at `target`, by direct light. The
/// target must lie on no edge.
pub fn irradiance_at(scene: &Scene, eye: Vec3, target: Vec3, light_samples: u32) -> f64 {
    let mut scene = scene.clone();
    scene.cameras = vec![camera(eye, target, 0.02)];
    let settings = settings(Mode::DirectRays, 1, 16).with(|s| s.picture.light_samples = light_samples);
    mean(&render_scene(&scene, &settings)) * PI / 0.5
}

#[test]
fn a_spot_has_the_falloff_of_the_specification() {
    let (height, inner, outer) = (2.0_f32, 0.3_f32, 0.6_f32);
    let measured = |inner: f32, angle: f32| {
        let mut scene = floor(10.0);
        scene.lights.push(spot(vec3(0.0, height, 0.0), Vec3::NEG_Y, 3.0, inner, outer));
        let x = height * angle.tan();
        irradiance_at(&scene, vec3(x, 4.0, 0.001), vec3(x, 0.0, 0.0), 1)
    };
    for angle in [0.0_f32, 0.2, 0.4, 0.5, 0.57, 0.7] {
        let found = measured(inner, angle);
        let cosine = f64::from(angle).cos();
        let [full, none] = [inner, outer].map(|a| f64::from(a).cos());
        let t = ((cosine - none) / (full - none)).clamp(0.0, 1.0);
        let right = 3.0 * t * t * cosine.powi(3) / 4.0;
        let fits = |found: f64| (found - right).abs() < 0.002 * right + 1e-9;
        assert!(fits(found), "at {angle}: {found} instead of {right}");
        let other = measured(inner - 0.01, angle);
        assert!(t == 0.0 || t == 1.0 || !fits(other), "control: {other} of another cone passes at {angle}");
    }
}

#[test]
fn narrow_spots_have_their_full_intensity_inside_of_the_inner_cone() {
    let height = 2.0_f32;
    let measured = |inner: f32, outer: f32, angle: f32| {
        let mut scene = floor(1.0);
        scene.lights.push(spot(vec3(0.0, height, 0.0), Vec3::NEG_Y, 3.0, inner, outer));
        let x = height * angle.tan();
        irradiance_at(&scene, vec3(x, 1.0, 0.00001), vec3(x, 0.0, 0.0), 1)
    };
    // Cones below 2.6 degrees, whose cosines differ by less than 0.001, and cones that lie close
    // together. Between the cones the falloff is quadratic in the squares of small angles.
    for (inner, outer) in [(0.0_f32, 0.01_f32), (0.0, 0.002), (0.02, 0.03), (0.3, 0.301)] {
        for part in [-0.25_f32, 0.25, 0.5] {
            let angle = (inner + part * (outer - inner)).max(0.0);
            let cosine = f64::from(angle).cos();
            let [full, none] = [inner, outer].map(|a| f64::from(a).cos());
            let t = ((cosine - none) / (full - none)).min(1.0);
            let right = 3.0 * t * t * cosine.powi(3) / 4.0;
            let found = measured(inner, outer, angle);
            assert!(within(found, right, 0.01), "{inner} to {outer} at {angle}: {found} instead of {right}");
        }
        assert_eq!(measured(inner, outer, 1.2 * outer), 0.0, "outside");
        let middle = 0.5 * (inner + outer);
        let (found, other) = (measured(inner, outer, middle), measured(inner, 1.1 * outer, middle));
        assert!(!within(other, found, 0.01), "control: {other} of a wider cone");
    }
}

#[test]
fn photons_of_a_spot_carry_its_exact_flux() {
    // Three cases: a light inside a ball, unobstructed in all directions; and a light outside the
    // scene's bounding sphere above a floor that is wider, or narrower, than its cone.
    let solid_angle = |inner: f64, outer: f64| 2.0 * PI * ((1.0 - inner.cos()) + (inner.cos() - outer.cos()) / 3.0);
    let inside = |inner: f32, outer: f32| {
        let mut ball = scene(&[diffuse(0.5)]);
        ball.spheres.push(sphere(Vec3::ZERO, 1.0, 0));
        ball.lights.push(spot(vec3(0.1, 0.3, 0.2), vec3(1.0, 2.0, 3.0), 5.0, inner, outer));
        direct_flux(&ball, 40_000)
    };
    let (measured, right) = (inside(0.4, 1.1), 5.0 * solid_angle(0.4, 1.1));
    assert!(within(measured, right, 1e-3), "inside: {measured} instead of {right}");
    assert!(!within(inside(0.41, 1.1), right, 1e-3), "control: another inner cone passes");
    let outside = |half: f32, inner: f32, outer: f32| {
        let mut scene = floor(half);
        scene.lights.push(spot(vec3(0.0, 5.0, 0.0), Vec3::NEG_Y, 5.0, inner, outer));
        direct_flux(&scene, 40_000)
    };
    let (measured, right) = (outside(1.0, 0.05, 0.15), 5.0 * solid_angle(0.05, 0.15));
    assert!(within(measured, right, 1e-3), "a narrow cone: {measured} instead of {right}");
    for (inner, outer) in [(0.0_f32, 0.01_f32), (0.0, 0.001), (0.02, 0.0201)] {
        let [full, none] = [inner, outer].map(f64::from);
        let right = 5.0 * 2.0 * PI * ((full / 2.0).sin().powi(2) * 4.0 / 3.0 + (none / 2.0).sin().powi(2) * 2.0 / 3.0);
        for measured in [outside(1.0, inner, outer), inside(inner, outer)] {
            assert!(within(measured, right, 2e-3), "{inner} to {outer}: {measured} W instead of {right} W");
        }
        assert!(!within(outside(1.0, inner, 1.01 * outer), right, 2e-3), "control: a wider cone");
    }
    // A square of half side a at distance h subtends the solid angle 4 atan(a²/(h √(h² + 2a²))).
    let (measured, right) = (outside(1.0, 1.4, 1.5), 20.0 * (1.0 / (5.0 * 27.0_f64.sqrt())).atan());
    assert!(within(measured, right, 0.01), "a wide cone: {measured} instead of {right}");
    assert!(!within(outside(1.02, 1.4, 1.5), right, 0.01), "control: a floor 2 % larger passes");
}

#[test]
fn a_directional_light_has_the_same_irradiance_everywhere() {
    let lit_from = |direction: Vec3| {
        let mut scene = floor(4.0);
        scene.lights.push(Light { kind: LightKind::Directional, direction, ..point_light(Vec3::splat(9.0), 3.0) });
        scene
    };
    let direction = vec3(1.0, -2.0, 0.5).normalize();
    let (scene, above) = (lit_from(direction), lit_from(Vec3::NEG_Y));
    let right = 3.0 * f64::from(-direction.y);
    for target in [Vec3::ZERO, vec3(3.0, 0.0, -2.0)] {
        let measured = |scene: &Scene| irradiance_at(scene, target + vec3(0.0, 4.0, 0.001), target, 1);
        assert!(within(measured(&scene), right, 0.001), "{} instead of {right}", measured(&scene));
        assert!(!within(measured(&above), right, 0.001), "control: straight from above");
    }
    // Flux that the floor receives: irradiance times area.
    let (measured, right) = (direct_flux(&scene, 40_000), right * 64.0);
    assert!(within(measured, right, 0.01), "photons: {measured} W instead of {right} W");
    assert!(!within(direct_flux(&above, 40_000), right, 0.01), "control: photons straight from above");
}

#[test]
fn a_uniform_sky_gives_pi_times_its_radiance() {
    let under = |strength: f32| {
        let sky = Environment { strength, ..Environment::uniform(Vec3::splat(0.75)) };
        Scene { environment: Some(sky), ..floor(4.0) }
    };
    let measured = |strength| irradiance_at(&under(strength), vec3(1.0, 4.0, 0.001), vec3(1.0, 0.0, 0.0), 16);
    assert!(within(measured(2.0), PI * 1.5, 0.005), "{} instead of {}", measured(2.0), PI * 1.5);
    assert!(!within(measured(2.04), PI * 1.5, 0.005), "control: a sky 2 % stronger passes");
    // Both sides of the floor: twice its area.
    let (flux, right) = (|strength| direct_flux(&under(strength), 40_000), PI * 1.5 * 2.0 * 64.0);
    assert!(within(flux(2.0), right, 0.01), "photons: {} W instead of {right} W", flux(2.0));
    assert!(!within(flux(2.04), right, 0.01), "control: photons of a sky 2 % stronger pass");
}

/// Irradiance by a polygon of radiance 1, seen counterclockwise from the point (Lambert 1760): half
/// the sum over its edges of the angle under which an edge is seen, times the cosine of its plane's
/// normal.
fn lambert(point: Vec3, normal: Vec3, corners: &[Vec3]) -> f64 {
    let to = |i: usize| (corners[i % corners.len()] - point).as_dvec3().normalize();
    let edge = |i: usize| to(i).angle_between(to(i + 1)) * to(i).cross(to(i + 1)).normalize().dot(normal.as_dvec3());
    0.5 * (0..corners.len()).map(edge).sum::<f64>().abs()
}

/// A square of 1 m² that emits downwards, over a floor and beside a wall at x = 1.5. It is not
/// double-sided.
fn square_over_floor(height: f32) -> (Scene, [Vec3; 4]) {
    let mut scene = floor(3.0);
    scene.materials.push(emissive("lamp", 0.0, 2.0, false));
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| vec3(x, height, z));
    add_quad(&mut scene, corners[0], Vec3::X, Vec3::Z, 1);
    add_quad(&mut scene, vec3(1.5, 0.0, -3.0), vec3(0.0, 0.0, 6.0), vec3(0.0, 3.0, 0.0), 0);
    (scene, corners)
}

#[test]
fn a_square_emitter_gives_what_its_form_factor_says() {
    let ((scene, corners), (higher, _)) = (square_over_floor(2.0), square_over_floor(2.05));
    let facing = [(vec3(0.1, 0.0, 0.0), Vec3::Y), (vec3(-1.2, 0.0, 0.7), Vec3::Y)];
    let askew = [(vec3(1.5, 1.0, 0.0), Vec3::NEG_X), (vec3(1.5, 0.3, -0.8), Vec3::NEG_X)];
    for (point, normal) in facing.into_iter().chain(askew) {
        let eye = point + 0.4 * normal + vec3(0.0, 0.1, 0.001);
        let measured = |scene| irradiance_at(scene, eye, point, 64);
        let right = 2.0 * lambert(point, normal, &corners);
        assert!(within(measured(&scene), right, 0.01), "at {point}: {} instead of {right}", measured(&scene));
        assert!(!within(measured(&higher), right, 0.01), "control: an emitter 5 cm higher passes at {point}");
    }
    // The back emits nothing.
    assert_eq!(irradiance_at(&scene, vec3(1.4, 2.6, 0.001), vec3(1.5, 2.5, 0.0), 64), 0.0);
    let mut both = scene.clone();
    both.materials[1].double_sided = true;
    let (measured, point) = (irradiance_at(&both, vec3(1.4, 2.6, 0.001), vec3(1.5, 2.5, 0.0), 64), vec3(1.5, 2.5, 0.0));
    let right = 2.0 * lambert(point, Vec3::NEG_X, &corners);
    assert!(within(measured, right, 0.01), "double-sided: {measured} instead of {right}");
}

#[test]
fn a_spherical_emitter_gives_what_its_solid_angle_says() {
    let bulb = |radius: f32| {
        let mut scene = floor(3.0);
        scene.materials.push(emissive("bulb", 0.0, 2.0, false));
        scene.spheres.push(sphere(vec3(0.0, 2.0, 0.0), radius, 1));
        scene
    };
    for x in [0.1_f32, 1.0, 2.5] {
        let (point, d2) = (vec3(x, 0.0, 0.0), f64::from(x * x + 4.0));
        let measured = |radius| irradiance_at(&bulb(radius), point + vec3(0.0, 0.5, 0.001), point, 64);
        let right = PI * 2.0 * 0.64 / d2 * 2.0 / d2.sqrt();
        assert!(within(measured(0.8), right, 0.005), "at {x}: {} instead of {right}", measured(0.8));
        assert!(!within(measured(0.816), right, 0.005), "control: a bulb 2 % larger passes at {x}");
    }
    // Flux of its photons: π L times its area. A large floor below receives half of it, an
    // enclosing ball all of it.
    let flux = |radius| {
        let mut scene = bulb(radius);
        scene.spheres.push(sphere(Vec3::ZERO, 50.0, 0));
        direct_flux(&scene, 40_000)
    };
    let right = PI * 2.0 * 4.0 * PI * 0.64;
    assert!(within(flux(0.8), right, 1e-3), "photons: {} W instead of {right} W", flux(0.8));
    assert!(!within(flux(0.801), right, 1e-3), "control: photons of a bulb 1 mm larger pass");
}

#[test]
fn only_large_lamps_are_looked_for_by_the_cosine() {
    let rays = |side: f32| {
        let mut scene = floor(0.5);
        scene.materials.push(emissive("lamp", 0.0, 1.0, false));
        add_quad(&mut scene, vec3(-0.5 * side, 2.0, -0.5 * side), vec3(side, 0.0, 0.0), vec3(0.0, 0.0, side), 1);
        scene.cameras = vec![camera(vec3(0.0, 1.0, 0.001), Vec3::ZERO, 10.0)];
        let settings = settings(Mode::DirectRays, 1, 8).with(|s| s.picture.light_samples = 16);
        render_scene(&scene, &settings).stats.rays
    };
    // Each of 64 pixels has its own ray and 16 samples.
    assert_eq!(rays(0.1), 64 * 17, "a lamp of 0.0025 sr");
    assert_eq!(rays(3.0), 64 * 33, "a lamp of 1.6 sr");
}

/// A lamp of 6 cm at the origin, in the middle of the scene: 1 m above a ground of 200 m, below a
/// roof at the height of the lamp's mirror image.
fn small_lamp(add: impl Fn(&mut Scene), radiance: f32) -> Scene {
    let mut scene = floor(100.0);
    for triangle in &mut scene.triangles {
        triangle.positions = triangle.positions.map(|corner| corner - Vec3::Y);
    }
    scene.materials.push(emissive("lamp", 0.0, radiance, false));
    add(&mut scene);
    add_quad(&mut scene, vec3(99.0, 1.0, -99.0), Vec3::X, Vec3::Z, 0);
    scene
}

/// What puts a lamp into a scene.
type Add<'a> = &'a dyn Fn(&mut Scene);

#[test]
fn small_lamps_amid_wide_scenes_light_what_is_far() {
    let ball = |scene: &mut Scene| scene.spheres.push(sphere(Vec3::ZERO, 0.03, 1));
    let square =
        |scene: &mut Scene| add_quad(scene, vec3(-0.03, 0.0, -0.03), vec3(0.06, 0.0, 0.0), vec3(0.0, 0.0, 0.06), 1);
    let upright =
        |scene: &mut Scene| add_quad(scene, vec3(0.0, -0.03, 0.03), vec3(0.0, 0.0, -0.06), vec3(0.0, 0.06, 0.0), 1);
    let cube = |scene: &mut Scene| add_box(scene, Vec3::splat(-0.03), Vec3::splat(0.03), 1);
    for x in [10.0_f32, 80.0] {
        let (point, d) = (vec3(x, -1.0, 0.0), f64::from(x * x + 1.0).sqrt());
        // Cosines at the ground and at the faces that look down and sideways.
        let (down, aside) = (1.0 / d, f64::from(x) / d);
        let face = 0.0036 / (d * d);
        let lamps: [(&str, Add, f64); 4] = [
            ("ball", &ball, PI * 0.0009 / (d * d) * down),
            ("square", &square, face * down * down),
            ("upright square", &upright, face * aside * down),
            ("cube", &cube, face * (down + aside) * down),
        ];
        for (name, add, right) in lamps {
            let measured =
                |radiance| irradiance_at(&small_lamp(add, radiance), point + vec3(0.0, 0.5, 0.001), point, 16);
            let found = measured(1.0);
            assert!(within(found, right, 0.005), "{name} at {x} m: {found} instead of {right}");
            assert!(!within(measured(1.02), right, 0.005), "control: a {name} 2 % stronger passes at {x} m");
        }
    }
}

#[test]
fn a_clear_coat_takes_its_reflectance_from_emission() {
    let fresnel = |cosine: f64| 0.04 + 0.96 * (1.0 - cosine).powi(5);
    let lamp = |clearcoat: f32, add: &dyn Fn(&mut Scene)| {
        let mut scene = floor(30.0);
        scene.materials.push(Material { clearcoat, ..emissive("lamp", 0.0, 1.0, false) });
        add(&mut scene);
        scene
    };
    let ball = |scene: &mut Scene| scene.spheres.push(sphere(Vec3::Y, 0.02, 1));
    let square =
        |scene: &mut Scene| add_quad(scene, vec3(-0.01, 1.0, -0.01), vec3(0.02, 0.0, 0.0), vec3(0.0, 0.0, 0.02), 1);
    for x in [0.5_f32, 2.0, 4.0] {
        let (point, d2) = (vec3(x, 0.0, 0.0), f64::from(x * x + 1.0));
        let cosine = 1.0 / d2.sqrt();
        let seen = |clearcoat: f32| {
            let mut scene = lamp(clearcoat, &square);
            scene.cameras = vec![camera(point, Vec3::Y + vec3(0.001, 0.0, 0.0), 0.02)];
            mean(&render_scene(&scene, &settings(Mode::DirectRays, 1, 4)))
        };
        let lit = |clearcoat: f32| irradiance_at(&lamp(clearcoat, &square), point + vec3(0.0, 0.5, 0.001), point, 64);
        let forms = [("seen", seen(1.0), seen(0.5), 1.0), ("lit", lit(1.0), lit(0.5), 0.0004 * cosine * cosine / d2)];
        for (what, found, control, bare) in forms {
            let right = bare * (1.0 - fresnel(cosine));
            assert!(within(found, right, 0.003), "{what} from {x} m: {found} instead of {right}");
            assert!(!within(control, right, 0.01), "control: {what} under half the coat, {control}");
        }
    }
    // The mean of the reflectance over the hemisphere, by the cosine: for photons, and for a ball
    // at some distance.
    let left = 1.0 - (0.04 + 0.96 / 21.0);
    let far = |clearcoat: f32| irradiance_at(&lamp(clearcoat, &ball), vec3(0.0, 0.5, 0.001), Vec3::ZERO, 256);
    let flux = |clearcoat: f32| {
        let mut scene = lamp(clearcoat, &ball);
        scene.spheres.push(sphere(Vec3::ZERO, 50.0, 0));
        direct_flux(&scene, 40_000)
    };
    let forms =
        [("a ball", far(1.0), far(0.5), PI * 0.0004), ("photons", flux(1.0), flux(0.5), PI * 4.0 * PI * 0.0004)];
    for (what, found, control, bare) in forms {
        assert!(within(found, bare * left, 0.003), "{what}: {found} instead of {}", bare * left);
        assert!(!within(control, bare * left, 0.01), "control: {what} under half the coat, {control}");
    }
}

#[test]
fn balls_vanish_in_a_furnace() {
    let furnace = |surface: Surface, mode: Mode| {
        let mut scene = scene(&[surface]);
        scene.spheres.push(sphere(vec3(-0.6, 0.0, 0.0), 0.6, 0));
        scene.spheres.push(sphere(vec3(0.6, 0.0, 0.0), 0.6, 0));
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        scene.cameras.push(camera(vec3(0.0, 0.0, 6.0), Vec3::ZERO, 25.0));
        let settings = settings(mode, 60_000, 32).with(|s| {
            s.photons.max_bounces = 60;
            s.estimate.neighbors = 50;
            s.photons.max_paths = Some(300_000);
        });
        let render = render_scene(&scene, &settings);
        assert!(render.frame.alpha().contains(&0.0), "the furnace itself has no coverage");
        render
    };
    for surface in [glass(), Surface::Mirror { tint: Vec3::ONE }] {
        let render = furnace(surface, Mode::DirectRays);
        let worst = render.frame.radiance().iter().flatten().map(|x| (x - 1.0).abs()).fold(0.0, f32::max);
        assert!(worst < 0.01, "{surface:?} can be told from the furnace by {worst}");
    }
    for mode in [Mode::Hybrid, Mode::Photons] {
        let (white, grey) = (mean(&furnace(diffuse(1.0), mode)), mean(&furnace(diffuse(0.9), mode)));
        assert!(within(white, 1.0, 0.01), "{mode:?}: white balls look {white}");
        assert!(!within(grey, 1.0, 0.01), "{mode:?}: control: grey balls look {grey}");
    }
}

/// A dim sky with a bright pixel above the horizon.
fn sky_with_a_sun(rotation: f32) -> Environment {
    let (width, height) = (64, 32);
    let pixels = (0..width * height).map(|i| if i == 8 * width + 20 { [900.0; 3] } else { [0.1; 3] });
    Environment { width, height, pixels: pixels.collect(), rotation, ..Environment::uniform(Vec3::ZERO) }
}

/// Radiance of a map in a direction, interpolated between pixels, as its documentation says.
fn looked_up(map: &Environment, d: glam::DVec3) -> f64 {
    let (s, c) = f64::from(map.rotation).sin_cos();
    let (x, z) = (c * d.x - s * d.z, c * d.z + s * d.x);
    let u = (0.5 + z.atan2(x) / (2.0 * PI)) * f64::from(map.width) - 0.5;
    let v = d.y.clamp(-1.0, 1.0).acos() / PI * f64::from(map.height) - 0.5;
    let at = |x: f64, y: f64| {
        let x = (x as i64).rem_euclid(i64::from(map.width)) as usize;
        let y = (y as i64).clamp(0, i64::from(map.height) - 1) as usize;
        f64::from(map.pixels[y * map.width as usize + x][0])
    };
    let (x, y) = (u.floor(), v.floor());
    let row = |y: f64| at(x, y) * (1.0 - (u - x)) + at(x + 1.0, y) * (u - x);
    row(y) * (1.0 - (v - y)) + row(y + 1.0) * (v - y)
}

#[test]
fn a_bright_pixel_lights_and_is_seen_where_it_is() {
    let (map, turned) = (sky_with_a_sun(0.5), sky_with_a_sun(0.5 + 20_f32.to_radians()));
    let normal = vec3(0.6, 0.5, -0.3).normalize();
    let cosine_sum = |map: &Environment| {
        let (rows, columns) = (2000, 4000);
        let one = |i: usize| {
            let (theta, phi) =
                (PI * ((i / columns) as f64 + 0.5) / rows as f64, 2.0 * PI * (i % columns) as f64 / columns as f64);
            let d = glam::dvec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            looked_up(map, d) * d.dot(normal.as_dvec3()).max(0.0) * theta.sin()
        };
        (0..rows * columns).map(one).sum::<f64>() * PI / rows as f64 * 2.0 * PI / columns as f64
    };
    // A tilted square of albedo 1/2.
    let mut scene = scene(&[diffuse(0.5)]);
    let across = normal.cross(Vec3::Y).normalize();
    add_quad(&mut scene, -across - normal.cross(across), 2.0 * across, 2.0 * normal.cross(across), 0);
    let other = Scene { environment: Some(turned.clone()), ..scene.clone() };
    scene.environment = Some(map.clone());
    let right = cosine_sum(&map);
    let point = 0.3 * across;
    let measured = |scene| irradiance_at(scene, point + normal, point, 16);
    assert!(within(measured(&scene), right, 0.01), "{} instead of {right}", measured(&scene));
    assert!(!within(measured(&other), right, 0.05), "control: {} with the map turned", measured(&other));
    // Flux of the photons that the two sides of the square receive.
    let back = irradiance_at(&scene, point - normal, point, 16);
    let flux = direct_flux(&scene, 40_000);
    assert!(within(flux, 4.0 * (right + back), 0.02), "photons: {flux} W instead of {} W", 4.0 * (right + back));
    let flux = direct_flux(&other, 40_000);
    assert!(!within(flux, 4.0 * (right + back), 0.02), "control: {flux} W with the map turned");
    // Seen from far above the square, each pixel has the radiance of the map.
    let center = vec3(-0.1, 0.63, -0.7);
    scene.cameras = vec![camera(vec3(0.0, 50.0, 0.0), vec3(0.0, 50.0, 0.0) + center, 90.0)];
    scene.cameras[0].aspect = None;
    let settings = settings(Mode::DirectRays, 1, 1).with(|s| s.picture.size = Some((48, 48)));
    let seen = render_scene(&scene, &settings).frame;
    let eye = &scene.cameras[0];
    let expected = |map: &Environment, i: usize| {
        let (x, y) = ((i % 48) as f32 + 0.5, (i / 48) as f32 + 0.5);
        let d = eye.forward + (x / 24.0 - 1.0) * eye.right + (1.0 - y / 24.0) * eye.up;
        looked_up(map, d.as_dvec3().normalize())
    };
    let worst = |map: &Environment| {
        let difference = |i: usize| (f64::from(seen.radiance()[i][0]) - expected(map, i)).abs();
        (0..48 * 48).map(difference).fold(0.0, f64::max)
    };
    assert!(seen.radiance().iter().any(|p| p[0] > 300.0), "the bright pixel is in the picture");
    assert!(worst(&map) < 2.0, "pixels differ from the map by up to {} of 900", worst(&map));
    assert!(worst(&turned) > 100.0, "control: the map turned");
}
