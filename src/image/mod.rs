//! Pictures: film and frame, EXR and PNG files, tone mapping, error metrics.

#[cfg(feature = "report")]
mod canvas;
pub mod difference;
mod exr;
mod file;
pub mod film;
pub mod flip;
mod frame;
pub mod layers;
mod orientation;
mod png;
mod radiance;
mod tonemap;

#[cfg(feature = "report")]
pub use canvas::{Canvas, Rgb8};
pub use exr::{EnvironmentProvenance, Provenance, read_exr, read_exr_attributes, write_exr};
pub use file::{check_output, close_files, write_file};
pub use film::Film;
pub use frame::{DataWindow, Frame};
pub use png::{encode_png, write_png};
pub(crate) use radiance::{decode_radiance, read_radiance_bytes};
pub use tonemap::{Tonemap, srgb_decode, srgb_encode};
