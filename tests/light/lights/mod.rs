//! Every kind of light: closed forms, photons against rays, and emission aimed at specular objects.

mod aimed;
mod closed_forms;
mod closed_lamps;
mod many;
mod photons;
mod steered;
mod textured;

use caustica::{
    bvh::Bvh,
    layout::Photon,
    passes::{PhotonTracer, TracedPhotons},
    progress::Silent,
    scene::{Light, LightKind, Scene},
    settings::{Mode, Settings},
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};
use support::*;

/// A floor of albedo 1/2 at height 0, `half` from its centre to its edges.
fn floor(half: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    add_quad(&mut scene, vec3(-half, 0.0, half), vec3(2.0 * half, 0.0, 0.0), vec3(0.0, 0.0, -2.0 * half), 0);
    scene
}

fn spot(position: Vec3, direction: Vec3, intensity: f32, inner: f32, outer: f32) -> Light {
    let kind = LightKind::Spot { inner, outer };
    Light { kind, direction: direction.normalize(), ..point_light(position, intensity) }
}

/// The first pass alone.
fn traced(scene: &Scene, settings: &Settings) -> TracedPhotons {
    let gpu = gpu();
    let buffers = SceneBuffers::new(gpu, scene, &Bvh::build(scene), &settings.lights).expect("the scene fits");
    let tracer = PhotonTracer::new(gpu, &buffers, settings.photons.sampler);
    tracer.trace(gpu, &buffers, &settings.photons, scene.has_specular(), &Silent).expect("photons trace")
}

/// Total flux of the photons of `emitted` paths, W in the first channel.
fn flux<'a>(photons: impl IntoIterator<Item = &'a Photon>, emitted: u64) -> f64 {
    photons.into_iter().map(|p| f64::from(p.flux[0])).sum::<f64>() / emitted as f64
}

/// Flux of the photons that come straight from the lights, W in the first channel.
fn direct_flux(scene: &Scene, photons: u32) -> f64 {
    let map = traced(scene, &settings(Mode::DirectPhotons, photons, 1)).maps.global;
    flux(&map.read(gpu()).expect("photons read back"), map.emitted)
}
