//! Arguments of `caustica merge` and `caustica status`.

use std::path::PathBuf;

use caustica::settings::PassRange;
use clap::{
    ArgAction,
    builder::{PathBufValueParser, TypedValueParser},
};

use super::{
    options::TonemapArg,
    values::{Exposure, exposure, output, passes},
};

const EXAMPLES: &str = "\
Passes are added in a fixed order: the picture has the bits of one machine, whatever the split and the order of PARTS.

Examples:
  caustica merge part-*.exr -o out.exr -o out.png
  caustica merge --passes 0..64 part-*.exr -o out.exr --allow-gaps";

#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct MergeArgs {
    /// Parts of one picture, rendered with `render --part` or kept by --checkpoint
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,

    /// File to write, .exr or .png; may be given several times
    #[arg(short, long = "output", value_name = "FILE", value_parser = PathBufValueParser::new().try_map(output))]
    #[arg(action = ArgAction::Append, required = true)]
    pub outputs: Vec<PathBuf>,

    /// Passes that should be there [default: from 0 to the last one that is there]
    #[arg(long, value_name = "N|A..B", value_parser = passes)]
    pub passes: Option<PassRange>,

    /// Merge what there is though passes or pixels are missing
    #[arg(long)]
    pub allow_gaps: bool,

    /// Brightens the PNG by this many stops; auto brings what is seen to middle grey
    #[arg(long, value_name = "auto|EV", default_value = "auto", value_parser = exposure)]
    pub exposure: Exposure,

    /// Tone curve of the PNG
    #[arg(long, value_name = "CURVE", value_enum, default_value = "neutral")]
    pub tonemap: TonemapArg,

    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, clap::Args)]
pub struct StatusArgs {
    /// Parts of one picture, rendered with `render --part` or kept by --checkpoint
    #[arg(required = true)]
    pub parts: Vec<PathBuf>,

    /// Passes that should be there [default: from 0 to the last one that is there]
    #[arg(long, value_name = "N|A..B", value_parser = passes)]
    pub passes: Option<PassRange>,

    /// Print JSON, for scripts
    #[arg(long)]
    pub json: bool,
}
