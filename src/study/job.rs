//! Render jobs of combinations and references.

use super::{Combination, Finer, cells::Key};
use crate::settings::{LightSettings, Mode, PhotonSettings, Settings};

/// One render to make.
pub(super) struct Job {
    pub subject: usize,
    pub settings: Settings,
    pub key: Key,
}

/// Settings of a combination's renders.
pub(super) fn repeats(combination: &Combination) -> impl Iterator<Item = Settings> + '_ {
    let settings = &combination.settings;
    (0..combination.repeats).map(|r| settings.clone().with(|s| s.photons.seed = settings.photons.seed.wrapping_add(r)))
}

/// Key of the photon maps: cells with equal keys use the same maps.
pub(super) fn photon_part(settings: &Settings) -> (&LightSettings, &PhotonSettings) {
    (&settings.lights, &settings.photons)
}

/// Settings of the passes of a reference.
pub(super) fn finer_settings(settings: &Settings, finer: Finer, mode: Mode) -> Vec<Settings> {
    // Offset that keeps the references' seeds apart from the seeds of the repeats, which count up
    // from the settings' seed.
    const APART: u32 = 0x8000_0000;
    let seed = |pass: u32| settings.photons.seed.wrapping_add(APART).wrapping_add(pass);
    let pass = |pass: u32| {
        settings.clone().with(|s| {
            s.photons.mode = mode;
            s.photons.global = finer.photons;
            s.photons.caustic = finer.photons;
            s.photons.final_gather = 0;
            s.estimate.neighbors = finer.neighbors;
            s.picture.spp = finer.spp;
            s.photons.seed = seed(pass);
        })
    };
    (0..finer.passes).map(pass).collect()
}
