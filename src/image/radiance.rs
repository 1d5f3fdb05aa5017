//! Pictures of radiance that others made, OpenEXR and Radiance HDR, read for their colours alone.

use std::{
    fs::File,
    io::{self, Cursor, Read},
    path::Path,
};

use exr::{
    math::Vec2,
    meta::{MetaData, header::Header},
    prelude::{ReadChannels, ReadLayers, ReadSpecificChannel},
};
use image::{ImageDecoder, codecs::hdr::HdrDecoder};

use crate::error::{Error, Result};

/// Bytes of a file that are read: more than the largest picture takes uncompressed.
const MAX_BYTES: u64 = 4 << 30;
/// Pixels of a picture: 16384 x 8192.
const MAX_PIXELS: u64 = 1 << 27;

/// How files of the two formats begin.
const EXR: &[u8] = &[0x76, 0x2f, 0x31, 0x01];
const HDR: &[u8] = b"#?";

/// Scene-linear colours, row 0 at the top, each number finite and ≥ 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RadiancePicture {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[f32; 3]>,
    /// What was read in a special way, one line each.
    pub notes: Vec<String>,
}

/// What is wrong with a file.
type Problem = Box<dyn std::error::Error + Send + Sync>;

/// Bytes of a file that begins as one of the two formats.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, begins otherwise or is too large.
pub(crate) fn read_radiance_bytes(path: &Path) -> Result<Vec<u8>> {
    let read = || -> std::result::Result<Vec<u8>, Problem> {
        let mut file = File::open(path)?;
        // Only what looks right is read to the end: the path may be that of a device.
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

/// The picture in the bytes of [`read_radiance_bytes`]. NaN and numbers below 0 become 0, infinity the largest finite
/// number of the picture.
///
/// # Errors
/// [`Error::Io`] with the path if they are damaged, hold no R, G, B and no luminance, or are too large.
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

/// Width and height of a picture that may be read.
fn checked_size(width: u64, height: u64) -> std::result::Result<(u32, u32), Problem> {
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w @ 1..), Ok(h @ 1..)) if width * height <= MAX_PIXELS => Ok((w, h)),
        _ => Err(format!("is {width} x {height} pixels; 1 to {MAX_PIXELS} pixels are read").into()),
    }
}

fn decode_hdr(bytes: &[u8]) -> std::result::Result<RadiancePicture, Problem> {
    // The strict decoder takes one of the signatures in use only, and this one takes any.
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes))?;
    let exposure = decoder.metadata().exposure.unwrap_or(1.0);
    let (width, height) = decoder.dimensions();
    let (width, height) = checked_size(width.into(), height.into())?;
    let mut pixels = vec![[0.0; 3]; width as usize * height as usize];
    decoder.read_image(bytemuck::cast_slice_mut(&mut pixels))?;
    let note = format!("its EXPOSURE of {exposure} is not undone, as in other renderers");
    Ok(RadiancePicture { width, height, pixels, notes: Vec::from_iter((exposure != 1.0).then_some(note)) })
}

/// Channels of an OpenEXR part that make up a colour.
enum Channels {
    Rgb([String; 3]),
    Luminance(String),
}

/// The first of the part's layers with R, G and B, the one without a name before others; else its luminance.
fn channels(header: &Header) -> Option<Channels> {
    let names: Vec<String> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
    let has = |name: &str| names.iter().any(|n| n == name);
    let layers = names.iter().filter_map(|name| name.strip_suffix(".R")).map(|layer| format!("{layer}."));
    let rgb = |layer: String| ["R", "G", "B"].map(|channel| format!("{layer}{channel}"));
    let mut colors = std::iter::once(String::new()).chain(layers).map(rgb);
    let luminance = (has("Y") && !has("RY") && !has("BY")).then(|| Channels::Luminance("Y".to_owned()));
    colors.find(|names| names.iter().all(|name| has(name))).map(Channels::Rgb).or(luminance)
}

fn decode_exr(bytes: &[u8]) -> std::result::Result<RadiancePicture, Problem> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)?;
    let part = meta.headers.iter().filter(|header| !header.deep).find_map(|header| Some((header, channels(header)?)));
    let (header, channels) = part.ok_or("has neither the channels R, G and B nor the luminance Y alone")?;
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err("has subsampled channels, which are not read".into());
    }
    checked_size(header.layer_size.width() as u64, header.layer_size.height() as u64)?;
    let display = header.shared_attributes.display_window;
    let (width, height) = checked_size(display.size.width() as u64, display.size.height() as u64)?;
    let window = Window { width, height, offset: header.own_attributes.layer_position - display.position };
    let read = exr::prelude::read().no_deep_data().largest_resolution_level().specific_channels();
    let pixels = match channels {
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
                .from_buffered(Cursor::new(bytes))?
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
                .from_buffered(Cursor::new(bytes))?
                .layer_data
                .channel_data
                .pixels
        }
    };
    Ok(RadiancePicture { width, height, pixels, notes: Vec::new() })
}

/// The display window of an OpenEXR file: what of the data lies outside is cut off, where there are none it is black.
#[derive(Clone, Copy)]
struct Window {
    width: u32,
    height: u32,
    /// Of the first datum from the window's corner.
    offset: Vec2<i32>,
}

impl Window {
    fn black(self) -> Vec<[f32; 3]> {
        vec![[0.0; 3]; self.width as usize * self.height as usize]
    }

    /// Writes the pixel of the datum `at`.
    fn put(self, pixels: &mut [[f32; 3]], at: Vec2<usize>, color: [f32; 3]) {
        let (x, y) = (at.x() as i64 + i64::from(self.offset.x()), at.y() as i64 + i64::from(self.offset.y()));
        if (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y) {
            pixels[y as usize * self.width as usize + x as usize] = color;
        }
    }
}

/// Makes all numbers finite and ≥ 0. Returns what had to be changed.
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
mod tests {
    use exr::{
        image::{AnyChannel, AnyChannels, FlatSamples, Image, Layer},
        meta::attribute::IntegerBounds,
        prelude::{Encoding, LayerAttributes, WritableImage, f16},
    };

    use super::*;

    /// A file of that many columns and two rows, with its data that far from the display window.
    fn exr(columns: usize, at: Vec2<i32>, channels: &[(&str, FlatSamples)]) -> Vec<u8> {
        let list = channels.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone())).collect();
        let attributes = LayerAttributes { layer_position: at, ..LayerAttributes::default() };
        let layer = Layer::new((columns, 2), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(list));
        let mut image = Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::new(Vec2(0, 0), Vec2(2, 2));
        let mut file = Cursor::new(Vec::new());
        image.write().to_buffered(&mut file).expect("it can be written");
        file.into_inner()
    }

    fn floats(numbers: &[f32]) -> FlatSamples {
        FlatSamples::F32(numbers.to_vec())
    }

    fn halves(numbers: &[f32]) -> FlatSamples {
        FlatSamples::F16(numbers.iter().map(|&x| f16::from_f32(x)).collect())
    }

    /// A Radiance file of bytes r, g, b, exponent.
    fn hdr(header: &str, width: u32, height: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
        [format!("{header}\n\n-Y {height} +X {width}\n").as_bytes(), pixels.as_flattened()].concat()
    }

    fn decoded(bytes: &[u8]) -> RadiancePicture {
        decode_radiance(Path::new("sky"), bytes).unwrap_or_else(|error| panic!("{error}"))
    }

    fn refusal(bytes: &[u8]) -> String {
        let error = decode_radiance(Path::new("sky"), bytes).expect_err("it must be refused").to_string();
        assert!(!error.contains('\n'), "{error}");
        error.strip_prefix("sky: ").expect("the file is named").to_owned()
    }

    #[test]
    fn half_and_float_colours_are_read_whatever_their_layer() {
        let (r, g, b) = ([1.0, 2.0, 3.0, 4.0], [0.5; 4], [0.0, 0.25, 0.0, 100.0]);
        let expected = [[1.0, 0.5, 0.0], [2.0, 0.5, 0.25], [3.0, 0.5, 0.0], [4.0, 0.5, 100.0]];
        let here = Vec2(0, 0);
        let other = floats(&[9.0; 4]);
        for bytes in [
            exr(2, here, &[("B", floats(&b)), ("G", floats(&g)), ("R", floats(&r))]),
            exr(2, here, &[("A", other.clone()), ("B", halves(&b)), ("G", floats(&g)), ("R", halves(&r))]),
            exr(2, here, &[("depth.Z", other.clone()), ("s.B", halves(&b)), ("s.G", halves(&g)), ("s.R", halves(&r))]),
            exr(
                2,
                here,
                &[
                    ("B", floats(&b)),
                    ("G", floats(&g)),
                    ("R", floats(&r)),
                    ("a.B", other.clone()),
                    ("a.G", other.clone()),
                    ("a.R", other.clone()),
                ],
            ),
        ] {
            let picture = decoded(&bytes);
            assert_eq!((picture.width, picture.height), (2, 2));
            assert_eq!((picture.pixels.as_slice(), picture.notes.len()), (&expected[..], 0));
        }
        let grey = decoded(&exr(2, here, &[("Y", halves(&r))]));
        assert_eq!(grey.pixels, r.map(|y| [y; 3]));
    }

    #[test]
    fn the_display_window_is_the_picture() {
        let y = floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let pixels = |at: Vec2<i32>| decoded(&exr(3, at, &[("Y", y.clone())])).pixels.iter().map(|p| p[0]).collect();
        let found: Vec<f32> = pixels(Vec2(0, 0));
        assert_eq!(found, [1.0, 2.0, 4.0, 5.0]);
        let found: Vec<f32> = pixels(Vec2(-2, 1));
        assert_eq!(found, [0.0, 0.0, 3.0, 0.0]);
    }

    #[test]
    fn radiance_files_of_either_signature_are_read() {
        // Mantissa times 2^(exponent - 136).
        let pixels = [[128, 64, 0, 129], [255, 0, 1, 136], [0, 0, 0, 0]];
        let expected = [[1.0, 0.5, 0.0], [255.0, 0.0, 1.0], [0.0; 3]];
        for signature in ["#?RADIANCE", "#?RGBE"] {
            let picture = decoded(&hdr(&format!("{signature}\nFORMAT=32-bit_rle_rgbe"), 3, 1, &pixels));
            assert_eq!((picture.width, picture.height, picture.pixels.as_slice()), (3, 1, &expected[..]));
            assert_eq!(picture.notes, [""; 0]);
        }
        let exposed = decoded(&hdr("#?RADIANCE\nEXPOSURE=2\nEXPOSURE=1.5", 3, 1, &pixels));
        assert_eq!(exposed.pixels, expected);
        assert_eq!(exposed.notes, ["its EXPOSURE of 3 is not undone, as in other renderers"]);
    }

    #[test]
    fn what_is_no_radiance_is_mended_and_said() {
        let (inf, nan) = (f32::INFINITY, f32::NAN);
        let bytes =
            |y: [f32; 4]| exr(2, Vec2(0, 0), &[("B", floats(&[0.0; 4])), ("G", floats(&[7.0; 4])), ("R", floats(&y))]);
        let picture = decoded(&bytes([inf, -1.0, nan, -inf]));
        assert_eq!(picture.pixels, [[7.0, 7.0, 0.0], [0.0, 7.0, 0.0], [0.0, 7.0, 0.0], [0.0, 7.0, 0.0]]);
        let said = "numbers below 0 or NaN, read as 0: 3; infinite numbers, read as the largest finite one, 7: 1";
        assert_eq!(picture.notes, [said]);
        assert_eq!(decoded(&bytes([3e38, 0.0, -0.0, 1e-40])).notes, [""; 0]);
    }

    #[test]
    fn what_cannot_be_read_is_one_line() {
        let samples = floats(&[1.0; 4]);
        let whole = exr(2, Vec2(0, 0), &[("Y", samples.clone())]);
        let no_color = "has neither the channels R, G and B nor the luminance Y alone";
        for channels in [&["R", "G"][..], &["Z"], &["Y", "RY", "BY"], &["a.R", "b.G", "b.B"]] {
            let channels: Vec<_> = channels.iter().map(|name| (*name, samples.clone())).collect();
            assert_eq!(refusal(&exr(2, Vec2(0, 0), &channels)), no_color);
        }
        for length in [4, 20, whole.len() / 2, whole.len() - 1] {
            refusal(&whole[..length]);
        }
        // The data window's right end is the first number of its second half.
        let at = whole.windows(10).position(|bytes| bytes == b"dataWindow").expect("a window") + 10 + 1 + 6 + 4 + 8;
        let mut wide = whole.clone();
        wide[at..at + 4].copy_from_slice(&0x0fff_ffff_i32.to_le_bytes());
        assert_eq!(refusal(&wide), "is 268435456 x 2 pixels; 1 to 134217728 pixels are read");

        let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe";
        assert_eq!(
            refusal(&hdr(header, 4_000_000, 4_000_000, &[])),
            "is 4000000 x 4000000 pixels; 1 to 134217728 pixels are read"
        );
        assert_eq!(refusal(&hdr(header, 0, 5, &[])), "is 0 x 5 pixels; 1 to 134217728 pixels are read");
        for damaged in [
            hdr(header, 2, 2, &[[1, 2, 3, 128]; 3]),
            hdr("#?RADIANCE\nFORMAT=32-bit_rle_xyze", 1, 1, &[[1, 2, 3, 128]]),
            b"#?RADIANCE\n".to_vec(),
            b"#?RADIANCE\n\n+X 2 -Y 2\n".to_vec(),
            b"#?RADIANCE\n\n-Y two +X 2\n".to_vec(),
        ] {
            refusal(&damaged);
        }
    }

    #[test]
    fn files_that_are_none_are_refused_before_they_are_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let refused = |bytes: &[u8]| {
            let path = folder.path().join("sky.hdr");
            std::fs::write(&path, bytes).expect("can be written");
            read_radiance_bytes(&path).expect_err("it must be refused").to_string()
        };
        for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n", b"#", b"v/1"] {
            let message = refused(bytes);
            assert!(message.ends_with("sky.hdr: is neither OpenEXR nor Radiance HDR"), "{message}");
        }
        let none = read_radiance_bytes(&folder.path().join("none.exr")).expect_err("there is none").to_string();
        assert!(none.contains("none.exr: "), "{none}");
        assert!(read_radiance_bytes(folder.path()).is_err(), "a folder");
    }
}
