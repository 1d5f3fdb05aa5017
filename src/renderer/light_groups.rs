//! Pictures of groups of lights: the scene is rendered once for each group, with photons of its
//! own, and the picture is the sum.

use super::session::Session;
use crate::{
    error::Result,
    gpu::Gpu,
    image::Film,
    progress::Progress,
    scene::Scene,
    settings::{ExtraLayers, Settings},
    stats::Stats,
};

/// A scene on the device, lit by each group of lights in turn; or by all lights together, if the
/// picture's layers do not ask for groups.
#[derive(Debug)]
pub struct LightGroups<'a> {
    sessions: Vec<Session<'a>>,
    /// Names of the groups; none if the only session has all lights.
    names: Vec<String>,
}

impl<'a> LightGroups<'a> {
    /// Opens the sessions. They share geometry and textures on the device.
    ///
    /// # Errors
    /// As [`Session::open`]; also if there are too many groups.
    pub fn open(gpu: &'a Gpu, scene: &'a Scene, settings: &Settings, progress: &dyn Progress) -> Result<Self> {
        let asked = settings.picture.layers.contains(&ExtraLayers::Lights);
        let names = if asked { scene.light_groups()? } else { Vec::new() };
        Ok(Self { sessions: Session::open_groups(gpu, scene, settings, &names, progress)?, names })
    }

    /// The sessions, one for each group.
    #[must_use]
    pub fn sessions(&self) -> &[Session<'a>] {
        &self.sessions
    }

    /// Renders a film with each session, given with its index, and adds them up.
    ///
    /// # Errors
    /// Those of `render`.
    pub fn film(&self, mut render: impl FnMut(usize, &Session<'a>) -> Result<(Film, Stats)>) -> Result<(Film, Stats)> {
        let mut rendered = self.sessions.iter().enumerate().map(|(i, session)| render(i, session));
        let first = rendered.next().expect("a session")?;
        if self.names.is_empty() {
            return Ok(first);
        }
        let (film, mut stats) = first;
        let mut films = vec![film];
        for next in rendered {
            let (film, of_group) = next?;
            films.push(film);
            let lights = stats.photons.lights.clone();
            stats.add(&of_group);
            stats.photons.lights = [lights, of_group.photons.lights].concat();
        }
        Ok((Film::of_light_groups(self.names.iter().cloned().zip(films).collect()), stats))
    }
}
