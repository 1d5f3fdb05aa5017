//! Materials: how surfaces scatter and emit light.

use std::fmt;

use glam::Vec3;

/// Scattering model of a surface. Colours are linear Rec.709, each channel 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Lambert reflectance.
    Diffuse {
        /// Reflectance of each channel.
        albedo: Vec3,
    },
    /// Perfect mirror.
    Mirror {
        /// Colour of the specular lobe, see [`Surface::color`].
        tint: Vec3,
    },
    /// Closed solid of smooth dielectric.
    Glass {
        /// Index of refraction.
        ior: f32,
        /// Colour of the specular lobe, see [`Surface::color`].
        tint: Vec3,
    },
    /// Thin smooth dielectric sheet, crossed in a straight line.
    Pane {
        /// Index of refraction.
        ior: f32,
        /// Colour of the specular lobe, see [`Surface::color`].
        tint: Vec3,
    },
}

impl Surface {
    /// Whether all scattering is specular.
    #[must_use]
    pub fn is_specular(&self) -> bool {
        !matches!(self, Surface::Diffuse { .. })
    }

    /// Albedo of the diffuse lobe, or tint of the specular lobe where it has one.
    #[must_use]
    pub fn color(&self) -> Vec3 {
        match *self {
            Surface::Diffuse { albedo } => albedo,
            Surface::Mirror { tint } | Surface::Glass { tint, .. } | Surface::Pane { tint, .. } => tint,
        }
    }

    /// Index of refraction of a transmitting surface.
    #[must_use]
    pub fn ior(&self) -> Option<f32> {
        match *self {
            Surface::Glass { ior, .. } | Surface::Pane { ior, .. } => Some(ior),
            Surface::Diffuse { .. } | Surface::Mirror { .. } => None,
        }
    }

    /// Medium inside the solid that the surface bounds.
    #[must_use]
    pub fn medium(&self) -> Option<Medium> {
        match *self {
            Surface::Glass { ior, tint } => Some(Medium { ior, tint }),
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

/// Medium inside a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Index of refraction.
    pub ior: f32,
    /// Factor on light that passes the surface of the solid, each channel 0 to 1.
    pub tint: Vec3,
}

/// A named surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// How the surface scatters light.
    pub surface: Surface,
    /// Emitted radiance, W/(m² sr) per channel, constant over all directions of the front side. The
    /// front side of a triangle is the one from which its corners run counterclockwise; that of a
    /// sphere is its outside.
    pub emission: Vec3,
    /// Whether the back side emits the same radiance.
    pub double_sided: bool,
    /// Of several solids that claim the same space, that of the highest priority fills it; among
    /// equals the smallest. 0 unless the file says otherwise.
    pub priority: i32,
}
