//! `caustica study`.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Mutex,
    time::Instant,
};

use caustica::{
    Error, Result,
    gpu::Gpu,
    image::read_exr,
    scene::{LoadOptions, Scene},
    settings::{Mode, Quality, Settings},
    study::{self, Finer, Look, Plan, Reference, Results, Subject},
};

use super::{
    files::{Files, make_folder},
    progress::Display,
    say::print,
    study_args::{PresetArg, ReferenceArg, StudyArgs},
    study_progress::StudyDisplay,
};

/// Folder of the project's scenes.
const SCENES: &str = "scenes";
/// Default size of the preset's pictures. The whole preset should take minutes on software Vulkan.
const PRESET_SIZE: (u32, u32) = (256, 256);
const PRESET_SPP: u32 = 1;
/// Default number of renders per combination of the preset's plane: noise needs two.
const PRESET_REPEATS: u32 = 2;

/// Runs the study, writes its files and reports failures.
pub fn run(args: &StudyArgs) -> Result<()> {
    let started = Instant::now();
    let options = &args.options;
    let display = Display::new(options.quiet, options.verbose);
    let mut plan = plan(args)?;
    options.environment.light(plan.subjects.iter_mut().map(|subject| &mut subject.scene))?;
    if let Some(environment) = plan.subjects.first().and_then(|subject| subject.scene.environment.as_ref()) {
        plan.title = format!("{} under {}", plan.title, environment.name);
    }
    plan.check()?;
    for warning in plan.subjects.iter().flat_map(|s| &s.scene.warnings).collect::<BTreeSet<_>>() {
        display.note(&format!("warning: {warning}"));
    }
    prepare(args, &plan)?;
    let gpu = Gpu::open(options.device.as_deref())?;
    display.note(&format!("device: {} ({})", gpu.name, gpu.driver));
    let watch = StudyDisplay { display: &display, told: Mutex::default() };
    let result = study::run(&gpu, &plan, &args.output, &watch);
    display.finish();
    let results = result?;
    for reference in &results.references {
        display.note(&format!("reference: {reference}"));
    }
    for failure in &results.failures {
        display.note(&format!("failed: {failure}"));
    }
    let written = study::write(&plan, &results, &args.output)?;
    display.note(&format!(
        "{} cells rendered, {} kept from before, {} files in {} after {:.1} s",
        results.rendered,
        results.kept,
        written.len(),
        args.output.display(),
        started.elapsed().as_secs_f64()
    ));
    if !options.quiet {
        print(&study::summary(&plan, &results))?;
    }
    verdict(&results, &args.output)
}

fn verdict(results: &Results, folder: &Path) -> Result<()> {
    match results.failures.as_slice() {
        [] => Ok(()),
        [first, ..] => Err(Error::Incomplete(format!(
            "{} of {} cells failed, the first: {first}; {} has the others",
            results.failures.len(),
            results.failures.len() + results.rendered + results.kept,
            folder.join("study.csv").display()
        ))),
    }
}

fn plan(args: &StudyArgs) -> Result<Plan> {
    let options = &args.options;
    let look = Look { exposure: options.exposure.of_all(), tonemap: options.tonemap.into() };
    // Final gathering is studied as pictures have it.
    let base = if args.gather.is_empty() { Settings::default() } else { Quality::Normal.settings() };
    let settings = options.settings(base);
    if args.preset == Some(PresetArg::Report) {
        if options.loading.options() != LoadOptions::default() {
            let problem = "has scenes of its own, which --scene, --variant, --texture-size, --allow-outside and \
                           --ignore-required do not change";
            return Err(Error::Setting { name: "--preset", value: "report".to_owned(), problem: problem.to_owned() });
        }
        let folder = args.scene.clone().unwrap_or_else(|| PathBuf::from(SCENES));
        let size = Some(options.size.unwrap_or(PRESET_SIZE));
        // The raw estimate is that of the report.
        let spp = options.spp.unwrap_or(PRESET_SPP);
        let settings = settings.with(|s| {
            s.picture.size = size;
            s.picture.spp = spp;
            s.estimate.raw = true;
        });
        return study::report(&folder, &settings, args.repeat.unwrap_or(PRESET_REPEATS), args.preset_scale, look);
    }
    // clap requires the scene, the photons and the neighbours without a preset.
    let scene = Scene::load_with(args.scene.as_deref().unwrap_or(Path::new("")), &options.loading.options())?;
    let modes: Vec<Mode> = args.modes.iter().map(|&mode| mode.into()).collect();
    let most = args.photons.iter().copied().max().unwrap_or(1);
    let (reference, size) = match &args.reference {
        None => (Reference::None, options.size),
        Some(ReferenceArg::Auto) => (Reference::Finer(Finer::than(most, settings.picture.spp)), options.size),
        Some(ReferenceArg::File(path)) => {
            let frame = read_exr(path)?;
            let size = options.size.unwrap_or((frame.width, frame.height));
            (Reference::Picture { name: path.display().to_string(), frame: Box::new(frame) }, Some(size))
        }
    };
    let settings = settings.with(|s| s.picture.size = size);
    let subject = Subject { scene, reference };
    let repeats = args.repeat.unwrap_or(1);
    if !args.gather.is_empty() {
        if let Some(mode) = modes.iter().find(|mode| !mode.gathers_finally()) {
            let problem = "has no final gathering; hybrid and indirect-photons have".to_owned();
            return Err(Error::Setting { name: "--modes", value: mode.name().to_owned(), problem });
        }
        return Ok(study::gather_grid(subject, &settings, &modes, &args.photons, &args.gather, repeats, look));
    }
    Ok(study::grid(subject, &settings, &modes, &args.photons, &args.neighbors, repeats, look))
}

/// Creates the folder and checks before the work that files can be written there.
fn prepare(args: &StudyArgs, plan: &Plan) -> Result<()> {
    let folder = &args.output;
    make_folder(folder)?;
    let mut files = Files::default();
    plan.subjects.iter().try_for_each(|subject| files.read_scene(&subject.scene))?;
    args.options.environment.env.iter().try_for_each(|path| files.read(path, "the environment"))?;
    if let Some(ReferenceArg::File(path)) = &args.reference {
        files.read(path, "the reference")?;
    }
    ["study.csv", "study.json", "contact-sheet.png", "report.html"]
        .iter()
        .try_for_each(|name| files.write(&folder.join(name)))
}
