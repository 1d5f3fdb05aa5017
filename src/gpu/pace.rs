//! Amount of work that is handed to the device at once. Operating systems end work that keeps a GPU
//! for too long, after about two seconds, and take the device away from the process; software has
//! no such watchdog.
//!
//! Each kernel's cost per invocation is measured on the device. A dispatch that would take longer
//! than [`MAX_PER_DISPATCH`] is cut into chunks, and a submission is closed before it takes longer
//! than [`MAX_PER_SUBMISSION`]. Nothing that reaches the picture depends on the cuts: an
//! invocation knows its number, never its chunk.

use std::{
    collections::{BTreeMap, HashMap},
    mem,
    sync::{Mutex, PoisonError},
    time::Duration,
};

/// Ways to cut dispatches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pacing {
    /// Not at all: for software.
    Whole,
    /// By measured time; in chunks of equal size where the device has no clock.
    Measured,
    /// Into chunks of that many invocations, for tests.
    Chunks(u32),
}

/// The longest that a dispatch should take: a quarter of the 100 ms that it may, for the next can
/// be four times as costly.
pub const MAX_PER_DISPATCH: Duration = Duration::from_millis(25);
/// The longest that a submission should take.
const MAX_PER_SUBMISSION: Duration = Duration::from_millis(100);
/// Invocations of a chunk at least: fewer would not fill a GPU, nor end much sooner.
pub(super) const MIN_CHUNK: u64 = 4096;
/// Invocations of a chunk of a kernel that was never measured.
pub(super) const UNMEASURED: u64 = 1 << 14;
/// Minimum invocations of a chunk that measures the cost: fewer measure latency.
pub(super) const MIN_TIMED: u64 = MIN_CHUNK / 2;
/// Factor on a cost that later measures fall below. Slow, for a queue of paths that dries up
/// measures less and less.
const DECAY: f64 = 0.98;

/// The next piece of a dispatch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chunk {
    pub invocations: u64,
    /// Seconds that it is likely to take; `None`: nobody knows.
    pub seconds: Option<f64>,
}

/// Costs of the kernels of a device.
#[derive(Debug)]
pub(super) struct Pace {
    pub pacing: Pacing,
    /// Seconds per invocation, by stem.
    costs: Mutex<HashMap<&'static str, f64>>,
    /// Seconds in all, by stem.
    seconds: Mutex<BTreeMap<String, f64>>,
}

impl Pace {
    pub fn new(pacing: Pacing) -> Self {
        Self { pacing, costs: Mutex::default(), seconds: Mutex::default() }
    }

    /// The next chunk of a dispatch of which `left` invocations are left. Chunks but the last are
    /// multiples of a workgroup.
    pub fn chunk(&self, stem: &str, left: u64) -> Chunk {
        let most = match self.pacing {
            Pacing::Whole => return Chunk { invocations: left, seconds: Some(0.0) },
            Pacing::Chunks(n) => {
                return Chunk { invocations: left.min(workgroups_of(n.into())), seconds: Some(f64::INFINITY) };
            }
            Pacing::Measured => self.cost(stem).map(|cost| (MAX_PER_DISPATCH.as_secs_f64() / cost) as u64),
        };
        let chunk = most.unwrap_or(UNMEASURED).max(MIN_CHUNK);
        // Equal chunks, so that none is a short rest.
        let chunks = left.div_ceil(chunk).max(1);
        let invocations = left.min(workgroups_of(left.div_ceil(chunks)));
        Chunk { invocations, seconds: self.cost(stem).map(|cost| cost * invocations as f64) }
    }

    /// Whether a submission of that length has room for the chunk.
    pub fn fits(&self, seconds: f64, chunk: &Chunk) -> bool {
        seconds == 0.0 || seconds + chunk.seconds.unwrap_or(f64::INFINITY) <= MAX_PER_SUBMISSION.as_secs_f64()
    }

    /// Takes note of what a chunk took.
    pub fn measured(&self, stem: &'static str, invocations: u64, seconds: f64) {
        let mut all = self.seconds.lock().unwrap_or_else(PoisonError::into_inner);
        *all.entry(stem.to_string()).or_default() += seconds;
        drop(all);
        if invocations < MIN_TIMED {
            return;
        }
        let cost = (seconds / invocations as f64).max(1e-15);
        let mut costs = self.costs.lock().unwrap_or_else(PoisonError::into_inner);
        costs.entry(stem).and_modify(|old| *old = cost.max(DECAY * *old)).or_insert(cost);
    }

    /// Seconds of all chunks measured since this was last asked, by stem.
    pub fn take_seconds(&self) -> BTreeMap<String, f64> {
        mem::take(&mut self.seconds.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Seconds per invocation, if it was measured.
    pub fn cost(&self, stem: &str) -> Option<f64> {
        self.costs.lock().unwrap_or_else(PoisonError::into_inner).get(stem).copied()
    }
}

fn workgroups_of(invocations: u64) -> u64 {
    invocations.max(1).next_multiple_of(crate::layout::WORKGROUP_SIZE.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes of the chunks of a dispatch, each of which takes that many seconds an invocation.
    fn chunks(pace: &Pace, mut left: u64, cost: f64) -> Vec<u64> {
        let mut sizes = Vec::new();
        while left > 0 {
            let chunk = pace.chunk("kernel", left);
            left -= chunk.invocations;
            pace.measured("kernel", chunk.invocations, cost * chunk.invocations as f64);
            sizes.push(chunk.invocations);
        }
        sizes
    }

    #[test]
    fn parts_last_as_long_as_they_may() {
        let pace = Pace::new(Pacing::Measured);
        // The first chunk measures.
        assert_eq!(chunks(&pace, 1 << 19, 1e-7), [16_384, 169_344, 169_280, 169_280]);
        assert_eq!(chunks(&pace, 1 << 17, 1e-7), [131_072]);
        // A kernel that turns costly is cut at its next dispatch; the floor bounds how far.
        assert_eq!(chunks(&pace, 1 << 17, 1e-6), [131_072]);
        assert!(chunks(&pace, 1 << 17, 1e-6).iter().all(|&n| (16_384..=25_024).contains(&n)));
        assert!(chunks(&pace, 1 << 17, 1.0)[1..].iter().all(|n| (4032..=4096).contains(n)));
        // Seconds that fall are believed little by little.
        assert_eq!(chunks(&pace, 1 << 12, 1e-9), [4096]);
        assert_eq!(pace.chunk("kernel", 1 << 17).invocations, MIN_CHUNK);
        for _ in 0..2000 {
            pace.measured("kernel", MIN_CHUNK, 0.0);
        }
        assert_eq!(pace.chunk("kernel", 1 << 17).invocations, 1 << 17);
    }

    #[test]
    fn submissions_end_before_they_are_too_long() {
        let pace = Pace::new(Pacing::Measured);
        let chunk = |seconds| Chunk { invocations: 64, seconds };
        assert!(pace.fits(0.0, &chunk(None)) && pace.fits(0.0, &chunk(Some(9.0))), "an empty one takes anything");
        assert!(pace.fits(0.05, &chunk(Some(0.025))) && !pace.fits(0.09, &chunk(Some(0.025))));
        assert!(!pace.fits(0.001, &chunk(None)), "who knows");
    }

    #[test]
    fn software_gets_all_at_once_and_tests_what_they_ask_for() {
        let whole = Pace::new(Pacing::Whole);
        assert_eq!(chunks(&whole, 1 << 30, 1.0), [1 << 30]);
        assert_eq!(whole.chunk("kernel", 1).seconds, Some(0.0), "no submission is ever full");
        assert_eq!(chunks(&Pace::new(Pacing::Chunks(100)), 300, 1.0), [128, 128, 44]);
    }
}
