//! Automatic exposure of PNG files.

use super::Frame;

/// Value on the tone curve's input that the log-average luminance becomes: the key of a normal
/// picture (Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", section 3).
const KEY: f64 = 0.18;
/// Luminance below which a pixel counts as black, relative to the mean: the logarithm of what is
/// all but black must not decide.
const BLACK: f64 = 1e-3;

/// Stops of exposure that bring the log-average luminance of what is seen to middle grey; 0 for a
/// black picture. Pixels without any hit are left out, unless there is nothing else.
#[must_use]
pub fn auto_exposure(frame: &Frame) -> f32 {
    let luminances = |seen: &dyn Fn(f32) -> bool| -> Vec<f64> {
        let pixels = frame.radiance().iter().zip(frame.alpha()).filter(|(_, alpha)| seen(**alpha));
        let luminance = |[r, g, b]: &[f32; 3]| 0.2126 * f64::from(*r) + 0.7152 * f64::from(*g) + 0.0722 * f64::from(*b);
        pixels.map(|(radiance, _)| luminance(radiance).max(0.0)).filter(|y| y.is_finite()).collect()
    };
    let mut seen = luminances(&|alpha| alpha > 0.0);
    if seen.iter().all(|y| *y == 0.0) {
        seen = luminances(&|_| true);
    }
    let count = seen.len().max(1) as f64;
    let mean = seen.iter().sum::<f64>() / count;
    if mean <= 0.0 {
        return 0.0;
    }
    let log_average = (seen.iter().map(|y| y.max(BLACK * mean).ln()).sum::<f64>() / count).exp();
    ((KEY / log_average).log2() as f32).clamp(-100.0, 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(radiance: &[f32], alpha: &[f32]) -> Frame {
        let radiance: Vec<_> = radiance.iter().map(|x| [*x; 3]).collect();
        let mut frame = Frame::new(radiance.len() as u32, 1, &radiance);
        frame.layer_mut("alpha").copy_from_slice(alpha);
        frame
    }

    #[test]
    fn a_lamp_and_a_candle_both_become_middle_grey() {
        for scale in [1e-6_f32, 1.0, 1e5] {
            let stops = auto_exposure(&frame(&[0.09 * scale, 0.36 * scale], &[1.0; 2]));
            assert!((stops + scale.log2()).abs() < 1e-3, "{scale}: {stops}");
        }
        // Pixels that show something count, not the void around them, and not their black pixels.
        let of = |radiance: &[f32], alpha: &[f32]| auto_exposure(&frame(radiance, alpha));
        assert!((of(&[0.18, 0.0, 900.0], &[1.0, 0.0, 0.0])).abs() < 1e-5);
        assert!(of(&[0.18, 0.18, 0.18, 0.0], &[1.0; 4]) < 2.7, "a quarter of black is no night");
        assert!((of(&[0.18, 0.18], &[0.0; 2])).abs() < 1e-5, "nothing but background");
        assert_eq!((of(&[0.0; 2], &[1.0; 2]), auto_exposure(&Frame::new(0, 0, &[]))), (0.0, 0.0));
        assert!((of(&[0.36, 0.36], &[1.0; 2]) + 1.0).abs() < 1e-5, "control: twice as bright is a stop less");
    }
}
