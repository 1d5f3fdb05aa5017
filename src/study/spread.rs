//! Noise and bias: the deviation between renders of different seeds, and the error that they have
//! in common.

use crate::image::Frame;

/// Side of the blocks over which the standard error of the bias is estimated, pixels.
const BLOCK: usize = 8;

/// Bias of renders of different seeds against a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bias {
    /// Root of the mean square over pixels and channels, W/(m² sr).
    pub value: f64,
    /// Detection limit: the root of two standard errors of the square, W/(m² sr). A smaller bias is
    /// indistinguishable from noise.
    pub limit: f64,
}

/// Root of the mean over pixels and channels of the unbiased variance between renders; `None` for
/// fewer than two.
pub(super) fn noise(frames: &[&Frame]) -> Option<f64> {
    let count = frames.len() as f64;
    let values = frames.first()?.radiance().len() * 3;
    if frames.len() < 2 || values == 0 {
        return None;
    }
    let variance = |i: usize| {
        let of = |frame: &&Frame| f64::from(frame.radiance()[i / 3][i % 3]);
        let mean = frames.iter().map(of).sum::<f64>() / count;
        frames.iter().map(|frame| (of(frame) - mean).powi(2)).sum::<f64>() / (count - 1.0)
    };
    Some(((0..values).map(variance).sum::<f64>() / values as f64).sqrt())
}

/// Estimates the squared bias from products of two renders' differences from the reference: their
/// noise is independent and averages to zero. `None` for fewer than two renders or an empty
/// picture.
pub(super) fn bias(frames: &[&Frame], reference: &Frame) -> Option<Bias> {
    let count = frames.len() as f64;
    if frames.len() < 2 || reference.radiance().is_empty() {
        return None;
    }
    let (width, height) = (reference.width as usize, reference.height as usize);
    let columns = width.div_ceil(BLOCK);
    let mut blocks = vec![(0.0, 0.0); columns * height.div_ceil(BLOCK)];
    for (i, right) in reference.radiance().iter().enumerate() {
        let block = &mut blocks[i / width / BLOCK * columns + i % width / BLOCK];
        for (c, right) in right.iter().enumerate() {
            let difference = |frame: &&Frame| f64::from(frame.radiance()[i][c]) - f64::from(*right);
            let sum: f64 = frames.iter().map(difference).sum();
            let squares: f64 = frames.iter().map(|frame| difference(frame).powi(2)).sum();
            // Mean of the products over all pairs.
            block.0 += (sum * sum - squares) / (count * (count - 1.0));
            block.1 += 1.0;
        }
    }
    let values: f64 = blocks.iter().map(|(_, n)| n).sum();
    let square = blocks.iter().map(|(sum, _)| sum).sum::<f64>() / values;
    // Deviation of each block from the value expected for its size.
    let departures: f64 = blocks.iter().map(|(sum, n)| (sum - square * n).powi(2)).sum();
    Some(Bias { value: square.max(0.0).sqrt(), limit: (2.0 * departures.sqrt() / values).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(side: u32, value: impl Fn(u32) -> f32) -> Frame {
        let radiance: Vec<_> = (0..side * side).map(|i| [value(i); 3]).collect();
        Frame::new(side, side, &radiance)
    }

    /// Pseudorandom number from -1 to 1.
    fn random(i: u32, seed: u32) -> f32 {
        let mut h = i.wrapping_mul(0x9E37_79B9) ^ seed.wrapping_mul(0x85EB_CA6B);
        for _ in 0..3 {
            h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        }
        (h >> 8) as f32 / (1 << 23) as f32 - 1.0
    }

    #[test]
    fn noise_is_the_deviation_between_renders() {
        // Variances 2 and 0 (of two values, n - 1).
        let (a, b) = (frame(2, |i| if i < 2 { 1.0 } else { 5.0 }), frame(2, |i| if i < 2 { 3.0 } else { 5.0 }));
        assert!((noise(&[&a, &b]).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!((noise(&[&a]), noise(&[]), noise(&[&a, &a])), (None, None, Some(0.0)));
    }

    #[test]
    fn bias_is_told_from_noise() {
        let reference = frame(128, |_| 1.0);
        let renders = |shift: f32| [1, 2, 3].map(|seed| frame(128, |i| 1.0 + shift + random(i, seed)));
        let found = |shift: f32| {
            let renders = renders(shift);
            bias(&renders.each_ref(), &reference).unwrap()
        };
        let (none, some) = (found(0.0), found(0.3));
        assert!((some.value - 0.3).abs() < 0.02 && some.value > some.limit, "{some:?}");
        assert!(none.value < none.limit && none.limit < 0.15, "{none:?}");
        let noisy = renders(0.0);
        assert!((noise(&noisy.each_ref()).unwrap() - (1.0_f64 / 3.0).sqrt()).abs() < 0.01);
        assert_eq!(bias(&[&noisy[0]], &reference), None);
    }
}
