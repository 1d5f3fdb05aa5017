//! 8-bit canvas for drawing and text: colour scales, legends, captions.

use std::{convert::Infallible, io};

use embedded_graphics::{
    Drawable, Pixel,
    draw_target::DrawTarget,
    geometry::{OriginDimensions, Point, Size},
    mono_font::{MonoFont, MonoTextStyle},
    pixelcolor::{Rgb888, RgbColor},
    text::{Alignment, Baseline, Text, TextStyleBuilder},
};

use super::png::encode_rgb8;

/// sRGB colour, 0 to 255 per channel.
pub type Rgb8 = [u8; 3];

/// sRGB picture with 8 bits per channel, row 0 at the top. Drawing outside it is clipped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width: u32,
    height: u32,
    pixels: Vec<u8>,
}

impl Canvas {
    /// Creates a canvas of one colour.
    #[must_use]
    pub fn new(width: u32, height: u32, color: Rgb8) -> Self {
        Self { width, height, pixels: color.repeat(width as usize * height as usize) }
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Sets one pixel.
    pub fn set(&mut self, x: u32, y: u32, color: Rgb8) {
        if x < self.width && y < self.height {
            let at = 3 * (y as usize * self.width as usize + x as usize);
            self.pixels[at..at + 3].copy_from_slice(&color);
        }
    }

    /// Colour of a pixel; `None` outside the canvas.
    #[must_use]
    pub fn get(&self, x: u32, y: u32) -> Option<Rgb8> {
        let inside = x < self.width && y < self.height;
        let at = 3 * (y as usize * self.width as usize + x as usize);
        inside.then(|| [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]])
    }

    /// Fills the rectangle with the given upper left corner and size.
    pub fn fill(&mut self, (x, y): (u32, u32), (width, height): (u32, u32), color: Rgb8) {
        for row in y..y.saturating_add(height).min(self.height) {
            for column in x..x.saturating_add(width).min(self.width) {
                self.set(column, row, color);
            }
        }
    }

    /// Draws a line of text with its upper edge at `y`; `x` is its left end, middle or right end as
    /// `alignment` says.
    pub fn write(&mut self, text: &str, (x, y): (i32, i32), font: &MonoFont, color: Rgb8, alignment: Alignment) {
        let style = MonoTextStyle::new(font, Rgb888::new(color[0], color[1], color[2]));
        let layout = TextStyleBuilder::new().alignment(alignment).baseline(Baseline::Top).build();
        let Ok(_) = Text::with_text_style(text, Point::new(x, y), style, layout).draw(self);
    }

    /// Encodes the canvas as a PNG file.
    ///
    /// # Errors
    /// If the canvas has no pixel.
    pub fn to_png(&self) -> io::Result<Vec<u8>> {
        encode_rgb8(&self.pixels, self.width, self.height)
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(point, color) in pixels {
            if let (Ok(x), Ok(y)) = (u32::try_from(point.x), u32::try_from(point.y)) {
                self.set(x, y, [color.r(), color.g(), color.b()]);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use embedded_graphics::mono_font::ascii::FONT_6X10;

    use super::*;

    #[test]
    fn drawing_is_clipped() {
        let mut canvas = Canvas::new(4, 3, [9; 3]);
        canvas.fill((2, 1), (100, u32::MAX), [1, 2, 3]);
        canvas.set(4, 0, [0; 3]);
        assert_eq!((canvas.get(3, 2), canvas.get(1, 1), canvas.get(4, 0)), (Some([1, 2, 3]), Some([9; 3]), None));
        canvas.write("long text", (-3, -2), &FONT_6X10, [255; 3], Alignment::Left);
        assert_eq!((canvas.width(), canvas.height()), (4, 3));
    }

    #[test]
    fn text_is_drawn() {
        let mut canvas = Canvas::new(40, 12, [0; 3]);
        let blank = canvas.clone();
        canvas.write(" ", (20, 1), &FONT_6X10, [255; 3], Alignment::Center);
        assert_eq!(canvas, blank, "the control");
        canvas.write("1e-4", (20, 1), &FONT_6X10, [255; 3], Alignment::Center);
        assert_ne!(canvas, blank);
        let read = image::load_from_memory(&canvas.to_png().unwrap()).unwrap().into_rgb8();
        assert_eq!(read.into_raw(), canvas.pixels);
    }
}
