//! Orientation of a Radiance HDR file: the order in which it holds the pixels. The file's line of
//! sizes names first the axis across scanlines, then that along them, each with the direction in
//! which pixels follow each other: `-Y rows +X columns` runs from the top, from the left. The eight
//! orders are those of Radiance's own reader.

use std::ops::Range;

/// Order of the pixels of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Orientation {
    /// Scanlines are columns.
    by_columns: bool,
    from_right: bool,
    from_bottom: bool,
}

/// Line of sizes of a file, if it names an orientation: where it lies without its end, the
/// orientation, and the line that says the same sizes in the usual orientation.
pub(super) fn size_line(bytes: &[u8]) -> Option<(Range<usize>, Orientation, String)> {
    let mut start = 0;
    // The header ends with an empty line.
    loop {
        let length = bytes[start..].iter().position(|byte| *byte == b'\n')?;
        start += length + 1;
        if length == 0 {
            break;
        }
    }
    let length = bytes[start..].iter().position(|byte| *byte == b'\n')?;
    let line = str::from_utf8(&bytes[start..start + length]).ok()?;
    let mut words = line.split_whitespace();
    let [across, scanlines, along, pixels] = [words.next()?, words.next()?, words.next()?, words.next()?];
    let (x, y, by_columns) = match (across, along) {
        ("-Y" | "+Y", "-X" | "+X") => (along, across, false),
        ("-X" | "+X", "-Y" | "+Y") => (across, along, true),
        _ => return None,
    };
    let orientation = Orientation { by_columns, from_right: x == "-X", from_bottom: y == "+Y" };
    Some((start..start + length, orientation, format!("-Y {scanlines} +X {pixels}")))
}

impl Orientation {
    /// Order of a file whose rows run from the top, and from the left.
    pub(super) const USUAL: Self = Self { by_columns: false, from_right: false, from_bottom: false };

    /// Puts the pixels of a file in the usual order. `along` is the length of a scanline, `across`
    /// the number of scanlines. Returns the picture with its width and height.
    pub(super) fn turned(
        self,
        pixels: Vec<[f32; 3]>,
        (along, across): (usize, usize),
    ) -> (Vec<[f32; 3]>, (usize, usize)) {
        let (width, height) = if self.by_columns { (across, along) } else { (along, across) };
        if self == Self::USUAL {
            return (pixels, (width, height));
        }
        let at = |x: usize, y: usize| {
            let x = if self.from_right { width - 1 - x } else { x };
            let y = if self.from_bottom { height - 1 - y } else { y };
            pixels[if self.by_columns { x * along + y } else { y * along + x }]
        };
        let rows = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        (rows.map(|(x, y)| at(x, y)).collect(), (width, height))
    }
}
