//! 8-bit PNG: exposure, tone curve, sRGB.

use std::{io, path::Path};

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use super::{Frame, Tonemap, srgb_encode, write_file};
use crate::error::{Error, Result};

/// Writes the radiance of the frame as 8-bit sRGB. Radiance is multiplied by 2^`exposure`, then
/// tone mapped. Pixels without any hit are black.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written. An older file is then kept.
pub fn write_png(path: &Path, frame: &Frame, exposure: f32, curve: Tonemap) -> Result<()> {
    let bytes = encode_png(frame, exposure, curve).map_err(|source| Error::Io { path: path.to_path_buf(), source })?;
    write_file(path, &bytes)
}

/// Encodes the bytes that [`write_png`] writes. The file's text `caustica:exposure` holds the
/// stops.
///
/// # Errors
/// If the frame has no pixel.
pub fn encode_png(frame: &Frame, exposure: f32, curve: Tonemap) -> io::Result<Vec<u8>> {
    let mut bytes = encode_rgb8(&to_srgb8(frame, exposure, curve), frame.width, frame.height)?;
    let text = text_chunk("caustica:exposure", &format!("{exposure} EV"));
    bytes.splice(AFTER_HEADER..AFTER_HEADER, text);
    Ok(bytes)
}

/// Bytes of a PNG file up to the end of its header, after which texts may stand.
const AFTER_HEADER: usize = 8 + 4 + 4 + 13 + 4;

/// Chunk of text of a PNG file (ISO/IEC 15948, 11.3.4.3): length, type, keyword, 0, text, CRC of
/// all but the length.
fn text_chunk(keyword: &str, text: &str) -> Vec<u8> {
    let data = [b"tEXt", keyword.as_bytes(), &[0], text.as_bytes()].concat();
    let bits = |crc: u32| (0..8).fold(crc, |crc, _| (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 });
    let crc = !data.iter().fold(u32::MAX, |crc, byte| (crc >> 8) ^ bits((crc ^ u32::from(*byte)) & 0xff));
    let length = data.len() as u32 - 4;
    [&length.to_be_bytes()[..], &data, &crc.to_be_bytes()].concat()
}

/// Encodes a PNG file from three bytes per pixel, rows from the top.
pub(super) fn encode_rgb8(pixels: &[u8], width: u32, height: u32) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(pixels, width, height, ExtendedColorType::Rgb8)
        .map_err(io::Error::other)?;
    Ok(bytes)
}

/// Converts to three bytes per pixel, rows from the top.
fn to_srgb8(frame: &Frame, exposure: f32, curve: Tonemap) -> Vec<u8> {
    let scale = exposure.exp2();
    let pixel = |radiance: &[f32; 3]| curve.apply(radiance.map(|x| x * scale)).map(to_byte);
    frame.radiance().iter().flat_map(pixel).collect()
}

fn to_byte(linear: f32) -> u8 {
    (srgb_encode(linear) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_file_holds_the_mapped_pixels() {
        let frame = Frame::new(2, 1, &[[0.0; 3], [0.09, 0.25, 4.0]]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png(&path, &frame, 1.0, Tonemap::None).unwrap();
        let read = image::open(&path).unwrap().into_rgb8();
        assert_eq!(read.dimensions(), (2, 1));
        // One stop more: 18 % grey becomes 118, one half becomes 188, and values above 1 are
        // clipped.
        assert_eq!(read.into_raw(), [0, 0, 0, 118, 188, 255]);
        let bytes = std::fs::read(&path).unwrap();
        let text = b"tEXtcaustica:exposure\x001 EV";
        let at = bytes.windows(text.len()).position(|w| w == text).expect("the exposure");
        // CRC by another implementation.
        assert_eq!(bytes[at + text.len()..][..4], 0x68e9_a62f_u32.to_be_bytes());
        write_png(&path, &frame, 0.0, Tonemap::None).unwrap();
        assert_ne!(image::open(&path).unwrap().into_rgb8().into_raw()[3], 118);
    }
}
