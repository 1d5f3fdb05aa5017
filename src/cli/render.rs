//! `caustica render`.

use std::{
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

use super::{
    args::RenderArgs,
    bugs,
    failures::Failures,
    files::{Files, make_folder},
    outlook::{Outlook, Plan},
    passes::{self, Inputs, Picture},
    progress::Display,
    say::say,
    signals,
    values::{Exposure, extension},
};

/// A scene and the pictures that are made of it.
pub(super) struct Job {
    pub scene: PathBuf,
    pub pictures: Vec<PathBuf>,
}

/// Jobs of the command, scene by scene.
pub(super) fn jobs(args: &RenderArgs) -> Vec<Job> {
    let pictures = |scene: &PathBuf| match &args.output_dir {
        None => args.outputs.clone(),
        Some(folder) => {
            let name = |extension: &str| {
                let mut name = scene.file_stem().unwrap_or_default().to_owned();
                name.push(extension);
                folder.join(name)
            };
            vec![name(".exr"), name(".png")]
        }
    };
    args.scenes.iter().map(|scene| Job { scene: scene.clone(), pictures: pictures(scene) }).collect()
}

/// All files that a run over one scene writes.
pub(super) fn outputs<'a>(args: &'a RenderArgs, job: &'a Job) -> impl Iterator<Item = &'a PathBuf> {
    job.pictures.iter().chain(&args.stats).chain(&args.passes.part).chain(&args.passes.checkpoint)
}

/// Renders all scenes on one device.
pub fn render(args: &RenderArgs) -> Result<()> {
    let shared = &args.options.shared;
    let display = Display::new(shared.quiet, shared.verbose);
    let (jobs, mut device) = (jobs(args), None);
    let Some(folder) = &args.output_dir else { return render_one(args, &jobs[0], &display, &mut device) };
    make_folder(folder)?;
    let mut failed = 0;
    for (done, job) in jobs.iter().enumerate() {
        display.note(&format!("scene {} of {}: {}", done + 1, jobs.len(), job.scene.display()));
        let problem = match bugs::caught(|| render_one(args, job, &display, &mut device)) {
            Ok(Ok(())) => continue,
            Ok(Err(Error::Stopped)) => return Err(Error::Stopped),
            Ok(Err(error)) => error.to_string(),
            Err(bug) => bug,
        };
        display.finish();
        failed += 1;
        let (scene, problem) = (job.scene.display().to_string(), problem.lines().collect::<Vec<_>>().join(" "));
        say(&if problem.contains(&scene) { format!("error: {problem}") } else { format!("error: {scene}: {problem}") });
    }
    if failed == 0 {
        return Ok(());
    }
    Err(Error::Incomplete(format!("{failed} of {} scenes were not rendered", jobs.len())))
}

/// Loads a scene, renders it and writes its outputs. The device is opened when the first scene
/// needs it.
fn render_one(args: &RenderArgs, job: &Job, display: &Display, device: &mut Option<Gpu>) -> Result<()> {
    let started = Instant::now();
    let options = &args.options;
    let mut files = Files::default();
    files.read(&job.scene, "the scene")?;
    options.shared.environment.env.iter().try_for_each(|path| files.read(path, "the environment"))?;
    outputs(args, job).try_for_each(|path| files.write(path))?;
    let settings = args.settings();

    if args.passes.checkpoint.is_some() {
        signals::keep_work();
    }
    let mut load_seconds = 0.0;
    display.report(Stage::Load, 0, 0);
    let scene = timed(&mut load_seconds, || -> Result<Scene> {
        let mut scene = Scene::load_with(&job.scene, &options.shared.loading.options())?;
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

    let gpu = match device {
        Some(gpu) => gpu,
        None => device.insert(Gpu::open(options.shared.device.as_deref())?),
    };
    display.note(&format!("device: {} ({})", gpu.name, gpu.driver));
    let write = |frame: &Frame, attributes: &Attributes| {
        let mut failures = Failures::default();
        for path in &job.pictures {
            failures.take(write_picture(path, frame, attributes, args));
        }
        failures.outcome()
    };
    let picture = if args.passes.are_given() {
        let (gpu, scene, settings) = (&*gpu, &scene, &settings);
        passes::render(&Inputs { gpu, scene, settings, args, display, write: &write })?
    } else {
        display.expect(Outlook::new(Plan::new(&scene, &settings)?), started);
        let result = renderer::render(gpu, &scene, &settings, display);
        display.finish();
        let renderer::Render { frame, stats } = result?;
        let attributes = scene.origin(&settings, &stats).attributes();
        Picture { frame, attributes, stats, failures: Failures::default() }
    };
    let Picture { frame, attributes, mut stats, mut failures } = picture;
    if is_empty(&frame) {
        stats.warnings.push(unseen(&scene, &settings)?);
    }
    for warning in stats.warnings.iter().filter(|w| !scene.warnings.contains(w)) {
        display.note(&format!("warning: {warning}"));
    }
    let mut warnings = scene.warnings.clone();
    warnings.extend(stats.warnings.iter().filter(|w| !scene.warnings.contains(w)).cloned());
    stats.warnings = warnings;

    for path in &job.pictures {
        display.check()?;
        if !failures.take(write_picture(path, &frame, &attributes, args)) {
            continue;
        }
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
    if let Some(path) = &args.stats {
        failures.take(write_stats(path, &stats));
    }
    failures.outcome()
}

/// Whether no sample has met a surface, and no light comes from beyond.
fn is_empty(frame: &Frame) -> bool {
    let is_zero = |numbers: &[f32]| numbers.iter().all(|x| *x == 0.0);
    is_zero(frame.alpha()) && is_zero(frame.layer("radiance"))
}

/// Warning of an empty picture.
fn unseen(scene: &Scene, settings: &Settings) -> Result<String> {
    let number = scene.camera_number(settings.picture.camera.as_deref())?;
    let place = if settings.picture.crop.is_some() { " in this crop" } else { "" };
    let name = &scene.cameras[number].name;
    Ok(format!("the camera {number} {name:?} sees nothing of the scene{place}: the picture is empty"))
}

/// Note on why a kd-tree's picture differs from the default one.
pub(super) const RAW_NOTE: &str = "the kd-tree is the report's: the estimate is raw, as with --raw-estimate";

fn write_picture(path: &Path, frame: &Frame, attributes: &Attributes, args: &RenderArgs) -> Result<()> {
    match extension(path).as_str() {
        "png" => write_png(path, frame, args.options.shared.exposure.of(frame), args.options.shared.tonemap.into()),
        _ => write_exr_with(path, frame, attributes),
    }
}

/// Stops beyond which a picture shows little but the noise of what glows: a candle of 1 cd, in
/// photometric units, asks for some 11. Files that viewers light by a sky of their own ask for more
/// if their only light is a glowing dashboard.
const DARK: f32 = 14.0;

/// The exposure of a PNG in one line.
pub(super) fn exposure_line(exposure: Exposure, frame: &Frame) -> String {
    let stops = exposure.of(frame);
    let how = match exposure {
        Exposure::Auto if stops > DARK => {
            " (auto): what is seen is all but dark; `render --env` or `--background` lights it"
        }
        Exposure::Auto => " (auto)",
        Exposure::Stops(_) => "",
    };
    format!("exposure: {stops:+.2} EV{how}")
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
         total {:.2}\ncamera samples in some pixels only: {}\nglobal map: {} photons of {} paths\ncaustic map: {} photons of {} paths\nrays: {}\n\
         peak device memory: {:.1} MiB",
        s.load,
        s.bvh,
        s.photons,
        s.grid,
        s.camera,
        s.direct,
        s.gather,
        s.total,
        stats.extra_samples,
        global.stored,
        global.emitted,
        caustic.stored,
        caustic.emitted,
        stats.rays,
        stats.peak_device_bytes as f64 / f64::from(1 << 20),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_of_nothing_has_neither_surfaces_nor_light() {
        let mut frame = Frame::new(2, 1, &[[0.0; 3]; 2]);
        assert!(is_empty(&frame));
        frame.layer_mut("alpha")[1] = 0.25;
        assert!(!is_empty(&frame), "a black surface");
        assert!(!is_empty(&Frame::new(2, 1, &[[0.0; 3], [0.0, 0.0, 1e-9]])), "a sky");
    }

    #[test]
    fn a_picture_that_is_all_but_dark_is_named() {
        let line = |radiance: f32, exposure| {
            let mut frame = Frame::new(1, 1, &[[radiance; 3]]);
            frame.layer_mut("alpha").copy_from_slice(&[1.0]);
            exposure_line(exposure, &frame)
        };
        assert!(line(1e-6, Exposure::Auto).contains("--background"));
        assert_eq!(line(0.09, Exposure::Auto), "exposure: +1.00 EV (auto)");
        assert_eq!(line(1e-4, Exposure::Auto), "exposure: +10.81 EV (auto)");
        assert_eq!(line(1e-6, Exposure::Stops(1.0)), "exposure: +1.00 EV");
    }
}
