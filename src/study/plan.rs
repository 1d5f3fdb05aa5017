//! What a study is to do.

use serde::Serialize;

use super::question::Question;
use crate::{
    error::{Error, Result},
    image::{Frame, Tonemap},
    scene::Scene,
    settings::{Mode, Settings},
};

/// A study: what to render, and how to show it.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Heads the page.
    pub title: String,
    pub subjects: Vec<Subject>,
    /// Each once.
    pub combinations: Vec<Combination>,
    pub figures: Vec<Figure>,
    pub look: Look,
}

/// A scene, and what its pictures are measured against.
#[derive(Clone, Debug)]
pub struct Subject {
    pub scene: Scene,
    pub reference: Reference,
}

/// The picture that counts as right.
#[derive(Clone, Debug)]
pub enum Reference {
    None,
    /// A picture that was brought along, for all modes.
    Picture {
        name: String,
        frame: Box<Frame>,
    },
    /// Much finer renders of our own, one for all modes that show the same light.
    Finer(Finer),
}

/// How much finer a reference of our own is: the mean of several passes of more photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Finer {
    /// Photons that each map can hold.
    pub photons: u32,
    pub neighbors: u32,
    pub spp: u32,
    /// Passes of different seeds.
    pub passes: u32,
}

/// Photons that a pass of a reference stops at, unless the study itself asks for more.
const MOST_PHOTONS: u32 = 1_000_000;

impl Finer {
    /// Ten times the photons of the study's finest map within reason, in several passes of so many samples a pixel.
    #[must_use]
    pub fn than(most_photons: u32, spp: u32) -> Self {
        let photons = most_photons.saturating_mul(10).min(MOST_PHOTONS.max(most_photons));
        Self { photons, neighbors: 50, spp, passes: 4 }
    }
}

/// A scene under settings, in one row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// Index into [`Plan::subjects`].
    pub subject: usize,
    /// Repeat r, from 0, has the seed `settings.photons.seed` + r.
    pub settings: Settings,
    /// Renders of different seeds, ≥ 1.
    pub repeats: u32,
    /// Whether it is measured against the subject's reference.
    pub measured: bool,
}

/// Combinations in rows and columns: a part of the contact sheet and of the page.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    pub title: String,
    pub columns: Vec<String>,
    /// Label and combinations, as many as there are columns, by index into [`Plan::combinations`].
    pub rows: Vec<(String, Vec<Option<usize>>)>,
    pub questions: Vec<Question>,
    /// Whether it is a plane of n down and k across, which is plotted.
    pub plane: bool,
}

impl Figure {
    /// All combinations, row by row.
    pub fn combinations(&self) -> impl Iterator<Item = usize> + '_ {
        self.rows.iter().flat_map(|(_, cells)| cells.iter().copied().flatten())
    }
}

/// How pictures are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Look {
    /// Stops by which pictures are brightened.
    pub exposure: f32,
    pub tonemap: Tonemap,
}

impl Plan {
    /// Adds a combination, or finds it; the larger number of repeats stays. Where no photons are traced, n and k make no
    /// difference and are the defaults. A study is of estimates: each point has its own.
    pub fn add(&mut self, mut new: Combination) -> usize {
        new.settings.estimate.share_reach = 0.0;
        if !new.settings.photons.mode.traces_photons() {
            let Settings { photons, estimate, .. } = Settings::default();
            new.settings.photons.global = photons.global;
            new.settings.photons.caustic = photons.caustic;
            new.settings.estimate.neighbors = estimate.neighbors;
        }
        let same = |old: &Combination| old.subject == new.subject && old.settings == new.settings;
        if let Some(at) = self.combinations.iter().position(same) {
            let old = &mut self.combinations[at];
            old.repeats = old.repeats.max(new.repeats);
            old.measured |= new.measured;
            return at;
        }
        self.combinations.push(new);
        self.combinations.len() - 1
    }

    /// Checks all that can be checked before the work.
    ///
    /// # Errors
    /// Settings out of their range, scenes that cannot be rendered, a reference of another size than the pictures.
    pub fn check(&self) -> Result<()> {
        for subject in &self.subjects {
            subject.scene.check_renderable()?;
        }
        for combination in &self.combinations {
            let subject = &self.subjects[combination.subject];
            combination.settings.check()?;
            subject.scene.camera(combination.settings.picture.camera.as_deref())?;
            let Reference::Picture { name, frame } = &subject.reference else { continue };
            let size = crate::renderer::picture_size(
                subject.scene.camera(combination.settings.picture.camera.as_deref())?,
                &combination.settings.picture,
            )?;
            if combination.measured && size != (frame.width, frame.height) {
                return Err(Error::Setting {
                    name: "reference",
                    value: name.clone(),
                    problem: format!(
                        "has {}x{} pixels, the pictures have {}x{}; give both the same size",
                        frame.width, frame.height, size.0, size.1
                    ),
                });
            }
        }
        Ok(())
    }
}

/// The mode whose picture is right for a mode: by photons or by rays, direct light is the same light.
pub(super) fn reference_mode(mode: Mode, has_delta: bool) -> Mode {
    match mode {
        Mode::Photons => Mode::Hybrid,
        Mode::DirectPhotons if !has_delta => Mode::DirectRays,
        other => other,
    }
}
