//! Text summary of a study: one line per combination, then the claims.

use std::fmt::Write;

use super::{Plan, Results, Row, Verdict, claims::answers, numbers::brief};

/// Formats the table and the claims as text.
#[must_use]
pub fn summary(plan: &Plan, results: &Results) -> String {
    let mut text = format!(
        "{:<52} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}\n",
        "combination", "gather s", "total s", "mean", "noise", "relMSE", "FLIP"
    );
    for row in &results.rows {
        line(&mut text, row);
    }
    for figure in &plan.figures {
        for claim in answers(figure, &results.rows) {
            let verdict = match claim.verdict {
                Verdict::Holds => "holds",
                Verdict::DoesNotHold => "does not hold",
                Verdict::Unknown => "cannot be told",
            };
            let line = format!("{}: {}\n  {verdict}: {}\n", figure.title, claim.claim, claim.measured);
            text.push_str(&line);
        }
    }
    text
}

fn line(text: &mut String, row: &Row) {
    let written = match &row.error {
        Some(error) => writeln!(text, "{:<52} failed: {error}", row.name()),
        None => {
            let optional = |x: Option<f64>| x.map_or("-".to_string(), brief);
            let values = [
                brief(row.seconds.gather),
                brief(row.seconds.total),
                brief(row.mean()),
                optional(row.noise),
                optional(row.rel_mse),
                optional(row.flip),
            ];
            let values: String = values.iter().map(|value| format!(" {value:>9}")).collect();
            writeln!(text, "{:<52}{values}", row.name())
        }
    };
    written.expect("a String can be written");
}
