//! Limits of memory and loops.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | windows | a device with tiny bindings gives the same picture: all that exceeds one is split | a larger binding is not split |
//! | refusal | what two bindings cannot hold is refused by the limit's name | it renders where they can |
//! | photons | maps that no buffers hold are refused before anything is done for them | maps that buffers hold |
//! | budget | a ray that outruns its loop budget is counted, not lost in silence | the full budget counts none |
//! | memory | the peak is at most 96 bytes a photon of capacity and 32 MiB | a tenth of that does not hold it |
//! | maps | a finished map keeps at most 48 bytes a photon | 32 bytes do not hold it |
//! | tiles | device memory does not grow with samples or size | it grows with photons |

use caustica::{
    Error,
    gpu::Gpu,
    progress::Silent,
    renderer::{Session, render},
    scene::Scene,
    settings::Mode,
};
use glam::{Vec3, vec3};
use support::*;

/// A closed room with a height field of 2 · side² triangles, a glass ball and a light.
fn room(side: i32) -> Scene {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    add_box(&mut scene, vec3(-1.0, -0.5, -1.0), vec3(1.0, 2.0, 1.0), 0);
    let at = |i: i32, j: i32| {
        let (x, z) = (2.0 * i as f32 / side as f32 - 1.0, 2.0 * j as f32 / side as f32 - 1.0);
        vec3(x, 0.1 * (5.0 * x).sin() * (4.0 * z).cos(), z)
    };
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        for [a, b, c] in [[at(i, j), at(i, j + 1), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i + 1, j)]] {
            let normals = [(b - a).cross(c - a).normalize(); 3];
            scene.triangles.push(caustica::scene::Triangle::new([a, b, c], normals, 0));
        }
    }
    scene.spheres.push(sphere(vec3(0.2, 0.6, 0.0), 0.35, 1));
    scene.lights.push(point_light(vec3(0.0, 1.8, 0.0), 3.0));
    scene.cameras.push(camera(vec3(0.0, 1.2, 0.95), vec3(0.0, 0.2, 0.0), 80.0));
    scene
}

/// A device with its maximum binding size set to `bytes`.
fn device_with_bindings(bytes: u64) -> Gpu {
    let mut gpu = Gpu::open(None).expect("tests need an adapter");
    gpu.limits.max_storage_buffer_binding_size = bytes;
    gpu
}

#[test]
fn what_exceeds_a_binding_is_split() {
    let scene = room(320);
    let primitives = scene.triangles.len() as u64 * 48;
    // Small batches, so that nothing else needs as much.
    let device = |bytes: Option<u64>| {
        let mut gpu = Gpu::open(None).expect("tests need an adapter");
        gpu.batch = 1 << 10;
        let binding = &mut gpu.limits.max_storage_buffer_binding_size;
        *binding = bytes.unwrap_or(*binding);
        gpu
    };
    let picture = |gpu: &Gpu, mode| {
        let settings = settings(mode, 300_000, 24);
        render(gpu, &scene, &settings, &Silent).map(|r| r.frame)
    };
    // About a half of the primitives exceed a binding, and the photons of a map; then, without
    // photons, most of the primitives, and a half of the nodes.
    let [more, less] = [primitives * 55 / 100, primitives * 10 / 100];
    for (mode, bytes) in [(Mode::Hybrid, more), (Mode::DirectRays, less)] {
        let whole = picture(&device(None), mode).expect("the scene renders");
        let split = picture(&device(Some(bytes)), mode).expect("what exceeds a binding is split");
        assert!(split == whole, "{bytes} bytes: the split scene gives another picture");
    }
    let mut gpu = device(Some(less));
    gpu.limits.max_texture_array_layers = 0;
    let refused = picture(&gpu, Mode::DirectRays).expect_err("control: no room for the rest");
    let Error::Limit { what, limit, .. } = &refused else { panic!("{refused}") };
    assert_eq!((what.as_str(), *limit), ("bvh nodes", "maxImageArrayLayers"), "{refused}");
}

#[test]
fn info_says_about_how_much_memory_geometry_takes() {
    for scene in [room(60), room(200)] {
        let bvh = caustica::bvh::Bvh::build(&scene);
        let right = (48 * bvh.nodes.len() + (48 + 16) * bvh.primitives.len()) as f64;
        let said = scene.describe().geometry_bytes as f64;
        assert!((said / right - 1.0).abs() < 0.1, "{said} for {right}");
    }
}

#[test]
fn maps_that_no_buffers_hold_are_refused_at_once() {
    let scene = room(4);
    // A binding holds the positions of 1024 photons; there are two bindings.
    let gpu = device_with_bindings(16 << 10);
    let refused = |global_photons, caustic_photons| {
        let settings = settings(Mode::Hybrid, 1, 8).with(|s| {
            s.photons.global = global_photons;
            s.photons.caustic = caustic_photons;
        });
        let before = gpu.dispatches();
        let error = render(&gpu, &scene, &settings, &Silent).map(|_| ()).expect_err("bindings are tiny");
        assert_eq!(gpu.dispatches(), before, "work was done for nothing");
        let Error::Limit { what, needed, allowed, .. } = error else { panic!("{error}") };
        (what, needed, allowed)
    };
    for (global, caustic, needed) in [(100_000_000, 1, 100_000_000), (1, 2049, 2049), (u32::MAX, 1, u32::MAX.into())] {
        assert_eq!(refused(global, caustic), ("a photon map".to_string(), needed, 2048));
    }
    let (what, ..) = refused(2048, 2048);
    assert_ne!(what, "a photon map", "control: these maps fit, only what comes after does not");
}

/// Number of rays in the room that exceed this loop budget.
fn unfinished(budget: f64) -> u32 {
    let ray = |i: u16| {
        let angle = f32::from(i) * 2.4;
        (Vec3::Y, vec3(angle.cos(), -0.5, angle.sin()))
    };
    rays::trace(&room(60), &[("TRACE_BUDGET", budget)], &(0..512).map(ray).collect::<Vec<_>>()).0.unfinished
}

#[test]
fn a_ray_out_of_its_loop_budget_is_counted() {
    assert!(unfinished(1.0) > 400, "rays that visit more than one node are not counted");
    assert_eq!(unfinished(8000.0), 0, "control: the full budget is not enough");
}

#[test]
fn memory_is_bounded_by_photons_alone() {
    const MIB: u64 = 1 << 20;
    let scene = room(8);
    // A separate device: the peak counts all its buffers.
    let gpu = Gpu::open(None).expect("tests need an adapter");
    let peak = |photons: u32, size: u32, spp: u32| {
        let settings = settings(Mode::IndirectPhotons, photons, size).with(|s| {
            s.photons.max_paths = Some(1_000_000);
            s.picture.spp = spp;
            s.estimate.neighbors = 10;
        });
        render(&gpu, &scene, &settings, &Silent).expect("the scene renders").stats.peak_device_bytes
    };
    let (few, many) = (peak(1000, 16, 1), peak(500_000, 16, 1));
    // Each of the two maps has its own capacity.
    let (per_photon, tile) = (96 * 2, 36 * MIB * gpu.batch.div_ceil(1 << 16));
    // What was read back has memory that is kept.
    let bound = |photons: u64| per_photon * photons + tile + 8 * MIB;
    assert!(few <= bound(1000), "{few} bytes for 1 k photons");
    assert!(many <= bound(500_000), "{many} bytes for 500 k photons");
    assert!(many > per_photon * 500_000 / 10, "control: {many} bytes are too few to be true");
    // Pictures that fill a tile.
    let side = |of_small_tiles: f64| (of_small_tiles * (gpu.batch as f64 / 65_536.0).sqrt()) as u32;
    // The first one leaves memory for what is read back to the others.
    let [_, full_tile] = [peak(1000, side(200.0), 1), peak(1000, side(200.0), 1)];
    let (large, deep) = (peak(1000, side(300.0), 1), peak(1000, side(64.0), 16));
    assert!(large <= full_tile && deep <= full_tile, "device memory grows: {large} by --size, {deep} by --spp");
    assert!(full_tile <= bound(1000), "{full_tile} bytes for 1 k photons");
}

#[test]
fn a_finished_map_keeps_48_bytes_a_photon() {
    let (scene, gpu) = (room(8), Gpu::open(None).expect("tests need an adapter"));
    for photons in [20_000, 500_000] {
        let settings = settings(Mode::Photons, photons, 16);
        let session = Session::open(&gpu, &scene, &settings.lights, &Silent).expect("the scene fits");
        let before = gpu.memory.now();
        let maps = session.photon_maps(&settings.photons, &Silent).expect("photons");
        let (kept, stored) = (gpu.memory.now() - before, maps.maps().iter().map(|m| u64::from(m.count())).sum::<u64>());
        assert!(stored >= u64::from(photons) * 9 / 10, "{stored} photons stored");
        assert!(kept <= 48 * stored + 1024, "{kept} bytes for {stored} photons");
        assert!(kept > 32 * stored, "control: {kept} bytes are too few to be true");
    }
}
