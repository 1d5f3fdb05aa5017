//! `caustica render` in passes: until their end, a time or an error; with checkpoints.

use std::{
    io,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

use caustica::{
    Error, Result,
    gpu::Gpu,
    image::{Attributes, ErrorEstimate, Frame, PassBlock, PassSum, differences, read_part, write_part},
    progress::{Progress, Stage},
    renderer::{LightGroups, Progressive, size_of},
    scene::Scene,
    settings::{PassRange, Settings},
    stats::{DeviceStats, PassStats, Stats},
};

use super::{args::RenderArgs, progress::Display, values::words_of_seconds};

/// Passes from which on their spread is trusted to end a run.
const LEAST_PASSES: u32 = 4;

/// A picture of passes.
pub struct Picture {
    pub frame: Frame,
    pub attributes: Attributes,
    pub stats: Stats,
}

/// Inputs of a run.
pub struct Inputs<'a> {
    pub gpu: &'a Gpu,
    pub scene: &'a Scene,
    pub settings: &'a Settings,
    pub args: &'a RenderArgs,
    pub display: &'a Display,
    /// Writes the outputs.
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
/// and its outputs as far as they are.
pub fn render(inputs: &Inputs) -> Result<Picture> {
    let started = Instant::now();
    let Inputs { args, settings, display, .. } = *inputs;
    let options = &args.passes;
    let range = options.range(settings);
    range.check(settings)?;
    check_region(inputs)?;
    let device = DeviceStats { name: inputs.gpu.name.clone(), driver: inputs.gpu.driver.clone() };
    let stats = Stats { device, ..Stats::default() };
    let mut done = Done { sum: resumed(inputs, range, &attributes(inputs, &stats))?, stats, passes: 0 };
    let ended = run(inputs, range, started, &mut done);
    display.finish();
    if let Some(path) = options.checkpoint.as_deref().filter(|_| !done.sum.blocks().is_empty()) {
        save(inputs, path, &done)?;
        if ended.is_err() {
            let picture = picture(inputs, &done)?;
            (inputs.write)(&picture.frame, &picture.attributes)?;
        }
        display.note(&format!("checkpoint: {} is in {}", passes(&done.sum), path.display()));
    }
    ended?;
    if let Some(path) = &options.part {
        write_part(path, &done.sum, &attributes(inputs, &done.stats))?;
        display.note(&format!("wrote {}", path.display()));
    }
    picture(inputs, &done)
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
        let (fraction, left) = outlook(options.time, range, next, elapsed, each);
        let tenth = (10.0 * fraction) as u32;
        let is_new = told.replace(tenth) != Some(tenth) || done.passes.is_power_of_two();
        display.state(&line(next, range, options.time.is_none(), error.as_ref(), left), fraction, is_new);
        let in_time = options.time.is_none_or(|time| elapsed + each <= time);
        if !in_time || is_over(inputs, next, range, error.as_ref()) {
            return Ok(());
        }
        display.check()?;
        if let Some(path) = options.checkpoint.as_deref().filter(|_| saved.elapsed() >= options.every) {
            // The work goes on if the disk is full for a while; the last checkpoint must succeed.
            let kept = save(inputs, path, done).and_then(|()| {
                let picture = picture(inputs, done)?;
                (inputs.write)(&picture.frame, &picture.attributes)
            });
            kept.unwrap_or_else(|problem| display.note(&format!("warning: no checkpoint now: {problem}")));
            saved = Instant::now();
        }
    }
}

/// Whether nothing is left to do but for the time.
fn is_over(inputs: &Inputs, next: u32, range: PassRange, error: Option<&ErrorEstimate>) -> bool {
    let target = inputs.args.passes.target_error.filter(|_| next >= range.first.saturating_add(LEAST_PASSES));
    next >= range.end || target.is_some_and(|target| error.is_some_and(|error| error.total() <= target))
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

/// Fraction of the run that is done, and seconds left.
fn outlook(time: Option<Duration>, range: PassRange, next: u32, elapsed: Duration, each: Duration) -> (f64, f64) {
    let of_passes = f64::from(next - range.first) / f64::from(range.count());
    let passes_left = each.as_secs_f64() * f64::from(range.end - next);
    let Some(time) = time else { return (of_passes, passes_left) };
    let of_time = elapsed.as_secs_f64() / time.as_secs_f64().max(f64::MIN_POSITIVE);
    let time_left = time.saturating_sub(elapsed).as_secs_f64();
    (of_passes.max(of_time).min(1.0), passes_left.min(time_left))
}

/// State of a run in one line. The passes of a run without an end are counted without it.
fn line(next: u32, range: PassRange, has_no_time: bool, error: Option<&ErrorEstimate>, left: f64) -> String {
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    let error = error.map_or(String::new(), |error| {
        let (total, noise, bias) = (percent(error.total()), percent(error.noise), percent(error.bias));
        format!("; estimated error {total} (noise {noise}, bias {bias})")
    });
    let done = next - range.first;
    let ends = range.end < PassRange::END.most();
    let of = if ends { format!(" of {}", range.count()) } else { String::new() };
    let left = if (ends || !has_no_time) && left >= 0.5 {
        format!("; {} left", words_of_seconds(left))
    } else {
        String::new()
    };
    format!("passes: {done}{of}{error}{left}")
}

/// Passes of a sum as words.
fn passes(sum: &PassSum) -> String {
    sum.range().map_or("none".to_owned(), |range| range.to_string())
}

fn check_region(inputs: &Inputs) -> Result<()> {
    let Some(region) = inputs.args.passes.region else { return Ok(()) };
    let size = size_of(inputs.scene, &inputs.settings.picture)?;
    let window = inputs.settings.picture.window(size);
    if region.touches((window.column, window.row), (window.width, window.height)) {
        return Ok(());
    }
    let value = format!("{},{},{},{}", region.column, region.row, region.width, region.height);
    let problem = format!("has no pixel of the picture of {}x{}, or of its crop", size.0, size.1);
    Err(Error::Setting { name: "--region", value, problem })
}

/// Attributes of the pictures and parts of the run.
fn attributes(inputs: &Inputs, stats: &Stats) -> Attributes {
    let mut attributes = inputs.scene.origin(inputs.settings, stats).attributes();
    attributes.insert("alpha".to_owned(), inputs.args.passes.alpha.to_string());
    attributes
}

/// The passes of the checkpoint, if the run goes on with one; none otherwise.
fn resumed(inputs: &Inputs, range: PassRange, ours: &Attributes) -> Result<PassSum> {
    let options = &inputs.args.passes;
    let Some(path) = options.checkpoint.as_deref().filter(|path| path.exists()) else { return Ok(PassSum::default()) };
    let refuse = |problem: String| {
        let source = io::Error::new(io::ErrorKind::AlreadyExists, problem);
        Err(Error::Io { path: path.to_path_buf(), source })
    };
    if !options.resume {
        return refuse("is there already; --resume goes on with it".to_owned());
    }
    let (header, sum) = read_part(path)?;
    let mut told = differences(ours, &header.attributes);
    for name in ["device", "driver"] {
        let (here, there) = (&ours[name], header.attributes.get(name));
        if there != Some(here) {
            told.push(format!("the {name} was {}, and is {here}", there.map_or("unknown", String::as_str)));
        }
    }
    let size = size_of(inputs.scene, &inputs.settings.picture)?;
    if (header.whole, header.window) != (size, inputs.settings.picture.window(size)) {
        told.push("`picture.size` or `picture.crop` are others".to_owned());
    }
    if header.passes.first != range.first || header.passes.end > range.end {
        told.push(format!("it has the passes {}, and {range} are asked for", header.passes));
    }
    if !told.is_empty() {
        return refuse(format!("is the checkpoint of another run: {}", told.join(", ")));
    }
    inputs.display.note(&format!("goes on after the passes {} of {}", header.passes, path.display()));
    Ok(sum)
}

fn save(inputs: &Inputs, path: &Path, done: &Done) -> Result<()> {
    write_part(path, &done.sum, &attributes(inputs, &done.stats))
}

/// The picture so far.
fn picture(inputs: &Inputs, done: &Done) -> Result<Picture> {
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
    Ok(Picture { frame: total.film().finish_with_errors(), attributes, stats })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_passes_error_and_time() {
        let error = ErrorEstimate { noise: 0.03, bias: 0.04 };
        let range = PassRange { first: 3, end: 11 };
        let expected = "passes: 2 of 8; estimated error 5.00 % (noise 3.00 %, bias 4.00 %); 12 s left";
        assert_eq!(line(5, range, true, Some(&error), 12.0), expected);
        let endless = PassRange { first: 0, end: PassRange::END.most() };
        assert_eq!(line(5, endless, true, None, 1e9), "passes: 5");
        assert_eq!(line(5, endless, false, None, 8.0), "passes: 5; 8 s left");
    }

    #[test]
    fn time_left_is_that_of_the_earlier_end() {
        let range = PassRange { first: 0, end: 10 };
        let at = |time| outlook(time, range, 5, Duration::from_secs(10), Duration::from_secs(2));
        assert_eq!(at(None), (0.5, 10.0));
        assert_eq!(at(Some(Duration::from_secs(12))), (10.0 / 12.0, 2.0));
        assert_eq!(at(Some(Duration::from_secs(100))), (0.5, 10.0));
    }
}
