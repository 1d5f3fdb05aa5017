//! Materials and images in the summary of a scene.

use std::fmt;

use serde::Serialize;

use super::{Alpha, Image, Material, Scene, Surface, Texture, words::one_line};

/// A material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialInfo {
    /// Name of the material.
    pub name: String,
    /// Kind of surface that the material is read as, its colour and index of refraction.
    pub read_as: String,
    /// Base colour, albedo or tint.
    pub base_color: [f32; 3],
    /// Fraction of metal.
    pub metallic: f32,
    /// Roughness of all lobes but the diffuse one.
    pub roughness: f32,
    /// Index of refraction of what transmits light.
    pub ior: Option<f32>,
    /// Reflectance of the coat along the normal, of a layered surface.
    pub f0: Option<[f32; 3]>,
    /// Strength of the coat of a layered surface.
    pub specular: Option<f32>,
    /// Fraction of transmission, of what transmits light.
    pub transmission: Option<f32>,
    /// Absorption coefficient inside, 1/m for each channel.
    pub absorption: [f32; 3],
    /// Strength of the clear coat.
    pub clearcoat: f32,
    /// Roughness of the clear coat.
    pub clearcoat_roughness: f32,
    /// Colour of the sheen.
    pub sheen_color: [f32; 3],
    /// Roughness of the sheen.
    pub sheen_roughness: f32,
    /// Strength of the anisotropy.
    pub anisotropy: f32,
    /// Strength of the iridescence.
    pub iridescence: f32,
    /// Dispersion.
    pub dispersion: f32,
    /// Fraction of diffuse transmission.
    pub diffuse_transmission: f32,
    /// Emitted radiance, W/(m² sr) in each channel, before its texture.
    pub emission: [f32; 3],
    /// `opaque`, `mask` or `blend`.
    pub alpha: &'static str,
    /// Opacity from which a mask is opaque.
    pub alpha_cutoff: Option<f32>,
    /// Opacity, of a mask or blend.
    pub opacity: f32,
    /// Whether the back emits light too.
    pub double_sided: bool,
    /// Whether light has no effect.
    pub unlit: bool,
    /// Textures of the properties.
    pub textures: Vec<TextureInfo>,
}

/// A texture of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TextureInfo {
    /// Property that it multiplies.
    pub property: &'static str,
    /// Index into the images.
    pub image: u32,
    /// Name of the image.
    pub name: String,
    /// Width and height, texels.
    pub size: [u32; 2],
}

/// An image of textures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImageInfo {
    /// Name of the image.
    pub name: String,
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Memory on the device, bytes.
    pub bytes: u64,
}

impl MaterialInfo {
    pub(super) fn new(material: &Material, images: &[Image]) -> Self {
        let (metallic, coat) = match material.surface {
            Surface::Layered { metallic, f0, specular, .. } => (metallic, Some((f0.to_array(), specular))),
            Surface::Mirror { .. } => (1.0, None),
            Surface::Diffuse { .. } | Surface::Glass { .. } | Surface::Pane { .. } => (material.metallic, None),
        };
        let (alpha, alpha_cutoff) = match material.alpha {
            Alpha::Opaque => ("opaque", None),
            Alpha::Mask { cutoff } => ("mask", Some(cutoff)),
            Alpha::Blend => ("blend", None),
        };
        let texture = |(property, texture): (&'static str, Option<Texture>)| {
            let Texture { image, .. } = texture?;
            let Image { name, width, height, .. } = &images[image as usize];
            Some(TextureInfo { property, image, name: name.clone(), size: [*width, *height] })
        };
        Self {
            name: material.name.clone(),
            read_as: material.surface.to_string(),
            base_color: material.surface.color().to_array(),
            metallic,
            roughness: material.roughness,
            ior: material.surface.ior(),
            f0: coat.map(|(f0, _)| f0),
            specular: coat.map(|(_, specular)| specular),
            transmission: material.surface.transmits().then_some(material.transmission),
            absorption: material.absorption.to_array(),
            clearcoat: material.clearcoat,
            clearcoat_roughness: material.clearcoat_roughness,
            sheen_color: material.sheen_color.to_array(),
            sheen_roughness: material.sheen_roughness,
            anisotropy: material.anisotropy,
            iridescence: material.iridescence,
            dispersion: material.dispersion,
            diffuse_transmission: material.diffuse_transmission,
            emission: material.emission.to_array(),
            alpha,
            alpha_cutoff,
            opacity: material.opacity,
            double_sided: material.double_sided,
            unlit: material.unlit,
            textures: material.textures.named().into_iter().filter_map(texture).collect(),
        }
    }
}

/// Images with their memory on the device: 4 bytes a texel, and a third more for smaller versions
/// where a texture reads them.
pub(super) fn images(scene: &Scene) -> Vec<ImageInfo> {
    let mut has_smaller = vec![false; scene.images.len()];
    for (_, texture) in scene.materials.iter().flat_map(|material| material.textures.named()) {
        if let Some(texture) = texture {
            has_smaller[texture.image as usize] |= texture.is_mipmapped;
        }
    }
    let image = |(Image { name, width, height, .. }, has_smaller): (&Image, &bool)| {
        let bytes = 4 * u64::from(*width) * u64::from(*height);
        let bytes = if *has_smaller { bytes + bytes / 3 } else { bytes };
        ImageInfo { name: name.clone(), size: [*width, *height], bytes }
    };
    scene.images.iter().zip(&has_smaller).map(image).collect()
}

/// The material in one line, without its textures.
impl fmt::Display for MaterialInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let triple = |[r, g, b]: [f32; 3]| format!("{r} {g} {b}");
        let is_diffuse = self.f0.is_none() && self.metallic == 0.0 && self.ior.is_none();
        let mut parts = vec![format!("{}  {}", self.name, self.read_as)];
        let mut add = |applies: bool, part: String| {
            if applies {
                parts.push(part);
            }
        };
        add(self.metallic > 0.0 && self.metallic < 1.0, format!("metallic {}", self.metallic));
        add(!is_diffuse, format!("roughness {}", self.roughness));
        if let Some((f0, specular)) = self.f0.zip(self.specular).filter(|_| self.metallic < 1.0) {
            add(true, format!("reflectance ({})", triple(f0)));
            add(specular != 1.0, format!("specular {specular}"));
        }
        if let Some(transmission) = self.transmission {
            add(true, format!("transmission {transmission}"));
        }
        add(self.absorption != [0.0; 3], format!("absorption ({}) per metre", triple(self.absorption)));
        let [coat, roughness] = [self.clearcoat, self.clearcoat_roughness];
        add(coat > 0.0, format!("clearcoat {coat} of roughness {roughness}"));
        let [sheen, roughness] = [triple(self.sheen_color), self.sheen_roughness.to_string()];
        add(self.sheen_color != [0.0; 3], format!("sheen ({sheen}) of roughness {roughness}"));
        add(self.anisotropy > 0.0, format!("anisotropy {}", self.anisotropy));
        add(self.iridescence > 0.0, format!("iridescence {}", self.iridescence));
        add(self.dispersion > 0.0, format!("dispersion {}", self.dispersion));
        add(self.diffuse_transmission > 0.0, format!("diffuse transmission {}", self.diffuse_transmission));
        if let Some(cutoff) = self.alpha_cutoff {
            add(true, format!("alpha mask from {cutoff}"));
        }
        add(self.alpha == "blend", "alpha blend".to_owned());
        add(self.opacity != 1.0, format!("opacity {}", self.opacity));
        add(self.unlit, "unlit".to_owned());
        f.write_str(&one_line(&parts.join(", ")))
    }
}

impl fmt::Display for TextureInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { property, image, name, size: [width, height] } = self;
        f.write_str(&one_line(&format!("{property} by image {image} {name:?}, {width} x {height}")))
    }
}

impl fmt::Display for ImageInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, size: [width, height], bytes } = self;
        write!(f, "{name}  {width} x {height}  {bytes} bytes on the device")
    }
}
