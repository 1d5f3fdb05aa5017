//! Atomic output files: written under a temporary name in the target folder, then renamed.

use std::{
    ffi::OsStr,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use tempfile::{Builder, NamedTempFile};

use crate::error::{Error, Result};

/// Temporary files of writes in progress.
struct Open {
    paths: Vec<PathBuf>,
    closed: bool,
}

impl Open {
    /// Removes the file from the list. Returns whether it was listed.
    fn forget(&mut self, path: &Path) -> bool {
        self.paths.iter().position(|p| p == path).map(|i| self.paths.swap_remove(i)).is_some()
    }
}

static OPEN: Mutex<Open> = Mutex::new(Open { paths: Vec::new(), closed: false });

fn open_files() -> MutexGuard<'static, Open> {
    OPEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes a file atomically: an older file is replaced only when all bytes of the new one are on
/// disk. A target that is neither a file nor a folder, such as a pipe, is written directly.
///
/// # Errors
/// [`Error::Io`] if the folder is missing or not writable, the path is a folder or a
/// write-protected file, or [`close_files`] was called. No temporary file remains then.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    let write = || -> io::Result<()> {
        let Some(target) = target_of(path)? else {
            return File::options().write(true).open(path)?.write_all(bytes);
        };
        let mut temporary = create_beside(&target)?;
        // Errors of the file itself do not name it.
        let file = temporary.as_file_mut();
        let written = file.write_all(bytes).and_then(|()| file.sync_all());
        put_in_place(temporary, written, &target)
    };
    write().map_err(|source| Error::Io { path: path.to_path_buf(), source })
}

/// Opens a file for reading. Refuses pipes and devices: they may never end, or never deliver a
/// byte.
///
/// # Errors
/// Errors of the system; and for folders and other paths that are no regular file.
pub(crate) fn open_regular(path: &Path) -> io::Result<File> {
    let found = fs::metadata(path)?;
    match (found.is_dir(), found.is_file()) {
        (true, _) => Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder")),
        (_, false) => Err(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file")),
        _ => File::open(path),
    }
}

/// Checks, before hours of work, whether [`write_file`] could write to the path now.
///
/// # Errors
/// As [`write_file`].
pub fn check_output(path: &Path) -> Result<()> {
    let check = || -> io::Result<()> {
        let Some(target) = target_of(path)? else { return Ok(()) };
        let probe = create_beside(&target)?;
        open_files().forget(probe.path());
        probe.close()
    };
    check().map_err(|source| Error::Io { path: path.to_path_buf(), source })
}

/// Removes the temporary files of all writes in progress and blocks further writes. For a process
/// that is about to exit in the middle of its work.
pub fn close_files() {
    let mut open = open_files();
    open.closed = true;
    for path in open.paths.drain(..) {
        let _ = fs::remove_file(path);
    }
}

/// Resolves the file to replace, following links; `None` for a pipe or a device.
fn target_of(path: &Path) -> io::Result<Option<PathBuf>> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder")),
        Ok(found) if !found.is_file() => Ok(None),
        Ok(found) if found.permissions().readonly() => {
            Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file there is write-protected"))
        }
        Ok(_) => fs::canonicalize(path).map(Some),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(Some(end_of_links(path))),
        Err(e) => Err(e),
    }
}

/// The file that links lead to, which is not there yet.
fn end_of_links(path: &Path) -> PathBuf {
    let mut end = path.to_path_buf();
    // A loop of links is another error than that of a file that is not there.
    while let Ok(link) = fs::read_link(&end) {
        end = end.parent().unwrap_or(Path::new("")).join(link);
    }
    end
}

fn create_beside(target: &Path) -> io::Result<NamedTempFile> {
    let parent = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // A slash after the name, which `file_name` leaves out, makes it that of a folder.
    let bytes = |text: &OsStr| text.as_encoded_bytes().to_vec();
    if !target.file_name().is_some_and(|name| bytes(target.as_os_str()).ends_with(&bytes(name))) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "names no file"));
    }
    // Uses a short temporary name: the name of the target may already have the maximum length.
    let mut builder = Builder::new();
    builder.prefix(".caustica-").suffix(".part");
    #[cfg(unix)]
    {
        // Permissions of a new file; the umask removes its bits.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut open = open_files();
    if open.closed {
        return Err(io::ErrorKind::Interrupted.into());
    }
    let temporary = builder.tempfile_in(parent).map_err(|e| explain(e, parent))?;
    open.paths.push(temporary.path().to_path_buf());
    Ok(temporary)
}

/// Renames the temporary file if it was written completely, else removes it.
fn put_in_place(temporary: NamedTempFile, written: io::Result<()>, target: &Path) -> io::Result<()> {
    // Holds the lock to the end, so that `close_files` runs before or after the renaming.
    let mut open = open_files();
    let known = open.forget(temporary.path());
    written?;
    if !known {
        return Err(io::ErrorKind::Interrupted.into());
    }
    if let Ok(older) = fs::metadata(target) {
        fs::set_permissions(temporary.path(), older.permissions())?;
    }
    temporary.persist(target).map(|_| ()).map_err(|e| e.error)
}

/// Names the folder: the message of the system contains only the temporary name, which means
/// nothing to the user.
fn explain(error: io::Error, folder: &Path) -> io::Error {
    let kind = error.kind();
    let why = match kind {
        io::ErrorKind::NotFound if !folder.exists() => "does not exist",
        // Virtual folders, such as /proc, report `NotFound` as well.
        io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "cannot be written"
        }
        io::ErrorKind::NotADirectory => "is not a folder",
        // The temporary name ends the message.
        _ => return io::Error::new(kind, error.to_string().split(" at path ").next().unwrap_or_default().to_owned()),
    };
    io::Error::new(kind, format!("the folder {} {why}", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn replaces_a_file_whole_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        check_output(&path).unwrap();
        assert!(names(folder.path()).is_empty());
        write_file(&path, b"old").unwrap();
        write_file(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.exr"]);
    }

    #[test]
    fn failures_name_the_place_in_one_line_and_keep_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let text = |path: &Path| {
            let message = write_file(path, b"x").unwrap_err().to_string();
            assert_eq!(check_output(path).unwrap_err().to_string(), message);
            assert!(!message.contains('\n') && message.starts_with(&path.display().to_string()), "{message}");
            message
        };
        assert!(text(folder.path()).ends_with("is a folder"));
        for name in ["a.exr/", "a.exr/.", "no/.."] {
            assert!(text(&folder.path().join(name)).ends_with("names no file"), "{name}");
        }
        assert!(text(&folder.path().join("no/a.exr")).contains("no does not exist"));
        let protected = folder.path().join("old.exr");
        fs::write(&protected, b"old").unwrap();
        let mut permissions = fs::metadata(&protected).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&protected, permissions).unwrap();
        assert!(text(&protected).contains("write-protected"));
        assert_eq!(fs::read(&protected).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["old.exr"]);
    }

    #[test]
    fn messages_do_not_have_the_temporary_name() {
        let error = io::Error::new(io::ErrorKind::StorageFull, "no space at path \"/a/.caustica-1.part\"");
        assert_eq!(explain(error, Path::new("/")).to_string(), "no space");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_the_mode_stays() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, b"old").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_file(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_file_that_is_not_there_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("far")).unwrap();
        std::os::unix::fs::symlink("far/link", path("link")).unwrap();
        std::os::unix::fs::symlink("file", path("far/link")).unwrap();
        check_output(&path("link")).unwrap();
        assert_eq!(names(&path("far")), ["link"]);
        write_file(&path("link"), b"new").unwrap();
        assert_eq!(fs::read(path("far/file")).unwrap(), b"new");
        assert!(["link", "far/link"].iter().all(|link| fs::symlink_metadata(path(link)).unwrap().is_symlink()));
    }
}
