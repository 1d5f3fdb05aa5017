//! Comparison of the grid on the device with the kd-tree on the CPU: both gather every visible
//! point from the same photons.
//!
//! Both sides get the same photons, visible points and settings in the same single precision. They
//! may differ in what rounding decides: where the last photon of an estimate and the next one are
//! tied (their squared distances differ by at most [`TIE`]), either may be summed. Such queries are
//! counted, may differ in tied photons only, and do not enter the differences of radius and
//! radiance. Both make the report's raw estimate, whatever
//! [`crate::settings::EstimateSettings::raw`] says.

mod comparison;
mod measure;
mod page;
mod pictures;
mod report;
mod sides;
mod write;

pub use comparison::{Comparison, Options, TOLERANCE, compare};
pub use report::{GridSide, KdTreeSide, Neighbors, RelativeDifference, Report, Row};
pub use write::FILES;

pub use crate::reference::TIE;
