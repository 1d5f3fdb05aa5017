//! Files of a comparison.

use std::path::Path;

use super::{comparison::Comparison, page, pictures};
use crate::{
    error::Result,
    image::{Provenance, Tonemap, write_exr, write_file, write_png},
};

/// Names of the files that [`Comparison::write`] writes to its folder.
pub const FILES: [&str; 8] = [
    "grid.exr",
    "kdtree.exr",
    "difference.exr",
    "grid.png",
    "kdtree.png",
    "difference.png",
    "report.json",
    "report.html",
];

impl Comparison {
    /// Writes [`FILES`] to the folder, each whole or not at all: both pictures and their difference
    /// (grid minus kd-tree) as EXR; as PNG both with `exposure` and `tonemap`, and the relative
    /// difference in false colours; the report as JSON and as a page that needs no other file.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write(&self, folder: &Path, origin: &Provenance, exposure: f32, tonemap: Tonemap) -> Result<()> {
        let path = |name: &str| folder.join(name);
        write_exr(&path("grid.exr"), &self.grid, origin)?;
        write_exr(&path("kdtree.exr"), &self.kdtree, origin)?;
        write_exr(&path("difference.exr"), &pictures::difference(&self.grid, &self.kdtree), origin)?;
        write_png(&path("grid.png"), &self.grid, exposure, tonemap)?;
        write_png(&path("kdtree.png"), &self.kdtree, exposure, tonemap)?;
        let difference = pictures::false_colors(&self.grid, &self.kdtree)?;
        write_file(&path("difference.png"), &difference)?;
        let mut json = serde_json::to_string_pretty(&self.report).expect("a report holds nothing that JSON cannot");
        json.push('\n');
        write_file(&path("report.json"), json.as_bytes())?;
        let page = page::page(self, origin, exposure, tonemap, &difference)?;
        write_file(&path("report.html"), page.as_bytes())
    }
}
