//! Decoding of PNG, JPEG and WebP to RGBA of 8 bits a channel.

use std::borrow::Cow;
use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

use super::super::fault::{Read, fault};
use crate::scene::LoadOptions;

/// Largest side of an image, texels.
const MAX_SIDE: u32 = LoadOptions::TEXTURE_SIZE.most();

/// Texels that all images together may claim, and how many more for each byte of them and of the
/// buffers: what is beyond is made to fill the memory. A byte of a PNG inflates to 1032 at most.
pub(super) const FREE_TEXELS: u64 = 1 << 23;
pub(super) const TEXELS_PER_BYTE: u64 = 1032;

/// Memory of a decoder besides the texels, bytes.
const DECODER_BYTES: u64 = 64 << 20;

/// An image of known format and size, not yet decoded.
#[derive(Debug)]
pub(super) struct Encoded<'d> {
    bytes: Cow<'d, [u8]>,
    format: ImageFormat,
    /// Width and height, texels, at least 1.
    pub(super) size: [u32; 2],
    /// The image in messages, and its place.
    said: String,
    place: String,
}

impl<'d> Encoded<'d> {
    /// Reads the header. The first bytes give the format, not by a name or MIME type.
    pub(super) fn new(bytes: Cow<'d, [u8]>, said: &str, place: String) -> Read<Self> {
        let format = match &*bytes {
            [0x89, b'P', b'N', b'G', ..] => ImageFormat::Png,
            [0xff, 0xd8, 0xff, ..] => ImageFormat::Jpeg,
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => ImageFormat::WebP,
            [0xab, b'K', b'T', b'X', ..] => return fault(place, format!("{said} is KTX2, which is not read")),
            _ => return fault(place, format!("{said} is neither PNG, JPEG nor WebP")),
        };
        let mut encoded = Self { bytes, format, size: [0; 2], said: said.to_owned(), place };
        let (width, height) = encoded.reader().into_dimensions().or_else(|error| encoded.damaged(&error))?;
        if width.max(height) > MAX_SIDE {
            let problem = format!("{said} has {width} x {height} texels; sides of at most {MAX_SIDE} are read");
            return fault(encoded.place, problem);
        }
        encoded.size = [width, height];
        Ok(encoded)
    }

    /// Takes the texels from those that may still be claimed. Each byte allows for some more.
    pub(super) fn claim(&self, left: &mut u64) -> Read<()> {
        let ([width, height], bytes) = (self.size, self.bytes.len());
        *left += TEXELS_PER_BYTE * bytes as u64;
        match left.checked_sub(u64::from(width) * u64::from(height)) {
            Some(rest) => *left = rest,
            None => {
                let problem = format!("{} claims {width} x {height} texels, but has {bytes} bytes", self.said);
                return fault(&self.place, problem);
            }
        }
        Ok(())
    }

    /// RGBA of all texels, row by row from the top. Grey counts for all three colours, 16 bits are
    /// rounded to 8; colour profiles and orientations are ignored, as glTF says.
    pub(super) fn texels(&self) -> Read<Vec<[u8; 4]>> {
        if self.format == ImageFormat::Jpeg && !ends(&self.bytes) {
            return fault(&self.place, format!("{} is damaged: its JPEG data is cut off", self.said));
        }
        let decoded = self.reader().decode().or_else(|error| self.damaged(&error))?;
        let rgba = match decoded {
            DynamicImage::ImageRgba8(rgba) => rgba,
            other => other.into_rgba8(),
        };
        let bytes = rgba.into_raw();
        Ok(bytemuck::allocation::try_cast_vec(bytes).unwrap_or_else(|(_, bytes)| bytes.as_chunks::<4>().0.to_vec()))
    }

    fn reader(&self) -> ImageReader<Cursor<&[u8]>> {
        let mut reader = ImageReader::with_format(Cursor::new(&*self.bytes), self.format);
        let mut limits = Limits::no_limits();
        let [width, height] = self.size;
        // Eight bytes a texel: RGBA of 16 bits. The size is not known before the header is read.
        limits.max_alloc = Some(DECODER_BYTES + 8 * u64::from(width) * u64::from(height));
        reader.limits(limits);
        reader
    }

    fn damaged<T>(&self, error: &image::ImageError) -> Read<T> {
        // Some of the messages have several lines.
        let words: Vec<_> = error.to_string().split_whitespace().map(str::to_owned).collect();
        fault(&self.place, format!("{} is damaged: {}", self.said, words.join(" ")))
    }
}

/// Whether the last scan of a JPEG has its end marker: the decoder takes what is missing for grey.
fn ends(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|pair| pair == [0xff, marker]);
    last(0xd9) > last(0xda)
}
