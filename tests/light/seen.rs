//! Visibility to a camera: near and far planes, faces, what is hidden.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | near plane | what lies before it is not seen, and keeps its shadow; with a lens too | a plane before the cover |
//! | far plane | beyond it the environment is seen; rays from a mirror have no end | a plane beyond the wall |
//! | cut glass | where the near plane cuts a ball, rays start in the glass: radiance n² L, or total reflection | glass of another index |
//! | plane in glass | an orthographic camera whose own plane cuts the ball sees the same | the ball before the plane |
//! | back faces | a single-sided face is drawn from behind, and does not shine there | a doubled one shines |

use std::f64::consts::PI;

use caustica::{
    scene::{Camera, Environment, Light, LightKind, Projection, Scene, Surface},
    settings::{Mode, Settings},
};
use glam::{Vec3, vec3};
use support::*;

const SIZE: u32 = 24;

fn quick(mode: Mode) -> Settings {
    settings(mode, 1000, SIZE)
}

/// A square around the axis of the camera, facing it.
fn add_cover(scene: &mut Scene, half: f32, depth: f32, material: u32) {
    add_quad(scene, vec3(-half, -half, -depth), Vec3::X * 2.0 * half, Vec3::Y * 2.0 * half, material);
}

fn sun(irradiance: f32) -> Light {
    Light { kind: LightKind::Directional, direction: Vec3::NEG_Z, ..point_light(Vec3::ZERO, irradiance) }
}

/// Cameras at the origin along -z that see about 0.7 m to each side at a distance of 2 m.
fn both_kinds() -> [Camera; 2] {
    let view = camera(Vec3::ZERO, Vec3::NEG_Z, 40.0);
    [Camera { projection: Projection::Orthographic { ymag: 0.7 }, ..view.clone() }, view]
}

/// Radiance and coverage of the middle of the picture, and of its upper left corner.
fn middle_and_corner(scene: &Scene, settings: &Settings) -> [(f64, f64); 2] {
    let render = render_scene(scene, settings);
    assert_eq!((render.stats.unfinished_rays, render.stats.media_overflows), (0, 0));
    let at = |pixel: usize| (f64::from(render.frame.radiance()[pixel][1]), f64::from(render.frame.alpha()[pixel]));
    [at((SIZE * SIZE / 2 + SIZE / 2) as usize), at(0)]
}

#[test]
fn what_lies_before_the_near_plane_is_not_seen_but_stands_in_the_light() {
    let pictures = |near: f32, lamp: Light| {
        both_kinds().map(|view| {
            // A black cover over the middle of a wall, of a mirror, a pane and a black square.
            let pane = Surface::Pane { ior: 1.5, tint: Vec3::ONE };
            let mut scene = scene(&[diffuse(0.5), diffuse(0.0), Surface::Mirror { tint: Vec3::ONE }, pane]);
            add_cover(&mut scene, 9.0, 2.0, 0);
            for (depth, material) in [(0.6, 2), (0.8, 3), (1.0, 1)] {
                add_cover(&mut scene, 0.3, depth, material);
            }
            scene.lights.push(lamp.clone());
            scene.cameras.push(Camera { near, ..view });
            let pinhole = middle_and_corner(&scene, &quick(Mode::DirectRays));
            if let Projection::Perspective { .. } = scene.cameras[0].projection {
                let lens = quick(Mode::DirectRays).with(|s| (s.picture.aperture, s.picture.focus) = (0.02, Some(2.0)));
                let [middle, _] = middle_and_corner(&scene, &lens);
                assert!((middle.0 - pinhole[0].0).abs() <= 0.01 * pinhole[0].0, "with a lens {middle:?}, {pinhole:?}");
            }
            pinhole
        })
    };
    let lit = |irradiance: f64| 0.5 / PI * irradiance;
    // A sun from behind the camera: the middle of the wall is in the shadow of what is not seen.
    for [middle, corner] in pictures(1.2, sun(3.0)) {
        assert_eq!(middle, (0.0, 1.0));
        assert!(within(corner.0, lit(3.0), 1e-4), "{corner:?}");
    }
    // A lamp between the cover and the wall, 0.5 m before it.
    let lamp = point_light(vec3(0.0, 0.0, -1.5), 1.0);
    for [middle, _] in pictures(1.2, lamp.clone()) {
        assert!(within(middle.0, lit(4.0), 0.02), "{middle:?}");
    }
    for [middle, _] in pictures(0.9, lamp) {
        assert_eq!(middle, (0.0, 1.0), "control: the cover is beyond the near plane");
    }
}

#[test]
fn beyond_the_far_plane_the_background_is_seen() {
    let pictures = |far: f32| {
        both_kinds().map(|view| {
            // Before the wall a mirror that shows what lies behind the camera, 3 m from it.
            let mut scene = scene(&[diffuse(0.5), Surface::Mirror { tint: Vec3::ONE }]);
            add_cover(&mut scene, 9.0, 2.0, 0);
            add_cover(&mut scene, 9.0, -2.0, 0);
            add_cover(&mut scene, 0.1, 1.0, 1);
            scene.environment = Some(Environment::uniform(Vec3::splat(0.25)));
            scene.lights.push(point_light(Vec3::ZERO, 20.0));
            scene.cameras.push(Camera { far, ..view });
            middle_and_corner(&scene, &quick(Mode::DirectRays))
        })
    };
    for ([middle, corner], [far_middle, far_corner]) in pictures(1.5).into_iter().zip(pictures(2.05)) {
        assert_eq!(corner, (0.25, 0.0), "the environment, uncovered");
        // The mirror's rays have no end. Depth is measured along the axis: the corner is farther
        // away than the plane.
        assert_eq!(middle, far_middle);
        assert!(middle.1 == 1.0 && middle.0 > 0.4, "{middle:?}");
        assert!(far_corner.1 == 1.0 && far_corner.0 > 0.4, "control: {far_corner:?}");
    }
}

const INDEX: f64 = 1.5;
const RADIUS: f64 = 1.0;

/// Numbers of right pixels of rays that start in the air, in glass and get out, in glass and are
/// trapped; and of wrong ones. The picture is of a ball in a furnace of radiance 2, cut by the near
/// plane. Closed forms are for a ball of [`INDEX`] around `center`.
fn cut_ball(view: Camera, center: Vec3, ior: f64) -> [usize; 4] {
    let mut scene = scene(&[Surface::Glass { ior: ior as f32, tint: Vec3::ONE }]);
    scene.spheres.push(sphere(center, RADIUS as f32, 0));
    scene.environment = Some(Environment::uniform(Vec3::splat(2.0)));
    scene.cameras.push(view.clone());
    let render = render_scene(&scene, &quick(Mode::DirectRays));
    let mut counts = [0; 4];
    for (i, pixel) in render.frame.radiance().iter().enumerate() {
        let at = |i: u32| 2.0 * (i as f32 + 0.5) / SIZE as f32 - 1.0;
        let (x, y) = (at(i as u32 % SIZE), -at(i as u32 / SIZE));
        let half = view.half_height_at(1.0, (SIZE, SIZE));
        let aside = half * (x * view.right + y * view.up);
        let (origin, direction) = match view.projection {
            Projection::Orthographic { .. } => (view.position + aside, view.forward),
            Projection::Perspective { .. } => (view.position, view.forward + aside),
        };
        let start = (origin + view.near * direction).as_dvec3() - center.as_dvec3();
        // The sine of incidence from inside, by the distance of the ray's line from the centre.
        let sine = start.cross(direction.normalize().as_dvec3()).length() / RADIUS;
        if (start.length() - RADIUS).abs() < 0.02 || (sine - 1.0 / INDEX).abs() < 0.02 || (sine - 1.0).abs() < 0.02 {
            continue;
        }
        let (kind, right) = match (start.length() < RADIUS, sine * INDEX < 1.0) {
            (false, _) => (0, 2.0),
            (true, true) => (1, 2.0 * INDEX * INDEX),
            (true, false) => (2, 0.0),
        };
        let is_right = (f64::from(pixel[0]) - right).abs() < 2e-3 * right + 1e-6;
        counts[if is_right { kind } else { 3 }] += 1;
    }
    counts
}

#[test]
fn where_the_near_plane_cuts_glass_rays_start_in_it() {
    for view in both_kinds() {
        let wide = Camera { near: 3.0, projection: wider(view.projection), ..view };
        let [air, bright, dark, wrong] = cut_ball(wide.clone(), vec3(0.1, 0.0, -3.0), INDEX);
        assert!(air > 80 && bright > 60 && dark > 40, "{air} in the air, {bright} bright, {dark} dark");
        assert_eq!(wrong, 0, "{:?}", wide.projection);
        let [.., wrong] = cut_ball(wide, vec3(0.1, 0.0, -3.0), 1.4);
        assert!(wrong > 60, "control: of another index only {wrong} pixels are wrong");
    }
}

/// A view of 1.5 m to each side at a distance of 3 m.
fn wider(projection: Projection) -> Projection {
    match projection {
        Projection::Orthographic { .. } => Projection::Orthographic { ymag: 1.5 },
        Projection::Perspective { .. } => Projection::Perspective { yfov: 2.0 * 0.5_f32.atan() },
    }
}

#[test]
fn the_plane_of_an_orthographic_camera_may_lie_in_glass() {
    let [view, _] = both_kinds();
    // The middle of the picture lies in the air: the ball is cut beside it. A depth below 0 is one
    // behind the camera.
    for (near, center) in [(0.0, vec3(0.4, 0.4, 0.0)), (-0.3, vec3(0.4, 0.4, 0.3)), (0.0, vec3(-1.2, 0.3, 0.0))] {
        let wide = Camera { near, projection: wider(view.projection), ..view.clone() };
        let [air, bright, dark, wrong] = cut_ball(wide.clone(), center, INDEX);
        assert!(air > 80 && bright > 20 && dark > 20, "{air} in the air, {bright} bright, {dark} dark");
        assert_eq!(wrong, 0, "from {near}, around {center}");
        let [.., dark, _] = cut_ball(wide, center - 3.0 * Vec3::Z, INDEX);
        assert_eq!(dark, 0, "control: from outside nothing is trapped");
    }
}

#[test]
fn single_sided_faces_are_drawn_from_behind() {
    let seen = |double_sided: bool| {
        let mut scene = scene(&[]);
        scene.materials.push(emissive("lamp", 0.5, 3.0, double_sided));
        // Corners run clockwise as the camera sees them.
        add_quad(&mut scene, vec3(-1.0, -1.0, -2.0), Vec3::Y * 2.0, Vec3::X * 2.0, 0);
        scene.lights.push(sun(2.0));
        scene.cameras.push(both_kinds()[1].clone());
        middle_and_corner(&scene, &quick(Mode::DirectRays))[0]
    };
    let reflected = 0.5 / PI * 2.0;
    assert!(seen(false).1 == 1.0 && within(seen(false).0, reflected, 1e-4), "{:?}", seen(false));
    assert!(within(seen(true).0, reflected + 3.0, 1e-4), "control: {:?}", seen(true));
}
