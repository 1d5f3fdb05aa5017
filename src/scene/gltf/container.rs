//! Container: the chunks of a GLB, or plain JSON.

use super::fault::{Notes, Read, fault};

/// JSON text and binary chunk of a file.
pub(super) fn split<'a>(bytes: &'a [u8], notes: &mut Notes) -> Read<(&'a [u8], Option<&'a [u8]>)> {
    let (text, bin) = if bytes.starts_with(b"glTF") { split_glb(bytes, notes)? } else { (bytes, None) };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
        Some(b'{') => Ok((text, bin)),
        _ => fault("file", "is neither glTF JSON nor a GLB container"),
    }
}

/// Chunks of a GLB; unknown chunks are skipped, as the format requires.
fn split_glb<'a>(bytes: &'a [u8], notes: &mut Notes) -> Read<(&'a [u8], Option<&'a [u8]>)> {
    let word = |at: usize| -> Option<u32> { bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes) };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return fault("GLB header", format!("needs 12 bytes, the file has {}", bytes.len()));
    };
    if version != 2 {
        return fault("GLB header", format!("version {version} is not read, only 2"));
    }
    if length as usize != bytes.len() {
        return fault("GLB header", format!("says {length} bytes, the file has {}", bytes.len()));
    }
    let (mut json, mut bin, mut at) = (None, None, 12);
    while at < bytes.len() {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return fault("GLB chunk", format!("header at byte {at} is cut off"));
        };
        let Some(data) = bytes.get(at + 8..).and_then(|rest| rest.get(..size as usize)) else {
            let left = bytes.len() - at - 8;
            return fault("GLB chunk", format!("at byte {at} says {size} bytes, {left} are left"));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() && at == 12 => json = Some(data),
            b"BIN\0" if bin.is_none() => bin = Some(data),
            _ => {}
        }
        at += 8 + size as usize;
    }
    let Some(json) = json else { return fault("GLB chunk", "the first chunk is not JSON") };
    let padding = json.iter().rev().take_while(|byte| **byte == 0).count();
    if padding > 0 {
        notes.add("the JSON of the GLB is padded with NUL bytes, not with spaces");
    }
    Ok((&json[..json.len() - padding], bin))
}
