//! Contact sheet: all pictures of a figure, with captions.

use std::io;

use embedded_graphics::{
    mono_font::{
        MonoFont,
        iso_8859_1::{FONT_6X13_BOLD, FONT_7X13, FONT_9X15_BOLD},
    },
    text::Alignment,
};

use super::{Figure, Row, measure::Thumbnail, numbers::brief};
use crate::image::{Canvas, Rgb8};

const PAPER: Rgb8 = [24, 24, 27];
const INK: Rgb8 = [236, 236, 238];
const SOFT: Rgb8 = [160, 160, 168];
const MISSING: Rgb8 = [60, 40, 40];
/// Gap between elements, pixels.
const GAP: u32 = 8;
/// Height of a line of text, pixels.
const LINE: u32 = 17;
const TITLE_FONT: &MonoFont = &FONT_9X15_BOLD;
const LABEL_FONT: &MonoFont = &FONT_6X13_BOLD;
const CAPTION_FONT: &MonoFont = &FONT_7X13;

/// Draws the figures below each other into a PNG file.
pub(super) fn contact_sheet(figures: &[Figure], rows: &[Row]) -> io::Result<Vec<u8>> {
    let layouts: Vec<Layout> = figures.iter().map(|figure| Layout::new(figure, rows)).collect();
    let width = layouts.iter().map(Layout::width).max().unwrap_or(0).max(1);
    let height = layouts.iter().map(Layout::height).sum::<u32>().max(1);
    let mut canvas = Canvas::new(width, height, PAPER);
    let mut y = 0;
    for layout in &layouts {
        layout.draw(&mut canvas, y, rows);
        y += layout.height();
    }
    canvas.to_png()
}

/// Layout of a figure.
struct Layout<'a> {
    figure: &'a Figure,
    /// Size reserved for each picture, pixels.
    cell: (u32, u32),
    /// Width reserved for the labels at the left, pixels.
    labels: u32,
}

impl<'a> Layout<'a> {
    /// Minimum width of a column, in which the caption fits, pixels.
    const NARROWEST: u32 = 148;

    fn new(figure: &'a Figure, rows: &[Row]) -> Self {
        let sizes = figure.combinations().map(|c| (rows[c].thumbnail.width, rows[c].thumbnail.height));
        let (w, h) = sizes.fold((Self::NARROWEST, 32), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        let longest = figure.rows.iter().map(|(label, _)| label.chars().count() as u32).max().unwrap_or(0);
        Self { figure, cell: (w, h), labels: longest * LABEL_FONT.character_size.width + GAP }
    }

    fn width(&self) -> u32 {
        let columns = self.figure.columns.len() as u32;
        let title = self.figure.title.chars().count() as u32 * TITLE_FONT.character_size.width + 2 * GAP;
        (GAP + self.labels + columns * (self.cell.0 + GAP)).max(title)
    }

    /// Height of one row of pictures with two lines of caption.
    fn step(&self) -> u32 {
        self.cell.1 + 2 * LINE + GAP
    }

    fn height(&self) -> u32 {
        GAP + 2 * LINE + self.figure.rows.len() as u32 * self.step() + GAP
    }

    fn draw(&self, canvas: &mut Canvas, top: u32, rows: &[Row]) {
        let at = |x: u32, y: u32| (x as i32, y as i32);
        canvas.write(&self.figure.title, at(GAP, top + GAP), TITLE_FONT, INK, Alignment::Left);
        let left = GAP + self.labels;
        let column = |c: usize| left + c as u32 * (self.cell.0 + GAP);
        for (c, label) in self.figure.columns.iter().enumerate() {
            let middle = column(c) + self.cell.0 / 2;
            canvas.write(label, at(middle, top + GAP + LINE), LABEL_FONT, SOFT, Alignment::Center);
        }
        for (r, (label, cells)) in self.figure.rows.iter().enumerate() {
            let y = top + GAP + 2 * LINE + r as u32 * self.step();
            canvas.write(label, at(GAP, y + self.cell.1 / 2 - LINE / 2), LABEL_FONT, SOFT, Alignment::Left);
            for (c, combination) in cells.iter().enumerate() {
                let Some(row) = combination.map(|i| &rows[i]) else { continue };
                self.draw_cell(canvas, (column(c), y), row);
            }
        }
    }

    fn draw_cell(&self, canvas: &mut Canvas, (x, y): (u32, u32), row: &Row) {
        let middle = (x + self.cell.0 / 2) as i32;
        let mut caption = |line: u32, text: &str, color: Rgb8| {
            let position = (middle, (y + self.cell.1 + 2 + line * (LINE - 2)) as i32);
            canvas.write(text, position, CAPTION_FONT, color, Alignment::Center);
        };
        if row.error.is_some() {
            caption(0, "failed", INK);
            canvas.fill((x, y), self.cell, MISSING);
            return;
        }
        let [first, second] = captions(row);
        caption(0, &first, INK);
        caption(1, &second, SOFT);
        let corner = (x + (self.cell.0 - row.thumbnail.width) / 2, y + (self.cell.1 - row.thumbnail.height) / 2);
        paste(canvas, &row.thumbnail, corner);
    }
}

/// Two lines: the error or the mean, and the time.
fn captions(row: &Row) -> [String; 2] {
    let first = match row.rel_mse {
        Some(error) => format!("relMSE {}", brief(error)),
        None => format!("mean {}", brief(row.mean())),
    };
    let radius = [row.global.radius, row.caustic.radius].into_iter().flatten().next();
    let radius = radius.map(|r| format!(", r {} m", brief(r.median.into()))).unwrap_or_default();
    [first, format!("{} s{radius}", brief(row.seconds.total))]
}

fn paste(canvas: &mut Canvas, picture: &Thumbnail, (left, top): (u32, u32)) {
    for (i, color) in (0..).zip(&picture.pixels) {
        canvas.set(left + i % picture.width, top + i / picture.width, *color);
    }
}
