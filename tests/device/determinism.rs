//! Determinism: the same scene, settings, seed and adapter give the same bits.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | twice | two renders in one process are equal | another seed |
//! | tables | so are those from tables and from storage buffers | another seed |
//! | threads | so are renders by the program with one and with two driver threads, under other names | another seed |
//! | path 2^32 | random numbers go on there, whatever the batch begins with, and repeat none | numbers of 32 bits begin anew |
//! | emission | the closed form and rejection in a cube draw the same directions (chi-square) | those of a spot |

use std::{fs, path::Path, process::Command};

use caustica::{
    bvh::Bvh,
    gpu::Gpu,
    layout::{self, Counters, PhotonBatch},
    progress::Silent,
    renderer::render,
    scene::{Alpha, Light, LightKind},
    settings::{LightSettings, Mode, Sampler},
    upload::{SceneBuffers, sampler_constant},
};
use glam::{Vec3, vec3};
use support::*;

#[test]
fn two_renders_are_equal() {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.spheres.push(sphere(vec3(0.3, -0.3, 0.0), 0.5, 1));
    scene.lights.push(point_light(vec3(0.0, 0.9, 0.1), 1.0));
    scene.lights.push(point_light(vec3(-0.5, 0.5, 0.1), 0.3));
    scene.cameras.push(camera(vec3(0.0, 0.0, 0.99), Vec3::ZERO, 80.0));
    let picture = |seed| {
        let settings = settings(Mode::Hybrid, 20_000, 40).with(|s| {
            s.photons.seed = seed;
            s.picture.spp = 2;
        });
        render_scene(&scene, &settings).frame
    };
    assert_eq!(picture(7), picture(7));
    assert_ne!(picture(7), picture(8), "control: the seed changes nothing");
}

#[test]
fn tables_and_storage_buffers_give_the_same_bits() {
    let mut scene = scene(&[diffuse(0.6), glass(), diffuse(0.3)]);
    scene.materials[2].alpha = Alpha::Blend;
    scene.materials[2].opacity = 0.4;
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    add_box(&mut scene, vec3(-0.9, -0.5, -0.9), vec3(0.9, -0.4, -0.2), 2);
    scene.spheres.push(sphere(vec3(0.3, -0.3, 0.0), 0.5, 1));
    scene.lights.push(point_light(vec3(0.0, 0.9, 0.1), 1.0));
    scene.cameras.push(camera(vec3(0.0, 0.0, 0.99), Vec3::ZERO, 80.0));
    let picture = |gpu: &Gpu, seed| {
        let settings = settings(Mode::Hybrid, 20_000, 40).with(|s| {
            s.photons.seed = seed;
            s.photons.final_gather = 16;
        });
        render(gpu, &scene, &settings, &Silent).expect("the scene renders").frame
    };
    let in_buffers = Gpu::open(None).expect("tests need an adapter").with_storage_buffers();
    assert!(!in_buffers.keeps_tables());
    assert_eq!(picture(gpu(), 7), picture(&in_buffers, 7));
    assert_ne!(picture(gpu(), 7), picture(&in_buffers, 8), "control: the seed changes nothing");
}

#[test]
fn driver_threads_and_file_names_change_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = |threads: &str, name: &str, seed: &str| {
        let out = folder.path().join(name);
        let status = Command::new(env!("CARGO_BIN_EXE_caustica"))
            .args(["render", "scenes/mirror-and-glass.gltf", "-q", "--size", "48x48", "--photons", "10k"])
            .args(["--seed", seed, "-o"])
            .arg(&out)
            .env("LP_NUM_THREADS", threads)
            .status()
            .expect("the program starts");
        assert!(status.success());
        read(&out)
    };
    let one = run("1", "a.exr", "0");
    assert!(one == run("2", "b.exr", "0"), "one and two driver threads give different files");
    assert!(one != run("2", "c.exr", "1"), "control: the seed changes nothing");
}

fn read(path: &Path) -> Vec<u8> {
    fs::read(path).expect("the program wrote a file")
}

/// Directions of `count` paths from path `first` on, as drawn by the kernel.
fn emitted_directions(first: u64, count: u32, sampler: Sampler, strata: u32) -> Vec<Vec3> {
    emitted_directions_of(LightKind::Point, first, count, sampler, strata)
}

/// Variant of [`emitted_directions`] for another kind of light.
fn emitted_directions_of(kind: LightKind, first: u64, count: u32, sampler: Sampler, strata: u32) -> Vec<Vec3> {
    let gpu = gpu();
    let mut scene = scene(&[diffuse(0.5)]);
    scene.spheres.push(sphere(Vec3::ZERO, 1.0, 0));
    scene.lights.push(Light { kind, ..point_light(Vec3::ZERO, 1.0) });
    let bvh = Bvh::build(&scene);
    let buffers = SceneBuffers::new(gpu, &scene, &bvh, &LightSettings::default()).expect("the scene fits");
    let emit = buffers.kernel_with(gpu, "emit_photons", &[sampler_constant(sampler)]);
    let batch = PhotonBatch { seed: 3, paths: count, light_count: 1, strata, target_count: 1, ..Default::default() };
    let batch = batch.starting_at(first);
    let uniform = gpu.uniform("batch", &batch);
    let paths = gpu.storage::<layout::Path>("paths", u64::from(count)).expect("fits");
    let queue = gpu.storage::<u32>("queues", 2 * u64::from(count)).expect("fits");
    let counts = gpu.storage::<u32>("counts", u64::from(count * layout::MAP_KINDS)).expect("fits");
    let counters = gpu.storage::<Counters>("counters", 1).expect("fits");
    let bindings = emit.bind(
        gpu,
        &buffers.with(&[
            ("batch", &uniform),
            ("choices", &buffers.lights.photons.buffer),
            ("paths", &paths),
            ("queues", &queue),
            ("counts", &counts),
            ("counters", &counters),
        ]),
    );
    let mut encoder = gpu.encoder();
    emit.dispatch(&mut encoder, &bindings, u64::from(count));
    gpu.submit(encoder);
    let paths: Vec<layout::Path> = gpu.read(&paths, 0, u64::from(count)).expect("paths read back");
    paths.iter().map(|p| Vec3::from(p.direction)).collect()
}

/// Rejection sampling: uniform points in a cube that lie inside the unit sphere, projected onto it.
fn rejection_directions(count: usize) -> Vec<Vec3> {
    let mut state = 12345_u64;
    let mut uniform = || {
        // SplitMix64 (Steele et al. 2014): independent of the renderer's own generator.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 23) as f32 - 1.0
    };
    let mut found = Vec::new();
    while found.len() < count {
        let v = vec3(uniform(), uniform(), uniform());
        if v.length() <= 1.0 && v.length() > 1e-3 {
            found.push(v.normalize());
        }
    }
    found
}

/// Chi-square of two samples of the same size over 128 cells of equal area: 8 of height times 16 of
/// azimuth.
fn chi_square(a: &[Vec3], b: &[Vec3]) -> f64 {
    let cells = |sample: &[Vec3]| {
        let mut counts = vec![0.0_f64; 128];
        for v in sample {
            let row = (((v.z + 1.0) * 4.0) as usize).min(7);
            let column = ((v.y.atan2(v.x) / std::f32::consts::TAU + 0.5) * 16.0) as usize;
            counts[row * 16 + column.min(15)] += 1.0;
        }
        counts
    };
    cells(a).iter().zip(&cells(b)).map(|(x, y)| (x - y).powi(2) / (x + y).max(1.0)).sum()
}

#[test]
fn closed_form_and_rejection_draw_the_same_directions() {
    let (ours, theirs) = (emitted_directions(0, 100_000, Sampler::Random, 1), rejection_directions(100_000));
    // 127 degrees of freedom: the 99.9 % point of chi-square is 181.
    let value = chi_square(&ours, &theirs);
    assert!(value < 181.0, "chi-square {value}");
    assert!(value > 60.0, "chi-square {value} is too small for independent samples");
    let kind = LightKind::Spot { inner: 2.0, outer: 3.1 };
    let cone = emitted_directions_of(kind, 0, 100_000, Sampler::Random, 1);
    assert!(chi_square(&cone, &theirs) > 181.0, "control: a spot passes");
}

#[test]
fn random_numbers_go_on_after_four_billion_paths() {
    const HALF: u32 = 200;
    for (sampler, strata) in [(Sampler::Sobol, 1), (Sampler::Random, 1), (Sampler::Sobol, 3)] {
        let from = |first, count| emitted_directions(first, count, sampler, strata);
        // The path at which the low word of the round overflows.
        let border = u64::from(strata) << 32;
        let across = from(border - u64::from(HALF), 2 * HALF);
        let (before, after) = across.split_at(HALF as usize);
        assert_eq!(after, from(border, HALF), "{sampler:?}, {strata} strata: a batch that begins there");
        assert_eq!(before, from(border - u64::from(HALF), HALF), "{sampler:?}, {strata} strata: one that ends there");
        let begun = from(0, HALF);
        assert!(after.iter().chain(before).all(|v| !begun.contains(v)), "{sampler:?}, {strata} strata: numbers repeat");
        let cut_to_32_bits = (border / u64::from(strata)) as u32;
        assert_eq!(from(cut_to_32_bits.into(), HALF), begun, "control: {sampler:?}, {strata} strata");
    }
}
