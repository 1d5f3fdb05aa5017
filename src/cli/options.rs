//! Options that are common to all commands that render.

use caustica::{
    density::DensityKernel,
    image::Tonemap,
    pixel_filter::PixelFilter,
    settings::{
        Crop, Emission, EstimateSettings, ExtraLayers, LightSampling, LightSettings, LightUnit, Mode, PhotonSettings,
        PictureSettings, Quality, Range, Sampler, Search, Settings,
    },
};
use clap::{
    ValueEnum,
    builder::{EnumValueParser, PossibleValue, TypedValueParser},
    error::{ContextKind, ContextValue},
};

use super::environment::EnvironmentOptions;
use super::loading::LoadingOptions;
use super::values::{
    Exposure, aperture, cone_constant, count, crop, exposure, focus, light_weight, photons, radius, size, whole,
};

/// Range of `--seed`: all numbers.
const SEED: Range<u32> = Range::at_least(0);

/// Options of commands that make one picture.
#[derive(Debug, clap::Args)]
pub struct RenderOptions {
    /// Which light reaches the picture and how, by name or number
    #[arg(long, value_parser = ModeParser, default_value = "hybrid", help_heading = "Light")]
    pub mode: ModeArg,

    /// Photons that each map can hold, as 100000, 200k or 1.5M [default: 100k; `render` has them by
    /// --quality and --size]
    #[arg(long, value_name = "N", value_parser = photons, allow_hyphen_values = true, help_heading = "Photons")]
    pub photons: Option<u32>,

    /// Photons that the global map can hold [default: --photons]
    #[arg(long, value_name = "N", value_parser = photons, allow_hyphen_values = true, help_heading = "Photons")]
    pub global_photons: Option<u32>,

    /// Photons that the caustic map can hold [default: --photons]
    #[arg(long, value_name = "N", value_parser = photons, allow_hyphen_values = true, help_heading = "Photons")]
    pub caustic_photons: Option<u32>,

    #[arg(help = format!(
        "Neighbours in the radiance estimate, {} [default: 100, 50 with final gathering by --quality]",
        EstimateSettings::NEIGHBORS
    ))]
    #[arg(short = 'k', long, value_name = "K", help_heading = "Estimate")]
    #[arg(value_parser = whole(EstimateSettings::NEIGHBORS))]
    pub neighbors: Option<u32>,

    #[command(flatten)]
    pub shared: SharedOptions,
}

/// Options of all work on a scene that makes pictures: what is rendered, how, and what is said of
/// it meanwhile.
#[derive(Debug, clap::Args)]
pub struct SharedOptions {
    /// How photon paths are dealt to lights
    #[arg(long, value_name = "HOW", value_enum, default_value = "power", help_heading = "Light")]
    pub light_sampling: LightSamplingArg,

    /// Multiplies the share of a light's photons, by the name of the light, emissive material or
    /// environment; may be given several times
    #[arg(long, value_name = "NAME=WEIGHT", value_parser = light_weight, help_heading = "Light")]
    pub light_photons: Vec<(String, f64)>,

    /// Samples of the direct light of emissive surfaces, the environment and more than 16 punctual
    /// lights per visible point [default: 4]
    #[arg(long, value_name = "N", help_heading = "Light")]
    #[arg(value_parser = whole(PictureSettings::LIGHT_SAMPLES))]
    pub light_samples: Option<u32>,

    /// Where photon paths are sent
    #[arg(long, value_name = "HOW", value_enum, default_value = "aimed", help_heading = "Photons")]
    pub emission: EmissionArg,

    /// How the file's light intensities are read
    #[arg(long, value_name = "UNIT", value_enum, default_value = "radiometric", help_heading = "Light")]
    pub light_unit: LightUnitArg,

    #[command(flatten)]
    pub environment: EnvironmentOptions,

    #[command(flatten)]
    pub loading: LoadingOptions,

    /// Photon paths emitted at most, for each map by itself unless --emission unaimed [default: 100
    /// times the larger capacity, fewer where little light goes from surface to surface]
    #[arg(long, value_name = "N", value_parser = count, allow_hyphen_values = true, help_heading = "Photons")]
    pub max_paths: Option<u64>,

    #[arg(help = format!(
        "Most diffuse surfaces on a photon path, up to {}; 0 leaves the end of paths to Russian roulette, as it always does \
         in mirrors and glass",
        PhotonSettings::MAX_BOUNCES.most()
    ))]
    #[arg(long, value_name = "B", default_value_t = PhotonSettings::default().max_bounces, help_heading = "Photons")]
    #[arg(value_parser = whole(PhotonSettings::MAX_BOUNCES))]
    pub max_bounces: u32,

    /// Kernel that weighs the photons by their distance; each integrates to 1 over its disc
    #[arg(long, value_name = "KERNEL", value_enum, default_value = "cone", help_heading = "Estimate")]
    pub kernel: KernelArg,

    #[arg(help = format!("Constant of the cone kernel, {}", EstimateSettings::CONE_CONSTANT))]
    #[arg(long, value_name = "C", default_value_t = EstimateSettings::default().cone_constant, value_parser = cone_constant, help_heading = "Estimate")]
    pub cone_constant: f32,

    /// Count photons of neighbouring surfaces and take the disc for whole: bright corners, dark
    /// edges, as in the report
    #[arg(long, help_heading = "Estimate")]
    pub raw_estimate: bool,

    /// Bound of the search radius in metres [default: none]
    #[arg(long, value_name = "R", value_parser = radius, help_heading = "Estimate")]
    pub max_radius: Option<f32>,

    /// Camera samples per pixel, spread over the pixel filter; 1 is the pixel's centre [default: 4]
    #[arg(long, value_name = "N", value_parser = whole(PictureSettings::SPP), help_heading = "Picture")]
    pub spp: Option<u32>,

    /// Size in pixels; the vertical angle of view stays [default: 512 high, as wide as the camera
    /// says or square]
    #[arg(long, value_name = "WxH", value_parser = size, allow_hyphen_values = true, help_heading = "Picture")]
    pub size: Option<(u32, u32)>,

    /// Camera of the file, by name or by index from 0 [default: the first]
    #[arg(long, value_name = "NAME|INDEX", help_heading = "Picture")]
    pub camera: Option<String>,

    /// Part of the picture to render: column and row of its upper left pixel, width, height
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop, allow_hyphen_values = true, help_heading = "Picture")]
    pub crop: Option<Crop>,

    /// How the light around a pixel's centre is weighed
    #[arg(long, value_name = "FILTER", value_enum, default_value = "box", help_heading = "Picture")]
    pub pixel_filter: PixelFilterArg,

    /// Diameter of the lens in metres; needs --focus [default: 0, all is sharp]
    #[arg(long, value_name = "D", value_parser = aperture, requires = "focus", help_heading = "Picture")]
    pub aperture: Option<f32>,

    /// Distance of the sharp plane along the camera's axis, in metres
    #[arg(long, value_name = "DIST", value_parser = focus, requires = "aperture", help_heading = "Picture")]
    pub focus: Option<f32>,

    /// Brightens the PNG by this many stops; auto brings what is seen to middle grey (in a
    /// comparison or study, auto is 0)
    #[arg(long, value_name = "auto|EV", default_value = "auto", value_parser = exposure, help_heading = "Picture")]
    pub exposure: Exposure,

    /// Tone curve of the PNG
    #[arg(long, value_name = "CURVE", value_enum, default_value = "neutral", help_heading = "Picture")]
    pub tonemap: TonemapArg,

    /// Numbers for sampling of photons, pixels, lens and lights
    #[arg(long, value_name = "HOW", value_enum, default_value = "sobol", help_heading = "Run")]
    pub sampler: SamplerArg,

    #[arg(help = format!("One number that decides all randomness, {} to {}", SEED.least(), SEED.most()))]
    #[arg(long, value_name = "S", default_value_t = 0, help_heading = "Run")]
    #[arg(value_parser = whole(SEED))]
    pub seed: u32,

    /// Adapter, by a part of its name or by the index that `caustica devices` shows [default: the
    /// best real GPU, else software]
    #[arg(long, value_name = "NAME|INDEX", env = "CAUSTICA_DEVICE", hide_env_values = true, help_heading = "Run")]
    pub device: Option<String>,

    /// Print errors only
    #[arg(short, long, help_heading = "Run", conflicts_with = "verbose")]
    pub quiet: bool,

    /// Print more: seconds by stage, photons and memory
    #[arg(short, long, help_heading = "Run")]
    pub verbose: bool,
}

impl RenderOptions {
    /// Converts the arguments to the library's settings; others are those of `base`.
    pub fn settings(&self, base: Settings) -> Settings {
        let capacity = |own: Option<u32>, default| own.or(self.photons).unwrap_or(default);
        self.shared.settings(base).with(|s| {
            s.photons.mode = self.mode.into();
            s.photons.global = capacity(self.global_photons, s.photons.global);
            s.photons.caustic = capacity(self.caustic_photons, s.photons.caustic);
            s.estimate.neighbors = self.neighbors.unwrap_or(s.estimate.neighbors);
        })
    }
}

impl SharedOptions {
    /// Converts the arguments to the library's settings. Mode, photons and neighbours stay at those
    /// of `base`.
    pub fn settings(&self, base: Settings) -> Settings {
        let Settings { photons, estimate, picture, counts_seen, .. } = base;
        Settings {
            counts_seen,
            lights: LightSettings {
                sampling: self.light_sampling.into(),
                photon_weights: self.light_photons.clone(),
                unit: self.light_unit.into(),
            },
            photons: PhotonSettings {
                max_paths: self.max_paths,
                emission: self.emission.into(),
                max_bounces: self.max_bounces,
                sampler: self.sampler.into(),
                seed: self.seed,
                ..photons
            },
            estimate: EstimateSettings {
                kernel: self.kernel.into(),
                cone_constant: self.cone_constant,
                max_radius: self.max_radius,
                raw: self.raw_estimate,
                ..estimate
            },
            picture: PictureSettings {
                size: self.size,
                crop: self.crop,
                camera: self.camera.clone(),
                spp: self.spp.unwrap_or(picture.spp),
                // That many samples are those of every pixel.
                max_spp: picture.max_spp.filter(|_| self.spp.is_none()),
                pixel_filter: self.pixel_filter.into(),
                aperture: self.aperture.unwrap_or(picture.aperture),
                focus: self.focus,
                light_samples: self.light_samples.unwrap_or(picture.light_samples),
                layers: picture.layers,
            },
        }
    }
}

/// Defines an enumeration of the command line with the values of one of the library, and its
/// conversion.
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

/// Parser of modes by name or number. The message for other texts names both.
#[derive(Clone, Copy, Debug)]
pub struct ModeParser;

impl TypedValueParser for ModeParser {
    type Value = ModeArg;

    fn parse_ref(
        &self,
        command: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<ModeArg, clap::Error> {
        EnumValueParser::new().parse_ref(command, arg, value).map_err(|mut error| {
            let tip = "the numbers 0 to 4 stand for these, in this order";
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
            error
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(ModeArg::value_variants().iter().filter_map(ModeArg::to_possible_value)))
    }
}

value_enum!(LightSamplingArg => LightSampling {
    /// In proportion to power
    Power,
    /// In turn, whatever the power
    Uniform,
});

value_enum!(EmissionArg => Emission {
    /// Towards the scene and what its cameras see for the global map, and apart from that towards
    /// mirrors and glass for the caustic map
    Aimed,
    /// Wherever the lights shine, for both maps at once
    Unaimed,
});

value_enum!(LightUnitArg => LightUnit {
    /// Candela read as W/sr in each channel
    Radiometric,
    /// Candela divided by 683 lm/W
    Photometric,
});

value_enum!(KernelArg => DensityKernel {
    /// 1 - q/C, q the distance over the radius
    Cone,
    /// 1
    Constant,
    /// 1 - q^2
    Epanechnikov,
    /// Jensen's Gaussian, which falls to 0.27 at the rim
    Gaussian,
    /// (1 - q^2)^2
    Silverman,
});

value_enum!(SearchArg => Search {
    /// The k nearest, in the grid on the device
    Grid,
    /// The k nearest, in a kd-tree on the CPU: the same as the grid's but for rounding
    #[value(name = "kdtree")]
    KdTree,
    /// All photons within --radius, in the grid
    Radius,
});

value_enum!(QualityArg => Quality {
    /// To look at while a scene is made
    Draft,
    /// Clean where light is smooth
    Normal,
    /// Clean edges and penumbrae as well
    High,
    /// As good as one pass can be
    Final,
});

value_enum!(LayerArg => ExtraLayers {
    /// emission, direct, global, caustic: what the picture is the sum of
    Components,
    /// light.NAME: what each light gives, with photons of its own; lights of one
    /// extras.caustica.group are one
    Lights,
    /// globalEstimate, causticEstimate: radius in metres, and photons
    Estimates,
    /// position: of the first hit, in the file's coordinates
    Position,
    /// UV: texture coordinates of textured surfaces
    Uv,
    /// motion: 0, since nothing moves
    Motion,
    /// CryptoObject: mattes of nodes
    Objects,
    /// CryptoMaterial: mattes of materials
    Materials,
});

value_enum!(SamplerArg => Sampler {
    /// Owen-scrambled Sobol sequences: spread evenly
    Sobol,
    /// Independent numbers
    Random,
});

value_enum!(PixelFilterArg => PixelFilter {
    /// The pixel's square
    Box,
    /// exp(-x² / 2σ²), σ = 0.5 pixels, cut at 1.5
    Gaussian,
    /// Blackman and Harris' window, 3 pixels wide
    BlackmanHarris,
});

value_enum!(TonemapArg => Tonemap {
    /// Khronos PBR Neutral: keeps base colours, rolls off highlights
    Neutral,
    /// ACES, as fitted by Stephen Hill
    Aces,
    /// Reinhard's curve on luminance
    Reinhard,
    /// AgX: colours go to white with rising light
    Agx,
    /// Clips at 1
    None,
});
