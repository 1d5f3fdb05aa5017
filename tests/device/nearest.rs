//! The k nearest photons of the grid are those of brute force, at every size, density and k.

use std::sync::LazyLock;

use caustica::{
    density::{Density, DensityKernel},
    gpu::{Buffer, Gpu},
    layout::{Gathered, Photon, PhotonFlux, PhotonPosition, VisiblePoint, from_octahedral},
    passes::{
        estimate::gather::{Gather, GatherOptions, GatherSettings, GatherStats, gathered_buffer},
        maps::radix_sort::RadixSort,
        maps::{MapKernels, PhotonMap, PhotonStore},
    },
    progress::Silent,
    reference::{Found, brute_force, estimate, usable},
};
use glam::Vec3;
use support::photons::{Random, caustic_box, coincident, point, uniform_box};

/// A device with all kernels compiled.
struct Bench {
    gpu: &'static Gpu,
    kernels: MapKernels,
    one_sided: Gather<'static>,
    two_sided: Gather<'static>,
}

/// Results of a gather.
#[derive(Clone, Debug, PartialEq)]
struct Answer {
    gathered: Vec<Gathered>,
    radiance: Vec<[f32; 4]>,
    stats: GatherStats,
}

const EMITTED: u64 = 1000;
const CONE: Density = Density { kernel: DensityKernel::Cone, cone_constant: 2.0 };

impl Bench {
    fn open() -> Self {
        Self::on(support::gpu())
    }

    /// One for each way in which lanes share the work and maps are kept.
    fn each() -> impl Iterator<Item = Self> {
        static SPREAD: LazyLock<Gpu> = LazyLock::new(|| {
            Gpu::open(None).expect("tests need an adapter").with_spread_packets().with_storage_buffers()
        });
        let both = [support::gpu(), &SPREAD];
        let differ = both[0].spreads_packets() != both[1].spreads_packets();
        both.into_iter().take(if differ { 2 } else { 1 }).map(Self::on)
    }

    fn on(gpu: &'static Gpu) -> Self {
        let kernels = MapKernels::new(gpu);
        let one_sided = Gather::new(gpu, GatherOptions::default());
        let two_sided = Gather::new(gpu, GatherOptions { side_test: false, ..GatherOptions::default() });
        Self { gpu, kernels, one_sided, two_sided }
    }

    fn map(&self, photons: &[Photon]) -> PhotonMap {
        let store = PhotonStore::with(self.gpu, photons).unwrap();
        PhotonMap::build(self.gpu, &self.kernels, store, photons.len() as u32, EMITTED).unwrap()
    }

    fn ask(&mut self, side_test: bool, map: &PhotonMap, points: &[VisiblePoint], settings: &GatherSettings) -> Answer {
        let gather = if side_test { &mut self.one_sided } else { &mut self.two_sided };
        run(self.gpu, gather, map, points, settings)
    }
}

fn run(gpu: &Gpu, gather: &mut Gather, map: &PhotonMap, points: &[VisiblePoint], settings: &GatherSettings) -> Answer {
    let count = points.len() as u32;
    let asked = gpu.storage_with("points", points).unwrap();
    let gathered = gathered_buffer(gpu, count).unwrap();
    let radiance: Buffer = gpu.storage::<[f32; 4]>("radiance", count.into()).unwrap();
    let stats = gather.run(gpu, map, &asked, count, settings, (&radiance, &gathered), &Silent).unwrap();
    Answer {
        gathered: gpu.read(&gathered, 0, count.into()).unwrap(),
        radiance: gpu.read(&radiance, 0, count.into()).unwrap(),
        stats,
    }
}

fn settings(k: u32) -> GatherSettings {
    GatherSettings { neighbors: k, radius: None, max_radius: None, density: CONE, softness: 0 }
}

/// Number of valid points whose answer differs from brute force over `photons`: in the count, in
/// the radius (beyond rounding) or in the estimate, which a single wrong photon changes. Points
/// whose answer rounding decides are left out: devices round sums of products in different ways.
fn differences(
    answer: &Answer,
    (photons, fluxes): (&[PhotonPosition], &[PhotonFlux]),
    points: &[VisiblePoint],
    settings: &GatherSettings,
    side_test: bool,
) -> usize {
    let positions: Vec<Vec3> = photons.iter().map(|p| p.position.into()).collect();
    let wrong = |(i, point): (usize, &VisiblePoint)| {
        let accepted = |p: usize| !side_test || usable(&photons[p], point);
        let k = settings.radius.map_or(settings.neighbors, |_| u32::MAX);
        let bound = settings.radius.or(settings.max_radius);
        let found = brute_force(&positions, point.position.into(), k, bound, accepted);
        let flat = VisiblePoint { ns: point.ng, ..*point };
        let expected = if side_test { *point } else { flat };
        let radiance = estimate((photons, fluxes), &found, &expected, settings.density, EMITTED, side_test);
        !agrees(&answer.gathered[i], &answer.radiance[i], &found, radiance) && !is_close_call(photons, point, &found)
    };
    points.iter().enumerate().filter(|(_, p)| p.next_map != 0).filter(|p| wrong(*p)).count()
}

/// Whether a photon about as far away as the last one of an estimate, or nearer, lies in the plane
/// of the point, or two lie at different distances that are about that of the last one.
fn is_close_call(photons: &[PhotonPosition], point: &VisiblePoint, found: &Found) -> bool {
    let position = Vec3::from(point.position);
    let (last, slack) = (f64::from(found.radius_squared), 2e-6 * f64::from(found.radius_squared));
    let squared = |p: &PhotonPosition| f64::from(Vec3::from(p.position).distance_squared(position));
    let along = |p: &PhotonPosition| from_octahedral(p.wi).dot(point.ng.into()).abs();
    let in_plane = photons.iter().any(|p| squared(p) <= last + slack && along(p) < 2e-6);
    let at_the_end: Vec<f64> = photons.iter().map(squared).filter(|d| (d - last).abs() <= slack).collect();
    in_plane || at_the_end.iter().any(|d| *d != at_the_end[0])
}

fn agrees(gathered: &Gathered, radiance: &[f32; 4], found: &Found, expected: [f64; 3]) -> bool {
    let close = |a: f64, b: f64, tolerance: f64| (a - b).abs() <= tolerance * a.abs().max(b.abs());
    gathered.count as usize == found.photons.len()
        && close(gathered.radius_squared.into(), found.radius_squared.into(), 1e-6)
        && (0..3).all(|c| close(radiance[c].into(), expected[c], 2e-4))
}

/// Gathers `k` neighbours and compares with brute force. The control compares with brute force over
/// a map that lacks the photon nearest to the last valid point.
fn check(bench: &mut Bench, photons: &[Photon], points: &[VisiblePoint], settings: &GatherSettings, side_test: bool) {
    let map = bench.map(photons);
    let answer = bench.ask(side_test, &map, points, settings);
    let (photons, fluxes) = map.read(bench.gpu).unwrap();
    let wrong = differences(&answer, (&photons, &fluxes), points, settings, side_test);
    assert_eq!(wrong, 0, "{} photons, {settings:?}, side test {side_test}", photons.len());
    if photons.len() > 1 && settings.radius.or(settings.max_radius).is_none() {
        let last = points.iter().rfind(|p| p.next_map != 0).unwrap();
        let distance = |p: &PhotonPosition| Vec3::from(p.position).distance(last.position.into());
        let lost = (0..photons.len())
            .filter(|&i| !side_test || usable(&photons[i], last))
            .min_by(|&a, &b| distance(&photons[a]).total_cmp(&distance(&photons[b])));
        let Some(lost) = lost else { return };
        let (mut fewer_photons, mut fewer_fluxes) = (photons, fluxes);
        fewer_photons.remove(lost);
        fewer_fluxes.remove(lost);
        assert!(differences(&answer, (&fewer_photons, &fewer_fluxes), points, settings, side_test) > 0);
    }
}

#[test]
fn nearest_photons_equal_brute_force_at_awkward_sizes() {
    for mut bench in Bench::each() {
        let mut random = Random(1);
        for size in [1, 2, 10, 31, 32, 33, 63, 64, 65, 257, 1000, 5000] {
            let photons = uniform_box(&mut random, size);
            let points: Vec<_> = (0..150).map(|i| point(&mut random, i % 3 == 0)).collect();
            for k in [1, 10, 50, 1000] {
                check(&mut bench, &photons, &points, &settings(k), true);
                check(&mut bench, &photons, &points, &settings(k), false);
            }
        }
    }
}

#[test]
fn few_photons_in_a_wide_scene_give_numbers() {
    let mut bench = Bench::open();
    let mut random = Random(11);
    let wide = |p: &mut [f32; 3]| *p = p.map(|x| x * 100.0);
    let mut photons = uniform_box(&mut random, 70);
    photons.iter_mut().for_each(|p| wide(&mut p.position));
    let mut points: Vec<_> = (0..60).map(|_| point(&mut random, false)).collect();
    points.iter_mut().for_each(|p| wide(&mut p.position));
    for k in [3, 100] {
        check(&mut bench, &photons, &points, &settings(k), true);
    }
}

#[test]
fn an_empty_map_gives_nothing() {
    let mut bench = Bench::open();
    let map = bench.map(&[]);
    let points = vec![point(&mut Random(1), false); 10];
    let answer = bench.ask(true, &map, &points, &settings(10));
    assert!(answer.radiance.iter().all(|r| *r == [0.0; 4]));
    assert!(answer.gathered.iter().all(|g| g.count == 0));
    // Control: the same query of a map that is not empty.
    let map = bench.map(&uniform_box(&mut Random(1), 100));
    assert!(bench.ask(true, &map, &points, &settings(10)).radiance.iter().any(|r| *r != [0.0; 4]));
}

#[test]
fn nearest_photons_are_exact_in_dense_caustics_and_far_outside() {
    for mut bench in Bench::each() {
        let mut random = Random(2);
        // 20,000 photons within a thousandth of the box, 5000 on its walls.
        let photons = caustic_box(&mut random, 25_000, 0.8, 1e-3);
        let mut points: Vec<_> = (0..60).map(|i| point(&mut random, i % 2 == 0)).collect();
        for (i, p) in points.iter_mut().enumerate() {
            match i % 4 {
                0 => p.position = photons[i * 100].position,
                1 => p.position = p.position.map(|x| x * 1e4),
                _ => {}
            }
        }
        for k in [1, 50, 1000] {
            check(&mut bench, &photons, &points, &settings(k), true);
            check(&mut bench, &photons, &points, &settings(k), false);
        }
    }
}

#[test]
fn photons_on_one_spot_neither_hang_nor_give_nonsense() {
    for mut bench in Bench::each() {
        let mut random = Random(3);
        let photons = coincident(&mut random, 20_000, 3000);
        let spot = Vec3::from(photons.last().unwrap().position);
        let mut points: Vec<_> = (0..40).map(|_| point(&mut random, false)).collect();
        points[0].position = spot.into();
        points[1].position = (spot + Vec3::X * 1e-6).into();
        for k in [1, 100, 1000] {
            check(&mut bench, &photons, &points, &settings(k), true);
            check(&mut bench, &photons, &points, &settings(k), false);
            let map = bench.map(&photons);
            let answer = bench.ask(false, &map, &points, &settings(k));
            assert!(answer.radiance.iter().flatten().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn a_maximal_radius_bounds_the_search() {
    let mut bench = Bench::open();
    let mut random = Random(4);
    let photons = uniform_box(&mut random, 5000);
    let points: Vec<_> = (0..100).map(|_| point(&mut random, false)).collect();
    for max_radius in [0.01, 0.1, 0.3, 10.0] {
        let bounded = GatherSettings { max_radius: Some(max_radius), ..settings(50) };
        check(&mut bench, &photons, &points, &bounded, true);
    }
    // Control: the bound matters.
    let map = bench.map(&photons);
    let bounded = GatherSettings { max_radius: Some(0.1), ..settings(50) };
    assert_ne!(
        bench.ask(true, &map, &points, &bounded).gathered,
        bench.ask(true, &map, &points, &settings(50)).gathered
    );
}

#[test]
fn every_kernel_sums_what_its_formula_says() {
    for mut bench in Bench::each() {
        let mut random = Random(11);
        let photons = caustic_box(&mut random, 5000, 0.5, 1e-2);
        let points: Vec<_> = (0..100).map(|i| point(&mut random, i % 9 == 0)).collect();
        for kernel in DensityKernel::ALL {
            for k in [30, 1000] {
                check(
                    &mut bench,
                    &photons,
                    &points,
                    &GatherSettings { density: Density { kernel, ..CONE }, ..settings(k) },
                    true,
                );
            }
            let density = Density { kernel, cone_constant: 1.2 };
            let bounded = GatherSettings { max_radius: Some(0.2), density, ..settings(100) };
            check(&mut bench, &photons, &points, &bounded, true);
            // Control: another kernel gives another result.
            let other = Density { kernel: DensityKernel::ALL[(kernel as usize + 1) % 5], ..density };
            let map = bench.map(&photons);
            let answer = bench.ask(true, &map, &points, &bounded);
            let (photons, fluxes) = map.read(bench.gpu).unwrap();
            let asked = GatherSettings { density: other, ..bounded };
            assert!(
                differences(&answer, (&photons, &fluxes), &points, &asked, true) > 50,
                "{kernel:?} passes for {other:?}"
            );
        }
    }
}

#[test]
fn all_photons_within_a_radius_are_summed() {
    for mut bench in Bench::each() {
        let mut random = Random(12);
        let photons = caustic_box(&mut random, 5000, 0.5, 1e-2);
        let mut points: Vec<_> = (0..100).map(|i| point(&mut random, i % 9 == 0)).collect();
        points[1].position = [30.0, 0.0, 0.0];
        let map = bench.map(&photons);
        for radius in [1e-3, 0.1, 0.5, 100.0] {
            // A kernel that falls to 0 at the edge of the disc weights two or three photons by
            // differences of nearly equal numbers.
            let last = if radius < 0.5 { DensityKernel::Gaussian } else { DensityKernel::Silverman };
            for kernel in [DensityKernel::Cone, last] {
                let density = Density { kernel, ..CONE };
                // The number of neighbours and the maximum radius have no effect.
                let within = GatherSettings { radius: Some(radius), max_radius: Some(0.01), density, ..settings(3) };
                check(&mut bench, &photons, &points, &within, true);
                let answer = bench.ask(true, &map, &points, &within);
                let far = (answer.gathered[1].count, &answer.radiance[1][..3]);
                assert!(radius > 10.0 || far == (0, &[0.0; 3]), "no photon, no light: {far:?}");
                let other = bench.ask(true, &map, &points, &GatherSettings { radius: Some(radius * 1.1), ..within });
                assert!(radius < 0.01 || answer.radiance != other.radiance, "control: the radius matters");
            }
        }
    }
}

#[test]
fn each_kernel_integrates_to_1_over_its_disc() {
    // Photons of flux 1 on a unit square at y = 0, one in each cell of a grid: the irradiance is
    // their number.
    let mut bench = Bench::open();
    let mut random = Random(13);
    let side = 200;
    let mut photons = uniform_box(&mut random, side * side);
    for (i, p) in photons.iter_mut().enumerate() {
        let along = |cell: usize, jitter: f32| (cell as f32 + jitter) / side as f32;
        p.position = [along(i % side, random.unit()), 0.0, along(i / side, random.unit())];
        (p.flux, p.wi) = ([1.0; 3], caustica::layout::octahedral(Vec3::Y));
    }
    let mut points: Vec<_> = (0..1000).map(|_| point(&mut random, false)).collect();
    for p in &mut points {
        p.position = [0.2 + 0.6 * random.unit(), 0.0, 0.2 + 0.6 * random.unit()];
        (p.ng, p.ns, p.weight) = ([0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0; 3]);
    }
    let map = bench.map(&photons);
    let kept: Vec<_> = photons.iter().enumerate().filter(|(i, _)| i % 20 != 0).map(|(_, p)| *p).collect();
    let fewer = bench.map(&kept);
    let even = (side * side) as f64 / EMITTED as f64;
    for kernel in DensityKernel::ALL {
        let density = Density { kernel, ..CONE };
        for radius in [None, Some(0.05)] {
            let mut integral = |map| {
                let answer = bench.ask(true, map, &points, &GatherSettings { radius, density, ..settings(300) });
                answer.radiance.iter().map(|r| f64::from(r[0])).sum::<f64>() / points.len() as f64 / even
            };
            let found = integral(&map);
            assert!((found - 1.0).abs() < 0.01, "{kernel:?}, radius {radius:?}: {found}");
            let fewer = integral(&fewer);
            assert!((fewer - 1.0).abs() > 0.01, "control: {kernel:?}: {fewer} with every 20th photon away");
        }
    }
}

#[test]
fn the_side_test_takes_only_photons_before_the_surface() {
    let mut bench = Bench::open();
    let mut random = Random(5);
    // All photons come from above. Points with a downward normal gather none.
    let mut photons = uniform_box(&mut random, 3000);
    photons.iter_mut().for_each(|p| p.wi = caustica::layout::octahedral(Vec3::new(0.1, 0.9, 0.2).normalize()));
    let mut points: Vec<_> = (0..40).map(|_| point(&mut random, false)).collect();
    points.iter_mut().for_each(|p| (p.ng, p.ns) = ([0.0, -1.0, 0.0], [0.0, -1.0, 0.0]));
    let map = bench.map(&photons);
    assert!(bench.ask(true, &map, &points, &settings(10)).gathered.iter().all(|g| g.count == 0));
    assert!(bench.ask(false, &map, &points, &settings(10)).gathered.iter().all(|g| g.count == 10));
}

#[test]
fn a_tiny_budget_goes_on_in_further_dispatches_with_the_same_bits() {
    for mut bench in Bench::each() {
        let mut random = Random(6);
        let photons = caustic_box(&mut random, 30_000, 0.3, 1e-2);
        // Enough points for pilots of both strides; they lie far apart.
        let points: Vec<_> = (0..2500).map(|_| point(&mut random, false)).collect();
        let map = bench.map(&photons);
        for (budget, k, count) in
            [(3, 200, 200), (100, 20, 2500), (1000, 200, 2500), (1000, 1000, 2500), (5000, 1000, 2500)]
        {
            let whole = bench.ask(true, &map, &points[..count], &settings(k));
            // Lanes that share a packet look at a cell in fewer steps.
            let step_budget = if bench.gpu.spreads_packets() { budget / 10 } else { budget };
            let mut tiny = Gather::new(bench.gpu, GatherOptions { step_budget, ..GatherOptions::default() });
            let pieces = run(bench.gpu, &mut tiny, &map, &points[..count], &settings(k));
            assert!(pieces.stats.dispatches > 2 * whole.stats.dispatches, "{:?} {:?}", pieces.stats, whole.stats);
            assert!(pieces.gathered == whole.gathered, "other sets: budget {budget}, k = {k}");
            assert!(pieces.radiance == whole.radiance, "other bits: budget {budget}, k = {k}");
            // Control: the result depends on k.
            let other = bench.ask(true, &map, &points[..count], &settings(k - 1));
            assert!(other.gathered != whole.gathered, "the control");
        }
    }
}

#[test]
fn answers_do_not_depend_on_how_lanes_share_the_work() {
    let photons = caustic_box(&mut Random(14), 50_000, 0.3, 1e-2);
    let points: Vec<_> = (0..3000).map(|i| point(&mut Random(i), i % 7 == 0)).collect();
    let answers = |k| {
        let answer = |bench: Bench| {
            let options = GatherOptions { fingerprint: true, ..GatherOptions::default() };
            let mut gather = Gather::new(bench.gpu, options);
            run(bench.gpu, &mut gather, &bench.map(&photons), &points, &settings(k)).gathered
        };
        Bench::each().map(answer).collect::<Vec<_>>()
    };
    let (found, other) = (answers(50), answers(49));
    assert!(found.iter().all(|answer| *answer == found[0]));
    assert!(other[0] != found[0], "control: another number of photons");
}

#[test]
fn equal_photons_give_equal_bits() {
    let mut bench = Bench::open();
    let photons = caustic_box(&mut Random(7), 70_000, 0.3, 1e-2);
    let points: Vec<_> = (0..1000).map(|i| point(&mut Random(i), false)).collect();
    let mut answer = |photons: &[Photon]| {
        let map = bench.map(photons);
        (map.read(bench.gpu).unwrap(), bench.ask(true, &map, &points, &settings(50)))
    };
    let first = answer(&photons);
    assert!(first == answer(&photons));
    let mut other = photons.clone();
    (other[0].flux, other[1].flux) = (photons[1].flux, photons[0].flux);
    assert!(first != answer(&other), "the control: other photons are another map");
}

#[test]
fn nearest_photons_equal_a_tree_at_a_million() {
    use kiddo::{ImmutableKdTree, SquaredEuclidean};
    let mut bench = Bench::open();
    let mut random = Random(8);
    let photons = caustic_box(&mut random, 1_000_000, 0.3, 1e-2);
    let mut points: Vec<_> = (0..2000).map(|_| point(&mut random, false)).collect();
    points.iter_mut().enumerate().filter(|(i, _)| i % 2 == 0).for_each(|(i, p)| p.position = photons[i * 400].position);
    let positions: Vec<[f32; 3]> = photons.iter().map(|p| p.position).collect();
    let tree: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&positions).unwrap();
    let map = bench.map(&photons);
    for k in [1u32, 10, 50, 500] {
        let answer = bench.ask(false, &map, &points, &settings(k));
        let wrong = |shift: u32| {
            let differs = |(p, g): (&VisiblePoint, &Gathered)| {
                let n = std::num::NonZero::new((k + 1 + shift) as usize).unwrap();
                let found = tree.query(&p.position).nearest_n::<SquaredEuclidean<f32>>(n).execute();
                let r2 = found.last().unwrap().distance;
                (r2 - g.radius_squared).abs() > 1e-6 * r2 || g.count != k
            };
            points.iter().zip(&answer.gathered).filter(|x| differs(*x)).count()
        };
        assert_eq!(wrong(0), 0, "k = {k}");
        assert!(wrong(1) > points.len() / 2, "the control: the next photon is another one");
    }
}

#[test]
fn photons_in_several_windows_are_found_as_in_one() {
    for mut bench in Bench::each() {
        let mut random = Random(10);
        let photons = caustic_box(&mut random, 5000, 0.3, 1e-2);
        let points: Vec<_> = (0..200).map(|_| point(&mut random, false)).collect();
        let whole = bench.map(&photons);
        let kernels = MapKernels::segmented(bench.gpu, 4096);
        let split = |photons: &[Photon]| {
            let store = PhotonStore::segmented(bench.gpu, 5000, 1024).unwrap();
            store.write(bench.gpu, photons);
            PhotonMap::build(bench.gpu, &kernels, store, 5000, EMITTED).unwrap()
        };
        let segmented = split(&photons);
        let parts = if bench.gpu.keeps_tables() { 1 } else { 2 };
        assert_eq!((whole.segments(), segmented.segments()), (1, parts));
        assert!(whole.read(bench.gpu).unwrap() == segmented.read(bench.gpu).unwrap());
        let mut fewer = photons.clone();
        fewer[4999] = fewer[0];
        let other = split(&fewer);
        for k in [10, 500] {
            let expected = bench.ask(true, &whole, &points, &settings(k));
            assert_eq!(bench.ask(true, &segmented, &points, &settings(k)), expected);
            assert!(
                k < 500 || bench.ask(true, &other, &points, &settings(k)) != expected,
                "the control: another last photon"
            );
        }
    }
}

#[test]
fn the_sort_is_stable_at_every_size() {
    let gpu = support::gpu();
    let radix = RadixSort::new(gpu);
    for count in [0u32, 1, 2, 63, 64, 65, 255, 256, 257, 10_000, 65_535 * 64 + 1] {
        let mut random = Random(u64::from(count));
        let entries: Vec<[u32; 2]> = (0..count).map(|i| [random.bits() as u32 & 0x3fff_0fff, i]).collect();
        let buffers = [gpu.storage_with("a", &entries).unwrap(), gpu.storage_with("b", &entries).unwrap()];
        let sorted = radix.sort(gpu, [&buffers[0], &buffers[1]], count, 0..30).unwrap();
        let mut expected = entries.clone();
        expected.sort_by_key(|e| e[0]);
        let got: Vec<[u32; 2]> = gpu.read(&buffers[sorted], 0, count.into()).unwrap();
        assert!(got == expected, "{count} entries");
        if count > 100 {
            let sorted = radix.sort(gpu, [&buffers[0], &buffers[1]], count, 0..20).unwrap();
            let got: Vec<[u32; 2]> = gpu.read(&buffers[sorted], 0, count.into()).unwrap();
            assert!(got != expected, "the control: sorted by the low bits only");
        }
    }
}

#[test]
fn the_estimate_is_unbiased_with_the_next_photon() {
    // Photons of flux 1, uniform on a unit square at y = 0: the irradiance is their number over the
    // number of paths.
    let mut bench = Bench::open();
    let mut random = Random(9);
    let count = 40_000u32;
    let mut photons = uniform_box(&mut random, count as usize);
    for p in &mut photons {
        (p.position[1], p.flux) = (0.0, [1.0; 3]);
        p.wi = caustica::layout::octahedral(Vec3::Y);
    }
    let mut points: Vec<_> = (0..20_000).map(|_| point(&mut random, false)).collect();
    for p in &mut points {
        p.position = [0.2 + 0.6 * random.unit(), 0.0, 0.2 + 0.6 * random.unit()];
        (p.ng, p.ns, p.weight) = ([0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0; 3]);
    }
    let map = bench.map(&photons);
    let answer = bench.ask(true, &map, &points, &settings(10));
    let even = f64::from(count) / EMITTED as f64;
    let mean = answer.radiance.iter().map(|r| f64::from(r[0])).sum::<f64>() / points.len() as f64 / even;
    // The square holds 4000 disjoint discs of 10 photons: the noise of the mean is about 1 /
    // sqrt(40,000) / 2.
    assert!((mean - 1.0).abs() < 0.01, "{mean}");
    // Control: with the radius of the k-th photon the mean is too bright, by weight(r) / (k - 1) /
    // mean weight.
    let (photons, fluxes) = map.read(bench.gpu).unwrap();
    let positions: Vec<Vec3> = photons.iter().map(|p| p.position.into()).collect();
    let with_kth = |p: &VisiblePoint| {
        let mut found = brute_force(&positions, p.position.into(), 10, None, |_| true);
        let last = *found.photons.last().unwrap() as usize;
        found.radius_squared = positions[last].distance_squared(p.position.into());
        estimate((&photons, &fluxes), &found, p, CONE, EMITTED, true)[0]
    };
    let mean = points.iter().step_by(10).map(with_kth).sum::<f64>() / points.len() as f64 * 10.0 / even;
    let expected = 1.0 + 0.5 / 9.0 / (2.0 / 3.0);
    assert!((mean - expected).abs() < 0.03, "{mean} {expected}");
}
