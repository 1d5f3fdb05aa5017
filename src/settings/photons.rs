//! Settings of the first pass: which light is traced, how many photons, and the random numbers of
//! the whole render.

use serde::{Deserialize, Serialize};

use super::range::{Range, fail};
use crate::error::Result;

/// Maximum length of a path, surfaces: the key of a staged photon has no bits for more positions
/// along a path.
pub const MAX_BOUNCES: u32 = crate::layout::PHOTON_INDEX_MASK;

/// Light that reaches the picture, and the method that computes it (the report's five modes).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// 0: direct light by shadow rays, all other light by photons.
    #[default]
    Hybrid,
    /// 1: all light by photons.
    Photons,
    /// 2: direct light by shadow rays only.
    DirectRays,
    /// 3: light directly from the lights or over specular surfaces only, by photons.
    DirectPhotons,
    /// 4: the part of mode 0 that photons compute. The only mode whose picture does not show
    /// emitters.
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

    /// Whether direct light comes from shadow rays.
    #[must_use]
    pub fn direct_by_rays(self) -> bool {
        matches!(self, Mode::Hybrid | Mode::DirectRays)
    }

    /// Whether its light over other surfaces can come from final gathering.
    #[must_use]
    pub fn gathers_finally(self) -> bool {
        matches!(self, Mode::Hybrid | Mode::IndirectPhotons)
    }

    /// Whether the picture shows emitters: directly, in mirrors and through glass.
    #[must_use]
    pub fn sees_lights(self) -> bool {
        self != Mode::IndirectPhotons
    }

    /// Whether photons are traced at all.
    #[must_use]
    pub fn traces_photons(self) -> bool {
        self != Mode::DirectRays
    }

    /// Whether the global map stores photons that come directly from a light (LD).
    #[must_use]
    pub fn stores_direct(self) -> bool {
        matches!(self, Mode::Photons | Mode::DirectPhotons)
    }

    /// Whether photons go on after their first diffuse surface.
    #[must_use]
    pub fn follows_diffuse(self) -> bool {
        !matches!(self, Mode::DirectRays | Mode::DirectPhotons)
    }
}

/// Aim of photon paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Emission {
    /// Paths for the global map are aimed at the scene and at what its cameras see. Other paths,
    /// for the caustic map, are aimed at mirrors and glass.
    #[default]
    Aimed,
    /// Paths go wherever the lights shine. They serve both maps at once.
    Unaimed,
}

/// Source of the numbers that sample photons, camera rays and direct light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// Owen-scrambled Sobol sequences: every prefix is spread evenly.
    #[default]
    Sobol,
    /// Independent random numbers.
    Random,
}

/// Settings of the photon maps. Pictures made from the maps use the same mode, limit of bounces,
/// sampler and seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PhotonSettings {
    /// Light that reaches the picture.
    pub mode: Mode,
    /// Photons that the global map can hold, in [`Self::CAPACITY`].
    pub global: u32,
    /// Photons that the caustic map can hold, in [`Self::CAPACITY`].
    pub caustic: u32,
    /// Maximum number of emitted photon paths, in [`Self::MAX_PATHS`], for each map by itself
    /// unless emission is unaimed; `None`: 100 times the larger capacity, and fewer for a map of
    /// indirect light where little light goes from surface to surface.
    pub max_paths: Option<u64>,
    /// Aim of photon paths.
    pub emission: Emission,
    /// Maximum number of diffuse surfaces on a photon path, in [`Self::MAX_BOUNCES`]; 0: roulette
    /// alone ends paths. Chains of mirrors and glass go on beyond it.
    pub max_bounces: u32,
    /// Source of the numbers for sampling.
    pub sampler: Sampler,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Rays of final gathering per visible point, in [`Self::FINAL_GATHER`]; 0: no final gathering.
    /// Light that comes over another surface is then estimated from the maps where the rays end,
    /// not from the global map at the visible point itself. Only in the modes hybrid and
    /// indirect-photons.
    pub final_gather: u32,
}

impl Default for PhotonSettings {
    fn default() -> Self {
        Self {
            mode: Mode::Hybrid,
            global: 100_000,
            caustic: 100_000,
            max_paths: None,
            emission: Emission::Aimed,
            max_bounces: 100,
            sampler: Sampler::Sobol,
            seed: 0,
            final_gather: 0,
        }
    }
}

impl PhotonSettings {
    /// Range of [`Self::global`] and [`Self::caustic`], photons.
    pub const CAPACITY: Range<u32> = Range::at_least(1);
    /// Range of [`Self::max_paths`].
    pub const MAX_PATHS: Range<u64> = Range::at_least(1);
    /// Range of [`Self::max_bounces`], surfaces.
    pub const MAX_BOUNCES: Range<u32> = Range::closed(0, MAX_BOUNCES);
    /// Range of [`Self::final_gather`], rays.
    pub const FINAL_GATHER: Range<u32> = Range::closed(0, 65_536);

    /// Maximum number of surfaces that a path meets, 1 to [`MAX_BOUNCES`].
    #[must_use]
    pub fn bounce_limit(&self) -> u32 {
        if self.max_bounces == 0 { MAX_BOUNCES } else { self.max_bounces }
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        Self::FINAL_GATHER.check("photons.final_gather", self.final_gather)?;
        if self.final_gather > 0 && !self.mode.gathers_finally() {
            let problem = format!("goes with the modes hybrid and indirect-photons, not {}", self.mode.name());
            return fail("photons.final_gather", self.final_gather.to_string(), &problem);
        }
        Self::CAPACITY.check("photons.global", self.global)?;
        Self::CAPACITY.check("photons.caustic", self.caustic)?;
        Self::MAX_BOUNCES.check("photons.max_bounces", self.max_bounces)?;
        self.max_paths.map_or(Ok(()), |paths| Self::MAX_PATHS.check("photons.max_paths", paths))
    }
}
