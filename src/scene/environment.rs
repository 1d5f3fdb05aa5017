//! Light from all around, infinitely far away.

use std::{f64::consts::TAU, path::Path};

use glam::{DVec3, Vec3};
use sha2::{Digest as _, Sha256};

use crate::{
    Error, Result,
    image::{decode_radiance, read_radiance_bytes},
};

/// An equirectangular picture of the radiance that arrives from each direction: row 0 is the top (+Y), and a direction
/// (x, y, z) lies at u = 0.5 + atan2(z, x)/2π, v = acos(y)/π, before the rotation.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// What it is called in statistics: the name of its file, or "background".
    pub name: String,
    /// SHA-256 of the file's bytes, in hexadecimal; of a uniform one's numbers.
    pub hash: String,
    /// Pixels, each ≥ 1.
    pub width: u32,
    pub height: u32,
    /// Radiance, W/(m² sr) in each channel, row by row; finite, ≥ 0.
    pub pixels: Vec<[f32; 3]>,
    /// Factor on all of it, ≥ 0.
    pub strength: f32,
    /// Turn about +Y, radians, counterclockwise as seen from above: what lay at direction d lies at d so turned.
    pub rotation: f32,
    /// What of the file was read in a special way, one line each.
    pub warnings: Vec<String>,
}

impl Environment {
    /// Reads an OpenEXR or Radiance HDR file, whichever it is by its content. OpenEXR: any type of sample; R, G and B,
    /// or luminance alone, of the first part and layer that has them. `strength` is a factor ≥ 0, `rotation` in degrees.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, is damaged, or has more than 2²⁷ pixels; [`Error::Setting`] for a
    /// strength or rotation that is no such number, or a strength that takes the brightest pixel beyond all numbers.
    pub fn load(path: &Path, strength: f32, rotation: f32) -> Result<Self> {
        let wrong = |name, value: f32, problem: &str| Error::Setting {
            name,
            value: value.to_string(),
            problem: problem.to_owned(),
        };
        if !(strength.is_finite() && strength >= 0.0) {
            return Err(wrong("environment strength", strength, "is not a number from 0"));
        }
        if !rotation.is_finite() {
            return Err(wrong("environment rotation", rotation, "is not a number of degrees"));
        }
        let bytes = read_radiance_bytes(path)?;
        let picture = decode_radiance(path, &bytes)?;
        let brightest = picture.pixels.as_flattened().iter().copied().fold(0.0, f32::max);
        if !(brightest * strength).is_finite() {
            let problem = format!("the brightest pixel of {}, {brightest}, gets infinitely bright", path.display());
            return Err(wrong("environment strength", strength, &problem));
        }
        let name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let warnings = picture.notes.into_iter().map(|note| format!("{name}: {note}")).collect();
        Ok(Self {
            name,
            hash: hash(&bytes),
            width: picture.width,
            height: picture.height,
            pixels: picture.pixels,
            strength,
            rotation: rotation.rem_euclid(360.0).to_radians(),
            warnings,
        })
    }

    /// The same radiance from everywhere.
    #[must_use]
    pub fn uniform(radiance: Vec3) -> Self {
        Self {
            name: "background".to_owned(),
            hash: hash(bytemuck::bytes_of(&radiance)),
            width: 1,
            height: 1,
            pixels: vec![radiance.to_array()],
            strength: 1.0,
            rotation: 0.0,
            warnings: Vec::new(),
        }
    }

    /// It gives no light at all.
    #[must_use]
    pub fn is_dark(&self) -> bool {
        self.strength == 0.0 || self.pixels.iter().all(|pixel| *pixel == [0.0; 3])
    }

    /// Radiance that arrives from a direction (a unit vector), W/(m² sr): bilinear between the middles of pixels, around
    /// the horizon without a seam, and above the top row's and below the bottom row's middles as there.
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let DVec3 { x, y, z } = direction.as_dvec3();
        // A turn counterclockwise lessens the azimuth atan2(z, x), since z points to the viewer from above.
        let u = 0.5 + (z.atan2(x) + f64::from(self.rotation)) / TAU;
        let v = y.clamp(-1.0, 1.0).acos() / (0.5 * TAU);
        let (width, height) = (i64::from(self.width), i64::from(self.height));
        let (column, row) = (u * width as f64 - 0.5, v * height as f64 - 0.5);
        let (left, top) = (column.floor(), row.floor());
        let pixel = |dx: i64, dy: i64| {
            let (x, y) = ((left as i64 + dx).rem_euclid(width), (top as i64 + dy).clamp(0, height - 1));
            Vec3::from(self.pixels[(y * width + x) as usize])
        };
        let (across, down) = ((column - left) as f32, (row - top) as f32);
        let above = pixel(0, 0).lerp(pixel(1, 0), across);
        let below = pixel(0, 1).lerp(pixel(1, 1), across);
        self.strength * above.lerp(below, down)
    }
}

/// SHA-256 in hexadecimal.
fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
