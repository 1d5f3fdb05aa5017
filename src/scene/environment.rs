//! Light from all around, infinitely far away.

use glam::Vec3;

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
}

impl Environment {
    /// The same radiance from everywhere.
    #[must_use]
    pub fn uniform(radiance: Vec3) -> Self {
        Self {
            name: "background".to_owned(),
            hash: String::new(),
            width: 1,
            height: 1,
            pixels: vec![radiance.to_array()],
            strength: 1.0,
            rotation: 0.0,
        }
    }
}
