//! `caustica render`.

use std::{
    collections::HashSet,
    io,
    path::{Path, PathBuf},
    time::Instant,
};

use caustica::{
    Error, Result,
    gpu::Gpu,
    image::{Attributes, Frame, write_exr_with, write_file, write_png},
    progress::{Progress, Stage},
    renderer,
    scene::Scene,
    settings::{LightUnit, Search, Settings},
    stats::{Stats, timed},
};

use clap::{CommandFactory, error::ErrorKind};

use super::{
    args::{Args, RenderArgs},
    files::{Files, identity},
    passes::{self, Inputs, Picture},
    progress::Display,
    values::{Exposure, extension},
};

/// Refuses wrong usage that no single argument shows: two outputs that are one file.
pub fn check(args: &RenderArgs) -> std::result::Result<(), clap::Error> {
    let mut known = HashSet::new();
    let twice = outputs(args).find(|path| !known.insert(identity(path)));
    let Some(path) = twice else { return Ok(()) };
    let mut command = Args::command();
    command.build();
    let usage_of = command.find_subcommand_mut("render").expect("this is its check");
    Err(usage_of.error(ErrorKind::ArgumentConflict, format!("{} is another output as well", path.display())))
}

/// All files that the run writes.
fn outputs(args: &RenderArgs) -> impl Iterator<Item = &PathBuf> {
    args.outputs.iter().chain(&args.stats).chain(&args.passes.part).chain(&args.passes.checkpoint)
}

/// Loads the scene, renders it and writes the outputs.
pub fn render(args: &RenderArgs) -> Result<()> {
    let started = Instant::now();
    let options = &args.options;
    let display = Display::new(options.shared.quiet, options.shared.verbose);
    let mut files = Files::default();
    files.read(&args.scene, "the scene")?;
    options.shared.environment.env.iter().try_for_each(|path| files.read(path, "the environment"))?;
    outputs(args).try_for_each(|path| files.write(path))?;
    let settings = args.settings();

    let mut load_seconds = 0.0;
    display.report(Stage::Load, 0, 0);
    let scene = timed(&mut load_seconds, || -> Result<Scene> {
        let mut scene = Scene::load_with(&args.scene, &options.shared.loading.options())?;
        options.shared.environment.light([&mut scene])?;
        Ok(scene)
    })?;
    files.read_scene(&scene)?;
    display.check()?;
    display.note(&light_unit_line(&settings));
    if options.shared.verbose {
        display.note(&args.quality_line());
    }
    if settings.estimate.search == Search::KdTree && !settings.estimate.raw {
        display.note(RAW_NOTE);
    }
    for warning in &scene.warnings {
        display.note(&format!("warning: {warning}"));
    }

    let gpu = Gpu::open(options.shared.device.as_deref())?;
    display.note(&format!("device: {} ({})", gpu.name, gpu.driver));
    let write = |frame: &Frame, attributes: &Attributes| {
        args.outputs.iter().try_for_each(|path| write_picture(path, frame, attributes, args))
    };
    let picture = if args.passes.are_given() {
        let (gpu, scene, settings, display) = (&gpu, &scene, &settings, &display);
        passes::render(&Inputs { gpu, scene, settings, args, display, write: &write })?
    } else {
        let result = renderer::render(&gpu, &scene, &settings, &display);
        display.finish();
        let renderer::Render { frame, stats } = result?;
        Some(Picture { frame, attributes: scene.origin(&settings, &stats).attributes(), stats })
    };
    let Some(Picture { frame, attributes, mut stats }) = picture else { return Ok(()) };
    for warning in stats.warnings.iter().filter(|w| !scene.warnings.contains(w)) {
        display.note(&format!("warning: {warning}"));
    }
    let mut warnings = scene.warnings.clone();
    warnings.extend(stats.warnings.iter().filter(|w| !scene.warnings.contains(w)).cloned());
    stats.warnings = warnings;

    for path in &args.outputs {
        display.check()?;
        write_picture(path, &frame, &attributes, args)?;
        if extension(path) == "png" {
            display.note(&exposure_line(options.shared.exposure, &frame));
        }
        display.note(&format!("wrote {}", path.display()));
    }
    stats.seconds.load = load_seconds;
    stats.seconds.total = started.elapsed().as_secs_f64();
    if options.shared.verbose {
        display.note(&summary(&stats));
    }
    args.stats.as_deref().map_or(Ok(()), |path| write_stats(path, &stats))
}

/// Note on why a kd-tree's picture differs from the default one.
pub(super) const RAW_NOTE: &str = "the kd-tree is the report's: the estimate is raw, as with --raw-estimate";

fn write_picture(path: &Path, frame: &Frame, attributes: &Attributes, args: &RenderArgs) -> Result<()> {
    match extension(path).as_str() {
        "png" => write_png(path, frame, args.options.shared.exposure.of(frame), args.options.shared.tonemap.into()),
        _ => write_exr_with(path, frame, attributes),
    }
}

/// The exposure of a PNG in one line.
pub(super) fn exposure_line(exposure: Exposure, frame: &Frame) -> String {
    let how = if exposure == Exposure::Auto { " (auto)" } else { "" };
    format!("exposure: {:+.2} EV{how}", exposure.of(frame))
}

fn write_stats(path: &Path, stats: &Stats) -> Result<()> {
    let mut text = serde_json::to_string_pretty(stats)
        .map_err(|e| Error::Io { path: path.to_path_buf(), source: io::Error::other(e) })?;
    text.push('\n');
    write_file(path, text.as_bytes())
}

fn light_unit_line(settings: &Settings) -> String {
    match settings.lights.unit {
        LightUnit::Radiometric => "light unit: radiometric (candela read as W/sr in each channel)".to_string(),
        LightUnit::Photometric => "light unit: photometric (candela divided by 683 lm/W)".to_string(),
    }
}

fn summary(stats: &Stats) -> String {
    let (s, global, caustic) = (&stats.seconds, stats.photons.global, stats.photons.caustic);
    format!(
        "seconds: load {:.2}, bvh {:.2}, photons {:.2}, grid {:.2}, camera {:.2}, direct {:.2}, gather {:.2}, \
         total {:.2}\nglobal map: {} photons of {} paths\ncaustic map: {} photons of {} paths\nrays: {}\n\
         peak device memory: {:.1} MiB",
        s.load,
        s.bvh,
        s.photons,
        s.grid,
        s.camera,
        s.direct,
        s.gather,
        s.total,
        global.stored,
        global.emitted,
        caustic.stored,
        caustic.emitted,
        stats.rays,
        stats.peak_device_bytes as f64 / f64::from(1 << 20),
    )
}
