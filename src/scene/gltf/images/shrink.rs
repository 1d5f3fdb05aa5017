//! Smaller versions of images.

use crate::{
    image::{srgb_decode, srgb_encode},
    scene::{Image, ImageValues},
};

/// The image with its sides halved, rounded down, until none is longer than `longest`. Each texel
/// is the mean over its area of the values that the RGB stand for, of colours as far as they are
/// there.
pub(super) fn shrunk(image: Image, longest: u32, values: ImageValues) -> Image {
    let mut halvings = 0;
    while image.width.max(image.height) >> halvings > longest {
        halvings += 1;
    }
    if halvings == 0 {
        return image;
    }
    let (width, height) = ((image.width >> halvings).max(1), (image.height >> halvings).max(1));
    let decoded = |x: f32| if values.are_colors() { srgb_decode(x) } else { x };
    let encoded = |x: f32| if values.are_colors() { srgb_encode(x) } else { x };
    let stored = |x: f32| (255.0 * x).round() as u8;
    let linear: [f32; 256] = std::array::from_fn(|value| decoded(value as f32 / 255.0));
    let there: [f32; 256] = std::array::from_fn(|alpha| values.there(alpha as u8).max(1e-5));
    let (columns, rows) = (spans(image.width, width), spans(image.height, height));
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for (first_row, row_weights) in &rows {
        // Sums over the rows of the span, for each column of the image.
        let mut sums = vec![[0.0_f32; 5]; image.width as usize];
        for (row, weight) in image.texels.chunks_exact(image.width as usize).skip(*first_row).zip(row_weights) {
            for (sum, texel) in sums.iter_mut().zip(row) {
                let own = weight * there[usize::from(texel[3])];
                (0..3).for_each(|c| sum[c] += own * linear[usize::from(texel[c])]);
                sum[3] += weight * f32::from(texel[3]) / 255.0;
                sum[4] += own;
            }
        }
        for (first, weights) in &columns {
            let mut mean = [0.0_f32; 5];
            for (sum, weight) in sums[*first..].iter().zip(weights) {
                (0..5).for_each(|c| mean[c] += weight * sum[c]);
            }
            let [r, g, b] = [0, 1, 2].map(|c| stored(encoded(mean[c] / mean[4])));
            texels.push([r, g, b, stored(mean[3])]);
        }
    }
    Image { width, height, texels, ..image }
}

/// For each of `to` equal parts of `from` texels the first that it covers, and the fraction of the
/// part that each of them is.
fn spans(from: u32, to: u32) -> Vec<(usize, Vec<f32>)> {
    let size = f64::from(from) / f64::from(to);
    let span = |part: u32| {
        let (start, end) = (f64::from(part) * size, (f64::from(part + 1) * size).min(f64::from(from)));
        let covered = start.floor() as usize..end.ceil() as usize;
        let weight = |i: usize| ((end.min(i as f64 + 1.0) - start.max(i as f64)) / size) as f32;
        (covered.start, covered.map(weight).collect())
    };
    (0..to).map(span).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        Image { name: String::new(), width, height, texels }
    }

    #[test]
    fn a_checker_becomes_the_grey_of_half_its_light() {
        let checker = image(8, 4, |x, y| [255 * ((x + y) % 2) as u8; 4]);
        let size = |image: &Image| (image.width, image.height);
        let color = shrunk(checker.clone(), 4, ImageValues::Colors);
        assert_eq!((size(&color), &color.texels[..]), ((4, 2), &[[188, 188, 188, 128]; 8][..]));
        let data = shrunk(checker.clone(), 1, ImageValues::Data);
        assert_eq!((size(&data), &data.texels[..]), ((1, 1), &[[128; 4]][..]));
        assert_eq!(shrunk(checker.clone(), 8, ImageValues::Colors), checker, "small enough");
    }

    #[test]
    fn what_is_not_there_has_no_colour() {
        let leaf = image(8, 8, |x, _| if x % 2 == 0 { [255, 255, 255, 200] } else { [0, 0, 0, 0] });
        let of = |values| shrunk(leaf.clone(), 4, values).texels[0];
        assert_eq!((of(ImageValues::Blend), of(ImageValues::Mask(128))), ([255, 255, 255, 100], [255, 255, 255, 100]));
        assert_eq!(of(ImageValues::Colors), [188, 188, 188, 100], "control");
    }

    #[test]
    fn odd_sides_keep_the_mean() {
        let ramp = image(5, 1, |x, _| [50 * x as u8, 100, 200, 255]);
        let small = shrunk(ramp, 2, ImageValues::Data);
        // Two parts of 2.5 texels: (0 + 50 + 100/2) / 2.5 and (100/2 + 150 + 200) / 2.5.
        assert_eq!(small.texels, [[40, 100, 200, 255], [160, 100, 200, 255]]);
        let all = image(7, 3, |x, y| [(x * y) as u8, 0, 0, 0]);
        assert_eq!(shrunk(all, 1, ImageValues::Data).texels, [[3, 0, 0, 0]]);
    }
}
