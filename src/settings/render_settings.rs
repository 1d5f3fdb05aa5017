//! Settings of one render: all parts, and the checks of one part against another.

use serde::{Deserialize, Serialize};

use super::{
    estimate::EstimateSettings, lights::LightSettings, photons::PhotonSettings, picture::PictureSettings, range::fail,
};
use crate::error::Result;

/// Settings of one render: a part for each stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Reading and sampling of lights.
    pub lights: LightSettings,
    /// The first pass.
    pub photons: PhotonSettings,
    /// The radiance estimate.
    pub estimate: EstimateSettings,
    /// Camera, pixels and samples.
    pub picture: PictureSettings,
    /// The statistics say how many photons the camera sees
    /// ([`SeenStats`](crate::stats::SeenStats)). The picture does not depend on it.
    #[serde(skip)]
    pub counts_seen: bool,
}

impl Settings {
    /// Returns the settings after a change.
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
    /// [`crate::Error::Setting`] with the first that is out of range.
    pub fn check(&self) -> Result<()> {
        self.lights.check()?;
        self.photons.check()?;
        self.estimate.check()?;
        self.picture.check()?;
        check_samples(&self.photons, &self.picture)
    }
}

/// Squares of 256 x 256 pixels: further apart, no eye compares them.
const MOST_SQUARE_BITS: u32 = 8;

/// Checks that 32-bit indices of the numbers for sampling suffice for a picture. They count over
/// all samples of a pixel and, within a sample, over its four paths, light samples or rays of final
/// gathering.
pub(crate) fn check_samples(photons: &PhotonSettings, picture: &PictureSettings) -> Result<()> {
    let (spp, extra) = (picture.spp, picture.extra_samples());
    let setting = if extra > spp { ("picture.max_spp", spp + extra) } else { ("picture.spp", spp) };
    check_sample_count(photons, picture, 1, (setting.0, setting.1.to_string()))
}

/// Variant of [`check_samples`] for that many passes together. `setting` is refused: its name and
/// value.
pub(super) fn check_sample_count(
    photons: &PhotonSettings,
    picture: &PictureSettings,
    passes: u64,
    (setting, value): (&'static str, String),
) -> Result<()> {
    let most = most_samples(photons, picture);
    let samples = passes.saturating_mul(picture.spp.max(picture.extra_samples()).into());
    if samples > most {
        let samples = if setting == "picture.spp" { "" } else { " samples of a pixel" };
        let problem = format!("must be at most {most}{samples} with these light samples and rays of final gathering");
        return fail(setting, value, &problem);
    }
    Ok(())
}

/// Maximum number of samples of a pixel. Those that only some pixels have are as many at most.
pub(super) fn most_samples(photons: &PhotonSettings, picture: &PictureSettings) -> u64 {
    let all = (1_u64 << 32) / numbers_of_sample(photons, picture);
    if picture.extra_samples() > 0 { first_extra(all) } else { all }
}

/// Indices of numbers that a sample takes, a power of two.
fn numbers_of_sample(photons: &PhotonSettings, picture: &PictureSettings) -> u64 {
    u64::from(picture.light_samples.max(photons.final_gather).max(4)).next_power_of_two()
}

/// Index of the first sample that only some pixels have: a power of two, so that these samples are
/// well distributed among themselves.
pub(crate) fn first_extra_sample(photons: &PhotonSettings, picture: &PictureSettings) -> u32 {
    if picture.extra_samples() > 0 { most_samples(photons, picture) as u32 } else { 0 }
}

/// Binary logarithm of the side of a square of pixels that share a set of numbers, 0 to
/// [`MOST_SQUARE_BITS`]: as wide as 32-bit indices allow.
pub(crate) fn square_bits(photons: &PhotonSettings, picture: &PictureSettings) -> u32 {
    let of_pixel = numbers_of_sample(photons, picture) * u64::from(picture.spp).next_power_of_two();
    let pixels = ((1_u64 << 32) / of_pixel).max(1);
    (pixels.ilog2() / 2).min(MOST_SQUARE_BITS)
}

/// The largest power of two of which there are two.
fn first_extra(all: u64) -> u64 {
    1 << (all.ilog2() - 1)
}

#[cfg(test)]
mod tests {
    use super::Settings;

    #[test]
    fn settings_that_a_file_leaves_out_are_the_defaults() {
        let read = |json: &str| serde_json::from_str::<Settings>(json).expect("it is well formed");
        assert_eq!(read("{}"), Settings::default());
        let changed = read(r#"{"estimate": {"share_reach": 0.0}}"#);
        assert_eq!(changed, Settings::default().with(|s| s.estimate.share_reach = 0.0));
        assert_ne!(changed, Settings::default(), "control");
    }
}
