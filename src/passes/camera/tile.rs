//! Tiles: parts of a picture's samples, and counts of one step over a tile.

use crate::layout::{Counters, LOST_SCALE};

/// A part of the picture's samples.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// Pixels, a power of 2, in Morton order; some of them may lie outside the picture.
    pub pixels: u32,
    /// Pixel of the upper left corner.
    pub first_column: u32,
    pub first_row: u32,
    pub first_sample: u32,
    /// Samples of each pixel.
    pub samples: u32,
}

/// Counts of one step, for the statistics.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepCount {
    pub rays: u64,
    pub media_overflows: u64,
    pub unfinished: u64,
    pub non_finite: u64,
    /// Weight of the camera paths that the chain limit ended, in paths.
    pub lost: f64,
}

impl std::ops::AddAssign for StepCount {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.media_overflows += other.media_overflows;
        self.unfinished += other.unfinished;
        self.non_finite += other.non_finite;
        self.lost += other.lost;
    }
}

impl From<Counters> for StepCount {
    fn from(counters: Counters) -> Self {
        Self {
            rays: counters.all_rays(),
            media_overflows: u64::from(counters.media_overflows),
            unfinished: u64::from(counters.unfinished),
            non_finite: u64::from(counters.non_finite),
            lost: counters.all_lost() as f64 / f64::from(LOST_SCALE),
        }
    }
}
