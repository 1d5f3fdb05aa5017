//! Faults of the device, and the splitting of dispatches that avoids them.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | parts | dispatches that are cut, by force or by the device's clock, change no bit of the picture | uncut ones are fewer; another seed |
//! | loss | a device that is lost at any stage ends the render with an error, and stays lost | a device that is not renders |
//! | memory | what finds no memory is named with its size | it renders where there is enough |
//! | refusal | a command that the driver refuses is an error of the next wait, once | a command in order is none |

use std::sync::atomic::{AtomicBool, Ordering};

use caustica::{
    Error, Result,
    gpu::{Gpu, Pacing},
    progress::{Progress, Silent, Stage},
    renderer::{Render, render},
    scene::Scene,
    settings::{Mode, Settings},
};
use glam::{Vec3, vec3};
use support::*;

/// A closed room with a glass ball, a lamp and an emissive panel.
fn room() -> Scene {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    scene.materials.push(emissive("panel", 0.5, 2.0, false));
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    add_quad(&mut scene, vec3(-0.3, 0.99, -0.3), 0.6 * Vec3::X, 0.6 * Vec3::Z, 2);
    scene.spheres.push(sphere(vec3(0.3, -0.3, 0.0), 0.5, 1));
    scene.lights.push(point_light(vec3(-0.5, 0.5, 0.1), 0.3));
    scene.cameras.push(camera(vec3(0.0, 0.0, 0.99), Vec3::ZERO, 80.0));
    scene
}

fn small() -> Settings {
    settings(Mode::Hybrid, 1000, 8).with(|s| s.estimate.neighbors = 20)
}

fn open(pacing: Pacing) -> Gpu {
    Gpu::open_paced(None, Some(pacing)).expect("tests need an adapter")
}

#[test]
fn cut_dispatches_change_no_bit() {
    let scene = room();
    let settings = small().with(|s| s.photons.final_gather = 1);
    let picture = |pacing, settings: &Settings| {
        let gpu = open(pacing);
        let frame = render(&gpu, &scene, settings, &Silent).expect("the scene renders").frame;
        (frame, gpu.dispatches())
    };
    let (whole, uncut) = picture(Pacing::Whole, &settings);
    let (cut, chunks) = picture(Pacing::Chunks(256), &settings);
    assert!(cut == whole, "parts of 256 invocations give another picture");
    assert!(chunks > uncut + 100, "control: {uncut} dispatches, {chunks} when cut");
    let (timed, chunks) = picture(Pacing::Measured, &settings);
    assert!(timed == whole, "dispatches cut by time give another picture");
    assert!(chunks >= uncut, "{uncut} dispatches, {chunks} when timed");
    let (other, _) = picture(Pacing::Whole, &settings.with(|s| s.photons.seed = 1));
    assert!(other != whole, "control: the seed changes nothing");
}

/// Destroys the device when a stage is reported.
struct Loses<'g> {
    gpu: &'g Gpu,
    at: Stage,
    done: AtomicBool,
}

impl Progress for Loses<'_> {
    fn report(&self, stage: Stage, _: u64, _: u64) {
        if stage == self.at && !self.done.swap(true, Ordering::Relaxed) {
            self.gpu.device.destroy();
        }
    }

    fn stop_requested(&self) -> bool {
        false
    }
}

fn render_losing(gpu: &Gpu, at: Stage) -> Result<Render> {
    render(gpu, &room(), &small(), &Loses { gpu, at, done: AtomicBool::new(false) })
}

#[test]
fn a_lost_device_is_an_error_at_any_stage() {
    for stage in [Stage::Bvh, Stage::Photons, Stage::Grid, Stage::Camera] {
        let gpu = open(Pacing::Whole);
        let error = render_losing(&gpu, stage).expect_err("the device is lost");
        assert!(matches!(error, Error::Lost { .. }), "{stage:?}: {error}");
        let text = error.to_string();
        assert!(text.contains("`device`") && text.contains(&gpu.name) && !text.contains('\n'), "{text}");
        let error = render(&gpu, &room(), &small(), &Silent).expect_err("it stays lost");
        assert!(matches!(error, Error::Lost { .. }), "{stage:?}, again: {error}");
    }
    // Control: a stage that never occurs.
    assert!(render_losing(&open(Pacing::Whole), Stage::Compare).is_ok());
}

#[test]
fn what_finds_no_memory_is_named() {
    let gpu = open(Pacing::Whole);
    let picture = || render(&gpu, &room(), &small(), &Silent).map(|r| r.stats.peak_device_bytes);
    let peak = picture().expect("control: there is enough");
    for limit in [peak / 4 * 3, 1000] {
        gpu.memory.set_limit(limit);
        let error = picture().expect_err("there is too little");
        let Error::Memory { needed: Some(needed), used, .. } = error else { panic!("{error}") };
        assert!(used + needed > limit, "{used} + {needed} bytes of {limit}");
        let text = error.to_string();
        assert!(["`photons.global`", "`device`", &gpu.name].iter().all(|said| text.contains(said)), "{text}");
    }
    gpu.memory.set_limit(u64::MAX);
    assert_eq!(picture().expect("it goes on when there is enough again"), peak);
}

#[test]
fn a_refused_command_is_an_error_of_the_next_wait() {
    let gpu = open(Pacing::Whole);
    let buffer = gpu.storage::<u32>("four", 4).expect("fits");
    gpu.write(&buffer, 0, &[1_u32; 4]);
    gpu.wait().expect("control: what fits is in order");
    gpu.write(&buffer, 0, &[1_u32; 5]);
    let error = gpu.wait().expect_err("five do not fit into four");
    let text = error.to_string();
    assert!(matches!(error, Error::Gpu(_)) && text.contains("refused") && !text.contains('\n'), "{text}");
    assert_eq!(gpu.read::<u32>(&buffer, 0, 4).expect("the fault is told once"), [1; 4]);
}
