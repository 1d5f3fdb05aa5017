//! HTML page of a comparison, a single self-contained file.

use std::fmt::Write;

use base64::{Engine, prelude::BASE64_STANDARD};

use super::{comparison::Comparison, measure::Histogram, report::grouped};
use crate::{
    error::{Error, Result},
    html::{escaped, filled},
    image::{Frame, Provenance, Tonemap, encode_png},
};

const TEMPLATE: &str = include_str!("page.html");
/// Width below which a picture is shown with its pixels as squares.
const PIXELATED_BELOW: u32 = 300;

/// The page; `difference` is the PNG of the difference.
pub(super) fn page(
    comparison: &Comparison,
    origin: &Provenance,
    exposure: f32,
    tonemap: Tonemap,
    difference: &[u8],
) -> Result<String> {
    let report = &comparison.report;
    let picture = |frame: &Frame| {
        let png = encode_png(frame, exposure, tonemap);
        png.map(|png| BASE64_STANDARD.encode(png)).map_err(|source| Error::Io { path: "report.html".into(), source })
    };
    let (class, verdict) = match comparison.verdict() {
        Ok(()) => ("good", format!("They agree: within {:.0e} but for ties.", comparison.tolerance)),
        Err(error) => ("bad", error.to_string()),
    };
    let facts = report.facts().iter().fold(String::new(), |all, (what, value)| all + &row(&[what, value]));
    let rows = report.rows().iter().fold(String::new(), |all, r| all + &row(&[r.what, &r.grid, &r.kdtree]));
    let width = comparison.grid.width;
    Ok(filled(
        TEMPLATE,
        &[
            ("scene", &escaped(origin.scene)),
            ("origin", &escaped(&subtitle(comparison, origin))),
            ("verdict_class", class),
            ("verdict", &escaped(&verdict)),
            ("rendering", if width < PIXELATED_BELOW { "pixelated" } else { "auto" }),
            ("width", &width.to_string()),
            ("height", &comparison.grid.height.to_string()),
            ("difference_width", &width.max(640).to_string()),
            ("histogram", &histogram(&comparison.histogram, comparison.tolerance)),
            ("none", &grouped(comparison.histogram.none)),
            ("tied", &grouped(report.neighbors.tied)),
            ("facts", facts.trim_end()),
            ("rows", rows.trim_end()),
            ("grid_png", &picture(&comparison.grid)?),
            ("kdtree_png", &picture(&comparison.kdtree)?),
            ("difference_png", &BASE64_STANDARD.encode(difference)),
        ],
    ))
}

fn subtitle(comparison: &Comparison, origin: &Provenance) -> String {
    let (settings, photons) = (origin.settings, &comparison.stats.photons);
    let environment = origin.environment.map_or(String::new(), |environment| format!(" under {}", environment.name));
    format!(
        "{}{environment}, {} mode, k = {}, {} + {} photons, {} x {} pixels, {} spp; Caustica {}",
        origin.scene,
        settings.photons.mode.name(),
        settings.estimate.neighbors,
        grouped(photons.global.stored),
        grouped(photons.caustic.stored),
        comparison.grid.width,
        comparison.grid.height,
        settings.picture.spp,
        env!("CARGO_PKG_VERSION"),
    )
}

/// A row of a table whose first cell is its name.
fn row(cells: &[&str]) -> String {
    let others: String = cells[1..].iter().map(|cell| format!("<td>{}</td>", escaped(cell))).collect();
    format!("<tr><th scope=\"row\">{}</th>{others}</tr>\n", escaped(cells[0]))
}

/// Histogram over half decades, as SVG.
fn histogram(histogram: &Histogram, tolerance: f64) -> String {
    const BAR: f64 = 22.0;
    const LEFT: f64 = 20.0;
    const TOP: f64 = 26.0;
    const BOTTOM: f64 = 190.0;
    let width = 2.0 * LEFT + BAR * histogram.bins.len() as f64;
    let most = histogram.bins.iter().copied().max().unwrap_or(0).max(1);
    let mut svg = format!("<svg viewBox=\"0 0 {width} 230\" role=\"img\" aria-label=\"histogram\">\n");
    for (i, &count) in histogram.bins.iter().enumerate().filter(|(_, count)| **count > 0) {
        // Minimum height that makes even a single query visible.
        let height = ((BOTTOM - TOP) * count as f64 / most as f64).max(2.0);
        let (x, y) = (LEFT + BAR * i as f64, BOTTOM - height);
        let _ = writeln!(
            svg,
            "<rect class=\"bar\" x=\"{:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{height:.1}\"><title>{}</title></rect>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" style=\"font-size:9px\">{}</text>",
            x + 0.5,
            BAR - 1.0,
            grouped(count),
            x + BAR / 2.0,
            y - 4.0,
            short(count),
        );
    }
    let _ =
        writeln!(svg, "<line class=\"axis\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{BOTTOM}\" y2=\"{BOTTOM}\"/>", width - LEFT);
    let along = |exponent: f64| LEFT + BAR * 2.0 * (exponent - f64::from(Histogram::FIRST));
    for exponent in Histogram::FIRST..=0 {
        let x = along(exponent.into());
        let number = if exponent == 0 { "1".to_string() } else { format!("1e{exponent}") };
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"208\" text-anchor=\"middle\">{number}</text>");
    }
    let middle = width / 2.0;
    let _ =
        writeln!(svg, "<text x=\"{middle}\" y=\"225\" text-anchor=\"middle\">relative difference of radiance</text>");
    let limit = along(tolerance.log10());
    if (LEFT..=width - LEFT).contains(&limit) {
        let _ = writeln!(svg, "<line class=\"limit\" x1=\"{limit:.1}\" x2=\"{limit:.1}\" y1=\"14\" y2=\"{BOTTOM}\"/>");
    }
    svg + "</svg>"
}

/// Formats a count in at most four characters.
fn short(count: u64) -> String {
    match count {
        0..10_000 => count.to_string(),
        10_000..1_000_000 => format!("{}k", count / 1000),
        _ => format!("{}M", count / 1_000_000),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_names_stays_text() {
        assert_eq!(row(&["a<b>", "\"&\""]), "<tr><th scope=\"row\">a&lt;b&gt;</th><td>&quot;&amp;&quot;</td></tr>\n");
    }

    #[test]
    fn every_query_has_a_bar() {
        let mut counts = Histogram::default();
        counts.bins[3] = 1;
        counts.bins[4] = 2_500_000;
        let svg = histogram(&counts, 1e-4);
        assert_eq!(svg.matches("class=\"bar\"").count(), 2);
        assert!(svg.contains("2,500,000") && svg.contains(">2M<") && svg.contains("class=\"limit\""));
        assert!(!histogram(&counts, 0.0).contains("class=\"limit\""), "zero has no place on the scale");
    }
}
