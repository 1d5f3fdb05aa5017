//! Arguments of the command line.

use std::path::PathBuf;

use caustica::{
    image::Tonemap,
    settings::{LightSampling, LightUnit, Mode, Settings},
};
use clap::{
    ArgAction, Parser, Subcommand, ValueEnum,
    builder::{PathBufValueParser, TypedValueParser},
};

use super::values::{cone_constant, count, exposure, output, photons, radius, size};

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
    /// List the adapters: name, driver, kind, limits, usable or why not
    Devices,
    /// Say what a scene holds and how it will be read
    Info {
        /// glTF 2.0 file, .gltf or .glb
        scene: PathBuf,
    },
}

const EXAMPLES: &str = "\
Examples:
  caustica render scene.glb -o out.exr
  caustica render scene.gltf -o out.exr -o out.png --size 1024x1024 --photons 1M
  caustica render scene.gltf -o preview.png --mode direct-rays --spp 1 --exposure 1
  caustica render scene.glb -o out.exr --stats out.json -q --seed 7";

#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct RenderArgs {
    /// glTF 2.0 file, .gltf or .glb
    pub scene: PathBuf,

    /// File to write, .exr or .png; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true, value_parser = PathBufValueParser::new().try_map(output))]
    #[arg(action = ArgAction::Append)]
    pub outputs: Vec<PathBuf>,

    /// Which light reaches the picture and how, by name or number
    #[arg(long, value_enum, default_value = "hybrid", help_heading = "Light")]
    pub mode: ModeArg,

    /// How photon paths are dealt to lights
    #[arg(long, value_name = "HOW", value_enum, default_value = "power", help_heading = "Light")]
    pub light_sampling: LightSamplingArg,

    /// How the file's light intensities are read
    #[arg(long, value_name = "UNIT", value_enum, default_value = "radiometric", help_heading = "Light")]
    pub light_unit: LightUnitArg,

    /// Photons that each map can hold, as 100000, 200k or 1.5M [default: 100k]
    #[arg(long, value_name = "N", value_parser = photons, help_heading = "Photons")]
    pub photons: Option<u32>,

    /// Photons that the global map can hold [default: --photons]
    #[arg(long, value_name = "N", value_parser = photons, help_heading = "Photons")]
    pub global_photons: Option<u32>,

    /// Photons that the caustic map can hold [default: --photons]
    #[arg(long, value_name = "N", value_parser = photons, help_heading = "Photons")]
    pub caustic_photons: Option<u32>,

    /// Photon paths emitted at most [default: 100 times the capacity]
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Photons")]
    pub max_paths: Option<u64>,

    /// Longest photon path, and longest chain of mirrors and glass on a camera path, in surfaces; 0 leaves the end
    /// of paths to Russian roulette
    #[arg(long, value_name = "B", default_value_t = 20, help_heading = "Photons")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=65535))]
    pub max_bounces: u32,

    /// Neighbours in the radiance estimate, 1 to 1000
    #[arg(short = 'k', long, value_name = "K", default_value_t = 100, help_heading = "Estimate")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub neighbors: u32,

    /// Constant of the cone filter, at least 1
    #[arg(long, value_name = "C", default_value_t = 2.0, value_parser = cone_constant, help_heading = "Estimate")]
    pub cone_constant: f32,

    /// Bound of the search radius in metres [default: none]
    #[arg(long, value_name = "R", value_parser = radius, help_heading = "Estimate")]
    pub max_radius: Option<f32>,

    /// Jittered camera samples per pixel, averaged over the pixel's square; 1 is the pixel's centre
    #[arg(long, value_name = "N", default_value_t = 4, help_heading = "Picture")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,

    /// Size in pixels; the vertical angle of view stays [default: 512 high, as wide as the camera says or square]
    #[arg(long, value_name = "WxH", value_parser = size, help_heading = "Picture")]
    pub size: Option<(u32, u32)>,

    /// Camera of the file, by name or by index from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX", help_heading = "Picture")]
    pub camera: Option<String>,

    /// Brightens the PNG by this many stops
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = exposure, help_heading = "Picture")]
    #[arg(allow_negative_numbers = true)]
    pub exposure: f32,

    /// Tone curve of the PNG
    #[arg(long, value_name = "CURVE", value_enum, default_value = "neutral", help_heading = "Picture")]
    pub tonemap: TonemapArg,

    /// One number that decides all randomness
    #[arg(long, value_name = "S", default_value_t = 0, help_heading = "Run")]
    pub seed: u32,

    /// Adapter, by a part of its name or by the index that `caustica devices` shows [default: the best real GPU,
    /// else software]
    #[arg(long, value_name = "NAME|INDEX", env = "CAUSTICA_DEVICE", hide_env_values = true, help_heading = "Run")]
    pub device: Option<String>,

    /// Write what happened as JSON: device, seconds by stage, photons, rays, peak device memory, warnings
    #[arg(long, value_name = "FILE", help_heading = "Run")]
    pub stats: Option<PathBuf>,

    /// Print errors only
    #[arg(short, long, help_heading = "Run", conflicts_with = "verbose")]
    pub quiet: bool,

    /// Print more: seconds by stage, photons and memory, and what the library logs
    #[arg(short, long, help_heading = "Run")]
    pub verbose: bool,
}

impl RenderArgs {
    /// The library's settings that these arguments ask for.
    pub fn settings(&self) -> Settings {
        let defaults = Settings::default();
        let capacity = |specific: Option<u32>, default| specific.or(self.photons).unwrap_or(default);
        Settings {
            mode: self.mode.into(),
            global_photons: capacity(self.global_photons, defaults.global_photons),
            caustic_photons: capacity(self.caustic_photons, defaults.caustic_photons),
            max_paths: self.max_paths,
            neighbors: self.neighbors,
            cone_constant: self.cone_constant,
            max_radius: self.max_radius,
            max_bounces: self.max_bounces,
            spp: self.spp,
            size: self.size,
            camera: self.camera.clone(),
            seed: self.seed,
            light_sampling: self.light_sampling.into(),
            light_unit: self.light_unit.into(),
        }
    }
}

/// An enumeration of the command line, value for value one of the library.
macro_rules! value_enum {
    ($name:ident => $library:ident { $($(#[$meta:meta])* $value:ident),+ $(,)? }) => {
        #[derive(Clone, Copy, Debug, ValueEnum)]
        pub enum $name { $($(#[$meta])* $value),+ }

        impl From<$name> for $library {
            fn from(value: $name) -> Self {
                match value { $($name::$value => $library::$value),+ }
            }
        }
    };
}

value_enum!(ModeArg => Mode {
    /// 0: direct light by shadow rays, all else by photons
    #[value(alias = "0")]
    Hybrid,
    /// 1: all light by photons
    #[value(alias = "1")]
    Photons,
    /// 2: direct light by shadow rays only
    #[value(alias = "2")]
    DirectRays,
    /// 3: light straight from the lights or through mirrors and glass only, by photons
    #[value(alias = "3")]
    DirectPhotons,
    /// 4: what `hybrid` takes from photons
    #[value(alias = "4")]
    IndirectPhotons,
});

value_enum!(LightSamplingArg => LightSampling {
    /// In proportion to power
    Power,
    /// In turn, whatever the power
    Uniform,
});

value_enum!(LightUnitArg => LightUnit {
    /// Candela read as W/sr in each channel
    Radiometric,
    /// Candela divided by 683 lm/W
    Photometric,
});

value_enum!(TonemapArg => Tonemap {
    /// Khronos PBR Neutral: keeps base colours, rolls off highlights
    Neutral,
    /// ACES, as fitted by Stephen Hill
    Aces,
    /// Reinhard's curve on luminance
    Reinhard,
    /// Clips at 1
    None,
});

#[cfg(test)]
mod tests {
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
    fn without_options_the_settings_are_the_library_defaults() {
        assert_eq!(settings(""), Settings::default());
    }

    #[test]
    fn modes_go_by_name_or_number() {
        for (number, mode) in Mode::ALL.into_iter().enumerate() {
            assert_eq!(settings(&format!("--mode {number}")).mode, mode);
            assert_eq!(settings(&format!("--mode {}", mode.name())).mode, mode);
        }
    }

    #[test]
    fn a_map_of_its_own_capacity_overrides_photons() {
        let s = settings("--photons 200k --caustic-photons 1.5M");
        assert_eq!((s.global_photons, s.caustic_photons), (200_000, 1_500_000));
        let s = settings("--global-photons 7");
        assert_eq!((s.global_photons, s.caustic_photons), (7, 100_000));
    }

    #[test]
    fn every_option_reaches_the_settings() {
        let s = settings(
            "--max-paths 3M -k 50 --cone-constant 1.5 --max-radius 0.25 --max-bounces 0 --spp 9 --size 640x480 \
             --camera side --seed 11 --light-sampling uniform --light-unit photometric",
        );
        let expected = Settings {
            max_paths: Some(3_000_000),
            neighbors: 50,
            cone_constant: 1.5,
            max_radius: Some(0.25),
            max_bounces: 0,
            spp: 9,
            size: Some((640, 480)),
            camera: Some("side".into()),
            seed: 11,
            light_sampling: LightSampling::Uniform,
            light_unit: LightUnit::Photometric,
            ..Settings::default()
        };
        assert_eq!(s, expected);
    }
}
