//! A picture with the radii of its estimates, and the mean of several pictures.

use super::{cells::Measured, radii::Counts};
use crate::{
    error::Result,
    image::Frame,
    layout::Gathered,
    map_kind::{ByKind, MapKind},
    progress::Progress,
    renderer::{Observer, PhotonMaps, Session},
    settings::Settings,
};

/// Histogram of the estimates' radii, per map.
#[derive(Default)]
struct Radii(ByKind<Counts>);

impl Observer for Radii {
    fn observe(&mut self, kind: MapKind, gathered: &[Gathered]) {
        self.0[kind].add(gathered);
    }
}

/// Renders one picture of the maps and counts the radii of the estimates at its visible points. No
/// two of them share an estimate.
pub(super) fn picture(
    session: &Session,
    maps: &PhotonMaps,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<(Frame, Measured)> {
    let mut radii = Radii::default();
    let (estimate, picture) = (&settings.estimate, &settings.picture);
    let (film, stats) = session.observed_film(maps, estimate, picture, Some(&mut radii), progress)?;
    Ok((film.finish(), Measured { stats, radii: [radii.0.global.finish(), radii.0.caustic.finish()] }))
}

/// Mean radiance of pictures of equal size; the other layers are those of the first.
pub(super) fn mean_frame(frames: Vec<Frame>) -> Frame {
    let scale = 1.0 / frames.len().max(1) as f32;
    let mut frames = frames.into_iter();
    let mut mean = frames.next().unwrap_or_default();
    for frame in frames {
        mean.radiance_mut().iter_mut().zip(frame.radiance()).for_each(|(a, b)| (0..3).for_each(|c| a[c] += b[c]));
    }
    mean.radiance_mut().iter_mut().flatten().for_each(|x| *x *= scale);
    mean
}
