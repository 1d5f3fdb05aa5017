//! Tables: CSV for spreadsheets, JSON for scripts.

use serde::Serialize;

use super::{Plan, Radii, Results, Row, claims::answers};
use crate::stats::DeviceStats;

/// A column: its name and the value in a row, empty where there is none.
type Column = (&'static str, fn(&Row) -> String);

/// The columns of the CSV file, in order. Seconds, metres and W/(m² sr).
pub(super) const COLUMNS: [Column; 39] = [
    ("scene", |r| r.scene.clone()),
    ("mode", |r| r.mode.name().to_string()),
    ("photons", |r| of_photons(r, r.photons)),
    ("neighbors", |r| of_photons(r, r.neighbors)),
    ("final_gather", |r| of_photons(r, r.final_gather)),
    ("seed", |r| r.seed.to_string()),
    ("repeats", |r| r.repeats.to_string()),
    ("width", |r| r.width.to_string()),
    ("height", |r| r.height.to_string()),
    ("spp", |r| r.spp.to_string()),
    ("seconds_bvh", |r| number(r.seconds.bvh)),
    ("seconds_photons", |r| number(r.seconds.photons)),
    ("seconds_grid", |r| number(r.seconds.grid)),
    ("seconds_camera", |r| number(r.seconds.camera)),
    ("seconds_direct", |r| number(r.seconds.direct)),
    ("seconds_gather", |r| number(r.seconds.gather)),
    ("seconds_total", |r| number(r.seconds.total)),
    ("global_emitted", |r| r.global.emitted.to_string()),
    ("global_stored", |r| r.global.stored.to_string()),
    ("global_radius_min", |r| radius(r.global.radius, |radii| radii.min)),
    ("global_radius_median", |r| radius(r.global.radius, |radii| radii.median)),
    ("global_radius_max", |r| radius(r.global.radius, |radii| radii.max)),
    ("caustic_emitted", |r| r.caustic.emitted.to_string()),
    ("caustic_stored", |r| r.caustic.stored.to_string()),
    ("caustic_radius_min", |r| radius(r.caustic.radius, |radii| radii.min)),
    ("caustic_radius_median", |r| radius(r.caustic.radius, |radii| radii.median)),
    ("caustic_radius_max", |r| radius(r.caustic.radius, |radii| radii.max)),
    ("mean_r", |r| number(r.mean_radiance[0])),
    ("mean_g", |r| number(r.mean_radiance[1])),
    ("mean_b", |r| number(r.mean_radiance[2])),
    ("noise", |r| r.noise.map(number).unwrap_or_default()),
    ("bias", |r| r.bias.map(number).unwrap_or_default()),
    ("bias_limit", |r| r.bias_limit.map(number).unwrap_or_default()),
    ("rel_mse", |r| r.rel_mse.map(number).unwrap_or_default()),
    ("rmse", |r| r.rmse.map(number).unwrap_or_default()),
    ("flip", |r| r.flip.map(number).unwrap_or_default()),
    ("corner_ratio", |r| r.corner_ratio.map(number).unwrap_or_default()),
    ("ok", |r| r.error.is_none().to_string()),
    ("error", |r| r.error.clone().unwrap_or_default()),
];

/// Empty where no photons are traced.
fn of_photons(row: &Row, value: u32) -> String {
    if row.mode.traces_photons() { value.to_string() } else { String::new() }
}

/// Formats all significant digits without an exponent, which some spreadsheets cannot read.
fn number(x: f64) -> String {
    let digits = if x.abs() >= 1.0 { 6 } else { (6.0 - x.abs().max(1e-12).log10().floor()) as usize };
    let text = format!("{x:.digits$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.is_empty() || text == "-0" { "0".to_string() } else { text.to_string() }
}

fn radius(radii: Option<Radii>, which: fn(&Radii) -> f32) -> String {
    radii.map(|radii| number(f64::from(which(&radii)))).unwrap_or_default()
}

/// CSV of RFC 4180, with a header.
pub(super) fn csv(rows: &[Row]) -> String {
    let line = |fields: Vec<String>| fields.iter().map(|f| quoted(f)).collect::<Vec<_>>().join(",") + "\r\n";
    let header = line(COLUMNS.iter().map(|(name, _)| (*name).to_string()).collect());
    let body = rows.iter().map(|row| line(COLUMNS.iter().map(|(_, value)| value(row)).collect()));
    header + &body.collect::<String>()
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\r', '\n']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_string()
    }
}

/// Contents of `study.json`.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    title: &'a str,
    device: &'a DeviceStats,
    look: super::Look,
    references: &'a [String],
    rows: &'a [Row],
    figures: Vec<FigureReport<'a>>,
    failures: &'a [String],
}

#[derive(Serialize)]
struct FigureReport<'a> {
    title: &'a str,
    columns: &'a [String],
    /// Label, and indices into `rows`.
    cells: &'a [(String, Vec<Option<usize>>)],
    claims: Vec<super::Claim>,
}

pub(super) fn json(plan: &Plan, results: &Results) -> serde_json::Result<String> {
    let figures = plan.figures.iter().map(|figure| FigureReport {
        title: &figure.title,
        columns: &figure.columns,
        cells: &figure.rows,
        claims: answers(figure, &results.rows),
    });
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        title: &plan.title,
        device: &results.device,
        look: plan.look,
        references: &results.references,
        rows: &results.rows,
        figures: figures.collect(),
        failures: &results.failures,
    };
    Ok(serde_json::to_string_pretty(&report)? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_digits_and_have_no_exponent() {
        for (x, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (-0.0, "0"),
            (0.1234567891, "0.1234568"),
            (1.5e-7, "0.00000015"),
            (1234.5, "1234.5"),
        ] {
            assert_eq!(number(x), text, "{x}");
        }
    }

    #[test]
    fn fields_with_commas_and_quotes_are_quoted() {
        assert_eq!(quoted("a"), "a");
        assert_eq!(quoted("a, \"b\""), "\"a, \"\"b\"\"\"");
    }
}
