//! Primaries of foreign pictures, and their conversion to linear Rec.709.

use glam::{DMat3, DVec2, DVec3, dvec2};

/// Largest difference of coordinates that still counts as equal.
const TOLERANCE: f64 = 1e-3;
/// Least determinant of the primaries. Those of a smaller one lie on a line.
const MIN_DETERMINANT: f64 = 1e-6;

/// ITU-R BT.709.
const REC709: Primaries = Primaries([dvec2(0.64, 0.33), dvec2(0.30, 0.60), dvec2(0.15, 0.06), dvec2(0.3127, 0.3290)]);

/// Spaces that notes call by their names: ITU-R BT.2020; SMPTE ST 2065-1 and S-2014-004 of the
/// Academy; SMPTE RP 431-2 with the white D65.
const NAMED: [(&str, Primaries); 4] = [
    ("Rec.2020", Primaries([dvec2(0.708, 0.292), dvec2(0.170, 0.797), dvec2(0.131, 0.046), dvec2(0.3127, 0.3290)])),
    ("ACES AP0", Primaries([dvec2(0.7347, 0.2653), dvec2(0.0, 1.0), dvec2(0.0001, -0.0770), dvec2(0.32168, 0.33767)])),
    ("ACES AP1", Primaries([dvec2(0.713, 0.293), dvec2(0.165, 0.830), dvec2(0.128, 0.044), dvec2(0.32168, 0.33767)])),
    ("P3", Primaries([dvec2(0.680, 0.320), dvec2(0.265, 0.690), dvec2(0.150, 0.060), dvec2(0.3127, 0.3290)])),
];

/// XYZ to the responses of cones, in columns: the matrix of Bradford (Lam 1985, "Metamerism and
/// Colour Constancy"; ICC.1:2022, annex E).
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

/// Chromaticities of an RGB space, CIE xy: red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries(pub(super) [DVec2; 4]);

impl Primaries {
    /// Converts the colours of a picture to linear Rec.709, and describes that; `None` where they
    /// are of Rec.709, and stay as they are. Pixels that are not finite stay too, as they have no
    /// hue.
    pub(super) fn convert(self, pixels: &mut [[f32; 3]]) -> Option<String> {
        if self.is_like(REC709) {
            return None;
        }
        let numbers = || self.0.map(|at| format!("{} {}", at.x as f32, at.y as f32)).join(", ");
        let Some(matrix) = self.to_rec709() else {
            return Some(format!("primaries {} are no colour space: Rec.709 is assumed", numbers()));
        };
        for pixel in pixels.iter_mut().filter(|pixel| pixel.iter().all(|x| x.is_finite())) {
            *pixel = (matrix * DVec3::from_array(pixel.map(f64::from))).as_vec3().to_array();
        }
        let named = NAMED.iter().find(|(_, primaries)| self.is_like(*primaries));
        let name = named.map_or_else(numbers, |(name, _)| format!("of {name}"));
        Some(format!("primaries {name} are converted to linear Rec.709"))
    }

    fn is_like(self, other: Self) -> bool {
        self.0.iter().zip(other.0).all(|(a, b)| a.abs_diff_eq(b, TOLERANCE))
    }

    /// Matrix to linear Rec.709, by which white stays white; `None` if these are no colour space.
    fn to_rec709(self) -> Option<DMat3> {
        let [from, to] = [self, REC709].map(|space| BRADFORD * xyz(space.0[3]));
        let adaptation = BRADFORD.inverse() * DMat3::from_diagonal(to / from) * BRADFORD;
        let matrix = REC709.to_xyz()?.inverse() * adaptation * self.to_xyz()?;
        matrix.is_finite().then_some(matrix)
    }

    /// Matrix to XYZ, in which white has a Y of 1 (SMPTE RP 177).
    fn to_xyz(self) -> Option<DMat3> {
        let [red, green, blue, white] = self.0;
        let columns = DMat3::from_cols_array_2d(&[red, green, blue].map(|at| [at.x, at.y, 1.0 - at.x - at.y]));
        let is_space = columns.determinant().abs() >= MIN_DETERMINANT && white.y > 0.0;
        is_space.then(|| columns * DMat3::from_diagonal(columns.inverse() * xyz(white)))
    }
}

/// XYZ of a chromaticity with a Y of 1.
fn xyz(at: DVec2) -> DVec3 {
    DVec3::new(at.x, at.y, 1.0 - at.x - at.y) / at.y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Colours of the rows of a published matrix: what red, green and blue become.
    fn assert_converts(name: &str, rows: [[f32; 3]; 3]) {
        let (_, primaries) = NAMED.iter().find(|(known, _)| *known == name).expect("it is known");
        let mut pixels = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3], [f32::INFINITY, 1.0, 0.0]];
        let said = primaries.convert(&mut pixels);
        assert_eq!(said, Some(format!("primaries of {name} are converted to linear Rec.709")));
        for (column, row) in (0..9).map(|i| (i % 3, i / 3)) {
            let (found, expected) = (pixels[column][row], rows[row][column]);
            assert!((found - expected).abs() < 2e-4, "{name}, row {row}, column {column}: {found}, not {expected}");
        }
        assert!(pixels[3].iter().all(|x| (x - 1.0).abs() < 1e-6), "white stays white: {:?}", pixels[3]);
        assert_eq!(pixels[4], [f32::INFINITY, 1.0, 0.0]);
    }

    #[test]
    fn conversions_are_the_published_ones() {
        // ITU-R BT.2087-0; ACES with Bradford's adaptation, as in OpenColorIO's configurations.
        assert_converts(
            "Rec.2020",
            [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]],
        );
        assert_converts(
            "ACES AP0",
            [[2.5217, -1.1341, -0.3876], [-0.2765, 1.3727, -0.0962], [-0.0154, -0.1530, 1.1684]],
        );
        assert_converts(
            "ACES AP1",
            [[1.7051, -0.6218, -0.0833], [-0.1303, 1.1408, -0.0105], [-0.0240, -0.1290, 1.1530]],
        );
    }

    #[test]
    fn what_is_no_other_space_changes_nothing() {
        let before = [[0.1, 0.7, 30.0], [-1.0, f32::NAN, 0.0]];
        let convert = |primaries: Primaries| {
            let mut pixels = before;
            let said = primaries.convert(&mut pixels);
            (said, pixels.map(|pixel| pixel.map(f32::to_bits)) == before.map(|pixel| pixel.map(f32::to_bits)))
        };
        assert_eq!(convert(REC709), (None, true));
        let near = |by: f64| Primaries(REC709.0.map(|at| at + by));
        assert_eq!(convert(near(9e-4)), (None, true));
        assert!(!convert(near(1.1e-3)).1, "control");
        let on_a_line = [0.1, 0.2, 0.3, 0.4].map(DVec2::splat);
        let said = "primaries 0.1 0.1, 0.2 0.2, 0.3 0.3, 0.4 0.4 are no colour space: Rec.709 is assumed";
        assert_eq!(convert(Primaries(on_a_line)), (Some(said.to_owned()), true));
        let [red, green, blue, white] = REC709.0;
        for wrong in [f64::NAN, f64::INFINITY].map(DVec2::splat) {
            for space in [[wrong, green, blue, white], [red, green, blue, wrong], [red, green, blue, DVec2::ZERO]] {
                let (said, is_same) = convert(Primaries(space));
                assert!(is_same && said.is_some_and(|said| said.ends_with("Rec.709 is assumed")), "{space:?}");
            }
        }
    }
}
