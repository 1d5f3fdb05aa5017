//! Reading of foreign radiance pictures, OpenEXR and Radiance HDR: colours only.

use std::{
    io::{self, Cursor, Read},
    path::Path,
};

use exr::{
    math::Vec2,
    meta::{MetaData, attribute::Chromaticities, header::Header},
    prelude::{ReadChannels, ReadLayers, ReadSpecificChannel},
};
use glam::{DVec2, dvec2};
use image::{ImageDecoder, ImageError, codecs::hdr::HdrDecoder};

use super::{
    file::open_regular,
    orientation::{Orientation, size_line},
    primaries::Primaries,
};
use crate::error::{Error, Result};

/// Size limit of a file, bytes: above the size of the largest picture uncompressed.
const MAX_BYTES: u64 = 4 << 30;
/// Size limit of a picture, pixels: 16384 x 8192.
const MAX_PIXELS: u64 = 1 << 27;

/// Size limits by file length: pixels that any file may claim, and pixels per byte beyond that.
/// Deflate, the strongest compression of the formats, expands one byte to at most 1032.
const UNCHECKED_PIXELS: u64 = 1 << 20;
const PIXELS_PER_BYTE: u64 = 1032;

/// Magic bytes of the two formats.
const EXR: &[u8] = &[0x76, 0x2f, 0x31, 0x01];
const HDR: &[u8] = b"#?";

/// Linear Rec.709 colours, row 0 at the top. All values are finite and ≥ 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RadiancePicture {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[f32; 3]>,
    /// Features that were approximated, one line each.
    pub notes: Vec<String>,
}

/// Description of a fault in a file.
type Problem = Box<dyn std::error::Error + Send + Sync>;

/// Reads the bytes of a file that begins with the magic bytes of one of the formats.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, begins otherwise or is too large.
pub(crate) fn read_radiance_bytes(path: &Path) -> Result<Vec<u8>> {
    let read = || -> std::result::Result<Vec<u8>, Problem> {
        let mut file = open_regular(path)?;
        // Reads to the end only if the magic bytes match.
        let mut bytes = Vec::new();
        file.by_ref().take(EXR.len() as u64).read_to_end(&mut bytes)?;
        if !bytes.starts_with(EXR) && !bytes.starts_with(HDR) {
            return Err("is neither OpenEXR nor Radiance HDR".into());
        }
        file.take(MAX_BYTES).read_to_end(&mut bytes)?;
        if bytes.len() as u64 >= MAX_BYTES {
            return Err(format!("is larger than {MAX_BYTES} bytes").into());
        }
        Ok(bytes)
    };
    read().map_err(|problem| failure(path, problem))
}

/// Decodes the bytes from [`read_radiance_bytes`]. Other primaries are converted; NaN and negative
/// values become 0, infinity the largest finite value of the picture.
///
/// # Errors
/// [`Error::Io`] with the path if the bytes are damaged, hold neither R, G, B nor luminance, or the
/// picture is too large.
pub(crate) fn decode_radiance(path: &Path, bytes: &[u8]) -> Result<RadiancePicture> {
    let decoded = if bytes.starts_with(EXR) { decode_exr(bytes) } else { decode_hdr(bytes) };
    let mut picture = decoded.map_err(|problem| failure(path, problem))?;
    let note = make_finite(&mut picture.pixels);
    picture.notes.extend(note);
    Ok(picture)
}

fn failure(path: &Path, problem: Problem) -> Error {
    let source = match problem.downcast::<io::Error>() {
        Ok(source) => *source,
        Err(problem) => io::Error::other(problem),
    };
    Error::Io { path: path.to_path_buf(), source }
}

/// Checks the size of a picture against the limits and the length of its file.
fn checked_size(width: u64, height: u64, length: usize) -> std::result::Result<(u32, u32), Problem> {
    let (width, height) = match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w @ 1..), Ok(h @ 1..)) if width * height <= MAX_PIXELS => (w, h),
        _ => return Err(format!("is {width} x {height} pixels; 1 to {MAX_PIXELS} pixels are read").into()),
    };
    if u64::from(width) * u64::from(height) > UNCHECKED_PIXELS + PIXELS_PER_BYTE * length as u64 {
        return Err(format!("is damaged: {length} bytes do not hold {width} x {height} pixels").into());
    }
    Ok((width, height))
}

/// Converts an error of the Radiance HDR decoder.
fn hdr_problem(error: ImageError) -> Problem {
    match error {
        ImageError::IoError(_) => "is damaged: it ends too early".into(),
        ImageError::Unsupported(error) => format!("cannot be read: {error}").into(),
        error => format!("is damaged: {error}").into(),
    }
}

/// Converts an error of the OpenEXR decoder.
fn exr_problem(error: exr::error::Error) -> Problem {
    match error {
        exr::error::Error::NotSupported(what) => format!("cannot be read: {what}").into(),
        exr::error::Error::Invalid(what) => format!("is damaged: {what}").into(),
        error => format!("is damaged: {error}").into(),
    }
}

fn decode_hdr(bytes: &[u8]) -> std::result::Result<RadiancePicture, Problem> {
    // The decoder knows one orientation. It is given the same scanlines under a line of sizes that
    // says that one.
    let end = bytes.len();
    let (line, orientation, usual) = size_line(bytes).unwrap_or((end..end, Orientation::USUAL, String::new()));
    let reader = bytes[..line.start].chain(usual.as_bytes()).chain(&bytes[line.end..]);
    // The strict decoder accepts only one of the signatures in use; this one accepts any.
    let decoder = HdrDecoder::new_nonstrict(reader).map_err(hdr_problem)?;
    let header = decoder.metadata();
    let (along, across) = decoder.dimensions();
    let (along, across) = checked_size(along.into(), across.into(), bytes.len())?;
    let mut pixels = vec![[0.0; 3]; along as usize * across as usize];
    decoder.read_image(bytemuck::cast_slice_mut(&mut pixels)).map_err(hdr_problem)?;
    let (mut pixels, (width, height)) = orientation.turned(pixels, (along as usize, across as usize));
    let (width, height) = (width as u32, height as u32);
    let mut notes = Vec::new();
    let exposure = header.exposure.unwrap_or(1.0);
    if exposure != 1.0 {
        notes.push(format!("its EXPOSURE of {exposure} is not undone, as in other renderers"));
    }
    let (r, g, b) = header.color_correction.unwrap_or((1.0, 1.0, 1.0));
    if [r, g, b] != [1.0; 3] {
        notes.push(format!("its COLORCORR of {r} {g} {b} is not undone, as in other renderers"));
    }
    let primaries = header.custom_attributes.iter().rfind(|(name, _)| name == "PRIMARIES");
    notes.extend(primaries.and_then(|(_, numbers)| match hdr_primaries(numbers) {
        Some(primaries) => primaries.convert(&mut pixels),
        None => Some(format!("its PRIMARIES, {:?}, are not eight numbers: Rec.709 is assumed", numbers.trim())),
    }));
    Ok(RadiancePicture { width, height, pixels, notes })
}

/// Primaries of a Radiance HDR file: x and y of red, green, blue and white.
fn hdr_primaries(text: &str) -> Option<Primaries> {
    let numbers = text.split_whitespace().map(str::parse).collect::<std::result::Result<Vec<f64>, _>>().ok()?;
    let numbers: [f64; 8] = numbers.try_into().ok()?;
    Some(Primaries([0, 2, 4, 6].map(|i| DVec2::from_slice(&numbers[i..]))))
}

impl From<Chromaticities> for Primaries {
    fn from(Chromaticities { red, green, blue, white }: Chromaticities) -> Self {
        Self([red, green, blue, white].map(|at| dvec2(at.x().into(), at.y().into())))
    }
}

/// Channels of an OpenEXR part that hold the colour.
enum Channels {
    Rgb([String; 3]),
    Luminance(String),
}

/// Finds the first layer with R, G and B, the unnamed one before others; else the luminance.
fn channels(header: &Header) -> Option<Channels> {
    let names: Vec<String> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
    let has = |name: &str| names.iter().any(|n| n == name);
    let layers = names.iter().filter_map(|name| name.strip_suffix(".R")).map(|layer| format!("{layer}."));
    let rgb = |layer: String| ["R", "G", "B"].map(|channel| format!("{layer}{channel}"));
    let mut colors = std::iter::once(String::new()).chain(layers).map(rgb);
    let luminance = (has("Y") && !has("RY") && !has("BY")).then(|| Channels::Luminance("Y".to_owned()));
    colors.find(|names| names.iter().all(|name| has(name))).map(Channels::Rgb).or(luminance)
}

// Decodes on one thread: a panic in a worker thread of the exr crate would end the process.
fn decode_exr(bytes: &[u8]) -> std::result::Result<RadiancePicture, Problem> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(exr_problem)?;
    let part = meta.headers.iter().filter(|header| !header.deep).find_map(|header| Some((header, channels(header)?)));
    let (header, channels) = part.ok_or("has neither the channels R, G and B nor the luminance Y alone")?;
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err("has subsampled channels, which are not read".into());
    }
    checked_size(header.layer_size.width() as u64, header.layer_size.height() as u64, bytes.len())?;
    let display = header.shared_attributes.display_window;
    let (width, height) = checked_size(display.size.width() as u64, display.size.height() as u64, bytes.len())?;
    let window = Window { width, height, offset: header.own_attributes.layer_position - display.position };
    let read = exr::prelude::read().no_deep_data().largest_resolution_level().specific_channels();
    // Luminance has no hue.
    let primaries = header.shared_attributes.chromaticities.filter(|_| matches!(channels, Channels::Rgb(_)));
    let mut pixels = match channels {
        Channels::Rgb([r, g, b]) => {
            read.required(r.as_str())
                .required(g.as_str())
                .required(b.as_str())
                .collect_pixels(
                    move |_, _| window.black(),
                    move |pixels: &mut Vec<_>, at, (r, g, b): (f32, f32, f32)| window.put(pixels, at, [r, g, b]),
                )
                .first_valid_layer()
                .all_attributes()
                .non_parallel()
                .from_buffered(Cursor::new(bytes))
                .map_err(exr_problem)?
                .layer_data
                .channel_data
                .pixels
        }
        Channels::Luminance(y) => {
            read.required(y.as_str())
                .collect_pixels(
                    move |_, _| window.black(),
                    move |pixels: &mut Vec<_>, at, (y,): (f32,)| window.put(pixels, at, [y; 3]),
                )
                .first_valid_layer()
                .all_attributes()
                .non_parallel()
                .from_buffered(Cursor::new(bytes))
                .map_err(exr_problem)?
                .layer_data
                .channel_data
                .pixels
        }
    };
    let note = primaries.and_then(|primaries| Primaries::from(primaries).convert(&mut pixels));
    Ok(RadiancePicture { width, height, pixels, notes: Vec::from_iter(note) })
}

/// Display window of an OpenEXR file. Data outside it is cropped; pixels without data are black.
#[derive(Clone, Copy)]
struct Window {
    width: u32,
    height: u32,
    /// Offset of the data window from the corner of the display window.
    offset: Vec2<i32>,
}

impl Window {
    fn black(self) -> Vec<[f32; 3]> {
        vec![[0.0; 3]; self.width as usize * self.height as usize]
    }

    /// Writes the colour of the data pixel `at`.
    fn put(self, pixels: &mut [[f32; 3]], at: Vec2<usize>, color: [f32; 3]) {
        let (x, y) = (at.x() as i64 + i64::from(self.offset.x()), at.y() as i64 + i64::from(self.offset.y()));
        if (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y) {
            pixels[y as usize * self.width as usize + x as usize] = color;
        }
    }
}

/// Makes all values finite and ≥ 0. Describes what was changed.
fn make_finite(pixels: &mut [[f32; 3]]) -> Option<String> {
    let numbers = || pixels.as_flattened().iter();
    let largest = numbers().copied().filter(|x| x.is_finite()).fold(0.0, f32::max);
    let (mut wrong, mut infinite) = (0_u64, 0_u64);
    for x in pixels.as_flattened_mut() {
        if x.is_nan() || *x < 0.0 {
            *x = 0.0;
            wrong += 1;
        } else if x.is_infinite() {
            *x = largest;
            infinite += 1;
        }
    }
    let wrong = (wrong > 0).then(|| format!("numbers below 0 or NaN, read as 0: {wrong}"));
    let infinite =
        (infinite > 0).then(|| format!("infinite numbers, read as the largest finite one, {largest}: {infinite}"));
    let changed: Vec<String> = wrong.into_iter().chain(infinite).collect();
    (!changed.is_empty()).then(|| changed.join("; "))
}

#[cfg(test)]
#[path = "radiance_tests.rs"]
mod tests;
