//! Files that a scene names by URI: permitted locations, and reading.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Component, Path, PathBuf};

use gltf::json;

use super::fault::{Read, fault};

/// Sources of buffer data.
pub(super) struct Resources<'a> {
    /// The binary chunk of a GLB.
    pub(super) bin: Option<&'a [u8]>,
    /// Folder of the scene's file.
    pub(super) folder: &'a Path,
    /// Whether files outside the folder are permitted.
    pub(super) allow_outside: bool,
}

/// Reads the first `most` bytes of a file, or all if it is shorter. Pipes and devices are refused,
/// as reading them may block or never end.
pub(super) fn read_regular(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder"));
    }
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

impl Resources<'_> {
    /// Paths of all files that a scene names, whether they are read or not.
    pub(super) fn named(&self, root: &json::Root) -> Vec<PathBuf> {
        let buffers = root.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
        let images = root.images.iter().filter_map(|image| image.uri.as_deref());
        let files = buffers.chain(images).filter(|uri| !uri.starts_with("data:"));
        files.filter_map(|uri| self.path(uri, "").ok()).collect()
    }

    /// The first `length` bytes of the file that a URI names, or all if it is shorter.
    pub(super) fn read_file(&self, uri: &str, length: u64, place: &str) -> Read<Vec<u8>> {
        let path = self.path(uri, place)?;
        let read = || -> io::Result<Option<Vec<u8>>> {
            if !self.allow_outside && !fs::canonicalize(&path)?.starts_with(fs::canonicalize(self.folder)?) {
                return Ok(None);
            }
            read_regular(&path, length).map(Some)
        };
        match read() {
            Ok(Some(bytes)) => Ok(bytes),
            Ok(None) => outside(uri, place),
            Err(error) => fault(place, format!("{uri:?}: {error}")),
        }
    }

    /// The path that a URI names (RFC 3986): relative to the folder, or `file:`.
    fn path(&self, uri: &str, place: &str) -> Read<PathBuf> {
        let (scheme, rest) = match uri.split_once(':') {
            Some((scheme, rest)) if is_scheme(scheme) => (Some(scheme.to_ascii_lowercase()), rest),
            _ => (None, uri),
        };
        let encoded = match scheme.as_deref() {
            None => rest,
            Some("file") => rest.strip_prefix("//localhost").or(rest.strip_prefix("//")).unwrap_or(rest),
            // Drive letter of a Windows path.
            Some(drive) if drive.len() == 1 => uri,
            Some(_) => return fault(place, format!("{uri:?}: only data URIs and files are read")),
        };
        let decoded = urlencoding::decode(encoded).or_else(|error| fault(place, format!("{uri:?}: {error}")))?;
        if decoded.is_empty() {
            return fault(place, "is empty");
        }
        // As exporters on Windows write them, and as web browsers read them.
        let decoded = decoded.replace('\\', "/");
        let path = Path::new(&decoded);
        if self.allow_outside {
            return Ok(self.folder.join(path));
        }
        match below(path) {
            Some(path) if scheme.is_none() => Ok(self.folder.join(path)),
            _ => outside(uri, place),
        }
    }
}

/// A relative path without steps upwards; none if it leads out of the folder that it starts in.
fn below(path: &Path) -> Option<PathBuf> {
    let mut below = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => below.push(name),
            Component::CurDir => {}
            Component::ParentDir if below.pop() => {}
            _ => return None,
        }
    }
    Some(below)
}

/// Whether the text before a colon names a scheme (RFC 3986, 3.1).
fn is_scheme(text: &str) -> bool {
    let mut bytes = text.bytes();
    bytes.next().is_some_and(|first| first.is_ascii_alphabetic())
        && bytes.all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte))
}

fn outside<T>(uri: &str, place: &str) -> Read<T> {
    let what = "leads out of the scene's folder, which only `load.allow_outside` permits";
    fault(place, format!("{uri:?} {what}"))
}
