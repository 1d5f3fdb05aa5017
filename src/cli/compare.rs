//! `caustica compare`.

use std::time::Instant;

use caustica::{
    Result,
    compare::{FILES, Options, compare},
    gpu::Gpu,
    progress::{Progress, Stage},
    scene::Scene,
    settings::Settings,
};

use super::{
    args::CompareArgs,
    files::{Files, make_folder},
    outlook::{Outlook, Plan},
    progress::Display,
    render::RAW_NOTE,
    say::print,
};

/// Compares, writes the files and fails if the two sides disagree.
pub fn run(args: &CompareArgs) -> Result<()> {
    let started = Instant::now();
    let options = &args.options;
    let display = Display::new(options.shared.quiet, options.shared.verbose);
    display.report(Stage::Load, 0, 0);
    let mut scene = Scene::load_with(&args.scene, &options.shared.loading.options())?;
    options.shared.environment.light([&mut scene])?;
    display.check()?;
    prepare(args, &scene)?;
    let settings = options.settings(Settings::default());
    let gpu = Gpu::open(options.shared.device.as_deref())?;
    display.note(&format!("device: {} ({})", gpu.name, gpu.driver));
    if !settings.estimate.raw {
        display.note(RAW_NOTE);
    }
    let asked = Options { tolerance: args.tolerance, sabotage: args.sabotage };
    display.expect(Outlook::new(Plan::new(&scene, &settings)?), started);
    let result = compare(&gpu, &scene, &settings, &asked, &display);
    display.finish();
    let comparison = result?;
    for warning in &comparison.stats.warnings {
        display.note(&format!("warning: {warning}"));
    }
    let stats = &comparison.stats;
    let origin = scene.origin(&settings, stats);
    display.check()?;
    comparison.write(&args.output, &origin, options.shared.exposure.of_all(), options.shared.tonemap.into())?;
    display.note(&format!("wrote {} in {:.1} s", args.output.display(), started.elapsed().as_secs_f64()));
    if !options.shared.quiet {
        print(&comparison.report.table())?;
    }
    comparison.verdict()
}

/// Creates the folder and checks before the work that every file can be written there.
fn prepare(args: &CompareArgs, scene: &Scene) -> Result<()> {
    let folder = &args.output;
    make_folder(folder)?;
    let mut files = Files::default();
    files.read_scene(scene)?;
    args.options.shared.environment.env.iter().try_for_each(|path| files.read(path, "the environment"))?;
    FILES.iter().try_for_each(|name| files.write(&folder.join(name)))
}
