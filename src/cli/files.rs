//! What is written must not destroy what is read, nor what the same run has written.

use std::{
    io,
    path::{Path, PathBuf},
};

use caustica::{Error, Result, image::check_output};

/// Files that a run uses, each under the one name that all ways to write its path have in common.
pub struct Files(Vec<(PathBuf, &'static str)>);

impl Files {
    /// Files that are read, with what they are.
    pub fn read<'a>(inputs: impl IntoIterator<Item = (&'a Path, &'static str)>) -> Self {
        Self(inputs.into_iter().map(|(path, what)| (identity(path), what)).collect())
    }

    /// Finds out before the work that an output can be written, and that it is no other file of the run.
    pub fn write(&mut self, path: &Path) -> Result<()> {
        let identity = identity(path);
        if let Some((_, what)) = self.0.iter().find(|(other, _)| *other == identity) {
            let source = io::Error::new(io::ErrorKind::InvalidInput, format!("is {what} as well"));
            return Err(Error::Io { path: path.to_path_buf(), source });
        }
        check_output(path)?;
        self.0.push((identity, "another output"));
        Ok(())
    }
}

/// The same for all ways to write the path of one file, whether it exists or not.
fn identity(path: &Path) -> PathBuf {
    let of_new_file = || {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(of_new_file).unwrap_or_else(|| path.to_path_buf())
}
