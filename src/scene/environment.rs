//! Environment light: radiance that arrives from infinitely far away.

use std::{f64::consts::TAU, path::Path};

use glam::{DVec3, Vec3};
use sha2::{Digest as _, Sha256};

use crate::{
    Error, Result,
    image::{decode_radiance, read_radiance_bytes},
    settings::Range,
};

/// Equirectangular map of incident radiance. Row 0 is the top (+Y). Before the rotation, a
/// direction (x, y, z) has the coordinates u = 0.5 + atan2(z, x)/2π, v = acos(y)/π.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Name in statistics: the name of the file, or "background".
    pub name: String,
    /// SHA-256 in hexadecimal: of the bytes of the file, or of the radiance if uniform.
    pub hash: String,
    /// Size in pixels, each ≥ 1.
    pub width: u32,
    /// Rows of pixels.
    pub height: u32,
    /// Radiance, W/(m² sr) in each channel, row by row; finite, ≥ 0.
    pub pixels: Vec<[f32; 3]>,
    /// Scale factor of the radiance, ≥ 0.
    pub strength: f32,
    /// Rotation of the map about +Y, radians, counterclockwise as seen from above.
    pub rotation: f32,
    /// Features of the file that were approximated, one line each.
    pub warnings: Vec<String>,
}

/// Radiance of the ground in [`Environment::sky`].
const GROUND: f32 = 0.3;

impl Environment {
    /// Reads an OpenEXR or Radiance HDR file; the content decides which. OpenEXR: any sample type;
    /// R, G and B, or luminance alone, of the first part and layer that has them. `strength` is a
    /// factor ≥ 0, `rotation` is in degrees.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, is damaged, or has more than 2²⁷ pixels.
    /// [`Error::Setting`] if the strength or rotation is out of range, or if the strength makes the
    /// brightest pixel infinite.
    pub fn load(path: &Path, strength: f32, rotation: f32) -> Result<Self> {
        check_parameters(strength, rotation)?;
        Self::from_bytes(&read_radiance_bytes(path)?, path, strength, rotation)
    }

    /// Decodes the bytes of a file as [`Environment::load`]; messages name it by `path`.
    ///
    /// # Errors
    /// As [`Environment::load`].
    pub fn from_bytes(bytes: &[u8], path: &Path, strength: f32, rotation: f32) -> Result<Self> {
        check_parameters(strength, rotation)?;
        let picture = decode_radiance(path, bytes)?;
        let brightest = picture.pixels.as_flattened().iter().copied().fold(0.0, f32::max);
        if !(brightest * strength).is_finite() {
            let problem = format!("the brightest pixel of {}, {brightest:e}, gets infinitely bright", path.display());
            return Err(wrong("environment strength", strength, &problem));
        }
        let name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let black = (brightest == 0.0).then(|| "is black: it gives no light".to_owned());
        let (width, height) = (picture.width, picture.height);
        let stretched = (picture.pixels.len() > 1 && u64::from(width) != 2 * u64::from(height)).then(|| {
            format!("is {width}x{height}: it is stretched, as pictures of all directions are twice as wide as high")
        });
        let warnings =
            picture.notes.into_iter().chain(black).chain(stretched).map(|note| format!("{name}: {note}")).collect();
        Ok(Self {
            name,
            hash: hash(bytes),
            width: picture.width,
            height: picture.height,
            pixels: picture.pixels,
            strength,
            rotation: rotation.rem_euclid(360.0).to_radians(),
            warnings,
        })
    }

    /// Range of its strength, and of the channels of its radiance.
    pub const STRENGTH: Range<f32> = Range::at_least(0.0);

    /// Uniform radiance from all directions, each channel in [`Self::STRENGTH`].
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

    /// Uniform sky of radiance 1 with a smooth transition to a ground of 0.3 at the horizon. Under
    /// uniform light a white object could not be distinguished from its background.
    #[must_use]
    pub fn sky() -> Self {
        let pixels = vec![[1.0; 3], [1.0; 3], [GROUND; 3], [GROUND; 3]];
        let hash = hash(bytemuck::cast_slice(&pixels));
        Self { name: "default sky".to_owned(), hash, height: 4, pixels, ..Self::uniform(Vec3::ONE) }
    }

    /// Whether it emits no light.
    #[must_use]
    pub fn is_dark(&self) -> bool {
        self.strength == 0.0 || self.pixels.iter().all(|pixel| *pixel == [0.0; 3])
    }

    /// Radiance from a direction (a unit vector), W/(m² sr). Bilinear interpolation between pixel
    /// centres: periodic in u; beyond the centres of the top and bottom rows v is clamped.
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let DVec3 { x, y, z } = direction.as_dvec3();
        // A counterclockwise rotation decreases the azimuth atan2(z, x), since z points to the
        // viewer from above.
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

fn wrong(name: &'static str, value: f32, problem: &str) -> Error {
    Error::Setting { name, value: value.to_string(), problem: problem.to_owned() }
}

fn check_parameters(strength: f32, rotation: f32) -> Result<()> {
    Environment::STRENGTH.check("environment strength", strength)?;
    if !rotation.is_finite() {
        return Err(wrong("environment rotation", rotation, "is not a number of degrees"));
    }
    Ok(())
}

/// SHA-256 in hexadecimal.
fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_1_SQRT_2;

    use super::*;

    /// Map of eight columns and four rows, each pixel of its own colour: red is the column, green
    /// the row.
    fn map() -> Environment {
        let pixels = (0..32).map(|i| [(i % 8) as f32, (i / 8) as f32, 1.0]).collect();
        Environment { width: 8, height: 4, pixels, ..Environment::uniform(Vec3::ZERO) }
    }

    fn assert_near(found: Vec3, expected: Vec3) {
        assert!((found - expected).length() < 1e-5, "{found}, expected {expected}");
    }

    #[test]
    fn directions_map_as_in_three_js() {
        let map = map();
        // u = 0.5 + atan2(z, x)/2π: +X is the middle of the map, +Z three quarters, -Z one quarter,
        // -X both ends. Between two columns both have weight one half; the horizon lies between
        // rows 1 and 2.
        for (direction, column, row) in [
            (Vec3::X, 3.5, 1.5),
            (Vec3::Z, 5.5, 1.5),
            (Vec3::NEG_Z, 1.5, 1.5),
            (Vec3::NEG_X, 3.5, 1.5),
            (Vec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0), 3.5, 0.5),
            (Vec3::new(0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2), 5.5, 2.5),
        ] {
            assert_near(map.radiance(direction), Vec3::new(column, row, 1.0));
        }
        // At the poles the outer rows are not interpolated.
        assert_eq!((map.radiance(Vec3::Y).y, map.radiance(Vec3::NEG_Y).y), (0.0, 3.0));
        // At the centre of a pixel the result is that pixel.
        let (sin, cos) = (std::f32::consts::TAU * (2.5 / 8.0 - 0.5)).sin_cos();
        let v = std::f32::consts::PI * 2.5 / 4.0;
        assert_near(map.radiance(Vec3::new(cos * v.sin(), v.cos(), sin * v.sin())), Vec3::new(2.0, 2.0, 1.0));
    }

    #[test]
    fn interpolation_is_bilinear_without_a_seam() {
        let map = map();
        let at = |u: f32| {
            let (sin, cos) = (std::f32::consts::TAU * (u - 0.5)).sin_cos();
            map.radiance(Vec3::new(cos, 0.0, sin)).x
        };
        // From the centre of the last column to that of the first: 7, then 0.
        for (u, expected) in [(7.5, 7.0), (7.75, 5.25), (8.0, 3.5), (0.0, 3.5), (0.25, 1.75), (0.5, 0.0), (1.25, 0.75)]
        {
            assert!((at(u / 8.0) - expected).abs() < 1e-4, "{u}: {}", at(u / 8.0));
        }
    }

    #[test]
    fn rotation_turns_the_map_and_strength_scales_it() {
        let (plain, degrees) = (map(), 40.0_f32);
        let turned = Environment { rotation: degrees.to_radians(), strength: 3.0, ..map() };
        let turn = |by: f32| glam::Quat::from_rotation_y(by.to_radians());
        for d in [Vec3::X, Vec3::new(0.3, 0.2, -0.8).normalize(), Vec3::new(-0.5, -0.7, 0.1).normalize()] {
            assert_near(turned.radiance(turn(degrees) * d) / 3.0, plain.radiance(d));
            assert!((turned.radiance(turn(-degrees) * d) / 3.0 - plain.radiance(d)).length() > 0.1, "control: {d}");
        }
        // Counterclockwise from above: a rotation by 90° takes +X to -Z.
        let quarter = Environment { rotation: 90_f32.to_radians(), ..map() };
        assert_near(quarter.radiance(Vec3::NEG_Z), plain.radiance(Vec3::X));
    }

    #[test]
    fn a_uniform_environment_is_isotropic() {
        let (sky, other) = (Environment::uniform(Vec3::new(1.0, 2.0, 3.0)), Environment::uniform(Vec3::ONE));
        for d in [Vec3::X, Vec3::Y, Vec3::NEG_Y, Vec3::new(-0.6, 0.0, 0.8)] {
            assert_near(sky.radiance(d), Vec3::new(1.0, 2.0, 3.0));
        }
        assert!(!sky.is_dark() && Environment::uniform(Vec3::ZERO).is_dark());
        assert!(Environment { strength: 0.0, ..sky.clone() }.is_dark());
        assert!(sky.hash.len() == 64 && sky.hash != other.hash);
    }

    #[test]
    fn files_are_read_and_faults_are_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("sky.hdr");
        // One pixel of radiance 1, 0.5 and 0; one of 2^126.
        let write = |exponent: u8| {
            let bytes = [&b"#?RGBE\nEXPOSURE=2\n\n-Y 1 +X 1\n"[..], &[128, 64, 0, exponent]].concat();
            std::fs::write(&path, bytes).expect("can be written");
        };
        let load = |strength: f32, rotation: f32| Environment::load(&path, strength, rotation);
        write(129);
        let sky = load(2.0, -90.0).expect("it loads");
        assert_eq!((sky.name.as_str(), sky.strength, sky.rotation), ("sky.hdr", 2.0, 270_f32.to_radians()));
        assert_eq!(sky.warnings, ["sky.hdr: its EXPOSURE of 2 is not undone, as in other renderers"]);
        assert_near(sky.radiance(Vec3::X), Vec3::new(2.0, 1.0, 0.0));
        let digest = "1ac12aad04ffe539158961e10343c4890259a58a56ba06051e566d69e6bc50a3";
        assert_eq!(sky.hash, digest);
        write(255);
        assert_ne!(load(1.0, 0.0).expect("it loads").hash, digest);
        let square = [&b"#?RGBE\n\n-Y 2 +X 2\n"[..], &[128; 16]].concat();
        let square = Environment::from_bytes(&square, &path, 1.0, 0.0).expect("it loads").warnings;
        assert!(matches!(&square[..], [line] if line.starts_with("sky.hdr: is 2x2: it is stretched")), "{square:?}");
        let refused = |strength: f32, rotation: f32| {
            let error = load(strength, rotation).expect_err("it must be refused").to_string();
            error.replace(&path.display().to_string(), "sky.hdr")
        };
        for (strength, rotation, expected) in [
            (-1.0, 0.0, "environment strength -1: must be at least 0"),
            (f32::NAN, 0.0, "environment strength NaN: must be at least 0"),
            (f32::INFINITY, 0.0, "environment strength inf: must be at least 0"),
            (1.0, f32::INFINITY, "environment rotation inf: is not a number of degrees"),
            (
                8.0,
                0.0,
                "environment strength 8: the brightest pixel of sky.hdr, 8.507059e37, gets \
                 infinitely bright",
            ),
        ] {
            assert_eq!(refused(strength, rotation), expected);
        }
    }
}
