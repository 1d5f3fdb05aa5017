//! `caustica render` in passes: until their end, a time or an error; with checkpoints.

use std::{
    io,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use caustica::{
    Error, Result,
    gpu::Gpu,
    image::{Attributes, ErrorEstimate, Frame, PassBlock, PassSum, differences, read_part, write_part},
    progress::{Progress, Stage},
    renderer::{LightGroups, Progressive, size_of},
    scene::Scene,
    settings::{Crop, PassRange, Settings},
    stats::{DeviceStats, PassStats, Stats},
};

use super::{
    args::RenderArgs,
    failures::Failures,
    pass_lines::{is_reached, line, outlook, verdict},
    progress::Display,
};

/// Advice where a run cannot go on with a file.
const ANEW: &str = "without the file, it is begun anew";

/// A picture of passes.
pub struct Picture {
    pub frame: Frame,
    pub attributes: Attributes,
    pub stats: Stats,
    /// Of a checkpoint or a part.
    pub failures: Failures,
}

/// Inputs of a run.
pub struct Inputs<'a> {
    pub gpu: &'a Gpu,
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub args: &'a RenderArgs,
    pub display: &'a Display,
    /// Writes the pictures.
    pub write: &'a dyn Fn(&Frame, &Attributes) -> Result<()>,
}

/// Finished work of a run.
struct Done {
    sum: PassSum,
    stats: Stats,
    /// Passes of this process.
    passes: u32,
}

/// Renders the passes that are left. A run with a checkpoint that is asked to end writes it first,
/// and its outputs as far as they are. A checkpoint or a part that cannot be written is among the
/// failures of the picture.
pub fn render(inputs: &Inputs) -> Result<Picture> {
    let started = Instant::now();
    let Inputs { args, settings, display, .. } = *inputs;
    let options = &args.passes;
    let range = options.range(settings);
    range.check(settings)?;
    check_region(inputs)?;
    let device = DeviceStats { name: inputs.gpu.name.clone(), driver: inputs.gpu.driver.clone() };
    let stats = Stats { device, ..Stats::default() };
    let mut done = Done { sum: PassSum::default(), stats, passes: 0 };
    let from = resume(inputs, range, &mut done)?;
    let ended = run(inputs, range, started, &mut done);
    display.finish();
    let mut failures = Failures::default();
    // What was read and got nothing new stays as it is.
    let is_new = |path: &Path| done.passes > 0 || from != Some(path);
    if let Some(path) = options.checkpoint.as_deref().filter(|_| !done.sum.blocks().is_empty()) {
        if failures.take(if is_new(path) { save(inputs, path, &done) } else { Ok(()) }) {
            display.note(&format!("checkpoint: {} is in {}", passes(&done.sum), path.display()));
        }
        if ended.is_err() {
            failures.take(write_pictures(inputs, &done));
        }
    }
    if let Err(error) = ended {
        if !matches!(error, Error::Stopped) {
            failures.take(Err(error));
        }
        return Err(failures.outcome().err().unwrap_or(Error::Stopped));
    }
    if let Some(target) = options.target_error {
        display.note(&verdict(target, estimate(inputs, &done)?.as_ref(), done.sum.range()));
    }
    if let Some(path) = options.part.as_deref().filter(|path| is_new(path))
        && failures.take(save(inputs, path, &done))
    {
        display.note(&format!("wrote {}", path.display()));
    }
    picture(inputs, &done, failures)
}

/// Renders passes until the end.
fn run(inputs: &Inputs, range: PassRange, started: Instant, done: &mut Done) -> Result<()> {
    let Inputs { gpu, scene, args, settings, display, .. } = *inputs;
    let options = &args.passes;
    let mut next = done.sum.range().map_or(range.first, |there| there.end);
    let stages = Stages { display, shown: AtomicBool::new(true) };
    let mut saved = Instant::now();
    let mut told = None;
    let mut error = estimate(inputs, done)?;
    if is_over(inputs, next, range, error.as_ref()) {
        return Ok(());
    }
    let groups = LightGroups::open(gpu, scene, settings, &stages)?;
    let progressive = groups.sessions().iter().map(|session| {
        session.prefetch(settings);
        Progressive::new(session, settings, options.settings())
    });
    let progressive = progressive.collect::<Result<Vec<_>>>()?;
    loop {
        let (film, stats) = groups.film(|group, _| progressive[group].render(next, &stages))?;
        stages.shown.store(false, Ordering::Relaxed);
        done.sum.push(PassBlock::of_pass(next, film, &stats))?;
        match done.passes {
            0 => done.stats = stats,
            passes => done.stats.add_pass(&stats, passes),
        }
        done.passes += 1;
        next += 1;
        error = estimate(inputs, done)?;
        let elapsed = started.elapsed();
        let each = elapsed / done.passes;
        let in_time = options.time.is_none_or(|time| elapsed + each <= time);
        let ends = !in_time || is_over(inputs, next, range, error.as_ref());
        // Without a number of passes, `range` only says how many there can be.
        let (count, wanted) = (options.count(), options.target_error);
        let (fraction, left) = outlook(options.time, count, next - range.first, elapsed, each);
        let tenth = (10.0 * fraction) as u32;
        let is_new = told.replace(tenth) != Some(tenth) || done.passes.is_power_of_two() || ends;
        let left = left.filter(|_| !ends);
        display.state(&line(next - range.first, count, wanted, error.as_ref(), left), fraction, is_new);
        if ends {
            return Ok(());
        }
        display.check()?;
        if let Some(path) = options.checkpoint.as_deref().filter(|_| saved.elapsed() >= options.every) {
            // The work goes on if the disk is full for a while; the last checkpoint must succeed.
            let written = [("checkpoint", save(inputs, path, done)), ("picture", write_pictures(inputs, done))];
            for (what, result) in written {
                result.unwrap_or_else(|problem| display.note(&format!("warning: no {what} now: {problem}")));
            }
            saved = Instant::now();
        }
    }
}

/// Whether nothing is left to do but for the time.
fn is_over(inputs: &Inputs, next: u32, range: PassRange, error: Option<&ErrorEstimate>) -> bool {
    let target = inputs.args.passes.target_error.zip(error);
    next >= range.end || target.is_some_and(|(target, error)| is_reached(target, error, next - range.first))
}

/// Estimated errors, if somebody wants to know.
fn estimate(inputs: &Inputs, done: &Done) -> Result<Option<ErrorEstimate>> {
    let options = &inputs.args.passes;
    if inputs.args.options.shared.quiet && options.target_error.is_none() {
        return Ok(None);
    }
    let total = done.sum.total()?;
    Ok(total.and_then(|total| ErrorEstimate::of(total.film(), options.region)))
}

/// Passes of a sum as words.
fn passes(sum: &PassSum) -> String {
    sum.range().map_or("none".to_owned(), |range| range.to_string())
}

fn check_region(inputs: &Inputs) -> Result<()> {
    let Some(region) = inputs.args.passes.region else { return Ok(()) };
    let size = size_of(inputs.scene, &inputs.settings.picture)?;
    let Crop { column, row, width, height } = region;
    let refuse =
        |problem| Err(Error::Setting { name: "--region", value: format!("{column},{row},{width},{height}"), problem });
    let is_inside = |first: u32, count: u32, whole: u32| u64::from(first) + u64::from(count) <= u64::from(whole);
    if !is_inside(column, width, size.0) || !is_inside(row, height, size.1) {
        return refuse(format!("must have pixels, all of them in the picture of {}x{}", size.0, size.1));
    }
    let window = inputs.settings.picture.window(size);
    if !region.touches((window.column, window.row), (window.width, window.height)) {
        return refuse("has no pixel of `picture.crop`".to_owned());
    }
    Ok(())
}

/// Attributes of the pictures and parts of the run.
fn attributes(inputs: &Inputs, stats: &Stats) -> Attributes {
    let mut attributes = inputs.scene.origin(inputs.settings, stats).attributes();
    attributes.insert("alpha".to_owned(), inputs.args.passes.alpha.to_string());
    attributes
}

/// Takes the passes of the checkpoint, or where there is none those of the part, if the run goes on
/// with them, and returns the file.
fn resume<'a>(inputs: &Inputs<'a>, range: PassRange, done: &mut Done) -> Result<Option<&'a Path>> {
    let options = &inputs.args.passes;
    let (checkpoint, part) = (options.checkpoint.as_deref(), options.part.as_deref());
    let of_checkpoint = checkpoint.filter(|path| path.exists()).map(|path| (path, "the checkpoint"));
    let of_part = part.filter(|path| options.resume && path.exists()).map(|path| (path, "a part"));
    let Some((path, what)) = of_checkpoint.or(of_part) else { return Ok(None) };
    let refuse = |problem: String| {
        let source = io::Error::new(io::ErrorKind::AlreadyExists, problem);
        Err(Error::Io { path: path.to_path_buf(), source })
    };
    if !options.resume {
        return refuse("is there already; --resume goes on with it".to_owned());
    }
    let (header, sum) = read_part(path).map_err(|error| match error {
        Error::Io { path, source } => {
            Error::Io { path, source: io::Error::new(source.kind(), format!("{source}; {ANEW}")) }
        }
        other => other,
    })?;
    let ours = attributes(inputs, &done.stats);
    let mut told = differences(&ours, &header.attributes);
    let theirs = |name: &str| header.attributes.get(name).map_or("unknown", String::as_str).to_owned();
    if header.passes == range {
        // All of the picture is theirs.
        done.stats.device = DeviceStats { name: theirs("device"), driver: theirs("driver") };
    } else {
        for name in ["device", "driver"].into_iter().filter(|name| theirs(name) != ours[*name]) {
            told.push(format!("the {name} was {}, and is {}", theirs(name), ours[name]));
        }
    }
    let size = size_of(inputs.scene, &inputs.settings.picture)?;
    if told.is_empty() && (header.whole, header.window) != (size, inputs.settings.picture.window(size)) {
        told.push("`picture.size` or `picture.crop` differs".to_owned());
    }
    if header.passes.first != range.first || header.passes.end > range.end {
        told.push(format!("it has the passes {}, and {range} are asked for", header.passes));
    }
    if !told.is_empty() {
        return refuse(format!("is {what} of another run: {}; {ANEW}", told.join(", ")));
    }
    inputs.display.note(&format!("goes on after the passes {} of {}", header.passes, path.display()));
    done.sum = sum;
    Ok(Some(path))
}

fn save(inputs: &Inputs, path: &Path, done: &Done) -> Result<()> {
    write_part(path, &done.sum, &attributes(inputs, &done.stats))
}

/// Writes the pictures so far.
fn write_pictures(inputs: &Inputs, done: &Done) -> Result<()> {
    let Picture { frame, attributes, .. } = picture(inputs, done, Failures::default())?;
    (inputs.write)(&frame, &attributes)
}

/// The picture so far.
fn picture(inputs: &Inputs, done: &Done, failures: Failures) -> Result<Picture> {
    let total = done.sum.total()?.ok_or_else(|| Error::Incomplete("no pass was rendered".to_owned()))?;
    let mut stats = done.stats.clone();
    (stats.photons.global, stats.photons.caustic) = (total.photons().global, total.photons().caustic);
    stats.extra_samples = total.film().extra_samples();
    let mut attributes = attributes(inputs, &stats);
    attributes.insert("passes".to_owned(), passes(&done.sum));
    let error = ErrorEstimate::of(total.film(), inputs.args.passes.region);
    stats.passes = done.sum.range().map(|range| PassStats {
        first: range.first,
        end: range.end,
        noise: error.map(|error| error.noise),
        bias: error.map(|error| error.bias),
    });
    Ok(Picture { frame: total.film().finish_with_errors(), attributes, stats, failures })
}

/// Shows the stages of the first pass; further ones are reported as wholes.
struct Stages<'a> {
    display: &'a Display,
    shown: AtomicBool,
}

impl Progress for Stages<'_> {
    fn report(&self, stage: Stage, done: u64, total: u64) {
        if self.shown.load(Ordering::Relaxed) {
            self.display.report(stage, done, total);
        }
    }

    fn stop_requested(&self) -> bool {
        self.display.stop_requested()
    }
}
