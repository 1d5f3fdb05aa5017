//! Settings of the first pass: which light is traced, how many photons, and the random numbers of
//! the whole render.

use serde::{Deserialize, Serialize};

use super::range::{Range, fail};
use crate::error::Result;

/// Longest path, surfaces: so far the key of a staged photon counts along its path.
pub const MAX_BOUNCES: u32 = crate::layout::PLACE_MASK;

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
    /// 3: light straight from the lights or through specular surfaces only, by photons.
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

/// Where photon paths are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Emission {
    /// Towards the scene, for the global map; and apart from that towards mirrors and glass, for
    /// the caustic map.
    #[default]
    Aimed,
    /// Wherever the lights shine, for both maps at once.
    Unaimed,
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

/// What photon maps are traced by. Pictures made of the maps use the same mode, bound, sampler and
/// seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PhotonSettings {
    /// Which light reaches the picture.
    pub mode: Mode,
    /// Photons that the global map can hold, in [`Self::CAPACITY`].
    pub global: u32,
    /// Photons that the caustic map can hold, in [`Self::CAPACITY`].
    pub caustic: u32,
    /// Photon paths emitted at most, in [`Self::MAX_PATHS`], for each map by itself unless emission
    /// is unaimed; `None`: 100 times the larger capacity.
    pub max_paths: Option<u64>,
    /// Where photon paths are sent.
    pub emission: Emission,
    /// Maximum number of diffuse surfaces on a photon path, in [`Self::MAX_BOUNCES`]; 0: roulette
    /// alone ends paths. Chains of mirrors and glass go on beyond it.
    pub max_bounces: u32,
    /// Numbers for sampling.
    pub sampler: Sampler,
    /// Decides all randomness.
    pub seed: u32,
    /// Rays of final gathering per visible point, in [`Self::FINAL_GATHER`]: light that comes over
    /// another surface is what they see of the global map there, not what that map holds at the
    /// point itself; 0: without. In the modes hybrid and indirect-photons.
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
            max_bounces: 20,
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

    /// The global map stores photons that come straight from a light (LD): as the mode says, and
    /// for rays of final gathering.
    #[must_use]
    pub fn stores_direct(&self) -> bool {
        self.mode.stores_direct() || self.final_gather > 0
    }

    /// Surfaces that a path meets at most, 1 to [`MAX_BOUNCES`].
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
        if self.final_gather > 0 && !matches!(self.mode, Mode::Hybrid | Mode::IndirectPhotons) {
            let problem = format!("goes with the modes hybrid and indirect-photons, not {}", self.mode.name());
            return fail("photons.final_gather", self.final_gather.to_string(), &problem);
        }
        Self::CAPACITY.check("photons.global", self.global)?;
        Self::CAPACITY.check("photons.caustic", self.caustic)?;
        Self::MAX_BOUNCES.check("photons.max_bounces", self.max_bounces)?;
        self.max_paths.map_or(Ok(()), |paths| Self::MAX_PATHS.check("photons.max_paths", paths))
    }
}
