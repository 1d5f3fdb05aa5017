//! Parts: the sums of some passes of a picture, or of a part of its pixels, in an OpenEXR file.
//!
//! A part shows as a picture: `R G B A` are the means of its passes. Each block of passes has the
//! channels `passesA-B.sum.C`, the sums over all samples of each channel C of [`LAYERS`], and if it
//! has several passes, `passesA-B.deviations.C` and `passesA-B.withBandwidth.C`, their second
//! moments. Layers on request have sums, and mattes the hashes and counts of their ranks. All are
//! 32-bit floats as they are in memory. `caustica:blocks` holds the rest as JSON.

use std::{io::BufReader, path::Path};

use exr::{
    block::{BlockIndex, chunk::TileCoordinates},
    meta::MetaData,
};
use serde::{Deserialize, Serialize};

use super::{
    bias_check::BiasCheck,
    cryptomatte::{Matte, RANKS},
    exr::{Attributes, channels_of, count_photons, count_samples, encode, failure},
    exr_read::{attributes_of, open_or, our_attributes, window_of},
    file::{open_regular, write_file},
    film::Film,
    film_sums::{Bandwidth, ExtraSums, Moments},
    frame::DataWindow,
    layers::{EXTRA_LAYERS, LAYERS, Rule, layer_index},
    pass_sum::{PassBlock, PassSum, is_block},
};
use crate::{
    error::{Error, Result},
    map_kind::ByKind,
    settings::{Crop, ExtraLayers, PassRange, PictureSettings, PixelGrid},
    stats::MapStats,
};

/// Version of what the channels and `blocks` hold, in the attribute `partFormat`. Parts without one
/// are of format 1, without estimates of less bias; those of format 2 have differences from them.
const FORMAT: &str = "3";
/// Kinds of the channels of estimates of less bias: sums, and of several passes their deviations.
const CHECKS: [&str; 2] = ["closer", "closerDeviations"];

/// Header of a part: all but its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct PartHeader {
    /// Attributes of the file.
    pub attributes: Attributes,
    /// Width and height of the whole picture, pixels.
    pub whole: (u32, u32),
    /// The part of the picture that it holds.
    pub window: Crop,
    /// The passes that it holds.
    pub passes: PassRange,
}

/// A block in the attribute `blocks`.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct BlockRow {
    passes: PassRange,
    samples: u64,
    non_finite: u64,
    /// Bit patterns of the mean of the squared radii, of the sum of their squared deviations, and
    /// of the mean of their inverses.
    bandwidth: [u64; 3],
    global: MapStats,
    caustic: MapStats,
    #[serde(default)]
    extras: Vec<ExtraRow>,
    #[serde(default)]
    mattes: Vec<ExtraLayers>,
    /// Number of times that the samples of a pixel double at most.
    #[serde(default)]
    doublings: u32,
    #[serde(default)]
    extra_samples: u64,
    /// Whether the passes have estimates of less bias.
    #[serde(default)]
    has_closer: bool,
}

/// A layer that was asked for.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct ExtraRow {
    channels: Vec<String>,
    rule: Rule,
}

impl ExtraRow {
    /// Names of all numbers of a pixel.
    fn numbers(&self) -> Vec<String> {
        let layer = self.channels.first().and_then(|name| name.rsplit_once('.')).map_or("", |(layer, _)| layer);
        let count = (self.rule == Rule::PerCount).then(|| format!("{layer}.count"));
        self.channels.iter().cloned().chain(count).collect()
    }
}

/// Names of the numbers of a matte: hash and count of each rank.
fn matte_numbers(of: ExtraLayers) -> Vec<String> {
    let ranks = 0..RANKS;
    ranks.flat_map(|rank| ["hash", "count"].map(|number| format!("{}.{number}{rank}", Matte::name(of)))).collect()
}

/// Writes a part. `attributes` are those of a picture.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written. An older file is then kept.
///
/// # Panics
/// If there is no pass, or passes are not consecutive.
pub fn write_part(path: &Path, sum: &PassSum, attributes: &Attributes) -> Result<()> {
    let total = sum.total()?.expect("a part has a pass");
    let mut attributes = attributes.clone();
    count_photons(&mut attributes, total.photons.global, total.photons.caustic);
    count_samples(&mut attributes, total.film.extra_samples);
    let rows: Vec<BlockRow> = sum.blocks.iter().map(row).collect();
    attributes.insert("blocks".to_owned(), serde_json::to_string(&rows).expect("blocks hold numbers only"));
    attributes.insert("passes".to_owned(), range(&rows).to_string());
    attributes.insert("partFormat".to_owned(), FORMAT.to_owned());
    let frame = total.film.finish();
    let shown = ["radiance", "alpha"].map(|name| LAYERS[layer_index(name)]);
    let mut channels: Vec<_> =
        shown.iter().flat_map(|layer| channels_of(frame.layer(layer.name), layer.channels, "")).collect();
    for PassBlock { range, film, .. } in &sum.blocks {
        let before = before(*range);
        for (i, layer) in LAYERS.iter().enumerate() {
            channels.extend(channels_of(&film.sums[i], layer.channels, &format!("{before}sum.")));
            let Some(moments) = &film.moments else { continue };
            channels.extend(channels_of(&moments.deviations[i], layer.channels, &format!("{before}deviations.")));
        }
        let own = row_of_layers(film);
        for (layer, row) in film.extras.iter().zip(&own.0) {
            let names = row.numbers();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            channels.extend(channels_of(&layer.sums, &names, &format!("{before}sum.")));
        }
        for matte in &film.mattes {
            let names = matte_numbers(matte.of);
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let numbers = |[hash, count]: &[u32; 2]| [f32::from_bits(*hash), *count as f32];
            let numbers: Vec<f32> = matte.ranks.iter().flatten().flat_map(numbers).collect();
            channels.extend(channels_of(&numbers, &names, &before));
        }
        if let Some(check) = &film.check {
            let names = LAYERS[layer_index("radiance")].channels;
            let kinds = CHECKS.iter().zip([&check.sums, &check.deviations]);
            for (kind, sums) in kinds.take(1 + usize::from(check.passes > 1)) {
                let mut spread = vec![0.0; 3 * frame.pixels()];
                for (place, numbers) in PixelGrid::of(film.whole).places(film.window).zip(sums.chunks(3)) {
                    spread[3 * place..][..3].copy_from_slice(numbers);
                }
                channels.extend(channels_of(&spread, names, &format!("{before}{kind}.")));
            }
        }
        if let Some(moments) = &film.moments {
            let names = LAYERS[layer_index("radiance")].channels;
            channels.extend(channels_of(&moments.with_bandwidth, names, &format!("{before}withBandwidth.")));
        }
    }
    let size = (frame.width, frame.height);
    let bytes = encode(size, frame.window, channels, &attributes).map_err(|e| failure(path, e))?;
    write_file(path, &bytes)
}

/// Beginning of the names of a block's channels.
fn before(range: PassRange) -> String {
    format!("passes{}-{}.", range.first, range.end)
}

/// Layers of a film that were asked for.
fn row_of_layers(film: &Film) -> (Vec<ExtraRow>, Vec<ExtraLayers>) {
    let row = |layer: &ExtraSums| ExtraRow { channels: layer.channels.clone(), rule: layer.rule };
    (film.extras.iter().map(row).collect(), film.mattes.iter().map(|matte| matte.of).collect())
}

fn row(block: &PassBlock) -> BlockRow {
    let (extras, mattes) = row_of_layers(&block.film);
    let Bandwidth { mean, deviations, inverse } = block.film.bandwidth;
    BlockRow {
        passes: block.range,
        samples: block.film.samples,
        non_finite: block.film.non_finite,
        bandwidth: [mean, deviations, inverse].map(f64::to_bits),
        global: block.photons.global,
        caustic: block.photons.caustic,
        extras,
        mattes,
        doublings: block.film.doublings,
        extra_samples: block.film.extra_samples,
        has_closer: block.film.check.is_some(),
    }
}

/// The passes of consecutive blocks, of which there is one at least.
fn range(rows: &[BlockRow]) -> PassRange {
    PassRange { first: rows[0].passes.first, end: rows[rows.len() - 1].passes.end }
}

/// Reads what a part says of itself, without its pixels.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, is not a part, or is cut off.
pub fn read_part_header(path: &Path) -> Result<PartHeader> {
    let file = open_regular(path).map_err(|source| Error::Io { path: path.to_path_buf(), source })?;
    let file = exr::block::read(BufReader::new(file), false).map_err(|error| match error {
        exr::error::Error::Io(source) => Error::Io { path: path.to_path_buf(), source },
        _ => no_part(path),
    })?;
    let [header] = file.headers() else { return Err(no_part(path)) };
    let attributes = our_attributes(header.shared_attributes.other.iter().chain(&header.own_attributes.other));
    let size = (header.layer_size.width() as u32, header.layer_size.height() as u32);
    let whole = header.shared_attributes.display_window;
    let position = header.own_attributes.layer_position - whole.position;
    let at = |n: i32| u32::try_from(n).map_err(|_| no_part(path));
    let window = Crop { column: at(position.x())?, row: at(position.y())?, width: size.0, height: size.1 };
    let whole = (whole.size.width() as u32, whole.size.height() as u32);
    let rows = rows(path, &attributes)?;
    // The last lines of the picture are the last bytes of the file.
    let is_last = |_: &MetaData, _: TileCoordinates, block: BlockIndex| {
        block.pixel_position.y() + block.pixel_size.height() == size.1 as usize
    };
    let mut lines = file.filter_chunks(false, is_last).map_err(|_| cut_off(path))?;
    match lines.next() {
        Some(Ok(_)) => Ok(PartHeader { passes: range(&rows), attributes, whole, window }),
        _ => Err(cut_off(path)),
    }
}

/// Reads a part.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read or is not a part.
pub fn read_part(path: &Path) -> Result<(PartHeader, PassSum)> {
    // What the decoder refuses is no part, or is cut off, or else has a damaged line.
    let image = open_or(path, |_| read_part_header(path).err().unwrap_or_else(|| damaged(path)))?;
    let attributes = attributes_of(&image);
    let rows = rows(path, &attributes)?;
    let layer = &image.layer_data;
    let size = (layer.size.width() as u32, layer.size.height() as u32);
    let DataWindow { whole, column, row } = window_of(&image).unwrap_or(DataWindow { whole: size, column: 0, row: 0 });
    let window = Crop { column, row, width: size.0, height: size.1 };
    let pixels = layer.size.area();
    let read = |before: &str, names: &[&str]| -> Result<Vec<f32>> {
        let channel = |name: &&str| {
            let name = format!("{before}{name}");
            let channel = layer.channel_data.list.iter().find(|c| c.name.bytes() == name.as_bytes());
            let samples = channel.map(|c| c.sample_data.values_as_f32().collect::<Vec<_>>());
            let missing = || failure(path, format!("the part has no channel {name}"));
            samples.filter(|samples| samples.len() == pixels).ok_or_else(missing)
        };
        let channels: Vec<Vec<f32>> = names.iter().map(channel).collect::<Result<_>>()?;
        Ok((0..pixels).flat_map(|i| channels.iter().map(move |channel| channel[i])).collect())
    };
    let mut blocks = Vec::new();
    for row in &rows {
        let before = before(row.passes);
        let of_layers = |kind: &str| -> Result<[Vec<f32>; LAYERS.len()]> {
            let mut all = [const { Vec::new() }; LAYERS.len()];
            for (numbers, layer) in all.iter_mut().zip(&LAYERS) {
                *numbers = read(&format!("{before}{kind}."), layer.channels)?;
            }
            Ok(all)
        };
        let moments = || -> Result<Moments> {
            let names = LAYERS[layer_index("radiance")].channels;
            let with_bandwidth = read(&format!("{before}withBandwidth."), names)?;
            Ok(Moments { deviations: of_layers("deviations")?, with_bandwidth })
        };
        let extra = |row: &ExtraRow| -> Result<ExtraSums> {
            let (channels, rule) = (row.channels.clone(), row.rule);
            let known = EXTRA_LAYERS.iter().find(|known| known.channels.iter().eq(&channels));
            let names = row.numbers();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let sums = read(&format!("{before}sum."), &names)?;
            Ok(ExtraSums { channels, rule, source: known.map(|known| known.source), sums })
        };
        let matte = |of: &ExtraLayers| -> Result<Matte> {
            let names = matte_numbers(*of);
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let numbers = read(&before, &names)?;
            let rank = |pixel: &[f32], rank: usize| [pixel[2 * rank].to_bits(), pixel[2 * rank + 1] as u32];
            let ranks = |pixel: &[f32]| std::array::from_fn(|i| rank(pixel, i));
            Ok(Matte { of: *of, ranks: numbers.chunks(2 * RANKS).map(ranks).collect() })
        };
        let check = || -> Result<BiasCheck> {
            let of = |kind: &str| -> Result<Vec<f32>> {
                let spread = read(&format!("{before}{kind}."), LAYERS[layer_index("radiance")].channels)?;
                let places = PixelGrid::of(whole).places(window);
                Ok(places.flat_map(|place| spread[3 * place..][..3].to_vec()).collect())
            };
            let sums = BiasCheck::of_pass(of(CHECKS[0])?);
            let passes = row.passes.count();
            Ok(if passes > 1 { BiasCheck { passes, deviations: of(CHECKS[1])?, ..sums } } else { sums })
        };
        let [mean, deviations, inverse] = row.bandwidth.map(f64::from_bits);
        let film = Film {
            whole,
            window,
            passes: row.passes.count(),
            samples: row.samples,
            sums: of_layers("sum")?,
            bandwidth: Bandwidth { mean, deviations, inverse },
            moments: if row.passes.count() > 1 { Some(moments()?) } else { None },
            extras: row.extras.iter().map(extra).collect::<Result<_>>()?,
            mattes: row.mattes.iter().map(matte).collect::<Result<_>>()?,
            check: row.has_closer.then(check).transpose()?,
            non_finite: row.non_finite,
            doublings: row.doublings,
            extra_samples: row.extra_samples,
        };
        let photons = ByKind { global: row.global, caustic: row.caustic };
        blocks.push(PassBlock { range: row.passes, film, photons });
    }
    Ok((PartHeader { passes: range(&rows), attributes, whole, window }, PassSum { blocks }))
}

/// The attribute `blocks`, checked.
fn rows(path: &Path, attributes: &Attributes) -> Result<Vec<BlockRow>> {
    let text = attributes.get("blocks").ok_or_else(|| no_part(path))?;
    let rows: Vec<BlockRow> = serde_json::from_str(text).map_err(|_| no_part(path))?;
    let is_good = |row: &BlockRow| {
        let is_finite = row.bandwidth.iter().all(|bits| f64::from_bits(*bits).is_finite());
        let in_reach = row.passes.first < row.passes.end && PassRange::END.contains(row.passes.end);
        in_reach
            && is_block(row.passes)
            && row.samples > 0
            && row.doublings <= PictureSettings::MOST_DOUBLINGS
            && is_finite
    };
    let consecutive = rows.windows(2).all(|pair| pair[0].passes.end == pair[1].passes.first);
    if rows.is_empty() || !consecutive || !rows.iter().all(is_good) {
        return Err(no_part(path));
    }
    match attributes.get("partFormat").map_or("1", String::as_str) {
        FORMAT => Ok(rows),
        other => Err(failure(path, format!("is a part of format {other}; this version reads and writes {FORMAT}"))),
    }
}

fn cut_off(path: &Path) -> Error {
    failure(path, "is a broken part: the end of the file is missing")
}

fn damaged(path: &Path) -> Error {
    failure(path, "is a broken part: its pixels are damaged")
}

fn no_part(path: &Path) -> Error {
    failure(path, "is no part of a picture: `write_part` did not write it, or it is damaged")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        image::{cryptomatte::hash, layers::Source, read_exr, write_exr_with},
        map_kind::MapKind,
        stats::Stats,
    };

    const WINDOW: Crop = Crop { column: 1, row: 2, width: 3, height: 2 };

    /// Passes of a crop of 3 x 2 pixels.
    fn sum(passes: std::ops::Range<u32>) -> PassSum {
        let mut sum = PassSum::default();
        for index in passes {
            let mut film = Film::new((5, 7), WINDOW, 4).with_layers(&ExtraLayers::ALL).with_doublings(2);
            for pixel in 0..6 {
                let value = 0.1 * (pixel + 1) as f32 + 1.0 / (index as f32 + 3.0);
                let position = (pixel % 3, pixel / 3);
                let rows = [
                    [value, value * 1e-9, 1e9, 0.0],
                    [value; 4],
                    [2.0; 4],
                    [value * 7.0; 4],
                    [value * 8.0; 4],
                    [0.0; 4],
                ];
                film.add(position, &rows, 4);
                film.add_to(Source::Estimate(MapKind::Caustic), position, &[value, 3.0, 1.0]);
                film.add_to_matte(ExtraLayers::Objects, position, [hash("a"), hash("b"), hash("a")].into_iter());
                film.weigh(position, if pixel == 2 { 2 } else { 0 });
            }
            let film = film.with_bandwidth(1.0 / (f64::from(index) + 0.3)).checked_by(&closer(index));
            sum.push(PassBlock::of_pass(index, film, &Stats::default())).expect("of one picture");
        }
        sum
    }

    /// Estimates of less bias at the pixels of the grid in the crop, which are all.
    fn closer(index: u32) -> Film {
        let mut film = Film::new((5, 7), WINDOW, 1);
        for pixel in 0..6 {
            let value = 1.0 / ((index + pixel) as f32 + 0.7);
            let position = (pixel % 3, pixel / 3);
            film.add(position, &[[value, 3.0, 1e-7, 0.0], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]], 1);
        }
        film
    }

    fn attributes() -> Attributes {
        [("version", "1"), ("sceneHash", "ab")].map(|(a, b)| (a.to_owned(), b.to_owned())).into()
    }

    #[test]
    fn a_part_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        for passes in [0..1, 3..8, 0..8, 999_990..1_000_000] {
            let written = sum(passes.clone());
            write_part(&path, &written, &attributes()).unwrap();
            let (header, read) = read_part(&path).unwrap();
            assert_eq!(read, written, "{passes:?}");
            assert_eq!(read_part_header(&path).unwrap(), header);
            assert_eq!((header.whole, header.window), ((5, 7), WINDOW));
            assert_eq!(header.passes, PassRange { first: passes.start, end: passes.end });
            assert_eq!(header.attributes["sceneHash"], "ab");
            assert_ne!(read, sum(0..2), "control");
        }
    }

    #[test]
    fn a_part_shows_the_means_as_a_picture() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let written = sum(3..8);
        write_part(&path, &written, &attributes()).unwrap();
        let shown = read_exr(&path).unwrap();
        let expected = written.total().unwrap().unwrap().film.finish();
        assert_eq!((shown.radiance(), shown.alpha()), (expected.radiance(), expected.alpha()));
        assert_eq!(shown.window, expected.window);
    }

    #[test]
    fn other_files_are_no_parts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let said = |path: &Path| {
            let message = read_part(path).unwrap_err().to_string();
            assert_eq!(read_part_header(path).unwrap_err().to_string(), message);
            message
        };
        write_exr_with(&path, &sum(0..1).blocks[0].film.finish(), &attributes()).unwrap();
        assert!(said(&path).contains("is no part of a picture"), "{}", said(&path));
        // A header alone, of 16 gigapixels.
        write_part(&path, &sum(0..1), &attributes()).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
            let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
            bytes[at..at + 16].copy_from_slice(&[[0; 4], [0; 4], [255, 255, 1, 0], [255, 255, 1, 0]].concat());
        }
        std::fs::write(&path, &bytes).unwrap();
        let message = read_part(&path).unwrap_err().to_string();
        assert!(message.contains("is damaged: ") && message.ends_with("131072 x 131072 pixels"), "{message}");
        let (format, blocks) = (b"partFormat\0", b"string\0\x01\0\0\0");
        write_part(&path, &sum(0..1), &attributes()).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let name = [&b"caustica:"[..], format, blocks].concat();
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len();
        assert_eq!(bytes[at], b'3');
        bytes[at] = b'1';
        std::fs::write(&path, &bytes).unwrap();
        assert!(said(&path).contains("is a part of format 1; this version reads and writes 3"), "{}", said(&path));
        write_part(&path, &sum(0..1), &attributes()).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for bytes in [whole.len() - 1, whole.len() - 200] {
            std::fs::write(&path, &whole[..bytes]).unwrap();
            let message = read_part_header(&path).unwrap_err().to_string();
            assert!(message.ends_with("a.exr: is a broken part: the end of the file is missing"), "{message}");
            assert!(read_part(&path).is_err());
        }
        let mut damaged = whole.clone();
        let middle = whole.len() - 300;
        damaged[middle..middle + 40].fill(255);
        std::fs::write(&path, &damaged).unwrap();
        let message = read_part(&path).unwrap_err().to_string();
        assert!(message.contains("is a broken part: its pixels are damaged"), "{message}");
        for bytes in [&b"no picture at all"[..], b"", &whole[..100]] {
            std::fs::write(&path, bytes).unwrap();
            assert!(said(&path).contains("is no part of a picture"), "{}", said(&path));
        }
        for blocks in ["[]", "{}", "7", r#"[{"passes":{"first":3,"end":9}}]"#] {
            let mut attributes = attributes();
            attributes.insert("blocks".to_owned(), blocks.to_owned());
            write_exr_with(&path, &sum(0..1).blocks[0].film.finish(), &attributes).unwrap();
            assert!(said(&path).contains("is no part of a picture"), "{blocks}");
        }
    }
}
