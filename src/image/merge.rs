//! Merging of parts into one picture: of other passes, of other pixels, or both.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use super::{
    exr::{Attributes, count_photons, count_samples},
    frame::{DataWindow, Frame},
    layers::LAYERS,
    part::{PartHeader, read_part, read_part_header},
    part_identity::differences,
    pass_sum::Fold,
};
use crate::{
    error::{Error, Result},
    settings::{Crop, PassRange},
};

/// Maximum number of differences in one message.
const MOST_TOLD: usize = 3;

/// Passes and pixels of a picture that there are.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Width and height of the picture, pixels.
    pub whole: (u32, u32),
    /// Attributes of the part with the first pass, of several crops the upper left one.
    pub attributes: Attributes,
    /// Parts of the picture's pixels, from the top and the left.
    pub windows: Vec<WindowParts>,
    /// Adapters with their drivers.
    pub devices: BTreeSet<(String, String)>,
    /// Passes or pixels that are there more than once, one line each.
    pub overlaps: Vec<String>,
}

/// Parts of the same pixels.
#[derive(Clone, Debug)]
pub struct WindowParts {
    /// The pixels.
    pub window: Crop,
    /// Passes and file of each part, ascending.
    pub parts: Vec<(PassRange, PathBuf)>,
}

/// Passes of some pixels that no part holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missing {
    /// The pixels; `None` if the parts are of the same ones.
    pub crop: Option<Crop>,
    /// The passes.
    pub passes: PassRange,
}

/// Reads what parts say of themselves, without their pixels.
///
/// # Errors
/// [`Error::Io`] if a file cannot be read or is not a part, [`Error::Differs`] if it is of another
/// picture than the first.
///
/// # Panics
/// If there is no part.
pub fn survey(paths: &[PathBuf]) -> Result<Survey> {
    let first = read_part_header(&paths[0])?;
    let mut survey = Survey {
        whole: first.whole,
        attributes: first.attributes.clone(),
        windows: Vec::new(),
        devices: BTreeSet::new(),
        overlaps: Vec::new(),
    };
    let place = |part: &PartHeader| (part.passes.first, part.window.row, part.window.column);
    let mut earliest = place(&first);
    for path in paths {
        let part = read_part_header(path)?;
        refuse_others(&part, path, &first, &paths[0])?;
        if place(&part) < earliest {
            earliest = place(&part);
            survey.attributes.clone_from(&part.attributes);
        }
        let attribute = |name: &str| part.attributes.get(name).cloned().unwrap_or_default();
        survey.devices.insert((attribute("device"), attribute("driver")));
        let entry = (part.passes, path.clone());
        match survey.windows.iter_mut().find(|parts| parts.window == part.window) {
            Some(parts) => parts.parts.push(entry),
            None => survey.windows.push(WindowParts { window: part.window, parts: vec![entry] }),
        }
    }
    survey.windows.sort_by_key(|parts| (parts.window.row, parts.window.column));
    survey.windows.iter_mut().for_each(|parts| parts.parts.sort());
    survey.overlaps = overlaps(&survey.windows);
    Ok(survey)
}

fn refuse_others(part: &PartHeader, path: &Path, first: &PartHeader, first_path: &Path) -> Result<()> {
    let mut told = differences(&first.attributes, &part.attributes);
    if part.whole != first.whole && !told.iter().any(|line| line.starts_with("`picture.size`")) {
        let size = |(width, height)| format!("{width}x{height}");
        told.push(format!("the size is {}, not {}", size(part.whole), size(first.whole)));
    }
    if told.is_empty() {
        return Ok(());
    }
    let more = told.len().saturating_sub(MOST_TOLD);
    told.truncate(MOST_TOLD);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    let (path, first) = (path.display(), first_path.display());
    Err(Error::Differs(format!("{path}: is a part of another picture than {first}: {}{more}", told.join(", "))))
}

fn overlaps(windows: &[WindowParts]) -> Vec<String> {
    let mut found = Vec::new();
    for parts in windows {
        let (mut last, mut end) = (None, 0);
        for (passes, path) in &parts.parts {
            if let Some(last) = last.filter(|_| passes.first < end) {
                let both = PassRange { first: passes.first, end: end.min(passes.end) };
                let last: &PathBuf = last;
                found.push(format!("the passes {both} are in {} and {}", last.display(), path.display()));
            }
            if passes.end > end {
                (last, end) = (Some(path), passes.end);
            }
        }
    }
    for (i, one) in windows.iter().enumerate() {
        for other in &windows[i + 1..] {
            let Crop { column, row, width, height } = other.window;
            if one.window.touches((column, row), (width, height)) {
                let (a, b) = (words(one.window), words(other.window));
                found.push(format!("the crops {a} ({}) and {b} ({}) overlap", one.first_file(), other.first_file()));
            }
        }
    }
    found
}

/// Column, row, width and height.
fn words(Crop { column, row, width, height }: Crop) -> String {
    format!("{column},{row},{width},{height}")
}

impl WindowParts {
    /// Ranges of passes that are there, ascending.
    #[must_use]
    pub fn passes(&self) -> Vec<PassRange> {
        let mut all: Vec<PassRange> = Vec::new();
        for (passes, _) in &self.parts {
            match all.last_mut() {
                Some(last) if last.end >= passes.first => last.end = last.end.max(passes.end),
                _ => all.push(*passes),
            }
        }
        all
    }

    /// Ranges of passes that are missing of `wanted`.
    #[must_use]
    pub fn missing(&self, wanted: PassRange) -> Vec<PassRange> {
        let mut at = wanted.first;
        let mut missing = Vec::new();
        for there in self.passes().into_iter().chain([PassRange { first: wanted.end, end: wanted.end }]) {
            if there.first > at {
                missing.push(PassRange { first: at, end: there.first.min(wanted.end) });
            }
            at = at.max(there.end);
            if at >= wanted.end {
                break;
            }
        }
        missing
    }

    fn first_file(&self) -> String {
        self.parts.first().map_or(String::new(), |(_, path)| path.display().to_string())
    }
}

impl Survey {
    /// Passes from 0 to the last one that is there.
    #[must_use]
    pub fn passes(&self) -> PassRange {
        let ends = self.windows.iter().flat_map(|parts| parts.parts.iter().map(|(passes, _)| passes.end));
        PassRange { first: 0, end: ends.max().unwrap_or(0) }
    }

    /// Passes and pixels missing of the passes `wanted`. A single window is a crop that is wanted.
    #[must_use]
    pub fn missing(&self, wanted: PassRange) -> Vec<Missing> {
        let many = self.windows.len() > 1;
        let of_window = |parts: &WindowParts| {
            let crop = many.then_some(parts.window);
            parts.missing(wanted).into_iter().map(move |passes| Missing { crop, passes })
        };
        let passes = self.windows.iter().flat_map(of_window);
        let crops = if many { self.missing_pixels() } else { Vec::new() };
        let crops = crops.into_iter().map(|crop| Missing { crop: Some(crop), passes: wanted });
        passes.chain(crops).collect()
    }

    /// Rectangles of pixels around a single crop: all that is wanted, or a part of it.
    #[must_use]
    pub fn around_crop(&self) -> Vec<Crop> {
        if self.windows.len() == 1 { self.missing_pixels() } else { Vec::new() }
    }

    /// Rectangles of pixels that no part holds.
    fn missing_pixels(&self) -> Vec<Crop> {
        let (width, height) = self.whole;
        let cuts = |of: &dyn Fn(&Crop) -> [u32; 2], side: u32| -> Vec<u32> {
            let all: BTreeSet<u32> = self.windows.iter().flat_map(|parts| of(&parts.window)).chain([0, side]).collect();
            all.into_iter().collect()
        };
        let columns = cuts(&|c| [c.column, c.column + c.width], width);
        let rows = cuts(&|c| [c.row, c.row + c.height], height);
        let mut missing: Vec<Crop> = Vec::new();
        for row in rows.windows(2) {
            for column in columns.windows(2) {
                let cell =
                    Crop { column: column[0], row: row[0], width: column[1] - column[0], height: row[1] - row[0] };
                if self.windows.iter().any(|parts| parts.window.touches((cell.column, cell.row), (1, 1))) {
                    continue;
                }
                match missing.last_mut() {
                    Some(last) if last.row == cell.row && last.column + last.width == cell.column => {
                        last.width += cell.width;
                    }
                    _ => missing.push(cell),
                }
            }
        }
        // Joins rectangles of the same columns below each other.
        let mut joined: Vec<Crop> = Vec::new();
        for crop in missing {
            let above = |other: &&mut Crop| {
                (other.column, other.width, other.row + other.height) == (crop.column, crop.width, crop.row)
            };
            match joined.iter_mut().find(above) {
                Some(other) => other.height += crop.height,
                None => joined.push(crop),
            }
        }
        joined
    }
}

/// Adds up the parts, one after the other. The bits are those of one machine, whatever the split.
/// `check` is asked before each part is read.
///
/// # Errors
/// [`Error::Io`] if a part cannot be read, and the errors of `check`.
pub fn merge(survey: &Survey, check: &dyn Fn(usize) -> Result<()>) -> Result<(Frame, Attributes)> {
    let mut attributes = survey.attributes.clone();
    attributes.remove("blocks");
    attributes.remove("partFormat");
    let joined = |of: fn(&(String, String)) -> &String| {
        survey.devices.iter().map(of).collect::<BTreeSet<_>>().into_iter().cloned().collect::<Vec<_>>().join("; ")
    };
    attributes.insert("device".to_owned(), joined(|(device, _)| device));
    attributes.insert("driver".to_owned(), joined(|(_, driver)| driver));
    let (mut frames, mut read, mut extra_samples) = (Vec::new(), 0, 0);
    for parts in &survey.windows {
        let mut fold = Fold::default();
        for (_, path) in &parts.parts {
            check(read)?;
            read_part(path)?.1.blocks.into_iter().try_for_each(|block| fold.push(block))?;
            read += 1;
        }
        let sum = fold.finish()?.expect("a window has a part");
        if frames.is_empty() {
            count_photons(&mut attributes, sum.photons.global, sum.photons.caustic);
            let passes: Vec<String> = parts.passes().iter().map(ToString::to_string).collect();
            attributes.insert("passes".to_owned(), passes.join(", "));
        }
        extra_samples += sum.film.extra_samples;
        frames.push((parts.window, sum.film.finish_with_errors()));
    }
    count_samples(&mut attributes, extra_samples);
    if frames.len() == 1 {
        return Ok((frames.pop().expect("one frame").1, attributes));
    }
    forget_crop(&mut attributes);
    Ok((joined_frames(survey.whole, &frames), attributes))
}

/// Sets the crop of the settings to none.
fn forget_crop(attributes: &mut Attributes) {
    let Some(settings) = attributes.get_mut("settings") else { return };
    let Ok(mut parsed) = serde_json::from_str::<crate::settings::Settings>(settings) else { return };
    parsed.picture.crop = None;
    *settings = serde_json::to_string(&parsed).expect("settings hold nothing that JSON cannot");
}

/// The whole picture of frames that are parts of it.
fn joined_frames((width, height): (u32, u32), frames: &[(Crop, Frame)]) -> Frame {
    let mut whole = Frame::new(width, height, &vec![[0.0; 3]; width as usize * height as usize]);
    whole.window = DataWindow::of((width, height), Crop { column: 0, row: 0, width, height });
    let copy = |into: &mut [f32], from: &[f32], window: Crop, count: usize| {
        let line = window.width as usize * count;
        for (row, numbers) in from.chunks(line).enumerate() {
            let at = ((window.row as usize + row) * width as usize + window.column as usize) * count;
            into[at..at + line].copy_from_slice(numbers);
        }
    };
    for (window, frame) in frames {
        for layer in &LAYERS {
            copy(whole.layer_mut(layer.name), frame.layer(layer.name), *window, layer.channels.len());
        }
    }
    let names: Vec<String> = frames[0].1.extras().map(|(name, _)| name.to_owned()).collect();
    for name in names {
        let mut numbers = vec![0.0; whole.pixels()];
        let of_all = frames.iter().all(|(window, frame)| {
            let found = frame.extras().find(|(other, _)| *other == name);
            found.inspect(|(_, from)| copy(&mut numbers, from, *window, 1)).is_some()
        });
        if of_all {
            whole.add_extra(&name, numbers);
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        image::{Film, PassBlock, PassSum, write_part},
        stats::Stats,
    };

    const WHOLE: (u32, u32) = (4, 3);

    /// Writes the passes of some pixels. Each pixel has values of its own in each pass.
    /// The name of the scene is that of the file.
    fn write(path: &Path, window: Crop, passes: std::ops::Range<u32>, version: &str) -> PathBuf {
        let scene = path.file_name().unwrap().to_str().unwrap();
        let mut sum = PassSum::default();
        for index in passes {
            let mut film = Film::new(WHOLE, window, 2);
            for (row, column) in (0..window.height).flat_map(|y| (0..window.width).map(move |x| (y, x))) {
                let pixel = (row + window.row) * WHOLE.0 + column + window.column;
                let value = 0.1 * (pixel + 1) as f32 + 1.0 / (index as f32 + 3.0);
                film.add(
                    (column, row),
                    &[[value, value, value, 0.0], [value; 4], [2.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]],
                    2,
                );
            }
            let film = film.with_bandwidth(1.0 / f64::from(index + 1));
            sum.push(PassBlock::of_pass(index, film, &Stats::default())).unwrap();
        }
        let attributes = [("version", version), ("scene", scene)].map(|(a, b)| (a.to_owned(), b.to_owned())).into();
        write_part(path, &sum, &attributes).unwrap();
        path.to_path_buf()
    }

    const ALL: Crop = Crop { column: 0, row: 0, width: 4, height: 3 };

    fn merged(paths: &[PathBuf]) -> Frame {
        merge(&survey(paths).unwrap(), &|_| Ok(())).unwrap().0
    }

    #[test]
    fn splits_over_passes_and_pixels_give_the_bits_of_one_machine() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        let one = merged(&[write(&file("one"), ALL, 0..11, "1")]);
        let cuts = [0, 3, 8, 11].windows(2).map(|w| write(&file(&format!("p{}", w[0])), ALL, w[0]..w[1], "1"));
        let mut passes: Vec<_> = cuts.collect();
        passes.reverse();
        assert_eq!(merged(&passes), one);
        assert!(one.extras().count() == 6, "with layers of errors");
        let (left, right) = (Crop { width: 1, ..ALL }, Crop { column: 1, width: 3, ..ALL });
        let crops = [
            write(&file("l"), left, 0..11, "1"),
            write(&file("r0"), right, 0..5, "1"),
            write(&file("r5"), right, 5..11, "1"),
        ];
        assert_eq!(merged(&crops), one);
        assert_ne!(merged(&passes[1..]), one, "control");
    }

    #[test]
    fn attributes_are_those_of_the_first_pass_whatever_the_order() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        let (top, rest) = (Crop { height: 1, ..ALL }, Crop { row: 1, height: 2, ..ALL });
        let parts = [
            write(&file("late"), top, 3..4, "1"),
            write(&file("low"), rest, 0..4, "1"),
            write(&file("first"), top, 0..3, "1"),
        ];
        for turn in 0..3 {
            let mut parts = parts.clone();
            parts.rotate_left(turn);
            let attributes = merge(&survey(&parts).unwrap(), &|_| Ok(())).unwrap().1;
            assert_eq!(attributes["scene"], "first", "{turn}");
        }
    }

    #[test]
    fn passes_and_pixels_that_are_missing_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        let missing = |crop: Option<Crop>, first: u32, end: u32| Missing { crop, passes: PassRange { first, end } };
        let a = write(&file("a"), ALL, 2..3, "1");
        let b = write(&file("b"), ALL, 5..9, "1");
        let found = survey(&[b.clone(), a.clone()]).unwrap();
        assert_eq!(found.missing(found.passes()), [missing(None, 0, 2), missing(None, 3, 5)]);
        assert_eq!(found.missing(PassRange { first: 2, end: 12 }), [missing(None, 3, 5), missing(None, 9, 12)]);
        assert!(found.missing(PassRange { first: 5, end: 9 }).is_empty());
        assert_eq!(found.overlaps, [""; 0]);
        assert!(found.around_crop().is_empty());
        let crop = Crop { column: 1, row: 1, width: 2, height: 1 };
        let c = write(&file("c"), crop, 0..2, "1");
        let d = write(&file("d"), Crop { row: 2, ..crop }, 0..2, "1");
        let found = survey(std::slice::from_ref(&c)).unwrap();
        assert!(found.missing(found.passes()).is_empty(), "a crop may be all that is wanted");
        let around = [[0, 0, 4, 1], [0, 1, 1, 1], [3, 1, 1, 1], [0, 2, 4, 1]];
        assert_eq!(found.around_crop(), around.map(|[column, row, width, height]| Crop { column, row, width, height }));
        let found = survey(&[c, d]).unwrap();
        assert!(found.around_crop().is_empty(), "they are missing");
        let expected = [[0, 0, 4, 1], [0, 1, 1, 2], [3, 1, 1, 2]]
            .map(|[column, row, width, height]| missing(Some(Crop { column, row, width, height }), 0, 2));
        assert_eq!(found.missing(found.passes()), expected);
    }

    #[test]
    fn overlaps_and_other_pictures_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        let a = write(&file("a"), ALL, 0..4, "1");
        let b = write(&file("b"), ALL, 2..9, "1");
        let crop = write(&file("crop"), Crop { width: 1, ..ALL }, 0..4, "1");
        let overlaps = survey(&[a.clone(), b, crop]).unwrap().overlaps;
        assert_eq!(overlaps.len(), 2, "{overlaps:?}");
        assert!(
            overlaps[0].contains("the passes 2..4 are in ") && overlaps[1].contains("the crops 0,0,"),
            "{overlaps:?}"
        );
        let other = write(&file("other"), ALL, 4..5, "2");
        let message = survey(&[a, other]).unwrap_err().to_string();
        assert!(
            message.contains("other: is a part of another picture than") && message.ends_with("version is 2, not 1")
        );
    }
}
