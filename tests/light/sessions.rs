//! One session makes many pictures, each as if it were the only one.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | settings | pictures of other settings, made before, change no bit | those of other settings differ |
//! | maps | those of another session are refused | those of the own one are not |

use caustica::{
    Error,
    progress::Silent,
    renderer::Session,
    scene::Scene,
    settings::{Mode, Sampler, Settings},
};
use glam::{Vec3, vec3};
use support::*;

fn room() -> Scene {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    add_box(&mut scene, vec3(-1.0, 0.0, -1.0), vec3(1.0, 2.0, 3.0), 0);
    scene.spheres.push(sphere(vec3(0.3, 0.4, 0.2), 0.4, 1));
    scene.lights.push(point_light(vec3(0.0, 1.7, 0.0), 5.0));
    scene.cameras.push(camera(vec3(0.0, 1.0, 2.9), vec3(0.0, 0.8, 0.0), 60.0));
    scene
}

fn open<'a>(scene: &'a Scene, settings: &Settings) -> Session<'a> {
    Session::open(gpu(), scene, &settings.lights, &Silent).expect("the scene fits")
}

fn picture(session: &Session, settings: &Settings) -> Vec<[f32; 3]> {
    let maps = session.photon_maps(&settings.photons, &Silent).expect("photons");
    let made = session.picture(&maps, &settings.estimate, &settings.picture, &Silent);
    made.expect("a picture").frame.radiance().to_vec()
}

#[test]
fn pictures_of_a_session_do_not_depend_on_those_before() {
    let scene = room();
    let base = settings(Mode::Hybrid, 5000, 16);
    let variants = [
        base.clone().with(|s| s.photons.sampler = Sampler::Random),
        base.clone().with(|s| s.photons.final_gather = 8),
        base.clone().with(|s| s.photons.mode = Mode::DirectPhotons),
        base.clone().with(|s| s.photons.seed = 7),
        base.clone(),
    ];
    let shared = open(&scene, &base);
    let pictures: Vec<_> = variants.iter().map(|settings| picture(&shared, settings)).collect();
    for (settings, made) in variants.iter().zip(&pictures) {
        assert_eq!(&picture(&open(&scene, settings), settings), made, "{settings:?}");
    }
    for other in &pictures[..4] {
        assert_ne!(other, &pictures[4], "control: the settings matter");
    }
}

#[test]
fn maps_of_another_session_are_refused() {
    let settings = settings(Mode::Hybrid, 1000, 8);
    let (a, mut b) = (room(), room());
    b.lights[0].intensity *= Vec3::splat(2.0);
    let (session, other) = (open(&a, &settings), open(&b, &settings));
    let maps = other.photon_maps(&settings.photons, &Silent).expect("photons");
    let made = |session: &Session| session.picture(&maps, &settings.estimate, &settings.picture, &Silent);
    match made(&session) {
        Err(Error::Setting { name, .. }) => assert_eq!(name, "maps"),
        other => panic!("{other:?}"),
    }
    assert!(made(&other).is_ok(), "control: its own maps");
}
