//! Pictures: the film's frame, EXR and PNG files, tone mapping, difference measures.

#[cfg(feature = "report")]
mod canvas;
pub mod difference;
mod exr;
mod file;
pub mod flip;
mod png;
mod radiance;
mod tonemap;

#[cfg(feature = "report")]
pub use canvas::{Canvas, Rgb8};
pub use exr::{EnvironmentOrigin, Origin, read_exr, read_exr_attributes, write_exr};
pub use file::{check_output, close_files, write_file};
pub use png::{encode_png, write_png};
pub(crate) use radiance::{decode_radiance, read_radiance_bytes};
pub use tonemap::{Tonemap, srgb_encode};

use crate::settings::Crop;

/// Where a part of a picture lies in the whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaceInWhole {
    /// Width and height of the whole, pixels.
    pub whole: (u32, u32),
    /// Column of the upper left pixel of the part in the whole.
    pub column: u32,
    /// Row of that pixel.
    pub row: u32,
}

impl PlaceInWhole {
    /// `None` if the part is all.
    #[must_use]
    pub fn of(whole: (u32, u32), part: Crop) -> Option<Self> {
        ((part.width, part.height) != whole).then_some(Self { whole, column: part.column, row: part.row })
    }
}

/// A finished frame, scene-linear, row 0 at the top. All vectors have `width * height` elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Where the frame lies, if it is a part of a larger picture.
    pub place: Option<PlaceInWhole>,
    /// Radiance in W/(m² sr) per channel, linear Rec.709.
    pub radiance: Vec<[f32; 3]>,
    /// Fraction of the pixel's samples whose first ray hit something, 0 to 1.
    pub alpha: Vec<f32>,
    /// Distance of the first hit along the camera's axis, metres, mean over the samples that hit; 0 if none did.
    pub depth: Vec<f32>,
    /// Interpolated normal of the first hit in world space, mean over the samples that hit; 0 if none did.
    pub normal: Vec<[f32; 3]>,
    /// Colour of the first hit's material, mean over the samples that hit; 0 if none did.
    pub albedo: Vec<[f32; 3]>,
}

impl Frame {
    /// Number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}
