//! Camera samples: distribution, lens, and shared estimates.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | sampler | every prefix of a Sobol set is uniform and stratified: each 2^n-th of an axis has its fraction | independent numbers are uniform and not stratified |
//! | pairs | two dimensions of a Sobol set are stratified together, in rectangles of every shape | independent numbers are not |
//! | matrices | columns of the third and fourth dimension are those of the recurrences | the next column is not |
//! | gain | integrals by Sobol sets err far less than by independent numbers | two sets of independent numbers err alike |
//! | filters | offsets have the filter's moments and distribution, the mean of a picture stays | another filter's distribution |
//! | lens | circles of confusion have the closed form's size | the plane in focus has none |
//! | parallel | an orthographic camera shows true sizes at every distance | a perspective one does not |
//! | crop | a crop has the bits of the whole picture | a crop shifted by one pixel has not |
//! | sharing | shared estimates have the error of estimates for every sample | other photons change more; half the photons err more |
//! | borders | shared estimates are continuous across the borders of tiles | a right half with other photons is not |

use std::path::Path;

use caustica::{
    Error,
    bvh::Bvh,
    image::{DataWindow, difference::rel_mse, read_exr},
    layout::VisiblePoint,
    passes::CameraTracer,
    pixel_filter::PixelFilter,
    progress::Silent,
    renderer::{Session, render},
    scene::{Camera, Projection, Scene},
    settings::{Crop, Mode, PictureSettings, Sampler, Settings},
    upload::SceneBuffers,
};
use glam::{DVec2, Vec3, vec3};
use support::*;

/// A white square of 3 m at z = `z`, facing the camera; no larger, so that rounding of its points
/// stays far below a pixel.
fn plane(z: f32) -> Scene {
    let mut scene = scene(&[diffuse(0.5)]);
    add_quad(&mut scene, vec3(-1.5, -1.5, z), Vec3::X * 3.0, Vec3::Y * 3.0, 0);
    scene.lights.push(point_light(vec3(0.0, 0.0, 5.0), 1.0));
    scene
}

/// Orthographic camera at the origin along -z that sees `ymag` metres up and down.
fn parallel_camera(ymag: f32) -> Camera {
    Camera { projection: Projection::Orthographic { ymag }, ..camera(Vec3::ZERO, Vec3::NEG_Z, 40.0) }
}

/// Pixel and visible point of each sample of a picture of `size`.
fn visible(scene: &Scene, camera: &Camera, size: u32, settings: &Settings) -> Vec<((u32, u32), Vec3)> {
    let buffers = SceneBuffers::new(gpu(), scene, &Bvh::build(scene), &settings.lights).expect("the scene fits");
    let tracer = CameraTracer::new(
        gpu(),
        &buffers,
        (camera, [0; 4]),
        (size, size),
        &settings.photons,
        &settings.picture,
        settings.estimate.share_reach > 0.0,
    )
    .expect("the camera is right");
    let mut found = Vec::new();
    for tile in tracer.tiles() {
        tracer.trace(gpu(), &buffers, &tile).expect("the tile is traced");
        let count = tracer.point_count(&tile);
        let points: Vec<VisiblePoint> = gpu().read(&tracer.points, 0, count.into()).expect("points read back");
        for (i, point) in (0..).zip(&points) {
            if let Some(pixel) = tracer.pixel(&tile, i * tile.pixels / count).filter(|_| point.next_map != 0) {
                found.push((pixel, point.position.into()));
            }
        }
    }
    found
}

/// Offsets of the samples of one pixel from its centre, in pixels, in the order of the set.
fn offsets(settings: &Settings) -> Vec<DVec2> {
    let seen = visible(&plane(-1.0), &parallel_camera(0.5), 1, settings);
    seen.into_iter().map(|(_, p)| p.as_dvec3().truncate()).collect()
}

fn set(sampler: Sampler, spp: u32, seed: u32) -> Vec<DVec2> {
    offsets(&Settings::default().with(|s| {
        s.photons.sampler = sampler;
        s.picture.spp = spp;
        s.photons.seed = seed;
    }))
}

/// Numbers of points in `parts` equal parts of each axis.
fn shares(points: &[DVec2], parts: usize) -> [Vec<usize>; 2] {
    [0, 1].map(|axis| {
        let mut counts = vec![0; parts];
        points.iter().for_each(|p| counts[(((p[axis] + 0.5) * parts as f64) as usize).min(parts - 1)] += 1);
        counts
    })
}

#[test]
fn every_prefix_is_fair_and_spread() {
    let (sobol, random) = (set(Sampler::Sobol, 1000, 5), set(Sampler::Random, 1000, 5));
    let spread = |points: &[DVec2]| {
        [4_usize, 16, 64, 256].iter().all(|&n| {
            let halves_and_so_on = (0..=n.ilog2()).map(|level| 1 << level);
            halves_and_so_on
                .into_iter()
                .all(|parts| shares(&points[..n], parts).iter().flatten().all(|&c| c == n / parts))
        })
    };
    assert!(spread(&sobol), "a part of an axis has more than its share");
    assert!(!spread(&random), "control: independent numbers are spread");
    for points in [&sobol, &random] {
        for n in [10, 100, 333, 1000] {
            for counts in shares(&points[..n], 8) {
                let expected = n as f64 / 8.0;
                let chi = counts.iter().map(|&c| (c as f64 - expected).powi(2) / expected).sum::<f64>();
                // 7 degrees of freedom: the 99.99 % point is 29.9.
                assert!(chi < 29.9, "{n} intervals: chi-square {chi}");
            }
        }
    }
    // Another seed gives another set: the scrambling is not a fixed table.
    assert_ne!(sobol, set(Sampler::Sobol, 1000, 6));
}

/// The first 256 points of the first two dimensions have one point in each of 256 equal rectangles
/// of any shape.
#[test]
fn two_dimensions_are_spread_together() {
    let spread = |points: &[DVec2]| {
        (0..=8).all(|level| {
            let (columns, rows) = (1 << level, 256 >> level);
            let mut seen = vec![0; 256];
            for p in points {
                let interval = |x: f64, parts: usize| (((x + 0.5) * parts as f64) as usize).min(parts - 1);
                seen[interval(p.x, columns) * rows + interval(p.y, rows)] += 1;
            }
            seen.iter().all(|n| *n == 1)
        })
    };
    for seed in 0..4 {
        assert!(spread(&set(Sampler::Sobol, 256, seed)), "seed {seed}");
        assert!(!spread(&set(Sampler::Random, 256, seed)), "control: independent numbers are spread");
    }
}

/// Columns of the matrices of x² + x + 1 and x³ + x + 1, 32 bits each, by the recurrences of Joe
/// and Kuo 2008 from their initial numbers.
fn sobol_columns() -> Vec<[u32; 2]> {
    let mut columns = vec![[0x8000_0000, 0x8000_0000], [0xc000_0000, 0xc000_0000], [0x6000_0000, 0x2000_0000]];
    for i in 3..32 {
        let ([_, a], [b, c], [d, _]) = (columns[i - 3], columns[i - 2], columns[i - 1]);
        columns.push([d ^ b ^ (b >> 2), c ^ a ^ (a >> 3)]);
    }
    columns
}

#[test]
fn matrices_follow_from_their_polynomials() {
    let text = include_str!("../../shaders/lib/core/sampler.wesl");
    let is_there = |i: usize, [z, w]: [u32; 2]| {
        let (z, w) = (z.reverse_bits(), w.reverse_bits());
        text.contains(&format!("column(index, {:#x}u, vec2u({z:#x}u, {w:#x}u))", 1_u32 << i))
    };
    let columns = sobol_columns();
    columns.iter().enumerate().for_each(|(i, column)| assert!(is_there(i, *column), "column {i}"));
    assert_eq!(text.matches(" column(index, ").count(), columns.len(), "further columns");
    assert!(!is_there(7, columns[8]), "control: any column passes");
}

#[test]
fn sobol_sets_integrate_better() {
    // Mean squared error of the area of a disc and of the integral of a smooth function, over 16
    // seeds and with a number of points that is not a power of two.
    let error = |sampler: Sampler, first_seed: u32| {
        let one = |seed| {
            let points = set(sampler, 200, seed);
            let mean = |f: &dyn Fn(DVec2) -> f64| points.iter().map(|&p| f(p)).sum::<f64>() / 200.0;
            let disc = mean(&|p| f64::from(u8::from(p.length() < 0.4))) - std::f64::consts::PI * 0.16;
            let smooth = mean(&|p| (p.x + 0.5) * (p.y + 0.5)) - 0.25;
            disc * disc + smooth * smooth
        };
        (first_seed..first_seed + 16).map(one).sum::<f64>() / 16.0
    };
    let (sobol, random) = (error(Sampler::Sobol, 0), error(Sampler::Random, 0));
    assert!(sobol < 0.2 * random, "{sobol} against {random}");
    assert!(error(Sampler::Random, 100) > 0.2 * random, "control: independent numbers err less too");
}

#[test]
fn samples_follow_the_pixel_filter() {
    let all = [PixelFilter::Box, PixelFilter::Gaussian, PixelFilter::BlackmanHarris];
    let drawn = all.map(|pixel_filter| {
        offsets(&Settings::default().with(|s| {
            s.picture.pixel_filter = pixel_filter;
            s.photons.sampler = Sampler::Random;
            s.picture.spp = 4096;
        }))
    });
    // Chi-square over 12 intervals of one axis, for the offsets inside the filter.
    let chi_square = |points: &[DVec2], filter: PixelFilter, axis: usize| {
        let (radius, steps) = (filter.radius(), 1200);
        let at = |i: usize| -radius + (i as f64 + 0.5) * 2.0 * radius / f64::from(steps);
        let weights: Vec<f64> = (0..steps as usize).map(|i| filter.weight(at(i))).collect();
        let whole: f64 = weights.iter().sum();
        let part = |p: &DVec2| (((p[axis] + radius) / (2.0 * radius) * 12.0).clamp(0.0, 11.0)) as usize;
        let mut counts = [0.0; 12];
        points.iter().for_each(|p| counts[part(p)] += 1.0);
        let expected = weights.chunks(100).map(|c| c.iter().sum::<f64>() / whole * points.len() as f64);
        counts.iter().zip(expected).map(|(c, e)| (c - e) * (c - e) / e.max(1.0)).sum::<f64>()
    };
    for (i, &filter) in all.iter().enumerate() {
        assert!(drawn[i].iter().all(|p| p.abs().max_element() <= filter.radius() + 1e-5), "{filter:?} reaches too far");
        for axis in 0..2 {
            // 11 degrees of freedom: the 99.99 % point is 37.4.
            let chi = chi_square(&drawn[i], filter, axis);
            assert!(chi < 37.4, "{filter:?}: chi-square {chi}");
            let other = chi_square(&drawn[i], all[(i + 1) % 3], axis);
            assert!(other > 37.4, "control: {filter:?} passes for another filter, chi-square {other}");
        }
    }
    // A single sample lies at the pixel's centre with the box filter, and not with others.
    assert_eq!(offsets(&Settings::default().with(|s| s.picture.spp = 1)), [DVec2::ZERO]);
    let one = Settings::default().with(|s| {
        s.picture.spp = 1;
        s.picture.pixel_filter = PixelFilter::Gaussian;
    });
    assert_ne!(offsets(&one), [DVec2::ZERO]);
}

#[test]
fn wider_filters_soften_edges_and_keep_the_mean() {
    // The left half of the picture is covered.
    let mut half = scene(&[diffuse(0.5)]);
    add_quad(&mut half, vec3(-50.0, -50.0, -1.0), Vec3::X * 50.0, Vec3::Y * 100.0, 0);
    half.lights.push(point_light(Vec3::ZERO, 1.0));
    half.cameras.push(parallel_camera(1.0));
    let alpha = |pixel_filter| {
        let settings = settings(Mode::DirectRays, 1, 16).with(|s| {
            s.picture.pixel_filter = pixel_filter;
            s.picture.spp = 256;
        });
        let frame = render_scene(&half, &settings).frame;
        let mean = frame.alpha().iter().sum::<f32>() / 256.0;
        (frame.alpha()[16 * 8 + 7], mean)
    };
    let (sharp, soft) = (alpha(PixelFilter::Box), alpha(PixelFilter::Gaussian));
    assert!(sharp.0 == 1.0 && (soft.0 - 0.841).abs() < 0.02, "{sharp:?} {soft:?}");
    assert!((sharp.1 - 0.5).abs() < 1e-3 && (soft.1 - 0.5).abs() < 1e-3, "{sharp:?} {soft:?}");
}

#[test]
fn circles_of_confusion_have_the_closed_form_s_size() {
    let eye = camera(Vec3::ZERO, Vec3::NEG_Z, 1.0);
    let (aperture, focus) = (0.2, 2.0);
    let lens = Settings::default().with(|s| {
        s.picture.aperture = aperture;
        s.picture.focus = Some(focus);
        s.picture.spp = 1024;
    });
    // Points of the plane that the one pixel of a narrow picture sees, relative to their centre: a
    // disc, blurred by the pixel.
    let spread = |distance: f32| {
        let points = visible(&plane(-distance), &eye, 1, &lens);
        let squares = points.iter().map(|(_, p)| p.truncate().length_squared());
        let pixel = 2.0 * distance * (0.5_f32.to_radians()).tan();
        let variance = squares.clone().sum::<f32>() / points.len() as f32 - pixel * pixel / 6.0;
        (variance, squares.fold(0.0, f32::max).sqrt() - 0.708 * pixel)
    };
    for distance in [1.0_f32, 4.0] {
        let radius = 0.5 * aperture * (1.0 - distance / focus).abs();
        let (variance, farthest) = spread(distance);
        assert!((variance / (0.5 * radius * radius) - 1.0).abs() < 0.05, "{distance} m: variance {variance}");
        assert!(farthest < radius * 1.001, "{distance} m: {farthest} from the centre, radius {radius}");
    }
    let (sharp, _) = spread(focus);
    assert!(sharp < 1e-5, "control: the sharp plane is blurred by {sharp}");
    let orthographic = Scene { cameras: vec![parallel_camera(1.0)], ..plane(-1.0) };
    let refused = render(gpu(), &orthographic, &lens.with(|s| s.picture.size = Some((8, 8))), &Silent);
    assert!(matches!(refused, Err(Error::Setting { name: "picture.aperture", .. })), "{refused:?}");
}

#[test]
fn parallel_rays_show_true_sizes() {
    // A square of 1 m in a picture of 4 m and 64 pixels.
    let pixels = |camera: &Camera, distance: f32| {
        let mut square = scene(&[diffuse(0.5)]);
        add_quad(&mut square, vec3(-0.25, -0.5, -distance), Vec3::X, Vec3::Y, 0);
        let seen = visible(&square, camera, 64, &Settings::default().with(|s| s.picture.spp = 1));
        for ((x, y), p) in &seen {
            let center = |i: u32| (i as f32 + 0.5) / 16.0 - 2.0;
            let off = (p.x - center(*x)).abs().max((p.y + center(*y)).abs());
            assert!(off < 1e-5 || camera.projection != parallel_camera(2.0).projection, "{off} beside the pixel");
        }
        seen.len()
    };
    let parallel = parallel_camera(2.0);
    assert_eq!((pixels(&parallel, 1.0), pixels(&parallel, 7.0)), (256, 256));
    let perspective = camera(Vec3::ZERO, Vec3::NEG_Z, 60.0);
    assert!(pixels(&perspective, 2.0) > 3 * pixels(&perspective, 7.0), "control: distance does not matter");
}

/// A room with glass, so that both maps hold photons.
fn room() -> Scene {
    let mut scene = scene(&[diffuse(0.6), glass()]);
    add_box(&mut scene, Vec3::splat(-1.0), Vec3::splat(1.0), 0);
    scene.spheres.push(sphere(vec3(0.3, -0.3, 0.0), 0.5, 1));
    scene.lights.push(point_light(vec3(0.0, 0.9, 0.1), 1.0));
    scene.cameras.push(camera(vec3(0.0, 0.0, 0.99), Vec3::ZERO, 80.0));
    scene
}

#[test]
fn a_crop_has_the_bits_of_the_whole() {
    let scene = room();
    // Two tiles and more: 20 samples with 4 branches leave 512 pixels to a tile.
    let base = settings(Mode::Hybrid, 3000, 40).with(|s| s.picture.spp = 20);
    // Irradiance in cells does not depend on what is cropped either.
    let gathering = base.clone().with(|s| s.photons.final_gather = 1);
    let part = Crop { column: 5, row: 19, width: 11, height: 9 };
    for settings in [&gathering, &base] {
        let session = Session::open(gpu(), &scene, &settings.lights, &Silent).expect("the scene fits");
        let maps = session.photon_maps(&settings.photons, &Silent).expect("photons");
        let picture = |crop| {
            let picture = PictureSettings { crop, ..settings.picture.clone() };
            session.picture(&maps, &settings.estimate, &picture, &Silent).map(|r| r.frame)
        };
        let whole = picture(None).expect("a picture");
        let cropped = picture(Some(part)).expect("a part");
        assert_eq!((cropped.width, cropped.height), (11, 9));
        assert_eq!(cropped.window, Some(DataWindow { whole: (40, 40), column: 5, row: 19 }));
        let same = |column: u32| {
            (0..99).all(|i: u32| {
                let there = ((19 + i / 11) * 40 + column + i % 11) as usize;
                let i = i as usize;
                cropped.radiance()[i] == whole.radiance()[there] && cropped.depth()[i] == whole.depth()[there]
            })
        };
        assert!(same(5), "the part differs from the whole");
        assert!(!same(6), "control: it agrees one pixel farther too");
        for (column, row, width, height) in [(30, 0, 11, 1), (0, 40, 1, 1), (0, 0, 1, 0), (u32::MAX, 0, 2, 1)] {
            let refused = picture(Some(Crop { column, row, width, height }));
            let name = format!("{column},{row},{width},{height}");
            assert!(matches!(refused, Err(Error::Setting { name: "picture.crop", .. })), "{name}");
        }
    }
}

#[test]
fn shared_estimates_err_like_those_of_every_sample() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references");
    let scene = Scene::load(&folder.join("S2.glb")).expect("the scene loads");
    let reference = read_exr(&folder.join("S2_128.exr")).expect("the reference reads").radiance().to_vec();
    let base = settings(Mode::Hybrid, 60_000, 128).with(|s| {
        s.estimate.raw = true;
        s.picture.spp = 2;
    });
    let session = Session::open(gpu(), &scene, &base.lights, &Silent).expect("the scene fits");
    let picture = |settings: &Settings, share_reach: f32| {
        let maps = session.photon_maps(&settings.photons, &Silent).expect("photons");
        let settings = settings.clone().with(|s| s.estimate.share_reach = share_reach);
        session
            .picture(&maps, &settings.estimate, &settings.picture, &Silent)
            .expect("a picture")
            .frame
            .radiance()
            .to_vec()
    };
    let (shared, own) = (picture(&base, base.estimate.share_reach), picture(&base, 0.0));
    let error = |picture: &[[f32; 3]]| rel_mse(picture, &reference, None);
    assert!(error(&shared) < 1.03 * error(&own), "{} against {}", error(&shared), error(&own));
    let sum = |picture: &[[f32; 3]]| picture.iter().flatten().map(|&x| f64::from(x)).sum::<f64>();
    assert!((sum(&shared) / sum(&own) - 1.0).abs() < 0.004, "mean {}", sum(&shared) / sum(&own));
    // The change by sharing is not zero, and less than the change by other photons.
    let change = rel_mse(&shared, &own, None);
    let other = rel_mse(&picture(&base.clone().with(|s| s.photons.seed = 1), 0.0), &own, None);
    assert!(change > 0.0 && change < 0.5 * other, "{change} against {other}");
    let few = base.clone().with(|s| s.photons.global = 30_000);
    let few = picture(&few, few.estimate.share_reach);
    assert!(error(&few) > 1.03 * error(&own), "control: half the photons err as little");
}

/// Largest change between adjacent columns at the borders of tiles, every `side` pixels, divided by
/// the median over all columns. A change is a root mean square over the rows of the back wall.
fn step_at_borders(radiance: &[[f32; 3]], width: usize, side: usize) -> f64 {
    let (rows, columns) = (width / 5..2 * width / 5, width / 5..4 * width / 5);
    let light = |x: usize, y: usize| f64::from(Vec3::from(radiance[y * width + x]).element_sum()).ln();
    let step = |x: usize| rows.clone().map(|y| (light(x, y) - light(x - 1, y)).powi(2)).sum::<f64>().sqrt();
    let mut all: Vec<f64> = columns.clone().map(step).collect();
    all.sort_by(f64::total_cmp);
    let at_borders = columns.filter(|x| x % side == 0).map(step).fold(0.0, f64::max);
    at_borders / all[all.len() / 2]
}

#[test]
fn shared_estimates_go_on_across_the_borders_of_tiles() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/diffuse.gltf");
    let scene = Scene::load(&file).unwrap_or_else(|error| panic!("{error}"));
    let asked = settings(Mode::IndirectPhotons, 20_000, 256).with(|s| s.picture.spp = 4);
    let mut radiance = render_scene(&scene, &asked).frame.radiance().to_vec();
    let step = step_at_borders(&radiance, 256, 128);
    assert!(step < 2.0, "light changes {step} times as much where tiles meet as elsewhere");
    // Control: tiles that cannot share, because their photons differ.
    let other = render_scene(&scene, &asked.clone().with(|s| s.photons.seed = 1)).frame.radiance().to_vec();
    for (row, other) in radiance.chunks_mut(256).zip(other.chunks(256)) {
        row[128..].copy_from_slice(&other[128..]);
    }
    let step = step_at_borders(&radiance, 256, 128);
    assert!(step > 2.0, "control: a right half of other photons changes as little: {step}");
}
