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
    pub fn is_delta(&self) -> bool {
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

/// Medium inside a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Index of refraction.
    pub ior: f32,
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
}

/// Media of a scene. Each material that bounds a solid has its own medium, which identifies the
/// solid that a path leaves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MediaTable {
    /// The media, by index.
    pub media: Vec<Medium>,
    /// Index of the medium of each material, if it bounds a solid.
    of_materials: Vec<Option<u32>>,
}

impl MediaTable {
    /// Lists the media that `materials` bound, in the order of the materials.
    #[must_use]
    pub fn new(materials: &[Material]) -> Self {
        let mut table = Self::default();
        for material in materials {
            let medium = material.surface.medium();
            table.of_materials.push(medium.map(|_| table.media.len() as u32));
            table.media.extend(medium);
        }
        table
    }

    /// Index of the medium that a material bounds.
    #[must_use]
    pub fn of(&self, material: u32) -> Option<u32> {
        self.of_materials[material as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_solids_have_media_and_each_its_own() {
        let surfaces = [
            Surface::Pane { ior: 1.3, tint: Vec3::ONE },
            Surface::Glass { ior: 1.5, tint: Vec3::ONE },
            Surface::Diffuse { albedo: Vec3::ONE },
            Surface::Glass { ior: 1.5, tint: Vec3::ZERO },
        ];
        let materials = surfaces.map(|surface| Material {
            name: String::new(),
            surface,
            emission: Vec3::ZERO,
            double_sided: false,
        });
        let table = MediaTable::new(&materials);
        assert_eq!(table.media, [Medium { ior: 1.5 }; 2]);
        assert_eq!([0, 1, 2, 3].map(|material| table.of(material)), [None, Some(0), None, Some(1)]);
    }
}
