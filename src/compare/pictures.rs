//! The difference of both pictures: as numbers, and in false colours with their scale.

use embedded_graphics::{mono_font::ascii::FONT_6X10, text::Alignment};

use super::measure::{Histogram, relative};
use crate::{
    error::{Error, Result},
    image::{Canvas, Frame, Rgb8},
};

const PAPER: Rgb8 = [24; 3];
const INK: Rgb8 = [235; 3];
/// Width in pixels up to which the picture is enlarged by integer factors; also the minimum width
/// of the scale.
const WIDTH: u32 = 384;
/// Margin at both ends of the scale's bar, half the width of its outer numbers.
const MARGIN: u32 = 14;
const BAR: u32 = 10;
const SCALE: u32 = 50;

/// Radiance of the grid minus that of the kd-tree; all other layers are those of the grid's
/// picture.
pub(super) fn difference(grid: &Frame, kdtree: &Frame) -> Frame {
    let mut difference = grid.clone();
    let pixels = difference.radiance_mut().iter_mut().zip(kdtree.radiance());
    pixels.for_each(|(a, b)| (0..3).for_each(|c| a[c] -= b[c]));
    difference
}

/// Relative difference of each pixel's worst channel, in false colours over a logarithmic scale; a
/// PNG file.
pub(super) fn false_colors(grid: &Frame, kdtree: &Frame) -> Result<Vec<u8>> {
    let zoom = (WIDTH / grid.width).max(1);
    let (width, height) = (grid.width * zoom, grid.height * zoom);
    let mut canvas = Canvas::new(width.max(WIDTH), height + SCALE, PAPER);
    let left = (canvas.width() - width) / 2;
    for (i, (a, b)) in (0..).zip(grid.radiance().iter().zip(kdtree.radiance())) {
        let worst = (0..3).map(|c| relative(a[c].into(), b[c].into())).fold(0.0, f64::max);
        let corner = (left + i % grid.width * zoom, i / grid.width * zoom);
        canvas.fill(corner, (zoom, zoom), color(worst));
    }
    draw_scale(&mut canvas, height + 6);
    canvas.to_png().map_err(|source| Error::Io { path: "difference.png".into(), source })
}

/// False colour: black for no difference, else by the logarithm of the difference between
/// 10^[`Histogram::FIRST`] and 1.
pub(super) fn color(difference: f64) -> Rgb8 {
    let first = f64::from(Histogram::FIRST);
    let fraction = if difference > 0.0 { (1.0 - difference.log10() / first).clamp(0.0, 1.0) } else { return [0; 3] };
    // Black is reserved for equal pixels, so the scale begins above it.
    colorous::INFERNO.eval_continuous(0.15 + 0.85 * fraction).as_array()
}

fn draw_scale(canvas: &mut Canvas, top: u32) {
    let width = canvas.width() - 2 * MARGIN;
    let decades = Histogram::FIRST.unsigned_abs();
    for x in 0..width {
        let exponent = f64::from(Histogram::FIRST) * (1.0 - f64::from(x) / f64::from(width - 1));
        canvas.fill((MARGIN + x, top), (1, BAR), color(10_f64.powf(exponent)));
    }
    for decade in 0..=decades {
        let x = MARGIN + decade * (width - 1) / decades;
        canvas.fill((x, top + BAR), (1, 3), INK);
        let exponent = Histogram::FIRST + decade as i32;
        let number = if exponent == 0 { "1".to_string() } else { format!("1e{exponent}") };
        canvas.write(&number, (x as i32, (top + BAR + 5) as i32), &FONT_6X10, INK, Alignment::Center);
    }
    let caption = "relative difference of radiance; black: none";
    let middle = canvas.width() as i32 / 2;
    canvas.write(caption, (middle, (top + BAR + 18) as i32), &FONT_6X10, INK, Alignment::Center);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_differences_are_brighter_and_equal_pixels_are_black() {
        let brightness = |difference: f64| color(difference).iter().map(|&c| u32::from(c)).sum::<u32>();
        let rising: Vec<_> = [0.0, 1e-12, 1e-7, 1e-4, 1e-2, 1.0].map(brightness).to_vec();
        assert!(rising.windows(2).all(|w| w[0] < w[1]), "{rising:?}");
        assert_eq!(color(0.0), [0; 3]);
        assert_eq!(color(f64::INFINITY), color(1.0));
    }

    #[test]
    fn the_picture_stands_above_its_scale() {
        let frame = |values: [f32; 2]| Frame::new(2, 1, &values.map(|v| [v; 3]));
        let png = false_colors(&frame([1.0, 1.0]), &frame([1.0, 0.99])).unwrap();
        let picture = image::load_from_memory(&png).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (WIDTH, WIDTH / 2 + SCALE));
        assert_eq!(picture.get_pixel(10, 10).0, [0; 3]);
        assert_eq!(picture.get_pixel(WIDTH - 10, 10).0, color(relative(1.0, 0.99_f32.into())));
        assert_eq!(difference(&frame([1.0, 3.0]), &frame([1.0, 2.0])).radiance(), [[0.0; 3], [1.0; 3]]);
    }
}
