//! The renders that combinations and references are made of.

use super::{Combination, Finer, cells::Key};
use crate::settings::{Mode, Settings};

/// One render to make.
pub(super) struct Job {
    pub subject: usize,
    pub settings: Settings,
    pub key: Key,
}

/// Settings of a combination's renders.
pub(super) fn repeats(combination: &Combination) -> impl Iterator<Item = Settings> + '_ {
    let settings = &combination.settings;
    (0..combination.repeats).map(|r| Settings { seed: settings.seed.wrapping_add(r), ..settings.clone() })
}

/// What decides the photon maps: all cells with the same share them.
pub(super) fn photon_part(settings: &Settings) -> Settings {
    let free = Settings::default();
    Settings {
        neighbors: free.neighbors,
        cone_constant: free.cone_constant,
        max_radius: free.max_radius,
        search: free.search,
        radius: free.radius,
        kernel: free.kernel,
        raw_estimate: free.raw_estimate,
        spp: free.spp,
        size: free.size,
        camera: free.camera,
        share_reach: free.share_reach,
        light_samples: free.light_samples,
        pixel_filter: free.pixel_filter,
        aperture: free.aperture,
        focus: free.focus,
        crop: free.crop,
        ..settings.clone()
    }
}

/// Settings of the passes of a reference.
pub(super) fn finer_settings(settings: &Settings, finer: Finer, mode: Mode) -> Vec<Settings> {
    // Far from the seeds that a study counts up from its own.
    const APART: u32 = 0x8000_0000;
    let seed = |pass: u32| settings.seed.wrapping_add(APART).wrapping_add(pass);
    let pass = |pass: u32| Settings {
        mode,
        global_photons: finer.photons,
        caustic_photons: finer.photons,
        neighbors: finer.neighbors,
        spp: finer.spp,
        seed: seed(pass),
        ..settings.clone()
    };
    (0..finer.passes).map(pass).collect()
}
