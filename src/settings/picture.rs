//! Settings of a picture: its pixels, the camera, samples of each pixel and of its direct light.

use serde::{Deserialize, Serialize};

use super::{
    layers::ExtraLayers,
    range::{Range, fail},
};
use crate::{error::Result, pixel_filter::PixelFilter};

/// Rectangular part of a picture, in pixels of the whole picture from its upper left corner. It has
/// at least one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crop {
    /// Column of the upper left pixel, from 0.
    pub column: u32,
    /// Row of the upper left pixel, from 0 at the top.
    pub row: u32,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
}

impl Crop {
    /// Whether a rectangle of the whole picture has pixels of this part.
    #[must_use]
    pub fn touches(&self, (column, row): (u32, u32), (width, height): (u32, u32)) -> bool {
        let overlap = |a: u32, a_size: u32, b: u32, b_size: u32| a < b + b_size && b < a + a_size;
        overlap(self.column, self.width, column, width) && overlap(self.row, self.height, row, height)
    }
}

/// Settings of one picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PictureSettings {
    /// Width and height in pixels, each in [`Self::SIDE`]; `None`: 512 high, with the camera's
    /// aspect ratio.
    pub size: Option<(u32, u32)>,
    /// The part of the picture that is rendered; `None`: all.
    pub crop: Option<Crop>,
    /// Name or index of the camera in the file; `None`: the first.
    pub camera: Option<String>,
    /// Camera samples per pixel, in [`Self::SPP`]. Many light samples or rays of final gathering
    /// lower the maximum: see [`super::Settings::check`].
    pub spp: u32,
    /// Maximum number of samples of a pixel whose neighbours are uneven: edges, penumbrae. Samples
    /// double from [`Self::spp`] on as long as they are no more. `None`: every pixel has
    /// [`Self::spp`]. Without an effect beyond [`Self::MOST_EVEN`] samples, or below two.
    pub max_spp: Option<u32>,
    /// Filter that weighs the light around a pixel's centre.
    pub pixel_filter: PixelFilter,
    /// Diameter of the lens, metres, in [`Self::APERTURE`]; 0: a pinhole camera, everything is in
    /// focus.
    pub aperture: f32,
    /// Distance of the plane of focus along the camera's axis, metres, in [`Self::FOCUS`]. Has an
    /// effect only with an aperture, which requires it.
    pub focus: Option<f32>,
    /// Samples of the direct light of emissive surfaces, the environment and more than 16 punctual
    /// lights per visible point, in [`Self::LIGHT_SAMPLES`].
    pub light_samples: u32,
    /// Further layers of the picture.
    pub layers: Vec<ExtraLayers>,
}

impl Default for PictureSettings {
    fn default() -> Self {
        Self {
            size: None,
            crop: None,
            camera: None,
            spp: 4,
            max_spp: None,
            pixel_filter: PixelFilter::Box,
            aperture: 0.0,
            focus: None,
            light_samples: 4,
            layers: Vec::new(),
        }
    }
}

impl PictureSettings {
    /// Range of the width and of the height, pixels.
    pub const SIDE: Range<u32> = Range::closed(1, 65_535);
    /// Range of [`Self::spp`].
    pub const SPP: Range<u32> = Range::at_least(1);
    /// Samples of every pixel beyond which none has more.
    pub const MOST_EVEN: u32 = 256;
    /// Maximum of [`Self::doublings`].
    pub const MOST_DOUBLINGS: u32 = 8;
    /// Range of [`Self::aperture`], metres.
    pub const APERTURE: Range<f32> = Range::at_least(0.0);
    /// Range of [`Self::focus`], metres.
    pub const FOCUS: Range<f32> = Range::above(0.0, 1e18);
    /// Range of [`Self::light_samples`].
    pub const LIGHT_SAMPLES: Range<u32> = Range::closed(1, 4096);

    /// Part that is rendered of a picture of the given size.
    #[must_use]
    pub fn window(&self, (width, height): (u32, u32)) -> Crop {
        self.crop.unwrap_or(Crop { column: 0, row: 0, width, height })
    }

    /// Number of times that the samples of a pixel double at most, where its neighbours are uneven.
    #[must_use]
    pub fn doublings(&self) -> u32 {
        let can_tell = (2..=Self::MOST_EVEN).contains(&self.spp);
        self.max_spp.filter(|_| can_tell).map_or(0, |most| (most / self.spp).max(1).ilog2()).min(Self::MOST_DOUBLINGS)
    }

    /// Samples that a pixel has at most besides those of every pixel.
    #[must_use]
    pub fn extra_samples(&self) -> u32 {
        (self.spp << self.doublings()) - self.spp
    }

    /// Inverse CDF of the pixel filter, see [`PixelFilter::offsets`]. A single sample with the box
    /// filter lies at the pixel's centre.
    #[must_use]
    pub fn pixel_filter_offsets(&self) -> Vec<f32> {
        if self.spp == 1 && self.pixel_filter == PixelFilter::Box { vec![0.0; 2] } else { self.pixel_filter.offsets() }
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        Self::SPP.check("picture.spp", self.spp)?;
        self.max_spp.map_or(Ok(()), |most| Self::SPP.check("picture.max_spp", most))?;
        Self::LIGHT_SAMPLES.check("picture.light_samples", self.light_samples)?;
        Self::APERTURE.check("picture.aperture", self.aperture)?;
        match self.focus {
            None if self.aperture > 0.0 => fail("picture.aperture", self.aperture.to_string(), "needs a focus"),
            Some(focus) => Self::FOCUS.check("picture.focus", focus),
            None => Ok(()),
        }
    }
}
