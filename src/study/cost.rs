//! Progress of a study and estimate of the remaining time.

use std::{
    fmt,
    sync::{Mutex, PoisonError},
    time::Instant,
};

use crate::{
    progress::{Progress, Stage},
    settings::Settings,
};

/// Progress of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The current render in words, such as `diffuse.gltf, hybrid, n = 10k, k = 50`.
    pub cell: String,
    /// One-based number of the current cell among those to render.
    pub number: usize,
    /// Number of cells to render.
    pub total: usize,
    /// Number of cells found on the disk.
    pub kept: usize,
    /// Completed fraction of the work, 0 to 1.
    pub done: f64,
    /// Estimate; `None` until there is one.
    pub seconds_left: Option<f64>,
}

/// Observer of a study. Its methods are called often and must return at once.
pub trait Watch: Sync {
    /// Receives the current progress.
    fn report(&self, state: &State);
    /// Whether the study should stop as soon as possible; finished cells are kept.
    fn stop_requested(&self) -> bool;
}

impl Watch for crate::progress::Silent {
    fn report(&self, _: &State) {}
    fn stop_requested(&self) -> bool {
        false
    }
}

/// Work of a cell in arbitrary units, from samples times neighbours and from photons. Only ratios
/// matter.
pub(super) fn work(settings: &Settings) -> f64 {
    let (width, height) = settings.picture.size.unwrap_or((512, 512));
    let samples = f64::from(width) * f64::from(height) * f64::from(settings.picture.spp);
    let gather =
        if settings.photons.mode.traces_photons() { 30.0 + f64::from(settings.estimate.neighbors) } else { 0.0 };
    // Records at spaced points, or rays that the samples of a pixel share.
    let spacing = f64::from(settings.estimate.gather_spacing.max(1)).powi(2);
    let gather = gather + f64::from(settings.photons.final_gather) / spacing;
    1e5 + samples * (10.0 + gather) + f64::from(settings.photons.global)
}

/// Maps the progress of successive renders to the progress of the study.
pub(super) struct Meter<'a> {
    watch: &'a dyn Watch,
    started: Instant,
    total_work: f64,
    state: Mutex<(State, Work)>,
}

/// Work in the units of [`work`].
#[derive(Clone, Copy, Default)]
struct Work {
    finished: f64,
    current: f64,
}

impl<'a> Meter<'a> {
    pub fn new(watch: &'a dyn Watch, total: usize, kept: usize, total_work: f64) -> Self {
        let state = State { cell: String::new(), number: 0, total, kept, done: 0.0, seconds_left: None };
        Self { watch, started: Instant::now(), total_work, state: Mutex::new((state, Work::default())) }
    }

    /// Marks the beginning of a cell.
    pub fn begin(&self, cell: String, settings: &Settings) {
        self.update(|state, work_done| {
            state.cell = cell;
            state.number += 1;
            work_done.current = work(settings);
            0.0
        });
    }

    /// Marks the end of a cell, finished or failed.
    pub fn end(&self) {
        self.update(|_, work_done| {
            work_done.finished += work_done.current;
            work_done.current = 0.0;
            0.0
        });
    }

    /// Applies `change`, which returns the completed fraction of the current cell.
    fn update(&self, change: impl FnOnce(&mut State, &mut Work) -> f64) {
        let mut guard = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (state, work_done) = &mut *guard;
        let part = change(state, work_done);
        state.done = ((work_done.finished + part * work_done.current) / self.total_work.max(1.0)).min(1.0);
        let elapsed = self.started.elapsed().as_secs_f64();
        state.seconds_left = (state.done > 0.0).then(|| elapsed * (1.0 - state.done) / state.done);
        self.watch.report(state);
    }
}

impl Progress for Meter<'_> {
    fn report(&self, stage: Stage, done: u64, total: u64) {
        if stage == Stage::Camera && total > 0 {
            self.update(|_, _| done as f64 / total as f64);
        }
    }

    fn stop_requested(&self) -> bool {
        self.watch.stop_requested()
    }
}

impl fmt::Debug for Meter<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Meter").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Last(Mutex<Option<State>>);

    impl Watch for Last {
        fn report(&self, state: &State) {
            *self.0.lock().unwrap() = Some(state.clone());
        }
        fn stop_requested(&self) -> bool {
            false
        }
    }

    #[test]
    fn progress_runs_over_all_cells_in_proportion_to_their_work() {
        let last = Last(Mutex::default());
        let settings = |neighbors| {
            Settings::default().with(|s| {
                s.estimate.neighbors = neighbors;
                s.picture.size = Some((100, 100));
            })
        };
        let (small, large) = (settings(1), settings(1000));
        let meter = Meter::new(&last, 2, 3, work(&small) + work(&large));
        let seen = || last.0.lock().unwrap().clone().expect("it was told");
        meter.begin("a".to_string(), &small);
        assert_eq!((seen().number, seen().kept, seen().done, seen().seconds_left), (1, 3, 0.0, None));
        meter.end();
        let after_small = seen().done;
        assert!(after_small > 0.0 && after_small < 0.2 && seen().seconds_left.is_some());
        meter.begin("b".to_string(), &large);
        Progress::report(&meter, Stage::Camera, 1, 2);
        assert!((seen().done - (after_small + 1.0) / 2.0).abs() < 1e-9 && seen().number == 2);
        meter.end();
        assert!((seen().done - 1.0).abs() < 1e-9);
    }
}
