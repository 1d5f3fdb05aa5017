//! Tone mapping of scene-linear radiance to display values: tone curves and the sRGB transfer
//! function.

use serde::{Deserialize, Serialize};

/// Tone curve: maps radiance to the range of a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tonemap {
    /// Khronos PBR Neutral (Khronos Group 2024): preserves base colours and compresses highlights.
    #[default]
    Neutral,
    /// ACES reference and output transforms, as fitted by Stephen Hill (BakingLab, `ACES.hlsl`),
    /// without its exposure bias.
    Aces,
    /// Reinhard et al. 2002, eq. 3, on Rec.709 luminance Y: the colour is divided by 1 + Y, then
    /// clipped.
    Reinhard,
    /// AgX (Sobotka 2022): all colours go to white with rising light, without shifts of hue.
    Agx,
    /// Clips to 0..1.
    None,
}

/// Largest finite half float: upper limit of the input of a curve, which keeps infinity out.
const MAX_INPUT: f32 = 65504.0;

impl Tonemap {
    /// Maps linear Rec.709 to linear display values in [0, 1]. Negative values and NaN become
    /// black.
    #[must_use]
    pub fn apply(self, color: [f32; 3]) -> [f32; 3] {
        let c = color.map(|x| if x > 0.0 { x.min(MAX_INPUT) } else { 0.0 });
        let mapped = match self {
            Self::Neutral => neutral(c),
            Self::Aces => aces(c),
            Self::Reinhard => {
                let luminance = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
                c.map(|x| x / (1.0 + luminance))
            }
            Self::Agx => agx(c),
            Self::None => c,
        };
        mapped.map(|x| x.clamp(0.0, 1.0))
    }
}

/// Khronos PBR Neutral, with the names of its specification.
fn neutral(color: [f32; 3]) -> [f32; 3] {
    const F90: f32 = 0.04;
    const START_COMPRESSION: f32 = 0.8 - F90;
    const DESATURATION: f32 = 0.15;
    // Subtracts the 4 % that a dielectric reflects at normal incidence, with a smooth transition
    // near black.
    let x = color[0].min(color[1]).min(color[2]);
    let offset = if x < 2.0 * F90 { x - x * x / (4.0 * F90) } else { F90 };
    let color = color.map(|c| c - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak <= START_COMPRESSION {
        return color;
    }
    // Compresses the peak below 1 and desaturates bright colours.
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let g = 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|c| new_peak + (c * new_peak / peak - new_peak) * g)
}

/// sRGB to the working space of the fit: XYZ, D65 to D60, AP1, RRT saturation.
const ACES_INPUT: [[f32; 3]; 3] =
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
/// ODT saturation, XYZ, D60 to D65, sRGB.
const ACES_OUTPUT: [[f32; 3]; 3] =
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];

fn aces(color: [f32; 3]) -> [f32; 3] {
    let times = |m: &[[f32; 3]; 3], v: [f32; 3]| m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
    let fit = |v: f32| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    times(&ACES_OUTPUT, times(&ACES_INPUT, color).map(fit))
}

/// Weights of the channels in AgX's inset: 0.8 of a colour, and a fifth of its weighted mean.
const AGX_WEIGHTS: [f32; 3] = [0.042_401_07, 0.078_436_5, 0.079_162_43];
const AGX_INSET: f32 = 0.8;
/// Stops that the curve spans, below and above middle grey, and that grey.
const AGX_STOPS: [f32; 2] = [10.0, 6.5];
const AGX_GREY: f32 = 0.18;
/// Slope of the curve at middle grey, which becomes 0.5, and the powers of its toe and shoulder.
const AGX_SLOPE: f32 = 2.0;
const AGX_POWERS: [f32; 2] = [3.0, 3.25];
/// Exponent of the display that the curve's values are meant for.
const AGX_DISPLAY: f32 = 2.2;

/// The base of AgX by its formulas (Sobotka's `AgX` configuration for `OpenColorIO`), without a
/// look.
fn agx(color: [f32; 3]) -> [f32; 3] {
    let weighted = |c: [f32; 3]| c.iter().zip(AGX_WEIGHTS).map(|(x, w)| x * w).sum::<f32>();
    let mean = weighted(color);
    let curve = |x: f32| {
        let stops = ((AGX_INSET * x + mean) / AGX_GREY).max(f32::MIN_POSITIVE).log2();
        let span = AGX_STOPS[0] + AGX_STOPS[1];
        let grey = AGX_STOPS[0] / span;
        let at = ((stops + AGX_STOPS[0]) / span).clamp(0.0, 1.0) - grey;
        let (end, power) = if at < 0.0 { (grey, AGX_POWERS[0]) } else { (1.0 - grey, AGX_POWERS[1]) };
        // A line through grey that bends so that the curve ends in 0 and in 1.
        let bend = ((AGX_SLOPE * end / 0.5).powf(power) - 1.0) / end.powf(power);
        0.5 + AGX_SLOPE * at * (1.0 + bend * at.abs().powf(power)).powf(-1.0 / power)
    };
    let curved = color.map(curve);
    // The inverse of the inset: the weights and 0.8 sum to 1, so that the weighted mean is kept.
    let mean = weighted(curved);
    curved.map(|x| ((x - mean) / AGX_INSET).clamp(0.0, 1.0).powf(AGX_DISPLAY))
}

/// Linear value of one encoded by the sRGB transfer function, 0 to 1 (IEC 61966-2-1).
#[must_use]
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// sRGB transfer function (IEC 61966-2-1): linear [0, 1] to encoded [0, 1].
#[must_use]
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_keep_their_srgb_value() {
        let again = |byte: u8| (255.0 * srgb_encode(srgb_decode(f32::from(byte) / 255.0))).round() as u8;
        assert!((0..=255).all(|byte| again(byte) == byte));
    }

    fn assert_near(a: [f32; 3], b: [f32; 3]) {
        assert!(a.iter().zip(b).all(|(x, y)| (x - y).abs() < 2e-4), "{a:?} is not {b:?}");
    }

    #[test]
    fn curves_have_their_known_values() {
        // Neutral, from the formula of the specification by hand: below the compression it
        // subtracts 0.04, near black x²/0.16 remains, and grey 2 becomes
        // 1 - 0.24²/(1.96 + 0.24 - 0.76) = 0.96.
        assert_near(Tonemap::Neutral.apply([0.5, 0.4, 0.3]), [0.46, 0.36, 0.26]);
        assert_near(Tonemap::Neutral.apply([0.04; 3]), [0.01; 3]);
        assert_near(Tonemap::Neutral.apply([2.0; 3]), [0.96; 3]);
        // Hill's fit at grey 1: (1.0245786 - 0.000090537) / 1.654761, times rows that sum to 1.
        assert_near(Tonemap::Aces.apply([1.0; 3]), [0.6191; 3]);
        assert_near(Tonemap::Reinhard.apply([1.0; 3]), [0.5; 3]);
        assert_near(Tonemap::Reinhard.apply([0.0, 1.0, 0.0]), [0.0, 1.0 / 1.7152, 0.0]);
        // AgX: middle grey becomes half of what a display of exponent 2.2 shows; the ends; and a
        // colour by the published matrices and curve, in f64.
        assert_near(Tonemap::Agx.apply([0.18; 3]), [0.5_f32.powf(2.2); 3]);
        assert_near(Tonemap::Agx.apply([0.0; 3]), [0.0; 3]);
        assert_near(Tonemap::Agx.apply([20.0; 3]), [1.0; 3]);
        assert_near(Tonemap::Agx.apply([1.0, 0.2, 0.05]), [0.65281, 0.25572, 0.11113]);
        assert_near(Tonemap::None.apply([0.25, 1.5, -1.0]), [0.25, 1.0, 0.0]);
    }

    #[test]
    fn every_curve_stays_in_range_and_rises() {
        for curve in [Tonemap::Neutral, Tonemap::Aces, Tonemap::Reinhard, Tonemap::Agx, Tonemap::None] {
            assert_eq!(curve.apply([f32::NAN; 3]), curve.apply([0.0; 3]));
            assert!(curve.apply([f32::INFINITY; 3]).iter().all(|&x| x > 0.98), "{curve:?}");
            let greys: Vec<_> = (0..200).map(|i| curve.apply([i as f32 * 0.02; 3])[0]).collect();
            assert!(greys.windows(2).all(|w| w[0] <= w[1]), "{curve:?}");
        }
    }

    #[test]
    fn srgb_transfer_has_its_known_values() {
        assert_eq!(srgb_encode(0.0), 0.0);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-6);
        // 18 % grey is encoded as 0.4614, and the two pieces are continuous.
        assert!((srgb_encode(0.18) - 0.461_356).abs() < 1e-5);
        assert!((srgb_encode(0.003_130_8) - srgb_encode(0.003_130_9)).abs() < 1e-5);
    }
}
