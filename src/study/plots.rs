//! Plots of a study.

use super::{
    Figure, Row,
    chart::{Series, heat_map, line_chart},
    numbers::short,
};

/// Plot: file stem, and the picture as SVG.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    pub stem: String,
    pub svg: String,
}

/// Plots of all planes of n and k, or of n and rays of final gathering: error against time, cost
/// against k and against n, error over the plane.
pub(super) fn plots(figures: &[Figure], rows: &[Row]) -> Vec<Plot> {
    let planes: Vec<&Figure> = figures.iter().filter(|figure| figure.plane).collect();
    planes.iter().flat_map(|figure| of_plane(figure, rows, planes.len() > 1)).collect()
}

fn of_plane(figure: &Figure, rows: &[Row], several: bool) -> Vec<Plot> {
    let good: Vec<&Row> = figure.combinations().map(|i| &rows[i]).filter(|row| row.error.is_none()).collect();
    let Some(first) = good.first() else { return Vec::new() };
    let mode = first.mode.name();
    let of = format!("{}, {mode}", first.scene);
    let mut plots = Vec::new();
    let mut add = |name: &str, svg: String| {
        let stem = if several { format!("{name}-{mode}") } else { name.to_string() };
        plots.push(Plot { stem, svg });
    };
    let n_name = |row: &Row| format!("n = {}", short(row.photons));
    // The columns: neighbours, or rays of final gathering.
    let gathers = good.iter().any(|row| row.final_gather > 0);
    let (k, long) = if gathers { ("rays", "rays of final gathering") } else { ("k", "neighbours k") };
    let column = |row: &Row| if gathers { row.final_gather } else { row.neighbors };
    let k_name = |row: &Row| format!("{k} = {}", column(row));
    if good.iter().any(|row| row.rel_mse.is_some()) {
        let lines = lines(&good, n_name, |row| Some((row.seconds.total, row.rel_mse?)));
        let title = format!("Error against time: {of}; dots go up with {k}");
        add("error-against-time", line_chart(&title, "total time, s", "relMSE", &lines));
    }
    let cost_k = lines(&good, n_name, |row| Some((f64::from(column(row)), row.seconds.gather)));
    add(&format!("cost-against-{k}"), line_chart(&format!("Cost against {k}: {of}"), long, "gather, s", &cost_k));
    let cost_n = lines(&good, k_name, |row| Some((f64::from(row.photons), row.seconds.gather)));
    add("cost-against-n", line_chart(&format!("Cost against n: {of}"), "photons n", "gather, s", &cost_n));
    if good.iter().any(|row| row.rel_mse.is_some()) {
        let value = |cell: &Option<usize>| cell.and_then(|i| rows[i].rel_mse);
        let values: Vec<Vec<_>> = figure.rows.iter().map(|(_, cells)| cells.iter().map(value).collect()).collect();
        let labels: Vec<String> = figure.rows.iter().map(|(label, _)| label.clone()).collect();
        let title = format!("Error (relMSE) over n and {k}: {of}");
        add(&format!("error-over-n-and-{k}"), heat_map(&title, &figure.columns, &labels, &values));
    }
    plots
}

/// Groups the points into one line per name, in the order of their first appearance.
fn lines(rows: &[&Row], name: impl Fn(&Row) -> String, point: impl Fn(&Row) -> Option<(f64, f64)>) -> Vec<Series> {
    let mut lines: Vec<Series> = Vec::new();
    for row in rows {
        let Some(point) = point(row) else { continue };
        let name = name(row);
        match lines.iter_mut().find(|line| line.name == name) {
            Some(line) => line.points.push(point),
            None => lines.push(Series { name, points: vec![point] }),
        }
    }
    lines
}
