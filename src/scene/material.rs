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

    /// Albedo of the diffuse lobe, or tint of the specular one that has a colour.
    #[must_use]
    pub fn color(&self) -> Vec3 {
        match *self {
            Surface::Diffuse { albedo } => albedo,
            Surface::Mirror { tint } | Surface::Glass { tint, .. } | Surface::Pane { tint, .. } => tint,
        }
    }

    /// Index of refraction of what lets light through.
    #[must_use]
    pub fn ior(&self) -> Option<f32> {
        match *self {
            Surface::Glass { ior, .. } | Surface::Pane { ior, .. } => Some(ior),
            Surface::Diffuse { .. } | Surface::Mirror { .. } => None,
        }
    }

    /// What fills the solid that it bounds.
    #[must_use]
    pub fn medium(&self) -> Option<Medium> {
        match *self {
            Surface::Glass { ior, .. } => Some(Medium { ior }),
            Surface::Diffuse { .. } | Surface::Mirror { .. } | Surface::Pane { .. } => None,
        }
    }
}

impl fmt::Display for Surface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self {
            Surface::Diffuse { .. } => "diffuse",
            Surface::Mirror { .. } => "mirror",
            Surface::Glass { .. } => "solid glass",
            Surface::Pane { .. } => "thin pane",
        };
        let color = self.color();
        write!(f, "{what} ({} {} {})", color.x, color.y, color.z)?;
        self.ior().map_or(Ok(()), |ior| write!(f, ", ior {ior}"))
    }
}

/// What fills a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Index of refraction.
    pub ior: f32,
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
