//! HTML page of a study: one self-contained file.

use std::io;

use base64::{Engine, engine::general_purpose::STANDARD};

use super::{
    Claim, Figure, Plan, Results, Row, Verdict,
    chart::INK,
    claims::answers,
    numbers::{brief, short},
    plots::Plot,
    sheet::contact_sheet,
};
use crate::html::{escaped, filled};

const TEMPLATE: &str = include_str!("page.html");

/// A column of the page's table: heading, and value in a row.
type Column = (&'static str, fn(&Row) -> Value);

/// The columns, in order.
const COLUMNS: [Column; 15] = [
    ("scene", |r| Value::text(&r.scene)),
    ("mode", |r| Value::text(r.mode.name())),
    ("n", |r| Value::of_photons(r, short(r.photons), r.photons)),
    ("k", |r| Value::of_photons(r, r.neighbors.to_string(), r.neighbors)),
    ("rays", |r| Value::of_photons(r, r.final_gather.to_string(), r.final_gather)),
    ("gather", |r| Value::number(Some(r.seconds.gather).filter(|_| r.error.is_none()))),
    ("total", |r| Value::number(Some(r.seconds.total).filter(|_| r.error.is_none()))),
    ("stored", |r| Value::text(&r.global.stored.to_string())),
    ("caustic", |r| Value::text(&r.caustic.stored.to_string())),
    ("median radius", |r| Value::number(r.global.radius.map(|radii| radii.median.into()))),
    ("mean", |r| Value::number(Some(r.mean()).filter(|_| r.error.is_none()))),
    ("noise", |r| Value::number(r.noise)),
    ("relMSE", |r| Value::number(r.rel_mse)),
    ("FLIP", |r| Value::number(r.flip)),
    ("corners", |r| Value::number(r.corner_ratio)),
];

/// A value's text in the table, and its sort key.
struct Value {
    shown: String,
    sorted: String,
}

impl Value {
    fn text(text: &str) -> Self {
        Self { shown: text.to_string(), sorted: text.to_string() }
    }

    /// Empty where no photons are traced.
    fn of_photons(row: &Row, shown: String, sorted: u32) -> Self {
        if row.mode.traces_photons() { Self { shown, sorted: sorted.to_string() } } else { Self::text("") }
    }

    fn number(x: Option<f64>) -> Self {
        Self { shown: x.map(brief).unwrap_or_default(), sorted: x.map(|x| x.to_string()).unwrap_or_default() }
    }
}

pub(super) fn page(plan: &Plan, results: &Results, plots: &[Plot]) -> io::Result<String> {
    let figures = plan.figures.iter().map(|figure| show_figure(figure, results)).collect::<io::Result<String>>()?;
    let failures = results.failures.iter().map(|line| format!("<p class=\"failure\">Failed: {}</p>", escaped(line)));
    let headers = COLUMNS.iter().map(|(name, _)| format!("<th scope=\"col\"><button>{name}</button></th>"));
    let parts = [
        ("title", escaped(&plan.title)),
        ("summary", summary(plan, results)),
        ("failures", failures.collect()),
        ("figures", figures),
        ("plots", plots.iter().map(|plot| inline(&plot.svg)).collect()),
        ("headers", headers.collect()),
        ("rows", results.rows.iter().map(table_row).collect()),
    ];
    Ok(filled(TEMPLATE, &parts.each_ref().map(|(name, part)| (*name, part.as_str()))))
}

fn summary(plan: &Plan, results: &Results) -> String {
    let references = match results.references.as_slice() {
        [] => "none".to_string(),
        lines => lines.iter().map(|line| escaped(line)).collect::<Vec<_>>().join("; "),
    };
    let size = results.rows.iter().find(|row| row.width > 0);
    let size = size
        .map(|r| format!(", {} x {} pixels, {} a pixel", r.width, r.height, counted(r.spp as usize, "sample")))
        .unwrap_or_default();
    format!(
        "{} in {}{size}. {} ({}). Caustica {}. References: {references}.",
        counted(results.rows.len(), "combination"),
        counted(plan.figures.len(), "figure"),
        escaped(&results.device.name),
        escaped(&results.device.driver),
        env!("CARGO_PKG_VERSION"),
    )
}

/// "1 figure", "2 figures".
fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

fn show_figure(figure: &Figure, results: &Results) -> io::Result<String> {
    let picture = STANDARD.encode(contact_sheet(std::slice::from_ref(figure), &results.rows)?);
    let title = escaped(&figure.title);
    let claims: String = answers(figure, &results.rows).iter().map(show_claim).collect();
    Ok(format!(
        "<h2>{title}</h2>\n<figure><img class=\"sheet\" alt=\"Contact sheet: {title}\" \
         src=\"data:image/png;base64,{picture}\"></figure>\n{claims}"
    ))
}

fn show_claim(claim: &Claim) -> String {
    let (class, verdict) = match claim.verdict {
        Verdict::Holds => ("holds", "holds"),
        Verdict::DoesNotHold => ("does-not-hold", "does not hold"),
        Verdict::Unknown => ("unknown", "cannot be told"),
    };
    format!(
        "<div class=\"claim {class}\"><p><strong>{}</strong> <span class=\"verdict\">{verdict}</span></p>\
         <p>Measured: {}.</p><p class=\"soft\">Holds if {}.</p></div>\n",
        escaped(claim.claim),
        escaped(&claim.measured),
        escaped(claim.rule)
    )
}

/// A plot whose ink is the page's text colour.
fn inline(svg: &str) -> String {
    svg.replace(INK, "currentColor")
}

fn table_row(row: &Row) -> String {
    let cell = |value: Value| format!("<td data-value=\"{}\">{}</td>", escaped(&value.sorted), escaped(&value.shown));
    let cells: String = COLUMNS.iter().map(|(_, value)| cell(value(row))).collect();
    format!("<tr>{cells}</tr>\n")
}
