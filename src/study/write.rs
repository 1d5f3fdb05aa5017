//! Output files of a study.

use std::{
    io,
    path::{Path, PathBuf},
};

use super::{Plan, Results, page::page, plots::plots, sheet::contact_sheet, table};
use crate::{
    error::{Error, Result},
    image::write_file,
};

/// Writes `study.csv`, `study.json`, `contact-sheet.png`, the plots as SVG, and `report.html` with
/// all of them. Returns their paths.
///
/// # Errors
/// [`Error::Io`] if a file cannot be written; files written before it stay.
pub fn write(plan: &Plan, results: &Results, folder: &Path) -> Result<Vec<PathBuf>> {
    let other = |name: &str, source: io::Error| Error::Io { path: folder.join(name), source };
    let mut written = Vec::new();
    let mut put = |name: &str, bytes: &[u8]| -> Result<()> {
        let path = folder.join(name);
        write_file(&path, bytes)?;
        written.push(path);
        Ok(())
    };
    put("study.csv", table::csv(&results.rows).as_bytes())?;
    let json = table::json(plan, results).map_err(|e| other("study.json", io::Error::other(e)))?;
    put("study.json", json.as_bytes())?;
    let sheet = contact_sheet(&plan.figures, &results.rows).map_err(|e| other("contact-sheet.png", e))?;
    put("contact-sheet.png", &sheet)?;
    let plots = plots(&plan.figures, &results.rows);
    for plot in &plots {
        put(&format!("{}.svg", plot.stem), on_paper(&plot.svg).as_bytes())?;
    }
    let page = page(plan, results, &plots).map_err(|e| other("report.html", e))?;
    put("report.html", page.as_bytes())?;
    Ok(written)
}

/// Standalone version of a plot: black ink on white, whatever the viewer's colours.
fn on_paper(svg: &str) -> String {
    svg.replacen('>', "><rect width=\"100%\" height=\"100%\" fill=\"#FFFFFF\"/>", 1)
}
