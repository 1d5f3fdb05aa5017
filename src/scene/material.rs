//! Materials: how surfaces scatter and emit light.

use std::fmt;

use glam::Vec3;

use super::Texture;

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
    /// Mix of metal and of a diffuse base under a dielectric coat (glTF 2.0, appendix B).
    Layered {
        /// Albedo of the base and reflectance of the metal along the normal.
        base: Vec3,
        /// Fraction of metal, 0 to 1.
        metallic: f32,
        /// Reflectance of the coat along the normal, at least 0; values above 1 count as 1.
        f0: Vec3,
        /// Strength of the coat, 0 to 1: factor on its reflectance at all angles.
        specular: f32,
    },
}

impl Surface {
    /// Whether the surface has no diffuse lobe and its other lobes are as sharp as the roughness of
    /// the material says.
    #[must_use]
    pub fn is_specular(&self) -> bool {
        match *self {
            Surface::Diffuse { .. } => false,
            Surface::Mirror { .. } | Surface::Glass { .. } | Surface::Pane { .. } => true,
            Surface::Layered { metallic, .. } => metallic >= 1.0,
        }
    }

    /// Whether there is a diffuse base under a coat.
    #[must_use]
    pub fn is_coated(&self) -> bool {
        matches!(*self, Surface::Layered { metallic, specular, .. } if metallic < 1.0 && specular > 0.0)
    }

    /// Whether light passes through the surface.
    #[must_use]
    pub fn transmits(&self) -> bool {
        matches!(self, Surface::Glass { .. } | Surface::Pane { .. })
    }

    /// Albedo of the diffuse lobe, or tint of the specular lobe where it has one.
    #[must_use]
    pub fn color(&self) -> Vec3 {
        match *self {
            Surface::Diffuse { albedo } => albedo,
            Surface::Layered { base, .. } => base,
            Surface::Mirror { tint } | Surface::Glass { tint, .. } | Surface::Pane { tint, .. } => tint,
        }
    }

    /// Index of refraction of a transmitting surface.
    #[must_use]
    pub fn ior(&self) -> Option<f32> {
        match *self {
            Surface::Glass { ior, .. } | Surface::Pane { ior, .. } => Some(ior),
            Surface::Diffuse { .. } | Surface::Mirror { .. } | Surface::Layered { .. } => None,
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
            Surface::Layered { metallic, .. } if *metallic >= 1.0 => "metal",
            Surface::Layered { metallic, .. } if *metallic > 0.0 => "part metal",
            Surface::Layered { .. } => "coated diffuse",
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
    /// Absorption coefficient of each channel, 1/m, at least 0.
    pub absorption: Vec3,
    /// 20 over the Abbe number, at least 0.
    pub dispersion: f32,
}

/// Coverage of a surface: how much of it is there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// All of it.
    #[default]
    Opaque,
    /// Is there where the opacity is at least the cutoff.
    Mask {
        /// At least 0.
        cutoff: f32,
    },
    /// A fraction of it: the opacity is its coverage.
    Blend,
}

/// Textures of a material. Each multiplies a factor of the material, channel by channel; colours
/// are stored with the sRGB curve, other values linearly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Textures {
    /// RGB, sRGB: base colour, albedo or tint. A: opacity.
    pub base_color: Option<Texture>,
    /// G: roughness. B: metallic.
    pub metallic_roughness: Option<Texture>,
    /// RGB: normal in the frame of the tangents, 0..1 for -1..1.
    pub normal: Option<Texture>,
    /// RGB, sRGB: emission.
    pub emission: Option<Texture>,
    /// A: strength of the coat.
    pub specular: Option<Texture>,
    /// RGB, sRGB: reflectance of the coat along the normal.
    pub specular_color: Option<Texture>,
    /// R: fraction of transmission.
    pub transmission: Option<Texture>,
    /// R: strength of the clearcoat.
    pub clearcoat: Option<Texture>,
    /// G: roughness of the clearcoat.
    pub clearcoat_roughness: Option<Texture>,
    /// Same as `normal`, for the clearcoat.
    pub clearcoat_normal: Option<Texture>,
    /// RGB, sRGB: colour of the sheen.
    pub sheen_color: Option<Texture>,
    /// A: roughness of the sheen.
    pub sheen_roughness: Option<Texture>,
    /// RG: direction of the anisotropy in the frame of the tangents, 0..1 for -1..1. B: strength.
    pub anisotropy: Option<Texture>,
    /// R: strength of the iridescence.
    pub iridescence: Option<Texture>,
    /// G: thickness of the film, from the smallest to the largest.
    pub iridescence_thickness: Option<Texture>,
    /// A: fraction of diffuse transmission.
    pub diffuse_transmission: Option<Texture>,
    /// RGB, sRGB: colour of diffuse transmission.
    pub diffuse_transmission_color: Option<Texture>,
}

impl Textures {
    /// All of them with the name of their property, in the order of the fields.
    #[must_use]
    pub fn named(&self) -> [(&'static str, Option<Texture>); 17] {
        [
            ("base colour", self.base_color),
            ("metallic and roughness", self.metallic_roughness),
            ("normal", self.normal),
            ("emission", self.emission),
            ("specular", self.specular),
            ("specular colour", self.specular_color),
            ("transmission", self.transmission),
            ("clearcoat", self.clearcoat),
            ("clearcoat roughness", self.clearcoat_roughness),
            ("clearcoat normal", self.clearcoat_normal),
            ("sheen colour", self.sheen_color),
            ("sheen roughness", self.sheen_roughness),
            ("anisotropy", self.anisotropy),
            ("iridescence", self.iridescence),
            ("iridescence thickness", self.iridescence_thickness),
            ("diffuse transmission", self.diffuse_transmission),
            ("diffuse transmission colour", self.diffuse_transmission_color),
        ]
    }
}

/// A named surface. Its factors are multiplied by its [`Textures`].
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Scattering of light at the surface.
    pub surface: Surface,
    /// Roughness of all lobes but the diffuse one, 0 to 1: the width of GGX is its square. Below
    /// [`SHARP_ROUGHNESS`] they are perfectly specular.
    pub roughness: f32,
    /// Glass and panes: fraction of the light within the surface that is transmitted, 0 to 1; the
    /// rest is scattered by a diffuse base of the same colour.
    pub transmission: f32,
    /// Glass and panes: fraction of the surface that is metal and transmits nothing, 0 to 1. A
    /// layered surface has its own.
    pub metallic: f32,
    /// Absorption coefficient inside of a solid, 1/m for each channel, at least 0.
    pub absorption: Vec3,
    /// Strength of a clear coat above everything else, 0 to 1.
    pub clearcoat: f32,
    /// Roughness of the clear coat, 0 to 1.
    pub clearcoat_roughness: f32,
    /// Factor on the x and y of its normal map.
    pub clearcoat_normal_scale: f32,
    /// Colour of the sheen of fibres, each channel 0 to 1 (KHR_materials_sheen).
    pub sheen_color: Vec3,
    /// Roughness of the sheen, 0 to 1.
    pub sheen_roughness: f32,
    /// Strength of the anisotropy, 0 to 1 (KHR_materials_anisotropy).
    pub anisotropy: f32,
    /// Direction in which the lobe is stretched, radians from the tangent towards the bitangent.
    pub anisotropy_rotation: f32,
    /// Strength of the interference in a thin film, 0 to 1 (KHR_materials_iridescence).
    pub iridescence: f32,
    /// Index of refraction of the film, at least 1.
    pub iridescence_ior: f32,
    /// Thickness of the film where its texture is 0 and where it is 1 or missing, nanometres.
    pub iridescence_thickness: [f32; 2],
    /// Dispersion of a transmitting surface: 20 over its Abbe number, at least 0
    /// (KHR_materials_dispersion).
    pub dispersion: f32,
    /// Fraction of the diffuse light that leaves on the other side, 0 to 1
    /// (KHR_materials_diffuse_transmission).
    pub diffuse_transmission: f32,
    /// Colour of that light, each channel 0 to 1.
    pub diffuse_transmission_color: Vec3,
    /// The base colour is shown as it is, whatever light falls on it (KHR_materials_unlit).
    pub unlit: bool,
    /// Emitted radiance, W/(m² sr) per channel, constant over all directions of the front side. The
    /// front side of a triangle is the one from which its corners run counterclockwise; that of a
    /// sphere is its outside.
    pub emission: Vec3,
    /// Whether the back side emits the same radiance.
    pub double_sided: bool,
    /// Coverage: how much of the surface is there.
    pub alpha: Alpha,
    /// Opacity, 0 to 1; see [`Alpha`].
    pub opacity: f32,
    /// Factor on the x and y of the normal map.
    pub normal_scale: f32,
    /// Priority among solids that claim the same space: that of the highest fills it; among
    /// equals the smallest. 0 unless the file says otherwise.
    pub priority: i32,
    /// Group that its emission is counted to in layers of lights; `None`: one of its own, by its
    /// name.
    pub group: Option<String>,
    /// Textures of the factors.
    pub textures: Textures,
}

pub use crate::layout::SHARP_ROUGHNESS;

impl Material {
    /// A material of that name and surface: smooth where it is specular, without emission or
    /// textures.
    #[must_use]
    pub fn new(name: &str, surface: Surface) -> Self {
        Self {
            name: name.to_owned(),
            surface,
            roughness: 0.0,
            transmission: 1.0,
            metallic: 0.0,
            absorption: Vec3::ZERO,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            clearcoat_normal_scale: 1.0,
            sheen_color: Vec3::ZERO,
            sheen_roughness: 0.0,
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            iridescence: 0.0,
            iridescence_ior: 1.3,
            iridescence_thickness: [100.0, 400.0],
            dispersion: 0.0,
            diffuse_transmission: 0.0,
            diffuse_transmission_color: Vec3::ONE,
            unlit: false,
            emission: Vec3::ZERO,
            double_sided: false,
            alpha: Alpha::Opaque,
            opacity: 1.0,
            normal_scale: 1.0,
            priority: 0,
            group: None,
            textures: Textures::default(),
        }
    }

    /// Whether the surface has more than a base: clear coat, sheen, anisotropy, iridescence or
    /// diffuse transmission. Of these glass has the clear coat and iridescence.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        let is_finished = self.clearcoat > 0.0
            || self.sheen_color != Vec3::ZERO
            || self.anisotropy > 0.0
            || self.iridescence > 0.0
            || self.diffuse_transmission > 0.0;
        let is_opaque = !self.surface.transmits() || self.transmission < 1.0;
        !self.unlit && ((is_finished && is_opaque) || self.clearcoat > 0.0 || self.iridescence > 0.0)
    }

    /// Whether the surface is a smooth pane, all of which is there and transmits: light that does
    /// not turn in it goes straight on.
    #[must_use]
    pub fn is_clear_pane(&self) -> bool {
        matches!(self.surface, Surface::Pane { .. }) && self.is_clear()
    }

    /// Whether the surface is of glass or a pane, smooth, and all of it is there and transmits.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        let Textures { transmission, normal, metallic_roughness, emission, .. } = &self.textures;
        let is_even = [transmission, normal, metallic_roughness, emission].iter().all(|texture| texture.is_none());
        let is_bare = self.transmission == 1.0 && self.metallic == 0.0 && !self.is_finished() && !self.unlit;
        self.surface.transmits()
            && (is_even && is_bare && self.roughness < SHARP_ROUGHNESS)
            && (self.alpha == Alpha::Opaque && self.emission == Vec3::ZERO)
    }

    /// Medium inside the solid that the surface bounds.
    #[must_use]
    pub fn medium(&self) -> Option<Medium> {
        match self.surface {
            Surface::Glass { ior, tint } => {
                Some(Medium { ior, tint, absorption: self.absorption, dispersion: self.dispersion })
            }
            _ => None,
        }
    }
}
