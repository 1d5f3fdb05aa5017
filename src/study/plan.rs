//! Plan of a study.

use serde::Serialize;

use super::question::Question;
use crate::{
    error::{Error, Result},
    image::{Frame, Tonemap},
    scene::Scene,
    settings::{Mode, Settings},
};

/// Plan of a study: what to render, and how to show it.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Title of the page.
    pub title: String,
    /// Scenes and their references.
    pub subjects: Vec<Subject>,
    /// Combinations, each listed once.
    pub combinations: Vec<Combination>,
    /// Figures, in the order in which they are shown.
    pub figures: Vec<Figure>,
    /// Display of the pictures.
    pub look: Look,
}

/// A scene and the reference for its pictures.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Scene to render.
    pub scene: Scene,
    /// Reference for the errors of its pictures.
    pub reference: Reference,
}

/// Reference for the error of a picture.
#[derive(Clone, Debug)]
pub enum Reference {
    /// No reference: errors are not measured.
    None,
    /// A given picture, for all modes.
    Picture {
        /// Name of the picture in the results.
        name: String,
        /// Reference picture, of the size of the renders.
        frame: Box<Frame>,
    },
    /// Finer renders made by the study, one for all modes that show the same light.
    Finer(Finer),
}

/// Settings of a rendered reference: the mean of several passes with more photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Finer {
    /// Capacity of each map, photons.
    pub photons: u32,
    /// Photons per radiance estimate, k.
    pub neighbors: u32,
    /// Samples per pixel in each pass.
    pub spp: u32,
    /// Number of passes, each with its own seed.
    pub passes: u32,
}

/// Maximum number of photons in a pass of a reference, unless the study itself uses more.
const MAX_PHOTONS: u32 = 1_000_000;

impl Finer {
    /// Default for a study: several passes with ten times the photons of its finest map, up to a
    /// limit, and `samples` samples a pixel.
    #[must_use]
    pub fn than(most_photons: u32, spp: u32) -> Self {
        let photons = most_photons.saturating_mul(10).min(MAX_PHOTONS.max(most_photons));
        Self { photons, neighbors: 50, spp, passes: 4 }
    }
}

/// A scene with settings: one row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// Index into [`Plan::subjects`].
    pub subject: usize,
    /// Settings of the renders. Repeat r, from 0, has the seed `settings.photons.seed` + r.
    pub settings: Settings,
    /// Number of renders with different seeds, ≥ 1.
    pub repeats: u32,
    /// Whether the renders are compared with the subject's reference.
    pub measured: bool,
}

/// Combinations in rows and columns, shown together on the contact sheet and the page.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Heading of the figure.
    pub title: String,
    /// Headings of the columns.
    pub columns: Vec<String>,
    /// Rows: a label, and for each column an index into [`Plan::combinations`].
    pub rows: Vec<(String, Vec<Option<usize>>)>,
    /// Questions that the figure's rows answer.
    pub questions: Vec<Question>,
    /// Whether the figure is a plane with n in rows and k in columns, which is plotted.
    pub plane: bool,
}

impl Figure {
    /// All combinations, row by row.
    pub fn combinations(&self) -> impl Iterator<Item = usize> + '_ {
        self.rows.iter().flat_map(|(_, cells)| cells.iter().copied().flatten())
    }
}

/// Display of the pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Look {
    /// Exposure of the displayed pictures, stops.
    pub exposure: f32,
    /// Tone curve of the displayed pictures.
    pub tonemap: Tonemap,
}

impl Plan {
    /// Adds a combination, or finds an equal one and keeps the larger number of repeats. Where no
    /// photons are traced, n and k have no effect and are set to the defaults. Sharing of estimates
    /// is switched off: a study measures one estimate per visible point.
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

    /// Checks everything that can be checked before rendering.
    ///
    /// # Errors
    /// Fails for settings out of range, scenes that cannot be rendered, and a reference whose size
    /// differs from the pictures'.
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

/// Mode of the reference for a mode: direct light by photons and by rays has the same expected
/// value.
pub(super) fn reference_mode(mode: Mode, has_specular: bool) -> Mode {
    match mode {
        Mode::Photons => Mode::Hybrid,
        Mode::DirectPhotons if !has_specular => Mode::DirectRays,
        other => other,
    }
}
