//! Size of a picture, its crop, and the memory that it takes.

use crate::{
    error::{Error, Result},
    memory::available,
    scene::{Camera, Scene},
    settings::{Crop, PictureSettings},
};

/// Height of a picture whose settings give no size, pixels.
const DEFAULT_HEIGHT: u32 = 512;
/// Maximum number of pixels of a picture.
const MAX_PIXELS: u64 = 1 << 28;
/// Host memory per pixel, bytes: the sums of all layers, their means, and the encoded file before
/// it is written.
const BYTES_PER_PIXEL: u64 = 160;

/// Size of the whole picture of a scene.
///
/// # Errors
/// [`Error::Setting`] if there is no such camera, or the size or the crop are out of range.
pub fn size_of(scene: &Scene, picture: &PictureSettings) -> Result<(u32, u32)> {
    picture_size(scene.camera(picture.camera.as_deref())?, picture)
}

/// Size of the whole picture: that of the settings, or the default height at the camera's aspect
/// ratio. Checks the number of pixels, the crop and the free memory.
pub(crate) fn picture_size(camera: &Camera, picture: &PictureSettings) -> Result<(u32, u32)> {
    let (width, height) = picture.size.unwrap_or_else(|| {
        let width = (DEFAULT_HEIGHT as f32 * camera.aspect.unwrap_or(1.0)).round();
        ((width as u32).max(1), DEFAULT_HEIGHT)
    });
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(Error::Setting {
            name: "picture.size",
            value: format!("{width}x{height}"),
            problem: format!("must have from 1 to {MAX_PIXELS} pixels"),
        });
    }
    if let Some(Crop { column, row, width: w, height: h }) = picture.crop {
        let inside = |first: u32, size: u32, whole: u32| size > 0 && first < whole && size <= whole - first;
        if !inside(column, w, width) || !inside(row, h, height) {
            return Err(Error::Setting {
                name: "picture.crop",
                value: format!("{column},{row},{w},{h}"),
                problem: format!("must have pixels, all of them in the picture of {width}x{height}"),
            });
        }
    }
    let Crop { width: w, height: h, .. } = picture.window((width, height));
    let needed = BYTES_PER_PIXEL * u64::from(w) * u64::from(h);
    if let Some(free) = available().filter(|free| needed > *free) {
        return Err(Error::Setting {
            name: "picture.size",
            value: format!("{width}x{height}"),
            problem: format!(
                "needs about {} MiB of memory, {} MiB are free; ask for a smaller `picture.size`, or for parts of it with `picture.crop`",
                needed >> 20,
                free >> 20
            ),
        });
    }
    Ok((width, height))
}
