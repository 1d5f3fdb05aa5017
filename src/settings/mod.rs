//! What a caller may choose, by stage. Every value has a unit, a range and a default.

mod estimate;
mod lights;
mod photons;
mod picture;
mod range;

use serde::{Deserialize, Serialize};

pub use estimate::{EstimateSettings, Search};
pub use lights::{LightSampling, LightSettings, LightUnit};
pub use photons::{Emission, MAX_BOUNCES, Mode, PhotonSettings, Sampler};
pub use picture::{Crop, PictureSettings};
pub use range::{Number, Range};

use crate::error::{Error, Result};

/// Settings of one render: a part for each stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// How lights are read and sampled.
    pub lights: LightSettings,
    /// The first pass.
    pub photons: PhotonSettings,
    /// The radiance estimate.
    pub estimate: EstimateSettings,
    /// Camera, pixels and samples.
    pub picture: PictureSettings,
}

impl Settings {
    /// The settings after a change.
    ///
    /// ```
    /// use caustica::settings::Settings;
    ///
    /// let settings = Settings::default().with(|s| s.picture.spp = 16);
    /// assert_eq!((settings.picture.spp, settings.estimate.neighbors), (16, 100));
    /// ```
    #[must_use]
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }

    /// Checks every value against its range, and those of different parts against each other.
    ///
    /// # Errors
    /// [`Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        self.lights.check()?;
        self.photons.check()?;
        self.estimate.check()?;
        self.picture.check()?;
        check_samples(&self.photons, &self.picture)
    }
}

/// Checks that numbers for sampling, which are counted in 32 bits over all samples of a pixel with
/// four paths of each, suffice for a picture.
pub(crate) fn check_samples(photons: &PhotonSettings, picture: &PictureSettings) -> Result<()> {
    let each = picture.light_samples.max(photons.final_gather).max(4);
    let most = (1_u64 << 32) / u64::from(each);
    if u64::from(picture.spp) > most {
        let problem = format!("must be at most {most} with these light samples and rays of final gathering");
        return fail("picture.spp", picture.spp.to_string(), &problem);
    }
    Ok(())
}

/// The error of a setting outside its range.
fn fail(name: &'static str, value: String, problem: &str) -> Result<()> {
    Err(Error::Setting { name, value, problem: problem.to_string() })
}
