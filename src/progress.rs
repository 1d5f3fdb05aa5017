//! Progress reports and cancellation of long work.

use crate::error::{Error, Result};

/// Stage of the work, shown to the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Reading the scene.
    Load,
    /// Building the hierarchy and copying the scene to the device. Units are primitives, of a large
    /// scene.
    Bvh,
    /// Tracing photons. Units are photons stored, over all maps.
    Photons,
    /// Sorting photons into the grid.
    Grid,
    /// Estimates of irradiance where rays of final gathering will end. Units are camera samples
    /// of the small picture that shows where that is.
    Cells,
    /// Final gathering at spaced points. Units are rays; their total is estimated before.
    Records,
    /// Camera rays, direct light and gather. Units are camera samples.
    Camera,
    /// The camera pass of a comparison, which gathers each tile twice. Units as in
    /// [`Stage::Camera`].
    Compare,
}

/// Listener of a render. Its methods are called often and must return immediately.
pub trait Progress: Sync {
    /// Reports `done` of `total` units of `stage`; `total` may grow or shrink between calls.
    fn report(&self, stage: Stage, done: u64, total: u64);
    /// Whether the work should stop as soon as possible.
    fn stop_requested(&self) -> bool;

    /// Returns an error if a stop was requested.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    fn check(&self) -> Result<()> {
        if self.stop_requested() { Err(Error::Stopped) } else { Ok(()) }
    }
}

/// Listener that ignores all reports and never requests a stop.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _: Stage, _: u64, _: u64) {}
    fn stop_requested(&self) -> bool {
        false
    }
}
