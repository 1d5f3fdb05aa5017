//! What is written must not destroy what is read, nor what the same run has written.

use std::{
    io,
    path::{Path, PathBuf},
};

use caustica::{Error, Result, image::check_output, scene::Scene};

/// Files that a run uses, each under the one name that all ways to write its path have in common. A
/// hard link is a file of its own: an output takes the place of its name and leaves the other one
/// alone.
#[derive(Default)]
pub struct Files {
    /// With what they are.
    read: Vec<(PathBuf, &'static str)>,
    /// With the paths as they were given.
    written: Vec<(PathBuf, PathBuf)>,
}

impl Files {
    /// A file that is read, with what it is; no output may be there.
    pub fn read(&mut self, path: &Path, what: &'static str) -> Result<()> {
        let identity = identity(path);
        if let Some((_, output)) = self.written.iter().find(|(other, _)| *other == identity) {
            return refused(output, what);
        }
        self.read.push((identity, what));
        Ok(())
    }

    /// The files of a scene.
    pub fn read_scene(&mut self, scene: &Scene) -> Result<()> {
        self.read(&scene.path, "the scene")?;
        scene.files.iter().try_for_each(|path| self.read(path, "a file of the scene"))
    }

    /// Finds out before the work that an output can be written, and that it is no other file of the
    /// run.
    pub fn write(&mut self, path: &Path) -> Result<()> {
        let identity = identity(path);
        let input = self.read.iter().find(|(other, _)| *other == identity).map(|(_, what)| *what);
        let output = self.written.iter().any(|(other, _)| *other == identity).then_some("another output");
        if let Some(what) = input.or(output) {
            return refused(path, what);
        }
        check_output(path)?;
        self.written.push((identity, path.to_path_buf()));
        Ok(())
    }
}

fn refused(path: &Path, what: &str) -> Result<()> {
    let source = io::Error::new(io::ErrorKind::InvalidInput, format!("is {what} as well"));
    Err(Error::Io { path: path.to_path_buf(), source })
}

/// The same for all ways to write the path of one file, whether it exists or not.
pub(super) fn identity(path: &Path) -> PathBuf {
    let of_new_file = || {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(of_new_file).unwrap_or_else(|| path.to_path_buf())
}
