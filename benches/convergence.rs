//! Benchmark: error of a picture of many passes, estimated and true, against a reference.
//!
//! `cargo bench --bench convergence [-- PASSES [SIZE [PLOT.svg [SCENE.glb]]]]`. The reference of a
//! scene, S1 unless one is given, is `SCENE_128.exr` beside it, averaged to SIZE x SIZE pixels: the
//! fewer pixels, the less noise it has, and the more passes can be compared with it. Errors are
//! relative, as [`ErrorEstimate`] has them. The noise of the reference is taken off. Fits are
//! slopes over the logarithm of the number of passes.

use std::{
    error::Error,
    path::{Path, PathBuf},
};

use caustica::{
    Gpu, Progressive, Scene, Session, Settings, Silent,
    image::{ErrorEstimate, Film, PassBlock, PassSum, difference::rel_mse, read_exr},
    settings::{PassSettings, Quality},
};
use plotters::prelude::*;
use support::blocks;

/// Side of references, in pixels.
const REFERENCE: u32 = 128;
const PHOTONS: u32 = 50_000;
const PASSES: u32 = 64;
/// Mean square of the noise of the references S1 and S2, from that at 256 x 256.
const REFERENCE_NOISE: f64 = 3e-4 / 4.0;
/// Part of the mean radiance that is added to that of each pixel, as in [`ErrorEstimate`].
const FLOOR: f64 = 0.1;
const SCENE: &str = "tests/references/S1.glb";

/// The state after some passes; errors are roots of mean squares.
struct Row {
    passes: u32,
    mean: f64,
    blocks: f64,
    estimate: Option<ErrorEstimate>,
    noise: f64,
    truth: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let passes = words.first().map_or(Ok(PASSES), |word| word.parse())?;
    let size = words.get(1).map_or(Ok(REFERENCE), |word| word.parse())?;
    if size == 0 || !REFERENCE.is_multiple_of(size) || !size.is_multiple_of(8) {
        return Err(format!("SIZE divides {REFERENCE} and is a multiple of 8, not {size}").into());
    }
    let scene = words.get(3).map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join(SCENE), PathBuf::from);
    let scene = scene.as_path();
    let mut curves = Vec::new();
    for (name, settings) in [("final gathering", Quality::Normal.settings()), ("photons alone", Settings::default())] {
        print_head(&format!("{}, {name}", scene.display()), size);
        let rows = measure(scene, settings, passes, size)?;
        print_slopes(&rows);
        curves.push((name, rows));
    }
    words.get(2).filter(|path| path.as_str() != "-").map_or(Ok(()), |path| plot(Path::new(path), &curves))
}

/// Renders the passes, and prints a row at each power of two.
fn measure(path: &Path, settings: Settings, passes: u32, size: u32) -> Result<Vec<Row>, Box<dyn Error>> {
    let scene = Scene::load(path)?;
    let stem = path.file_stem().ok_or("no file")?.to_string_lossy();
    let reference = read_exr(&path.with_file_name(format!("{stem}_{REFERENCE}.exr")))?;
    let reference = blocks(reference.radiance(), (REFERENCE / size) as usize);
    let settings = settings.with(|s| {
        (s.photons.global, s.photons.caustic) = (PHOTONS, PHOTONS);
        s.picture.size = Some((size, size));
    });
    let right: Vec<f64> = reference.as_flattened().iter().map(|x| f64::from(*x)).collect();
    let mean = right.iter().sum::<f64>() / right.len() as f64;
    // Mean over all numbers, each relative to the reference.
    let relative = |term: &dyn Fn(usize) -> f64| {
        let terms = right.iter().enumerate().map(|(i, x)| term(i) / (x * x + (FLOOR * mean).powi(2)));
        terms.sum::<f64>() / right.len() as f64
    };
    let gpu = Gpu::open(None)?;
    let session = Session::open(&gpu, &scene, &settings.lights, &Silent)?;
    let progressive = Progressive::new(&session, &settings, PassSettings::default())?;
    let (mut all, mut rows) = (PassSum::default(), Vec::new());
    // Even and odd passes.
    let mut halves: [Option<Film>; 2] = Default::default();
    for index in 0..passes {
        let (film, stats) = progressive.render(index, &Silent)?;
        let half = &mut halves[index as usize % 2];
        match half {
            Some(sum) => sum.merge(&film)?,
            None => *half = Some(film.clone()),
        }
        all.push(PassBlock::of_pass(index, film, &stats))?;
        if !(index + 1).is_power_of_two() {
            continue;
        }
        let total = all.total()?.ok_or("no pass")?;
        let frame = total.film().finish();
        let here = frame.layer("radiance");
        let square = |i: usize| (f64::from(here[i]) - right[i]).powi(2);
        let means = halves.each_ref().map(|half| half.as_ref().map(|film| film.finish().layer("radiance").to_vec()));
        let [Some(even), Some(odd)] = means else { continue };
        let noise = relative(&|i| (f64::from(even[i] - odd[i]) / 2.0).powi(2));
        let row = Row {
            passes: index + 1,
            mean: here.iter().map(|x| f64::from(*x)).sum::<f64>() / (mean * right.len() as f64),
            blocks: rel_mse(&blocks(frame.radiance(), 8), &blocks(&reference, 8), None),
            estimate: ErrorEstimate::of(total.film(), None),
            noise: noise.sqrt(),
            truth: (relative(&square) - reference_noise(size)).max(0.0).sqrt(),
        };
        print_row(&row);
        rows.push(row);
    }
    Ok(rows)
}

/// Mean square of the noise of references averaged to this size.
fn reference_noise(size: u32) -> f64 {
    REFERENCE_NOISE * (f64::from(size) / f64::from(REFERENCE)).powi(2)
}

fn print_head(name: &str, size: u32) {
    println!(
        "{name}, {size} x {size}: {PHOTONS} photons a map; noise of the reference {:.2} %",
        100.0 * reference_noise(size).sqrt()
    );
    println!(
        "{:>7} {:>8} {:>10} {:>9} {:>9} {:>9} {:>9} {:>11}",
        "passes", "mean", "8x8 relMSE", "noise %", "est. %", "bias e. %", "error %", "est. / true"
    );
}

fn print_row(row: &Row) {
    let estimate = row.estimate.unwrap_or(ErrorEstimate { noise: f64::NAN, bias: f64::NAN });
    let Row { passes, mean, blocks, truth, .. } = row;
    println!(
        "{passes:>7} {mean:>8.4} {blocks:>10.2e} {:>9.2} {:>9.2} {:>9.2} {:>9.2} {:>11.2}",
        100.0 * row.noise,
        100.0 * estimate.noise,
        100.0 * estimate.bias,
        100.0 * truth,
        estimate.total() / truth,
    );
}

fn print_slopes(rows: &[Row]) {
    let slope = |of: &dyn Fn(&Row) -> f64| {
        let points: Vec<(f64, f64)> =
            rows.iter().map(|row| (f64::from(row.passes).ln(), of(row).ln())).filter(|(_, y)| y.is_finite()).collect();
        let n = points.len() as f64;
        let (x, y) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
        let (above, below) =
            points.iter().fold((0.0, 0.0), |(a, b), (px, py)| (a + (px - x) * (py - y), b + (px - x).powi(2)));
        above / below
    };
    println!("slopes: noise {:.2}, error {:.2}\n", slope(&|row| row.noise), slope(&|row| row.truth));
}

/// Draws estimated and true errors over the number of passes.
fn plot(path: &Path, curves: &[(&str, Vec<Row>)]) -> Result<(), Box<dyn Error>> {
    let colors = [RGBColor(0, 114, 178), RGBColor(213, 94, 0)];
    let most = curves.iter().flat_map(|(_, rows)| rows.iter().map(|row| row.passes)).max().ok_or("no pass")?;
    let area = SVGBackend::new(path, (680, 420)).into_drawing_area();
    let mut chart = ChartBuilder::on(&area)
        .margin(12)
        .caption("Error over passes: true (line) and estimated (dots)", ("sans-serif", 18))
        .x_label_area_size(44)
        .y_label_area_size(60)
        .build_cartesian_2d((1.0..f64::from(most)).log_scale(), (0.1..20.0_f64).log_scale())?;
    chart.configure_mesh().x_desc("passes").y_desc("relative error, %").draw()?;
    for ((name, rows), color) in curves.iter().zip(colors) {
        let points = rows.iter().map(|row| (f64::from(row.passes), 100.0 * row.truth));
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(2)))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 20, y)], color.stroke_width(2)));
        let estimated = rows.iter().filter_map(|row| Some((f64::from(row.passes), 100.0 * row.estimate?.total())));
        chart.draw_series(estimated.map(|point| Circle::new(point, 4, color.filled())))?;
    }
    chart.configure_series_labels().position(SeriesLabelPosition::LowerLeft).border_style(BLACK).draw()?;
    area.present()?;
    Ok(())
}
