//! The camera in the form of the kernels.

use crate::{
    error::{Error, Result},
    layout::CameraTile,
    scene::{Camera, Projection},
    settings::{PhotonSettings, PictureSettings},
};

/// Depth of the near plane if there is none, metres.
pub(super) const UNCLIPPED: f32 = f32::MIN;

/// The camera for a picture of that size. The vertical angle of view is kept; the horizontal one
/// follows from the aspect ratio.
pub(super) fn view(
    camera: &Camera,
    (width, height): (u32, u32),
    photons: &PhotonSettings,
    picture: &PictureSettings,
) -> Result<CameraTile> {
    let parallel = matches!(camera.projection, Projection::Orthographic { .. });
    if parallel && picture.aperture > 0.0 {
        let problem = "needs a perspective camera; this one is orthographic".to_owned();
        return Err(Error::Setting { name: "picture.aperture", value: picture.aperture.to_string(), problem });
    }
    let half_height = camera.half_height_at(1.0, (width, height));
    let half_width = half_height * width as f32 / height as f32;
    Ok(CameraTile {
        position: camera.position.to_array(),
        seed: photons.seed,
        right: (camera.right * half_width).to_array(),
        width,
        up: (camera.up * half_height).to_array(),
        height,
        forward: camera.forward.to_array(),
        spp: picture.spp,
        parallel: u32::from(parallel),
        lens_radius: 0.5 * picture.aperture,
        focus: picture.focus.unwrap_or(1.0),
        near_depth: if camera.near == 0.0 { UNCLIPPED } else { camera.near },
        far_depth: camera.far.min(f32::MAX),
        ..Default::default()
    })
}
