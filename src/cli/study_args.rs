//! Arguments of `caustica study`.

use std::path::PathBuf;

use caustica::settings::{EstimateSettings, PhotonSettings, Range};
use clap::ValueEnum;

use super::{
    options::{ModeArg, ModeParser, SharedOptions},
    values::{photons, scale, whole},
};

/// Range of `--repeat`.
const REPEAT: Range<u32> = Range::closed(1, 1000);

const EXAMPLES: &str = "\
Renders every combination once; photons are traced once for all k of one n. Writes DIR/study.csv, study.json,
contact-sheet.png, plots as .svg, and report.html with all of them. Finished cells are kept in DIR/cells: called again, an
interrupted study goes on where it stopped. Exits with 1 when a cell fails; the others are written all the same.

Examples:
  caustica study scene.glb -o study --photons 1k,10k,100k -k 1,10,100 --size 256x256
  caustica study scene.glb -o study --photons 100k -k 10,50 --modes 0,1 --repeat 4 --reference auto
  caustica study scene.glb -o study --photons 20k,200k --gather 0,16,64,256 --reference scene.exr
  caustica study --preset report -o report";

#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct StudyArgs {
    /// glTF 2.0 file, .gltf or .glb; with --preset the folder of scenes [default: scenes]
    #[arg(required_unless_present = "preset")]
    pub scene: Option<PathBuf>,

    /// Folder for the results; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// Photons that each map can hold: several, as 1k,10k,1.5M
    #[arg(long, value_name = "N,N…", value_delimiter = ',', value_parser = photons, help_heading = "Study")]
    #[arg(allow_hyphen_values = true, required_unless_present = "preset", conflicts_with = "preset")]
    pub photons: Vec<u32>,

    #[arg(help = format!("Neighbours in the radiance estimate, {}: several, as 1,10,100", EstimateSettings::NEIGHBORS))]
    #[arg(short = 'k', long, value_name = "K,K…", value_delimiter = ',', help_heading = "Study")]
    #[arg(value_parser = whole(EstimateSettings::NEIGHBORS))]
    #[arg(allow_hyphen_values = true, required_unless_present_any = ["preset", "gather"])]
    #[arg(conflicts_with_all = ["preset", "gather"])]
    pub neighbors: Vec<u32>,

    #[arg(help = format!(
        "Rays of final gathering in place of neighbours, {}: several, as 16,64,256; 0 is the estimate at each point",
        PhotonSettings::FINAL_GATHER
    ))]
    #[arg(long, value_name = "R,R…", value_delimiter = ',', value_parser = whole(PhotonSettings::FINAL_GATHER))]
    #[arg(allow_hyphen_values = true, conflicts_with = "preset", help_heading = "Study")]
    pub gather: Vec<u32>,

    /// Modes by name or number: several, as 0,1 or hybrid,photons
    #[arg(long, value_name = "MODE,MODE…", value_delimiter = ',', value_parser = ModeParser, default_value = "hybrid")]
    #[arg(conflicts_with = "preset", help_heading = "Study")]
    pub modes: Vec<ModeArg>,

    #[arg(help = format!(
        "Renders of each combination with seeds of their own, {REPEAT}; noise and bias need two [default: 1, of the \
         preset's plane of n and k 2]"
    ))]
    #[arg(long, value_name = "R", value_parser = whole(REPEAT), help_heading = "Study")]
    pub repeat: Option<u32>,

    /// What pictures are measured against: an EXR file of their size, or auto for a much finer
    /// render [default: none]
    #[arg(long, value_name = "FILE.exr|auto", value_parser = reference, conflicts_with = "preset")]
    #[arg(help_heading = "Study")]
    pub reference: Option<ReferenceArg>,

    /// A study made up before
    #[arg(long, value_name = "NAME", value_enum, help_heading = "Study")]
    pub preset: Option<PresetArg>,

    /// Multiplies every n of the preset, for tests
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = scale, hide = true)]
    pub preset_scale: f64,

    #[command(flatten)]
    pub options: SharedOptions,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PresetArg {
    /// The figures of a university report on photon mapping, and its claims put to the test;
    /// 256x256 with one sample a pixel unless --size and --spp say otherwise
    Report,
}

/// Source of the reference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReferenceArg {
    Auto,
    File(PathBuf),
}

fn reference(text: &str) -> Result<ReferenceArg, String> {
    match text {
        "auto" => Ok(ReferenceArg::Auto),
        file if file.to_lowercase().ends_with(".exr") => Ok(ReferenceArg::File(PathBuf::from(file))),
        _ => Err("neither auto nor a name that ends in .exr".to_string()),
    }
}
