//! Report of a comparison, as JSON and as text.

use serde::Serialize;

use super::{
    measure::{Differences, Measure},
    sides::{GridGather, KdTreeGather},
};
use crate::stats::{DeviceStats, Stats};

/// The file `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Device on which the grid was built and queried.
    pub device: DeviceStats,
    /// Number of queries of each side: visible points times photon maps.
    pub queries: u64,
    /// Agreement of the summed photons.
    pub neighbors: Neighbors,
    /// Difference of the estimates' radii.
    pub radius: RelativeDifference,
    /// Difference of the estimates' radiance.
    pub radiance: RelativeDifference,
    /// Cost of the grid.
    pub grid: GridSide,
    /// Cost of the kd-tree.
    pub kdtree: KdTreeSide,
}

/// Agreement of the summed photons.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Neighbors {
    /// Fraction of all queries in which both sides summed the same photons, 0 to 1.
    pub identical_fraction: f64,
    /// Queries whose last photon and the next one are tied, see [`super::compare`].
    pub tied: u64,
}

/// Differences relative to the larger of both values, over all queries without a tie; for radiance,
/// that of the worst channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RelativeDifference {
    /// Maximum over the queries, ≥ 0.
    pub max_relative_difference: f64,
    /// Mean over the queries, ≥ 0.
    pub mean_relative_difference: f64,
}

/// The grid on the device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GridSide {
    /// Sorting the photons and building the grids, once the kernels are compiled.
    pub build_seconds: f64,
    /// Queries divided by the seconds of all gathers.
    pub queries_per_second: f64,
    /// Photons and grids.
    pub bytes: u64,
}

/// The kd-tree on the CPU.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KdTreeSide {
    /// Balancing the photons.
    pub build_seconds: f64,
    /// Queries divided by the seconds of all gathers.
    pub queries_per_second: f64,
    /// Photons and trees.
    pub bytes: u64,
    /// CPU threads.
    pub threads: usize,
}

/// A row of the table of both sides.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Name of the quantity.
    pub what: &'static str,
    /// Value of the grid, with its unit.
    pub grid: String,
    /// Value of the kd-tree, with its unit.
    pub kdtree: String,
}

impl Report {
    pub(super) fn new(measure: &Measure, grid: &GridGather, kdtree: &KdTreeGather, stats: &Stats) -> Self {
        let rate = |seconds: f64| measure.queries as f64 / seconds.max(1e-9);
        let difference =
            |d: &Differences| RelativeDifference { max_relative_difference: d.max, mean_relative_difference: d.mean() };
        Self {
            device: stats.device.clone(),
            queries: measure.queries,
            neighbors: Neighbors {
                identical_fraction: measure.identical as f64 / measure.queries.max(1) as f64,
                tied: measure.tied,
            },
            radius: difference(&measure.radius),
            radiance: difference(&measure.radiance),
            grid: GridSide {
                build_seconds: grid.build_seconds,
                queries_per_second: rate(grid.seconds),
                bytes: grid.bytes(),
            },
            kdtree: KdTreeSide {
                build_seconds: kdtree.build_seconds,
                queries_per_second: rate(kdtree.seconds),
                bytes: kdtree.bytes(),
                threads: rayon::current_num_threads(),
            },
        }
    }

    /// Facts about both sides together: name and value.
    #[must_use]
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let difference = |d: &RelativeDifference| match d.max_relative_difference {
            0.0 => "none".to_string(),
            most => format!("at most {most:.2e}, mean {:.2e}", d.mean_relative_difference),
        };
        vec![
            ("adapter", self.device.name.clone()),
            ("driver", self.device.driver.clone()),
            ("queries", grouped(self.queries)),
            ("identical neighbours", format!("{} %", percent(self.neighbors.identical_fraction))),
            ("tied queries", grouped(self.neighbors.tied)),
            ("relative difference of radius", difference(&self.radius)),
            ("relative difference of radiance", difference(&self.radiance)),
        ]
    }

    /// Rows of the table of both sides.
    #[must_use]
    pub fn rows(&self) -> Vec<Row> {
        let (g, t) = (&self.grid, &self.kdtree);
        let row = |what, grid, kdtree| Row { what, grid, kdtree };
        let mebibytes = |bytes: u64| format!("{:.2} MiB", bytes as f64 / f64::from(1 << 20));
        let threads = if t.threads == 1 { "1 CPU thread".to_string() } else { format!("{} CPU threads", t.threads) };
        vec![
            row("runs on", "the adapter".to_string(), threads),
            row("build", format!("{:.3} s", g.build_seconds), format!("{:.3} s", t.build_seconds)),
            row("queries per second", rounded(g.queries_per_second), rounded(t.queries_per_second)),
            row("memory", mebibytes(g.bytes), mebibytes(t.bytes)),
        ]
    }

    /// Formats the facts and rows as lines of text.
    #[must_use]
    pub fn table(&self) -> String {
        let mut lines: Vec<_> = self.facts().iter().map(|(what, value)| format!("{what:<32} {value}")).collect();
        let rows = self.rows();
        let width = rows.iter().map(|row| row.grid.chars().count()).max().unwrap_or(0).max("grid".len());
        lines.push(format!("\n{:<32} {:<width$}  kd-tree", "", "grid"));
        lines.extend(rows.iter().map(|row| format!("{:<32} {:<width$}  {}", row.what, row.grid, row.kdtree)));
        lines.push(String::new());
        lines.join("\n")
    }
}

/// Formats an integer with digits in groups of three.
pub(super) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Formats a number with three significant digits.
fn rounded(rate: f64) -> String {
    let unit = 10_f64.powf((rate.max(1.0).log10().floor() - 2.0).max(0.0));
    grouped(((rate / unit).round() * unit) as u64)
}

/// Formats a percentage with enough decimals that only all queries give 100.
fn percent(fraction: f64) -> String {
    let shown = format!("{:.4}", (fraction * 1e6).floor() / 1e4);
    shown.trim_end_matches('0').trim_end_matches('.').to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_easy_to_read() {
        assert_eq!(grouped(1_234_567), "1,234,567");
        assert_eq!(grouped(123), "123");
        assert_eq!(rounded(1_234_567.0), "1,230,000");
        assert_eq!(rounded(12.4), "12");
        assert_eq!(percent(1.0), "100");
        assert_eq!(percent(0.999_999_9), "99.9999");
        assert_eq!(percent(0.5), "50");
        assert_eq!(percent(0.0), "0");
    }
}
