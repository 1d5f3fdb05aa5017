//! How surfaces scatter light.

use std::fmt;

use glam::Vec3;

/// How a surface scatters light; colours are linear Rec.709, each channel 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Lambert reflectance.
    Diffuse { albedo: Vec3 },
    /// Perfect mirror.
    Mirror { tint: Vec3 },
    /// Closed solid of smooth dielectric.
    Glass { ior: f32, tint: Vec3 },
    /// Thin smooth dielectric sheet, crossed in a straight line.
    Pane { ior: f32, tint: Vec3 },
}

impl Surface {
    /// Scatters into single directions only.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        !matches!(self, Surface::Diffuse { .. })
    }
}

impl fmt::Display for Surface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, ior, color) = match *self {
            Surface::Diffuse { albedo } => ("diffuse", None, albedo),
            Surface::Mirror { tint } => ("mirror", None, tint),
            Surface::Glass { ior, tint } => ("solid glass", Some(ior), tint),
            Surface::Pane { ior, tint } => ("thin pane", Some(ior), tint),
        };
        write!(f, "{what} ({} {} {})", color.x, color.y, color.z)?;
        ior.map_or(Ok(()), |ior| write!(f, ", ior {ior}"))
    }
}

/// A named surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    pub name: String,
    pub surface: Surface,
    /// Radiance that it sends out by itself, W/(m² sr) in each channel, alike in all directions of its front side, where a
    /// triangle's corners run counterclockwise, or a sphere's outside.
    pub emission: Vec3,
    /// Its back sends out as much.
    pub double_sided: bool,
}
