//! Bytes of the buffers: the GLB's chunk, data URIs, and files beside the scene.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read as _;
use std::path::{Component, Path, PathBuf};

use base64::engine::{DecodePaddingMode, Engine as _, GeneralPurpose, GeneralPurposeConfig};
use gltf::json;
use sha2::{Digest as _, Sha256};

use super::fault::{Read, fault};

/// Bytes of each buffer, exactly `byteLength` of them; `None` where the file gives no data.
pub(super) type Buffers<'a> = Vec<Option<Cow<'a, [u8]>>>;

/// Reads all buffers; `hash` takes the bytes of the files among them.
pub(super) fn read<'a>(
    root: &json::Root,
    bin: Option<&'a [u8]>,
    folder: &Path,
    hash: &mut Sha256,
) -> Read<Buffers<'a>> {
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (i, buffer) in root.buffers.iter().enumerate() {
        let place = format!("buffers[{i}]");
        let length = buffer.byte_length.0;
        let bytes = match &buffer.uri {
            None if i == 0 && bin.is_some() => bin.map(Cow::Borrowed),
            None => None,
            Some(uri) if uri.starts_with("data:") => Some(Cow::Owned(decode_data_uri(uri, &place)?)),
            Some(uri) => {
                let bytes = read_file(&folder.join(relative_path(uri, &place)?), length, uri, &place)?;
                hash.update(&bytes);
                Some(Cow::Owned(bytes))
            }
        };
        if let Some(bytes) = &bytes
            && (bytes.len() as u64) < length
        {
            return fault(place, format!("byteLength is {length}, but there are {} bytes", bytes.len()));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// Bytes of a data URI (RFC 2397), base64 or percent-encoded.
fn decode_data_uri(uri: &str, place: &str) -> Read<Vec<u8>> {
    let place = format!("{place}.uri");
    let Some((header, data)) = uri.split_once(',') else {
        return fault(place, "data URI without a comma");
    };
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

/// The path that a URI names: below the scene's folder, whatever it says.
fn relative_path(uri: &str, place: &str) -> Read<PathBuf> {
    let decoded = urlencoding::decode(uri).or_else(|error| fault(format!("{place}.uri"), error.to_string()))?;
    let path = PathBuf::from(decoded.as_ref());
    let below = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if uri.contains("://") || uri.contains('\\') || !below || path.as_os_str().is_empty() {
        let what = "only data URIs and files in the scene's own folder are read";
        return fault(format!("{place}.uri"), format!("{uri:?}: {what}"));
    }
    Ok(path)
}

/// The first `length` bytes of a file, or all if it is shorter.
fn read_file(path: &Path, length: u64, uri: &str, place: &str) -> Read<Vec<u8>> {
    let read = || -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        File::open(path)?.take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().or_else(|error| fault(format!("{place}.uri"), format!("{uri:?}: {error}")))
}
