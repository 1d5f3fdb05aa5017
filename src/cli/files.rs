//! Protection of a run's inputs, and of its other outputs, from being overwritten.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use caustica::{Error, Result, image::check_output, scene::Scene};

/// Files that a run uses, each by its `identity`. A hard link is a file of its own: an output
/// replaces the file of its name and leaves the other link unchanged.
#[derive(Default)]
pub struct Files {
    /// Identity and description of each input.
    read: Vec<(PathBuf, &'static str)>,
    /// Identity of each output, and its path as given.
    written: Vec<(PathBuf, PathBuf)>,
}

impl Files {
    /// Registers an input and its description. Fails if it is an output as well.
    pub fn read(&mut self, path: &Path, what: &'static str) -> Result<()> {
        let identity = identity(path);
        if let Some((_, output)) = self.written.iter().find(|(other, _)| *other == identity) {
            return refused(output, what);
        }
        self.read.push((identity, what));
        Ok(())
    }

    /// Registers the files of a scene as inputs.
    pub fn read_scene(&mut self, scene: &Scene) -> Result<()> {
        self.read(&scene.path, "the scene")?;
        scene.files.iter().try_for_each(|path| self.read(path, "a file of the scene"))
    }

    /// Registers an output. Checks, before the work, that it can be written and is no other file of
    /// the run.
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

/// Creates a folder for outputs, and those that it lies in, unless it is there.
pub fn make_folder(path: &Path) -> Result<()> {
    let is_file = |part: &&Path| part.exists() && !part.is_dir();
    let source = match path.ancestors().find(is_file) {
        Some(file) => {
            io::Error::new(io::ErrorKind::NotADirectory, format!("{} is a file, not a folder", file.display()))
        }
        None => match fs::create_dir_all(path) {
            Ok(()) => return Ok(()),
            Err(error) => error,
        },
    };
    Err(Error::Io { path: path.to_path_buf(), source })
}

fn refused(path: &Path, what: &str) -> Result<()> {
    let source = io::Error::new(io::ErrorKind::InvalidInput, format!("is {what} as well"));
    Err(Error::Io { path: path.to_path_buf(), source })
}

/// Absolute path without links, equal for all ways to write the path of one file, whether the file
/// exists or not.
pub(super) fn identity(path: &Path) -> PathBuf {
    let of_new_file = || {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(of_new_file).unwrap_or_else(|| path.to_path_buf())
}
