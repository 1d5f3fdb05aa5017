//! Progress of a render on stderr: a bar on a terminal, plain lines elsewhere.

use std::{
    io::IsTerminal,
    sync::{Mutex, MutexGuard, PoisonError},
    time::Instant,
};

use caustica::progress::{Progress, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::{outlook::Outlook, say::say, signals, values::words_of_seconds};

/// Ratio to the time that was told above which it is told anew.
const MUCH_LONGER: f64 = 1.5;

/// Destination of the progress reports.
#[derive(Debug)]
enum Target {
    Nowhere,
    /// Number of tenths last reported for each stage.
    Lines(Mutex<Vec<(Stage, u64)>>),
    /// The bar, and what it shows.
    Bar(ProgressBar, Mutex<Shown>),
}

/// What a bar shows.
#[derive(Debug, Default)]
struct Shown {
    stage: Option<Stage>,
    /// Line of [`Display::state`].
    state: Option<String>,
}

/// Listener that shows the progress of a render and passes stop signals to it.
#[derive(Debug)]
pub struct Display {
    target: Target,
    outlook: Mutex<Option<Expected>>,
}

/// What is expected of a picture.
#[derive(Debug)]
struct Expected {
    outlook: Outlook,
    began: Instant,
    /// The time of all of it that was told, seconds.
    told: Option<f64>,
}

impl Display {
    /// Creates the display. `quiet` shows nothing; `plain` writes lines even on a terminal.
    pub fn new(quiet: bool, plain: bool) -> Self {
        let target = if quiet {
            Target::Nowhere
        } else if plain || !std::io::stderr().is_terminal() {
            Target::Lines(Mutex::default())
        } else {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()).with_style(words());
            Target::Bar(bar, Mutex::default())
        };
        Self { target, outlook: Mutex::default() }
    }

    /// Tells the time of a picture that began then, as soon as it is known, and from there on what
    /// is left of it.
    pub fn expect(&self, outlook: Outlook, began: Instant) {
        *lock(&self.outlook) = Some(Expected { outlook, began, told: None });
    }

    /// The time that is left, in words; tells that of the whole once, and again if it turns out to
    /// be much longer.
    fn left(&self, stage: Stage, done: u64, total: u64) -> String {
        let mut outlook = lock(&self.outlook);
        let Some(Expected { outlook, began, told }) = &mut *outlook else { return String::new() };
        let now = began.elapsed().as_secs_f64();
        let Some(left) = outlook.left(stage, done, total, now) else { return String::new() };
        let all = now + left;
        if told.is_none_or(|told| all > MUCH_LONGER * told) {
            let more = if told.is_some() { ", more than expected" } else { "" };
            self.note(&format!("about {} in all{more}", words_of_seconds(all)));
            *told = Some(all);
        }
        if left < 0.5 { String::new() } else { format!(", {} left", words_of_seconds(left)) }
    }

    /// Prints a line unless quiet.
    pub fn note(&self, line: &str) {
        match &self.target {
            Target::Nowhere => {}
            Target::Lines(_) => say(line),
            Target::Bar(bar, _) => bar.suspend(|| say(line)),
        }
    }

    /// Shows the state of long work in one line. On a terminal it stands beside the bar; elsewhere
    /// it is printed only if it is `new`.
    pub fn state(&self, line: &str, done: f64, new: bool) {
        match &self.target {
            Target::Nowhere => {}
            Target::Lines(_) if new => say(line),
            Target::Lines(_) => {}
            Target::Bar(bar, shown) => {
                if lock(shown).state.replace(line.to_owned()).is_none() {
                    // The line is drawn without the bar, which is still that of a stage.
                    bar.set_style(words());
                }
                bar.set_message(line.to_owned());
                bar.set_style(state_style());
                bar.update(|state| {
                    state.set_len(1000);
                    state.set_pos((1000.0 * done) as u64);
                });
            }
        }
    }

    /// Removes the bar. The last state of long work stays as a line.
    pub fn finish(&self) {
        if let Target::Bar(bar, shown) = &self.target {
            bar.finish_and_clear();
            if let Some(line) = lock(shown).state.take() {
                say(&line);
            }
        }
    }
}

impl Progress for Display {
    fn report(&self, stage: Stage, done: u64, total: u64) {
        let left = self.left(stage, done, total);
        match &self.target {
            Target::Nowhere => {}
            Target::Lines(told) => {
                if let Some(line) = next_line(&mut lock(told), stage, done, total) {
                    say(&format!("{line}{left}"));
                }
            }
            Target::Bar(bar, shown) => {
                let is_new = lock(shown).stage.replace(stage) != Some(stage);
                let unit = unit(stage, total);
                if is_new || unit.is_none() {
                    // The bar is drawn without numbers until it has those of the stage.
                    bar.set_style(words());
                    bar.set_message(name(stage));
                }
                if is_new {
                    bar.reset();
                }
                bar.set_length(total);
                bar.set_position(done);
                if let Some(unit) = unit {
                    bar.set_style(style(unit, &left));
                }
            }
        }
    }

    fn stop_requested(&self) -> bool {
        signals::stop_requested()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether the stage is that of another scene or group of lights than those that were told.
fn begins_anew(told: &[(Stage, u64)], stage: Stage, done: u64) -> bool {
    let camera = told.iter().find(|(s, _)| *s == Stage::Camera);
    match stage {
        Stage::Load => true,
        Stage::Photons => camera.is_some(),
        // Light of rays alone has no photons.
        Stage::Camera => done == 0 && camera.is_some_and(|(_, tenths)| *tenths == 10),
        _ => false,
    }
}

/// Line to print now: one at the start of a stage, then one whenever a further tenth is done.
fn next_line(told: &mut Vec<(Stage, u64)>, stage: Stage, done: u64, total: u64) -> Option<String> {
    if begins_anew(told, stage, done) {
        told.clear();
    }
    let unit = unit(stage, total);
    let part = |units: u64| (u128::from(done.min(total)) * u128::from(units) / u128::from(total.max(1))) as u64;
    let tenth = part(10);
    match told.iter_mut().find(|(s, _)| *s == stage) {
        Some((_, last)) if tenth <= *last => return None,
        Some((_, last)) => *last = tenth,
        None => told.push((stage, tenth)),
    }
    let (name, percent) = (name(stage), part(100));
    Some(match unit {
        Some(unit) => format!("{name}: {percent} % of {total} {unit}"),
        None if total == 1 && is_counted(stage) => format!("{name}: {percent} %"),
        None => name.to_string(),
    })
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Load => "load",
        Stage::Bvh => "bvh",
        Stage::Photons => "photons",
        Stage::Grid => "grid",
        Stage::Cells => "irradiance cells",
        Stage::Records => "final gathering",
        Stage::Camera => "camera",
        Stage::Compare => "compare",
    }
}

/// Name of a stage's units; `None` if the stage is not counted, as that of the tree of few
/// primitives, or has fewer than two units.
fn unit(stage: Stage, total: u64) -> Option<&'static str> {
    let unit = match stage {
        Stage::Photons => "photons",
        Stage::Records => "rays",
        Stage::Bvh => "primitives",
        _ => "samples",
    };
    (total > 1 && (is_counted(stage) || stage == Stage::Bvh)).then_some(unit)
}

fn is_counted(stage: Stage) -> bool {
    matches!(stage, Stage::Photons | Stage::Cells | Stage::Records | Stage::Camera | Stage::Compare)
}

/// Style without numbers.
fn words() -> ProgressStyle {
    ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn style(unit: &str, left: &str) -> ProgressStyle {
    let template = format!("{{msg:8}} {{bar:32}} {{human_pos}} of {{human_len}} {unit}{left}");
    ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn state_style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:10} {wide_msg}").unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_few_whatever_the_number_of_reports() {
        let mut told = Vec::new();
        let lines: Vec<_> = (0..=5000).filter_map(|done| next_line(&mut told, Stage::Photons, done, 5000)).collect();
        assert_eq!(lines.len(), 11);
        assert_eq!(lines[0], "photons: 0 % of 5000 photons");
        assert_eq!(lines[10], "photons: 100 % of 5000 photons");
    }

    #[test]
    fn stages_that_alternate_or_go_back_are_not_told_again() {
        let mut told = Vec::new();
        let mut line = |stage, done| next_line(&mut told, stage, done, 100);
        assert_eq!(line(Stage::Grid, 0).as_deref(), Some("grid"));
        assert!(line(Stage::Camera, 50).is_some());
        assert!(line(Stage::Grid, 0).is_none());
        assert!(line(Stage::Camera, 20).is_none());
        assert!(line(Stage::Camera, 61).is_some());
    }

    #[test]
    fn scenes_and_groups_of_lights_are_told_anew() {
        let mut told = Vec::new();
        let mut line = |stage, done| next_line(&mut told, stage, done, 100).is_some();
        for stage in [Stage::Load, Stage::Bvh, Stage::Photons, Stage::Camera] {
            assert!(line(stage, 0), "{stage:?}");
        }
        assert!(line(Stage::Camera, 100));
        for scene_or_group in [[Stage::Load, Stage::Photons], [Stage::Photons, Stage::Grid]] {
            assert!(scene_or_group.iter().all(|stage| line(*stage, 0)), "{scene_or_group:?}");
            assert!(!line(Stage::Photons, 5), "control: the same photons");
            assert!(line(Stage::Camera, 0) && line(Stage::Camera, 100));
        }
        assert!(line(Stage::Camera, 0) && line(Stage::Camera, 50), "a group without photons");
    }

    #[test]
    fn what_is_one_or_none_is_not_counted() {
        let mut told = Vec::new();
        let mut line = |stage, done, total| next_line(&mut told, stage, done, total);
        assert_eq!(line(Stage::Camera, 0, 1).as_deref(), Some("camera: 0 %"));
        assert_eq!(line(Stage::Camera, 1, 1).as_deref(), Some("camera: 100 %"));
        assert_eq!(line(Stage::Photons, 0, 0).as_deref(), Some("photons"));
        assert_eq!(next_line(&mut Vec::new(), Stage::Camera, 0, 2).as_deref(), Some("camera: 0 % of 2 samples"));
    }

    #[test]
    fn an_unknown_total_is_no_error() {
        assert_eq!(next_line(&mut Vec::new(), Stage::Camera, 3, 0).as_deref(), Some("camera"));
        assert!(next_line(&mut Vec::new(), Stage::Camera, 9, 4).is_some_and(|l| l.contains("100 %")));
    }
}
