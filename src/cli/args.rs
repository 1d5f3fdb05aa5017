//! Arguments of the command line.

use std::path::PathBuf;

use caustica::{
    compare::TOLERANCE,
    settings::{EstimateSettings, Mode, PhotonSettings, PictureSettings, Quality, Settings},
};
use clap::{
    ArgAction, Parser, Subcommand,
    builder::{PathBufValueParser, TypedValueParser},
};

use super::{
    loading::LoadingOptions,
    merge_args::{MergeArgs, StatusArgs},
    options::{LayerArg, QualityArg, RenderOptions, SearchArg},
    pass_args::PassOptions,
    study_args::StudyArgs,
    values::{gather_radius, gather_reach, irradiance_cells, output, radius, share_reach, tolerance, whole},
};

/// Caustica renders glTF scenes by photon mapping on the GPU, without a screen.
///
/// It is made for the light that glass, mirrors and water throw.
#[derive(Debug, Parser)]
#[command(name = "caustica", version, propagate_version = true, max_term_width = 120)]
#[command(after_help = "Exit codes: 0 success, 1 failure, 2 wrong usage, 130 Ctrl-C, 143 SIGTERM.")]
pub struct Args {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to OpenEXR and PNG
    Render(Box<RenderArgs>),
    /// Gather every visible point on the grid and on a kd-tree, and show how they differ
    Compare(Box<CompareArgs>),
    /// Render many combinations of photons and neighbours, measure them and report them together
    Study(Box<StudyArgs>),
    /// Add up parts of a picture, rendered with `render --part`
    Merge(Box<MergeArgs>),
    /// Say which passes of a picture there are, and which are missing
    Status(StatusArgs),
    /// List the adapters: name, driver, kind, limits, usable or why not
    Devices,
    /// Say what a scene holds and how it will be read
    Info {
        /// glTF 2.0 file, .gltf or .glb
        scene: PathBuf,

        #[command(flatten)]
        loading: LoadingOptions,

        /// Print JSON, for scripts
        #[arg(long)]
        json: bool,

        /// Trace the photons of a picture too, as `render` does by default, and say how many end
        /// where the camera sees them
        #[arg(long)]
        photons: bool,

        /// Adapter that traces them, as in `render` [env: CAUSTICA_DEVICE]
        #[arg(long, value_name = "NAME|INDEX", requires = "photons")]
        device: Option<String>,
    },
}

/// Settings of the default quality, for the words on defaults.
fn normal() -> Settings {
    Quality::default().settings()
}

const EXAMPLES: &str = "\
Examples:
  caustica render scene.glb -o out.exr
  caustica render scene.gltf -o out.exr -o out.png --size 1024x1024 --photons 1M
  caustica render scene.gltf -o preview.png --mode direct-rays --spp 1 --exposure 1
  caustica render scene.glb -o out.exr --stats out.json -q --seed 7
  caustica render scene.glb -o out.exr --target-error 0.01 --checkpoint out.part.exr --resume
  caustica render scene.glb --passes 16..32 --part part-16.exr
  caustica render a.glb b.glb c.glb --output-dir pictures";

#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct RenderArgs {
    /// glTF 2.0 file, .gltf or .glb; several with --output-dir
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,

    /// File to write, .exr or .png; may be given several times
    #[arg(short, long = "output", value_name = "FILE", value_parser = PathBufValueParser::new().try_map(output))]
    #[arg(required_unless_present_any = ["part", "output_dir"])]
    #[arg(action = ArgAction::Append)]
    pub outputs: Vec<PathBuf>,

    /// Write NAME.exr and NAME.png of each scene to this folder, made if it is not there; a scene
    /// that fails does not keep the others from being rendered
    #[arg(long, value_name = "DIR", conflicts_with_all = ["outputs", "part", "checkpoint", "stats"])]
    pub output_dir: Option<PathBuf>,

    #[command(flatten)]
    pub options: RenderOptions,

    /// Which photons are summed and where they are looked for
    #[arg(long, value_name = "HOW", value_enum, default_value = "grid", help_heading = "Estimate")]
    pub search: SearchArg,

    /// Radius of the estimate in metres, with --search radius
    #[arg(long, value_name = "R", value_parser = radius, help_heading = "Estimate")]
    #[arg(required_if_eq("search", "radius"))]
    pub radius: Option<f32>,

    #[arg(help = format!(
        "Photons, samples and final gathering of a picture for a purpose; single options override it. With a --size of \
         fewer pixels than {}x{}, the photons of the global map are in proportion to their number and those of the caustic \
         map to its root, at least as for {}x{}",
        Quality::WHOLE.0,
        Quality::WHOLE.1,
        Quality::LEAST.0,
        Quality::LEAST.1
    ))]
    #[arg(long, value_name = "WHAT", value_enum, default_value = "normal", help_heading = "Picture")]
    pub quality: QualityArg,

    #[arg(help = format!(
        "Camera samples of a pixel whose neighbours are uneven, as at edges, in penumbrae and in glass; no more than \
         --spp: every pixel has those [default: by --quality, {}; --spp where that is given, or without final gathering]",
        normal().picture.spp + normal().picture.extra_samples()
    ))]
    #[arg(long, value_name = "N", value_parser = whole(PictureSettings::SPP), help_heading = "Picture")]
    pub max_spp: Option<u32>,

    #[arg(help = format!(
        "Rays of final gathering per visible point: light over other surfaces is what these see of direct light and the \
         maps; 0 takes it from the photons around the point itself [default: by --quality, {}; 0 in other modes than \
         hybrid and indirect-photons, with --raw-estimate, and with other searches than the grid]",
        normal().photons.final_gather
    ))]
    #[arg(long, value_name = "N", value_parser = whole(PhotonSettings::FINAL_GATHER))]
    #[arg(help_heading = "Estimate")]
    pub final_gather: Option<u32>,

    #[arg(help = format!(
        "Points on one surface share an estimate within this fraction of its radius, {}; 0 makes one for every sample",
        EstimateSettings::SHARE_REACH
    ))]
    #[arg(long, value_name = "F", default_value_t = EstimateSettings::default().share_reach, value_parser = share_reach, help_heading = "Estimate")]
    pub share: f32,

    #[arg(help = format!(
        "Ends of final-gather rays share irradiance in cells of this fraction of the estimate's radius, {}; 0 makes an estimate for each",
        EstimateSettings::IRRADIANCE_CELLS
    ))]
    #[arg(long, value_name = "F", default_value_t = EstimateSettings::default().irradiance_cells, value_parser = irradiance_cells, help_heading = "Estimate")]
    pub irradiance_cells: f32,

    #[arg(help = format!(
        "Pixels between the points of final gathering, {}; samples take the light of those around them; 0 gathers at every sample [default: by --quality, {}]",
        EstimateSettings::GATHER_SPACING,
        normal().estimate.gather_spacing
    ))]
    #[arg(long, value_name = "N", value_parser = whole(EstimateSettings::GATHER_SPACING), help_heading = "Estimate")]
    pub gather_spacing: Option<u32>,

    #[arg(help = format!(
        "Radius around a sample from which it takes that light, pixels, {} [default: by --quality, {}]",
        EstimateSettings::GATHER_RADIUS,
        normal().estimate.gather_radius
    ))]
    #[arg(long, value_name = "R", value_parser = gather_radius, help_heading = "Estimate")]
    pub gather_radius: Option<f32>,

    #[arg(help = format!(
        "Distance over which a point gives that light to others, as a fraction of the mean distance to what surrounds it, {}; a sixth of it from the second of several passes on",
        EstimateSettings::GATHER_REACH
    ))]
    #[arg(long, value_name = "F", default_value_t = EstimateSettings::default().gather_reach, value_parser = gather_reach, help_heading = "Estimate")]
    pub gather_reach: f32,

    /// Further layers of .exr files, by name, with commas between; every layer costs a little,
    /// `lights` the time of one picture for each group of lights
    #[arg(long, value_name = "LAYERS", value_enum, value_delimiter = ',', help_heading = "Picture")]
    pub layers: Vec<LayerArg>,

    #[command(flatten)]
    pub passes: PassOptions,

    /// Write what happened as JSON: device, seconds by stage, photons, rays, peak device memory,
    /// warnings
    #[arg(long, value_name = "FILE", help_heading = "Run")]
    pub stats: Option<PathBuf>,
}

const COMPARE_EXAMPLES: &str = "\
Writes DIR/report.json, report.html, and grid, kdtree and difference as .exr and .png. Exits with 1 when the searches differ
beyond the tolerance.

Examples:
  caustica compare scene.glb -o comparison
  caustica compare scene.glb -o comparison --size 128x128 --spp 1 -k 500 --photons 1M -q";

#[derive(Debug, clap::Args)]
#[command(after_help = COMPARE_EXAMPLES, allow_negative_numbers = true)]
pub struct CompareArgs {
    /// glTF 2.0 file, .gltf or .glb
    pub scene: PathBuf,

    /// Folder for the report; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,

    /// Largest relative difference of radiance and radius; sets of photons may differ by ties only
    #[arg(long, value_name = "T", default_value_t = TOLERANCE, value_parser = tolerance)]
    pub tolerance: f64,

    #[command(flatten)]
    pub options: RenderOptions,

    /// Leave N photons out of the kd-tree: the comparison must then fail
    #[arg(long, value_name = "N", default_value_t = 0, hide = true)]
    pub sabotage: u32,
}

impl RenderArgs {
    /// Converts the arguments to the library's settings.
    pub fn settings(&self) -> Settings {
        let options = &self.options;
        let quality = Quality::from(self.quality);
        let goes = Mode::from(options.mode).gathers_finally()
            && matches!(self.search, SearchArg::Grid)
            && !options.shared.raw_estimate;
        let gathers = self.final_gather.map_or(goes, |rays| rays > 0);
        // Without a size, a picture is large enough.
        let size = options.shared.size.unwrap_or(Quality::WHOLE);
        let base = if gathers { quality.settings_for(size) } else { quality.without_final_gather_for(size) };
        options.settings(base).with(|s| {
            s.picture.max_spp = self.max_spp.or(s.picture.max_spp);
            s.photons.final_gather = self.final_gather.unwrap_or(s.photons.final_gather);
            s.estimate.gather_spacing = self.gather_spacing.unwrap_or(s.estimate.gather_spacing);
            s.estimate.gather_radius = self.gather_radius.unwrap_or(s.estimate.gather_radius);
            s.estimate.gather_reach = self.gather_reach;
            s.estimate.search = self.search.into();
            s.estimate.radius = self.radius;
            s.estimate.share_reach = self.share;
            s.estimate.irradiance_cells = self.irradiance_cells;
            s.picture.layers = self.layers.iter().map(|layer| (*layer).into()).collect();
            s.picture.layers.sort();
            s.picture.layers.dedup();
            s.counts_seen = self.stats.is_some();
        })
    }

    /// Values that the quality stands for, in the words of the other options.
    pub fn quality_line(&self) -> String {
        let Settings { photons, estimate, picture, .. } = self.settings();
        format!(
            "quality {}: --global-photons {} --caustic-photons {} -k {} --spp {} --max-spp {} --light-samples {} --final-gather {} \
             --gather-spacing {} --gather-radius {}",
            Quality::from(self.quality).name(),
            photons.global,
            photons.caustic,
            estimate.neighbors,
            picture.spp,
            picture.spp + picture.extra_samples(),
            picture.light_samples,
            photons.final_gather,
            estimate.gather_spacing,
            estimate.gather_radius,
        )
    }
}

#[cfg(test)]
mod tests {
    use caustica::{
        density::DensityKernel,
        settings::{Emission, LightSampling, LightUnit, Mode, Search},
    };

    use super::*;

    fn settings(line: &str) -> Settings {
        let words = ["caustica", "render", "a.glb", "-o", "a.exr"].into_iter().chain(line.split_whitespace());
        match Args::try_parse_from(words).expect("the line is well formed").command {
            Command::Render(args) => args.settings(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_definition_is_sound() {
        <Args as clap::CommandFactory>::command().debug_assert();
    }

    #[test]
    fn without_options_the_settings_are_those_of_normal_quality() {
        assert_eq!(settings(""), Quality::Normal.settings());
        assert_eq!(settings("--final-gather 0"), Settings::default());
        let high = settings("--quality high --spp 9 --final-gather 32");
        let expected = Quality::High.settings().with(|s| {
            s.picture.spp = 9;
            s.picture.max_spp = None;
            s.photons.final_gather = 32;
        });
        assert_eq!(high, expected);
    }

    #[test]
    fn a_number_of_samples_is_that_of_every_pixel() {
        let samples = |line: &str| {
            let picture = settings(line).picture;
            (picture.spp, picture.extra_samples())
        };
        assert_eq!(samples(""), (4, 60));
        assert_eq!(samples("--spp 4"), (4, 0));
        assert_eq!(samples("--spp 4 --max-spp 31"), (4, 12));
        assert_eq!(samples("--spp 4 --max-spp 7"), (4, 0));
        assert_eq!(samples("--max-spp 1"), (4, 0));
        assert_eq!(samples("--quality high"), (16, 112));
        assert_eq!(samples("--quality draft"), (1, 0));
        assert_eq!(samples("--final-gather 0"), (4, 0));
        assert_eq!(samples("--final-gather 0 --max-spp 64"), (4, 60));
    }

    #[test]
    fn small_pictures_have_fewer_photons_unless_they_are_given() {
        assert_eq!(settings("--size 256x256").photons, settings("").photons);
        let photons = |line: &str| {
            let photons = settings(line).photons;
            (photons.global, photons.caustic)
        };
        assert_eq!(photons("--size 64x64"), (12_500, 25_000));
        assert_eq!(photons("--size 64x64 --final-gather 0"), (6250, 25_000));
        assert_eq!(photons("--size 64x64 --quality high"), (18_750, 75_000));
        assert_eq!(photons("--size 64x64 --photons 100k"), (100_000, 100_000));
        assert_eq!(photons("--size 64x64 --caustic-photons 7"), (12_500, 7));
    }

    #[test]
    fn estimates_of_the_report_do_without_final_gathering() {
        for words in ["--mode photons", "--raw-estimate", "--search kdtree", "--search radius --radius 1"] {
            let s = settings(words);
            assert_eq!(
                (s.photons.final_gather, s.estimate.gather_spacing, s.estimate.neighbors),
                (0, 0, 100),
                "{words}"
            );
        }
    }

    #[test]
    fn modes_go_by_name_or_number() {
        for (number, mode) in Mode::ALL.into_iter().enumerate() {
            assert_eq!(settings(&format!("--mode {number}")).photons.mode, mode);
            assert_eq!(settings(&format!("--mode {}", mode.name())).photons.mode, mode);
        }
    }

    #[test]
    fn a_map_of_its_own_capacity_overrides_photons() {
        let s = settings("--photons 200k --caustic-photons 1.5M");
        assert_eq!((s.photons.global, s.photons.caustic), (200_000, 1_500_000));
        let s = settings("--global-photons 7");
        assert_eq!((s.photons.global, s.photons.caustic), (7, 100_000));
    }

    #[test]
    fn every_option_reaches_the_settings() {
        let s = settings(
            "--max-paths 3M -k 50 --kernel gaussian --raw-estimate --final-gather 16 --share 0.5 --irradiance-cells 0.25 --gather-spacing 3 --gather-radius 5 --gather-reach 2 --cone-constant 1.5 --max-radius 0.25 --max-bounces 0 --spp 9 --size 640x480 \
             --camera side --seed 11 --light-sampling uniform --light-unit photometric --search kdtree \
             --light-photons lamp=2 --light-photons sky=0.5 --light-samples 9 --emission unaimed",
        );
        let expected = Settings::default().with(|s| {
            s.photons.max_paths = Some(3_000_000);
            s.photons.global = 200_000;
            s.estimate.neighbors = 50;
            s.estimate.kernel = DensityKernel::Gaussian;
            s.estimate.raw = true;
            s.photons.final_gather = 16;
            s.estimate.share_reach = 0.5;
            s.estimate.irradiance_cells = 0.25;
            s.estimate.gather_spacing = 3;
            s.estimate.gather_radius = 5.0;
            s.estimate.gather_reach = 2.0;
            s.estimate.cone_constant = 1.5;
            s.estimate.max_radius = Some(0.25);
            s.photons.max_bounces = 0;
            s.picture.spp = 9;
            s.picture.size = Some((640, 480));
            s.picture.camera = Some("side".into());
            s.photons.seed = 11;
            s.lights.sampling = LightSampling::Uniform;
            s.lights.unit = LightUnit::Photometric;
            s.estimate.search = Search::KdTree;
            s.lights.photon_weights = vec![("lamp".into(), 2.0), ("sky".into(), 0.5)];
            s.picture.light_samples = 9;
            s.photons.emission = Emission::Unaimed;
        });
        assert_eq!(s, expected);
        let s = settings("--search radius --radius 0.1");
        assert_eq!((s.estimate.search, s.estimate.radius), (Search::Radius, Some(0.1)));
    }
}
