//! All images in one array of texels, each with smaller versions of itself.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::{
    image::{srgb_decode, srgb_encode},
    scene::{Image, ImageValues},
};

/// An image among the texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImageTexels {
    /// Index of its first texel.
    pub first: u32,
    pub width: u32,
    pub height: u32,
    /// The image, and versions of half the size each that follow it.
    pub levels: u32,
}

/// The texels that materials need.
pub(super) struct Texels<'a> {
    images: &'a [Image],
    words: Vec<u32>,
    known: HashMap<(u32, ImageValues, bool), ImageTexels>,
}

impl<'a> Texels<'a> {
    pub fn new(images: &'a [Image]) -> Self {
        Self { images, words: Vec::new(), known: HashMap::new() }
    }

    /// The texels of an image, which is added at its first use of that kind. `is_mipmapped`: with
    /// smaller versions.
    pub fn add(&mut self, image: u32, values: ImageValues, is_mipmapped: bool) -> ImageTexels {
        if let Some(added) = self.known.get(&(image, values, is_mipmapped)) {
            return *added;
        }
        let source = &self.images[image as usize];
        let first = self.words.len() as u32;
        self.words.extend(source.texels.iter().map(|texel| u32::from_le_bytes(*texel)));
        let (mut width, mut height, mut levels) = (source.width, source.height, 1);
        let mut level: Vec<[u8; 4]> = Vec::new();
        while is_mipmapped && (width > 1 || height > 1) {
            let finer = if levels == 1 { &source.texels } else { &level };
            // What is there of a mask has become the opacity of the smaller version.
            let values =
                if let (ImageValues::Mask(_), true) = (values, levels > 1) { ImageValues::Blend } else { values };
            level = halved(finer, (width, height), values);
            (width, height, levels) = ((width / 2).max(1), (height / 2).max(1), levels + 1);
            self.words.extend(level.iter().map(|texel| u32::from_le_bytes(*texel)));
        }
        let added = ImageTexels { first, width: source.width, height: source.height, levels };
        self.known.insert((image, values, is_mipmapped), added);
        added
    }

    pub fn into_words(self) -> Vec<u32> {
        self.words
    }
}

/// An image of half the size: each texel is the mean of those that it covers, two by two, or three
/// where the size is odd.
fn halved(finer: &[[u8; 4]], (width, height): (u32, u32), values: ImageValues) -> Vec<[u8; 4]> {
    let is_color = values.are_colors();
    let alpha = |a: u8| if let ImageValues::Mask(_) = values { 255.0 * values.there(a) } else { f32::from(a) };
    let linear: Vec<f32> = (0..=255_u8)
        .map(|byte| if is_color { srgb_decode(f32::from(byte) / 255.0) } else { f32::from(byte) })
        .collect();
    let (columns, rows) = ((width / 2).max(1), (height / 2).max(1));
    let covered = |i: u32, halves: u32, whole: u32| {
        let end = if i + 1 == halves { whole } else { 2 * i + 2 };
        2 * i..end
    };
    let texel = |i: u32| {
        let (mut sum, mut weight, mut count) = ([0.0; 4], 0.0, 0.0);
        for y in covered(i / columns, rows, height) {
            for x in covered(i % columns, columns, width) {
                let [r, g, b, a] = finer[(y * width + x) as usize];
                let own = values.there(a).max(1e-5);
                for (sum, value) in sum.iter_mut().zip([r, g, b]) {
                    *sum += own * linear[usize::from(value)];
                }
                sum[3] += alpha(a);
                weight += own;
                count += 1.0;
            }
        }
        let stored = |value: f32| if is_color { (255.0 * srgb_encode(value) + 0.5) as u8 } else { (value + 0.5) as u8 };
        [stored(sum[0] / weight), stored(sum[1] / weight), stored(sum[2] / weight), (sum[3] / count + 0.5) as u8]
    };
    (0..columns * rows).into_par_iter().map(texel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opacity_weighs_the_colours_of_what_is_there_in_part_alone() {
        // White that is not there beside black that is.
        let pair = [[255, 255, 255, 0], [0, 0, 0, 255]];
        let mean = |values| halved(&pair, (2, 1), values)[0];
        assert_eq!(mean(ImageValues::Data), [128, 128, 128, 128]);
        assert_eq!(mean(ImageValues::Colors), [188, 188, 188, 128]);
        for values in [ImageValues::Blend, ImageValues::Mask(128)] {
            let [r, g, b, a] = mean(values);
            assert!(r < 2 && [g, b] == [r; 2] && a == 128, "{values:?}: {r} {g} {b} {a}");
        }
        assert_eq!(mean(ImageValues::Mask(0)), [188, 188, 188, 255], "all of it is there");
    }

    #[test]
    fn masks_keep_the_colours_of_what_is_there_at_all_sizes() {
        // Three quarters of red that is there, of which the alpha is low, beside green that is not.
        let texels = (0..16).map(|i| if i % 4 == 3 { [0, 255, 0, 30] } else { [255, 0, 0, 40] }).collect();
        let image = Image { name: String::new(), width: 4, height: 4, texels };
        let coarsest = |values| {
            let images = [image.clone()];
            let mut texels = Texels::new(&images);
            assert_eq!(texels.add(0, values, true).levels, 3);
            texels.into_words().pop().expect("a texel").to_le_bytes()
        };
        assert_eq!(coarsest(ImageValues::Mask(35)), [255, 0, 0, 192]);
        assert!(coarsest(ImageValues::Blend)[1] > 100, "control: as if it were there by its alpha");
    }
}
