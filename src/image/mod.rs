//! Pictures: film and frame, EXR and PNG files, tone mapping, error metrics.

mod bias_check;
#[cfg(feature = "report")]
mod canvas;
mod convergence;
pub(crate) mod cryptomatte;
pub mod difference;
mod exposure;
mod exr;
mod exr_read;
mod file;
pub mod film;
mod film_sums;
pub mod flip;
mod frame;
pub mod layers;
mod merge;
mod moments;
mod orientation;
mod part;
mod part_identity;
mod pass_sum;
mod png;
mod primaries;
mod radiance;
mod tonemap;
mod weights;

#[cfg(feature = "report")]
pub use canvas::{Canvas, Rgb8};
pub use convergence::ErrorEstimate;
pub use exposure::auto_exposure;
pub use exr::{Attributes, EnvironmentProvenance, Provenance, write_exr, write_exr_with};
pub use exr_read::{read_exr, read_exr_attributes};
pub use file::{check_output, close_files, write_file};
pub use film::Film;
pub use frame::{DataWindow, Frame};
pub use merge::{Missing, Survey, WindowParts, merge, survey};
pub use part::{PartHeader, read_part, read_part_header, write_part};
pub use part_identity::differences;
pub use pass_sum::{Fold, PassBlock, PassSum};
pub use png::{encode_png, write_png};
pub(crate) use radiance::{decode_radiance, read_radiance_bytes};
pub use tonemap::{Tonemap, srgb_decode, srgb_encode};
