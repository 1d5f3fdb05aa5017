//! What the texels of an image stand for.

use super::Alpha;

/// What the RGBA of an image are, which says how texels are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ImageValues {
    /// Numbers.
    Data,
    /// Colours with the sRGB curve.
    Colors,
    /// Such colours and their opacity: a texel that is not there has no colour.
    Blend,
    /// Colours of texels that are there where their alpha is at least this one.
    Mask(u8),
}

impl ImageValues {
    /// Of the colours of a material with that opacity.
    pub fn of_colors(alpha: Alpha, opacity: f32) -> Self {
        match alpha {
            Alpha::Opaque => Self::Colors,
            Alpha::Blend => Self::Blend,
            // Rounded up, but not by the rounding of the quotient.
            Alpha::Mask { cutoff } => Self::Mask((255.0 * cutoff / opacity - 1e-3).ceil().clamp(0.0, 255.0) as u8),
        }
    }

    /// Of an image that is used as both.
    pub fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Data, values) | (values, Self::Data) => values,
            (Self::Colors, _) | (_, Self::Colors) => Self::Colors,
            (Self::Mask(one), Self::Mask(another)) => Self::Mask(one.min(another)),
            _ => Self::Blend,
        }
    }

    /// Whether the RGB have the sRGB curve.
    pub fn are_colors(self) -> bool {
        self != Self::Data
    }

    /// Fraction of a texel that is there, by its alpha.
    pub fn there(self, alpha: u8) -> f32 {
        match self {
            Self::Data | Self::Colors => 1.0,
            Self::Blend => f32::from(alpha) / 255.0,
            Self::Mask(least) => f32::from(u8::from(alpha >= least)),
        }
    }
}
