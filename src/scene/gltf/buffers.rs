//! Contents of buffers: the GLB's chunk, data URIs, and files beside the scene.

use std::borrow::Cow;

use base64::engine::{DecodePaddingMode, Engine as _, GeneralPurpose, GeneralPurposeConfig};
use gltf::json;
use sha2::{Digest as _, Sha256};

use super::extensions::is_fallback;
use super::fault::{Read, fault};
use super::files::Resources;

/// Bytes of each buffer, exactly `byteLength` of them; `None` where the file gives no data.
pub(super) type Buffers<'a> = Vec<Option<Cow<'a, [u8]>>>;

/// Error message for a buffer without data.
const NO_DATA: &str = "has no uri, and there is no binary chunk for it";

/// Reads all buffers; `hash` takes the bytes of the files among them.
pub(super) fn read<'a>(root: &json::Root, resources: &Resources<'a>, hash: &mut Sha256) -> Read<Buffers<'a>> {
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (i, buffer) in root.buffers.iter().enumerate() {
        let place = format!("buffers[{i}]");
        let length = buffer.byte_length.0;
        let bytes = match &buffer.uri {
            None if i == 0 && resources.bin.is_some() => resources.bin.map(Cow::Borrowed),
            None if is_fallback(buffer) => None,
            None => return fault(place, NO_DATA),
            Some(uri) if uri.starts_with("data:") => Some(Cow::Owned(decode_data_uri(uri, &place)?)),
            Some(uri) => {
                let bytes = resources.read_file(uri, length, &format!("{place}.uri"))?;
                hash.update(&bytes);
                Some(Cow::Owned(bytes))
            }
        };
        let Some(bytes) = bytes else {
            buffers.push(None);
            continue;
        };
        if (bytes.len() as u64) < length {
            return fault(place, format!("byteLength is {length}, but there are {} bytes", bytes.len()));
        }
        buffers.push(Some(match bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..length as usize]),
            Cow::Owned(mut bytes) => {
                bytes.truncate(length as usize);
                Cow::Owned(bytes)
            }
        }));
    }
    Ok(buffers)
}

/// Bytes of a referenced buffer.
pub(super) fn slice<'b>(
    buffers: &'b Buffers<'_>,
    buffer: usize,
    offset: u64,
    length: u64,
    place: &str,
) -> Read<&'b [u8]> {
    let Some(data) = buffers.get(buffer) else {
        return fault(format!("{place}.buffer"), format!("{buffer} of {}", buffers.len()));
    };
    let Some(data) = data else { return fault(format!("buffers[{buffer}]"), NO_DATA) };
    match offset.checked_add(length) {
        Some(end) if end <= data.len() as u64 => Ok(&data[offset as usize..end as usize]),
        _ => fault(place, format!("{length} bytes at {offset} run past buffers[{buffer}], which has {}", data.len())),
    }
}

/// Bytes of a data URI (RFC 2397), base64 or percent-encoded.
pub(super) fn decode_data_uri(uri: &str, place: &str) -> Read<Vec<u8>> {
    let place = format!("{place}.uri");
    let Some((header, data)) = uri.split_once(',') else {
        return fault(place, "data URI without a comma");
    };
    if header.split(';').skip(1).any(str::is_empty) {
        return fault(place, format!("{header:?} is not a media type"));
    }
    if header.ends_with(";base64") {
        let lenient = GeneralPurposeConfig::new()
            .with_decode_padding_mode(DecodePaddingMode::Indifferent)
            .with_decode_allow_trailing_bits(true);
        GeneralPurpose::new(&base64::alphabet::STANDARD, lenient)
            .decode(data)
            .or_else(|error| fault(place, format!("not base64: {error}")))
    } else {
        Ok(urlencoding::decode_binary(data.as_bytes()).into_owned())
    }
}
