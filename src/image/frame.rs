//! A finished picture: layers of pixels, and their data window.

use super::layers::{LAYERS, layer_index};
use crate::settings::Crop;

/// Position of a part of a picture in the whole picture (OpenEXR's data window in its display
/// window).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataWindow {
    /// Width and height of the whole picture, pixels.
    pub whole: (u32, u32),
    /// Column of the part's upper left pixel, from 0 at the left.
    pub column: u32,
    /// Row of the same pixel, from 0 at the top.
    pub row: u32,
}

impl DataWindow {
    /// Data window of a part; `None` if the part is the whole picture.
    #[must_use]
    pub fn of(whole: (u32, u32), part: Crop) -> Option<Self> {
        ((part.width, part.height) != whole).then_some(Self { whole, column: part.column, row: part.row })
    }
}

/// A finished frame, scene-linear, row 0 at the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Data window, if the frame is a part of a larger picture.
    pub window: Option<DataWindow>,
    /// The numbers of each layer of [`LAYERS`], pixel by pixel.
    layers: [Vec<f32>; LAYERS.len()],
    /// Further channels of files: name, and a number for each pixel.
    extras: Vec<(String, Vec<f32>)>,
}

impl Frame {
    /// Creates a frame with the given radiance, W/(m² sr) per channel; all other layers are 0.
    ///
    /// # Panics
    /// If there are not `width · height` pixels.
    #[must_use]
    pub fn new(width: u32, height: u32, radiance: &[[f32; 3]]) -> Self {
        assert_eq!(radiance.len(), width as usize * height as usize, "a pixel for each place");
        let zeros = |i: usize| vec![0.0; radiance.len() * LAYERS[i].channels.len()];
        let mut frame = Self { width, height, window: None, layers: std::array::from_fn(zeros), extras: Vec::new() };
        frame.radiance_mut().copy_from_slice(radiance);
        frame
    }

    /// Creates a frame from its layers, in the order of [`LAYERS`].
    pub(crate) fn of_layers(
        (width, height): (u32, u32),
        window: Option<DataWindow>,
        layers: [Vec<f32>; LAYERS.len()],
    ) -> Self {
        Self { width, height, window, layers, extras: Vec::new() }
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Numbers of the layer of that name, pixel by pixel.
    ///
    /// # Panics
    /// If [`LAYERS`] has no such layer.
    #[must_use]
    pub fn layer(&self, name: &str) -> &[f32] {
        &self.layers[layer_index(name)]
    }

    /// Mutable numbers of a layer, as [`Self::layer`].
    ///
    /// # Panics
    /// As [`Self::layer`].
    pub fn layer_mut(&mut self, name: &str) -> &mut [f32] {
        &mut self.layers[layer_index(name)]
    }

    /// Further channels that files get: name, and a number for each pixel.
    pub fn extras(&self) -> impl Iterator<Item = (&str, &[f32])> {
        self.extras.iter().map(|(name, numbers)| (name.as_str(), numbers.as_slice()))
    }

    /// Adds a channel to those that files get. OpenEXR takes the part of the name before the last
    /// dot as the layer.
    ///
    /// # Panics
    /// If there is not one number for each pixel.
    pub fn add_extra(&mut self, name: &str, numbers: Vec<f32>) {
        assert_eq!(numbers.len(), self.pixels(), "a number for each pixel");
        self.extras.push((name.to_owned(), numbers));
    }

    /// Radiance in W/(m² sr) per channel, linear Rec.709.
    #[must_use]
    pub fn radiance(&self) -> &[[f32; 3]] {
        bytemuck::cast_slice(self.layer("radiance"))
    }

    /// Mutable radiance, as [`Self::radiance`].
    pub fn radiance_mut(&mut self) -> &mut [[f32; 3]] {
        bytemuck::cast_slice_mut(self.layer_mut("radiance"))
    }

    /// Fraction of the pixel's samples whose first ray hit something, 0 to 1.
    #[must_use]
    pub fn alpha(&self) -> &[f32] {
        self.layer("alpha")
    }

    /// Distance of the first hit along the camera's axis, metres, mean over the samples that hit; 0
    /// if none did.
    #[must_use]
    pub fn depth(&self) -> &[f32] {
        self.layer("depth")
    }

    /// Interpolated normal of the first hit in world space, mean over the samples that hit; 0 if
    /// none did.
    #[must_use]
    pub fn normal(&self) -> &[[f32; 3]] {
        bytemuck::cast_slice(self.layer("normal"))
    }

    /// Colour of the first hit's material, mean over the samples that hit; 0 if none did.
    #[must_use]
    pub fn albedo(&self) -> &[[f32; 3]] {
        bytemuck::cast_slice(self.layer("albedo"))
    }
}
