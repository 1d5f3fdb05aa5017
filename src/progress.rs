//! How long work tells how far it is, and learns that it should stop.

use crate::error::{Error, Result};

/// What is being done; shown to the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Reading the scene.
    Load,
    /// Building the hierarchy and copying the scene to the device.
    Bvh,
    /// Counted in photons stored, of all maps.
    Photons,
    /// Sorting photons into the grid.
    Grid,
    /// Counted in tiles of camera samples: camera rays, direct light and gather.
    Camera,
    /// Counted in tiles, as [`Stage::Camera`], each gathered twice.
    Compare,
}

/// Listener of a render. Its methods are called often and must return at once.
pub trait Progress: Sync {
    /// `done` of `total` units of `stage`; `total` may grow or shrink between calls.
    fn report(&self, stage: Stage, done: u64, total: u64);
    /// The work should end as soon as it can.
    fn stop_requested(&self) -> bool;

    /// [`Error::Stopped`] if the work should end.
    ///
    /// # Errors
    /// Only that.
    fn check(&self) -> Result<()> {
        if self.stop_requested() { Err(Error::Stopped) } else { Ok(()) }
    }
}

/// Says nothing and never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _: Stage, _: u64, _: u64) {}
    fn stop_requested(&self) -> bool {
        false
    }
}
