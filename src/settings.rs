//! What a caller may choose. Every value has a unit, a range and a default.

use serde::{Deserialize, Serialize};

use crate::{
    density::{Density, DensityKernel},
    error::{Error, Result},
    pixel_filter::PixelFilter,
};

/// Largest radius of an estimate, metres: its square is far from the largest float.
const MAX_RADIUS: f32 = 1e18;

/// Which light reaches the picture, and by which way (the report's five modes).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// 0: direct light by shadow rays, all else by photons.
    #[default]
    Hybrid,
    /// 1: all light by photons.
    Photons,
    /// 2: direct light by shadow rays only.
    DirectRays,
    /// 3: light straight from the lights or through delta surfaces only, by photons.
    DirectPhotons,
    /// 4: what mode 0 takes from photons. The only one that does not show what shines.
    IndirectPhotons,
}

impl Mode {
    /// All modes in the report's order: the index is the report's number.
    pub const ALL: [Mode; 5] =
        [Mode::Hybrid, Mode::Photons, Mode::DirectRays, Mode::DirectPhotons, Mode::IndirectPhotons];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["hybrid", "photons", "direct-rays", "direct-photons", "indirect-photons"][self as usize]
    }

    /// Direct light comes from shadow rays.
    #[must_use]
    pub fn direct_by_rays(self) -> bool {
        matches!(self, Mode::Hybrid | Mode::DirectRays)
    }

    /// The picture shows what shines, straight, in mirrors and through glass.
    #[must_use]
    pub fn sees_lights(self) -> bool {
        self != Mode::IndirectPhotons
    }

    /// Photons are traced at all.
    #[must_use]
    pub fn traces_photons(self) -> bool {
        self != Mode::DirectRays
    }

    /// The global map stores photons that come straight from a light (LD).
    #[must_use]
    pub fn stores_direct(self) -> bool {
        matches!(self, Mode::Photons | Mode::DirectPhotons)
    }

    /// Photons go on after their first diffuse surface.
    #[must_use]
    pub fn follows_diffuse(self) -> bool {
        !matches!(self, Mode::DirectRays | Mode::DirectPhotons)
    }
}

/// How photon paths are dealt to lights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightSampling {
    /// In proportion to power: all photons start with like flux.
    #[default]
    Power,
    /// In turn, whatever the power. What shines by one material is one light.
    Uniform,
}

/// Where photon paths are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Emission {
    /// Towards the scene, for the global map; and apart from that towards mirrors and glass, for the caustic map.
    #[default]
    Aimed,
    /// Wherever the lights shine, for both maps at once.
    Unaimed,
}

/// How the file's light intensities are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightUnit {
    /// Candela read as W/sr in each channel.
    #[default]
    Radiometric,
    /// Candela divided by 683 lm/W.
    Photometric,
}

/// Which photons an estimate sums, and how they are found. Grid and kd-tree give the same picture but for rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Search {
    /// The nearest, by the grid on the device.
    #[default]
    Grid,
    /// The nearest, by the kd-tree of [`crate::reference`] on the CPU; makes the raw estimate always.
    KdTree,
    /// All within [`Settings::radius`], by the grid.
    Radius,
}

/// Where the numbers for sampling come from: those of photons, camera samples and direct light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// Owen-scrambled Sobol sequences: spread evenly, every prefix of them.
    #[default]
    Sobol,
    /// Independent numbers.
    Random,
}

/// Part of a picture, in pixels of the whole from its upper left corner; at least one pixel each way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crop {
    pub column: u32,
    pub row: u32,
    pub width: u32,
    pub height: u32,
}

/// Settings of one render.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    pub mode: Mode,
    /// Photons that the global map can hold, ≥ 1.
    pub global_photons: u32,
    /// Photons that the caustic map can hold, ≥ 1.
    pub caustic_photons: u32,
    /// Photon paths emitted at most, for each map by itself unless emission is unaimed; `None`: 100 times the larger capacity.
    pub max_paths: Option<u64>,
    /// Neighbours in the radiance estimate, 1 to 1000.
    pub neighbors: u32,
    /// Constant C of the cone filter, ≥ 1.
    pub cone_constant: f32,
    /// Distance within which visible points on one surface share an estimate, as a fraction of its radius, 0 to 2; 0: every camera
    /// sample has its own.
    #[serde(default)]
    pub share_reach: f32,
    /// Bound of the search radius, metres.
    pub max_radius: Option<f32>,
    /// Longest photon path and longest delta chain of a camera path; 0: roulette alone ends paths.
    pub max_bounces: u32,
    /// Camera samples per pixel, ≥ 1.
    pub spp: u32,
    /// Picture in pixels; `None`: 512 high, as wide as the camera's aspect says.
    pub size: Option<(u32, u32)>,
    /// Name or index of the camera in the file; `None`: the first.
    pub camera: Option<String>,
    pub seed: u32,
    pub light_sampling: LightSampling,
    pub light_unit: LightUnit,
    #[serde(default)]
    pub search: Search,
    /// Lights by name, and the factor on their share of the photons, each > 0.
    #[serde(default)]
    pub light_photons: Vec<(String, f64)>,
    #[serde(default)]
    pub emission: Emission,
    /// Samples of the direct light of emissive surfaces and the environment per visible point, 1 to 4096.
    #[serde(default = "default_light_samples")]
    pub light_samples: u32,
    /// Radius of the estimate with [`Search::Radius`], metres; `None` with the others.
    #[serde(default)]
    pub radius: Option<f32>,
    /// Shape of the kernel that weighs the photons.
    #[serde(default)]
    pub kernel: DensityKernel,
    /// Photons of neighbouring surfaces count, and the disc is taken to be there as a whole: the estimate of the report.
    #[serde(default)]
    pub raw_estimate: bool,
    /// Rays of final gathering per visible point, 0 to 65,536: light that comes over another surface is what they see of the
    /// global map there, not what that map holds at the point itself; 0: without. In the modes hybrid and indirect-photons.
    #[serde(default)]
    pub final_gather: u32,
    #[serde(default)]
    pub sampler: Sampler,
    #[serde(default)]
    pub pixel_filter: PixelFilter,
    /// Diameter of the lens, metres, ≥ 0; 0: a pinhole, all is sharp.
    #[serde(default)]
    pub aperture: f32,
    /// Distance of the sharp plane along the camera's axis, metres, > 0; with an aperture only.
    #[serde(default)]
    pub focus: Option<f32>,
    /// The part of the picture that is rendered; `None`: all.
    #[serde(default)]
    pub crop: Option<Crop>,
}

fn default_light_samples() -> u32 {
    Settings::default().light_samples
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            mode: Mode::Hybrid,
            global_photons: 100_000,
            caustic_photons: 100_000,
            max_paths: None,
            neighbors: 100,
            cone_constant: 2.0,
            share_reach: 2.0,
            max_radius: None,
            max_bounces: 20,
            spp: 4,
            size: None,
            camera: None,
            seed: 0,
            light_sampling: LightSampling::Power,
            light_unit: LightUnit::Radiometric,
            search: Search::Grid,
            light_photons: Vec::new(),
            emission: Emission::Aimed,
            light_samples: 4,
            radius: None,
            kernel: DensityKernel::Cone,
            raw_estimate: false,
            final_gather: 0,
            sampler: Sampler::Sobol,
            pixel_filter: PixelFilter::Box,
            aperture: 0.0,
            focus: None,
            crop: None,
        }
    }
}

impl Crop {
    /// Whether a rectangle of the whole picture has pixels of this part.
    #[must_use]
    pub fn touches(&self, (column, row): (u32, u32), (width, height): (u32, u32)) -> bool {
        let overlap = |a: u32, a_size: u32, b: u32, b_size: u32| a < b + b_size && b < a + a_size;
        overlap(self.column, self.width, column, width) && overlap(self.row, self.height, row, height)
    }
}

impl Settings {
    /// The part of a picture of that size that is rendered.
    #[must_use]
    pub fn window(&self, (width, height): (u32, u32)) -> Crop {
        self.crop.unwrap_or(Crop { column: 0, row: 0, width, height })
    }

    /// The table of the pixel filter; a single sample by the box filter is the pixel's centre.
    #[must_use]
    pub fn pixel_filter_offsets(&self) -> Vec<f32> {
        if self.spp == 1 && self.pixel_filter == PixelFilter::Box { vec![0.0; 2] } else { self.pixel_filter.offsets() }
    }

    /// The global map stores photons that come straight from a light (LD): as the mode says, and for rays of final gathering.
    #[must_use]
    pub fn stores_direct(&self) -> bool {
        self.mode.stores_direct() || self.final_gather > 0
    }

    /// The kernel with its constant.
    #[must_use]
    pub fn density(&self) -> Density {
        Density { kernel: self.kernel, cone_constant: self.cone_constant }
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        let fail =
            |name, value: String, problem: &str| Err(Error::Setting { name, value, problem: problem.to_string() });
        if !(1..=1000).contains(&self.neighbors) {
            return fail("neighbors", self.neighbors.to_string(), "must be from 1 to 1000");
        }
        if !(self.cone_constant >= 1.0 && self.cone_constant.is_finite()) {
            return fail("cone-constant", self.cone_constant.to_string(), "must be at least 1");
        }
        if let Some(r) = self.max_radius.filter(|r| !(*r > 0.0 && *r <= MAX_RADIUS)) {
            return fail("max-radius", r.to_string(), "must be above 0, at most 1e18");
        }
        if !(0.0..=2.0).contains(&self.share_reach) {
            return fail("share", self.share_reach.to_string(), "must be from 0 to 2");
        }
        match (self.search, self.radius) {
            (Search::Radius, None) => return fail("search", "radius".to_string(), "needs a radius"),
            (Search::Radius, Some(r)) if !(r > 0.0 && r <= MAX_RADIUS) => {
                return fail("radius", r.to_string(), "must be above 0, at most 1e18");
            }
            (Search::Radius, Some(_)) | (_, None) => {}
            (_, Some(r)) => return fail("radius", r.to_string(), "goes with the search by radius only"),
        }
        if self.final_gather > 65_536 {
            return fail("final-gather", self.final_gather.to_string(), "must be at most 65536");
        }
        if self.final_gather > 0 && !matches!(self.mode, Mode::Hybrid | Mode::IndirectPhotons) {
            let problem = format!("goes with the modes hybrid and indirect-photons, not {}", self.mode.name());
            return fail("final-gather", self.final_gather.to_string(), &problem);
        }
        if self.global_photons == 0 || self.caustic_photons == 0 {
            return fail("photons", "0".to_string(), "must be at least 1");
        }
        if self.spp == 0 {
            return fail("spp", "0".to_string(), "must be at least 1");
        }
        // Numbers for sampling are counted in 32 bits over all samples of a pixel, with four paths of each.
        let most = (1_u64 << 32) / u64::from(self.light_samples.max(self.final_gather).max(4));
        if u64::from(self.spp) > most {
            let problem = format!("must be at most {most} with these light samples and rays of final gathering");
            return fail("spp", self.spp.to_string(), &problem);
        }
        if !(1..=4096).contains(&self.light_samples) {
            return fail("light-samples", self.light_samples.to_string(), "must be from 1 to 4096");
        }
        if let Some((light, weight)) = self.light_photons.iter().find(|(_, w)| !(*w > 0.0 && w.is_finite())) {
            return fail("light-photons", format!("{light}={weight}"), "the weight must be above 0");
        }
        if !(self.aperture >= 0.0 && self.aperture.is_finite()) {
            return fail("aperture", self.aperture.to_string(), "must be at least 0");
        }
        match self.focus {
            None if self.aperture > 0.0 => return fail("aperture", self.aperture.to_string(), "needs a focus"),
            Some(f) if !(f > 0.0 && f.is_finite()) => return fail("focus", f.to_string(), "must be above 0"),
            _ => {}
        }
        if self.max_paths == Some(0) {
            return fail("max-paths", "0".to_string(), "must be at least 1");
        }
        Ok(())
    }
}
