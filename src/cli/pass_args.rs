//! Options of rendering in passes.

use std::{path::PathBuf, time::Duration};

use caustica::settings::{Crop, PassRange, PassSettings, Range, Settings};
use clap::builder::{PathBufValueParser, TypedValueParser};

use super::values::{crop, duration, part, passes};

/// Range of `--target-error`.
const TARGET_ERROR: Range<f64> = Range::above(0.0, 1.0);

/// Which passes are rendered, and when they end.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("progressive").multiple(true))]
#[command(group = clap::ArgGroup::new("kept").multiple(true))]
pub struct PassOptions {
    /// Render the passes from 0 to N, or from A to B, B left out; each has photons and samples of
    /// its own and smaller radii, so that together they converge [default: a single picture]
    #[arg(long, value_name = "N|A..B", value_parser = passes, group = "progressive", help_heading = "Passes")]
    pub passes: Option<PassRange>,

    #[arg(help = format!("How slowly radii shrink from pass to pass, {}; 1 leaves them", PassSettings::ALPHA))]
    #[arg(long, value_name = "A", default_value_t = PassSettings::default().alpha, value_parser = alpha, help_heading = "Passes")]
    #[arg(requires = "progressive")]
    pub alpha: f64,

    /// Render whole passes for this time, as 90s, 10m or 2h, and at least one
    #[arg(long, value_name = "T", value_parser = duration, allow_hyphen_values = true, help_heading = "Passes")]
    #[arg(group = "progressive")]
    pub time: Option<Duration>,

    /// Stop when the estimated relative error of the picture is at most this, as 0.01
    #[arg(long, value_name = "E", value_parser = target_error, group = "progressive", help_heading = "Passes")]
    pub target_error: Option<f64>,

    /// Estimate the error in this part of the picture only: column, row, width, height
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop, allow_hyphen_values = true, help_heading = "Passes")]
    #[arg(requires = "progressive")]
    pub region: Option<Crop>,

    /// Write the sums of the passes to this .exr, for `caustica merge`
    #[arg(long, value_name = "PART.exr", help_heading = "Passes")]
    #[arg(value_parser = PathBufValueParser::new().try_map(part), groups = ["progressive", "kept"])]
    pub part: Option<PathBuf>,

    /// Keep what is done in this file, a part as by --part, and the outputs up to date beside it
    #[arg(long, value_name = "FILE", requires = "progressive", group = "kept", help_heading = "Passes")]
    pub checkpoint: Option<PathBuf>,

    /// Time between checkpoints, as 30s or 5m; 0s is after every pass
    #[arg(long, value_name = "T", value_parser = duration, default_value = "60s", help_heading = "Passes")]
    #[arg(requires = "checkpoint", allow_hyphen_values = true)]
    pub every: Duration,

    /// Go on with the checkpoint, or with the part of an earlier run, if there is one
    #[arg(long, requires = "kept", help_heading = "Passes")]
    pub resume: bool,
}

impl PassOptions {
    /// Whether the picture is rendered in passes.
    pub fn are_given(&self) -> bool {
        self.passes.is_some() || self.time.is_some() || self.target_error.is_some() || self.part.is_some()
    }

    /// Converts the arguments to the library's settings.
    pub fn settings(&self) -> PassSettings {
        PassSettings { alpha: self.alpha }
    }

    /// The passes to render; `None` if a time or a target alone ends them.
    fn wanted(&self) -> Option<PassRange> {
        let ends_otherwise = self.time.is_some() || self.target_error.is_some();
        self.passes.or((!ends_otherwise).then_some(PassRange { first: 0, end: 1 }))
    }

    /// The passes to render at most.
    pub fn range(&self, settings: &Settings) -> PassRange {
        self.wanted().unwrap_or_else(|| PassRange::longest(settings))
    }

    /// Number of passes to render; `None` if a time or a target alone ends them.
    pub fn count(&self) -> Option<u32> {
        self.wanted().map(|range| range.count())
    }
}

/// Parameter of the shrinking.
fn alpha(text: &str) -> Result<f64, String> {
    in_range(text, PassSettings::ALPHA)
}

/// A relative error.
fn target_error(text: &str) -> Result<f64, String> {
    in_range(text, TARGET_ERROR)
}

fn in_range(text: &str, range: Range<f64>) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| range.contains(*number));
    number.ok_or_else(|| format!("a number {range}"))
}
