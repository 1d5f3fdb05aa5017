//! The base of a material: colour, opacity, metal, roughness and the dielectric coat, in either of
//! glTF's models.

use glam::Vec3;

use super::super::fault::{Read, fault};
use super::super::images::Content;
use super::extensions::SpecularGlossiness;
use super::reader::Reader;
use crate::scene::{Alpha, ImageValues, Texture};
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;

/// Default index of refraction in glTF.
const DEFAULT_IOR: f32 = 1.5;

/// Factors of a material with metal and roughness; those of the other model are converted to them.
#[derive(Default)]
pub(super) struct Base {
    pub(super) color: Vec3,
    pub(super) alpha: Alpha,
    pub(super) opacity: f32,
    pub(super) metallic: f32,
    pub(super) roughness: f32,
    /// Index of refraction from 1, or 0, for which everything is reflected (KHR_materials_ior).
    pub(super) ior: f32,
    /// Reflectance of the coat along the normal.
    pub(super) f0: Vec3,
    /// Strength of the coat.
    pub(super) specular: f32,
    /// Fraction of transmission.
    pub(super) transmission: f32,
    pub(super) color_texture: Option<Texture>,
    pub(super) metallic_roughness: Option<Texture>,
    pub(super) specular_texture: Option<Texture>,
    pub(super) specular_color: Option<Texture>,
}

impl Base {
    /// Whether all of it is metal.
    pub(super) fn is_metal(&self) -> bool {
        self.metallic == 1.0 && self.metallic_roughness.is_none()
    }

    /// Whether some light passes through it.
    pub(super) fn transmits(&self) -> bool {
        self.transmission > 0.0 && !self.is_metal() && self.ior > 0.0
    }
}

/// Reads the base of a material.
pub(super) fn read(reader: &mut Reader<'_>) -> Read<Base> {
    match reader.extension::<SpecularGlossiness>(SPECULAR_GLOSSINESS)? {
        Some(glossy) => of_glossiness(reader, &glossy),
        None => of_metal(reader),
    }
}

/// The colour alone, of a material that is not lit.
pub(super) fn of_unlit(reader: &mut Reader<'_>) -> Read<Base> {
    let pbr = &reader.material.pbr_metallic_roughness;
    let [r, g, b, a] = pbr.base_color_factor.0;
    let at = "pbrMetallicRoughness.baseColorFactor";
    let alpha = alpha(reader)?;
    Ok(Base {
        alpha,
        color: reader.color([r, g, b], "base colour", at)?,
        opacity: reader.unit(a, "opacity", at)?,
        color_texture: reader.base_texture(
            pbr.base_color_texture.as_ref(),
            (alpha, a),
            "pbrMetallicRoughness.baseColorTexture",
        )?,
        ..Base::default()
    })
}

/// pbrMetallicRoughness, with KHR_materials_ior and KHR_materials_specular.
fn of_metal(reader: &mut Reader<'_>) -> Read<Base> {
    const PBR: &str = "pbrMetallicRoughness";
    let material = reader.material;
    let pbr = &material.pbr_metallic_roughness;
    let [r, g, b, a] = pbr.base_color_factor.0;
    let specular = material.extensions.as_ref().and_then(|extensions| extensions.specular.as_ref());
    let ior = ior(reader)?;
    let alpha = alpha(reader)?;
    let mut base = Base {
        alpha,
        color: reader.color([r, g, b], "base colour", &format!("{PBR}.baseColorFactor"))?,
        opacity: reader.unit(a, "opacity", &format!("{PBR}.baseColorFactor"))?,
        metallic: reader.unit(pbr.metallic_factor.0, "metallic", &format!("{PBR}.metallicFactor"))?,
        roughness: reader.unit(pbr.roughness_factor.0, "roughness", &format!("{PBR}.roughnessFactor"))?,
        ior,
        f0: Vec3::splat(normal_reflectance(ior)),
        specular: 1.0,
        transmission: 0.0,
        color_texture: reader.base_texture(
            pbr.base_color_texture.as_ref(),
            (alpha, a),
            &format!("{PBR}.baseColorTexture"),
        )?,
        metallic_roughness: None,
        specular_texture: None,
        specular_color: None,
    };
    if let Some(transmission) = material.extensions.as_ref().and_then(|extensions| extensions.transmission.as_ref()) {
        let at = "extensions.KHR_materials_transmission.transmissionFactor";
        base.transmission = reader.unit(transmission.transmission_factor.0, "transmission", at)?;
    }
    let at = |member: &str| format!("extensions.KHR_materials_specular.{member}");
    if let Some(specular) = specular {
        base.specular = reader.unit(specular.specular_factor.0, "specular", &at("specularFactor"))?;
        let color = Vec3::from_array(specular.specular_color_factor.0);
        if !color.is_finite() || color.min_element() < 0.0 {
            let place = format!("{}.{}", reader.place, at("specularColorFactor"));
            let [r, g, b] = color.to_array();
            return fault(place, format!("{r} {g} {b} is not a colour of positive numbers"));
        }
        base.f0 *= color;
    }
    // Textures without effect are not decoded.
    let has_lobe = base.specular > 0.0 || base.transmission > 0.0;
    if base.metallic > 0.0 || (base.roughness > 0.0 && has_lobe) {
        let at = format!("{PBR}.metallicRoughnessTexture");
        base.metallic_roughness = reader.data_texture(pbr.metallic_roughness_texture.as_ref(), &at)?;
    }
    if let Some(specular) = specular.filter(|_| base.specular > 0.0 && !base.is_metal() && !base.transmits()) {
        base.specular_texture = reader.data_texture(specular.specular_texture.as_ref(), &at("specularTexture"))?;
        base.specular_color =
            reader.color_texture(specular.specular_color_texture.as_ref(), &at("specularColorTexture"))?;
    }
    Ok(base)
}

/// KHR_materials_pbrSpecularGlossiness, which goes before the other model. Its specular colour is
/// the reflectance of a coat over the diffuse base; its glossiness becomes an image of roughness.
fn of_glossiness(reader: &mut Reader<'_>, glossy: &SpecularGlossiness) -> Read<Base> {
    let at = |member: &str| format!("extensions.{SPECULAR_GLOSSINESS}.{member}");
    let [r, g, b, a] = glossy.diffuse_factor;
    let glossiness = reader.unit(glossy.glossiness_factor, "glossiness", &at("glossinessFactor"))?;
    let transmission = reader.material.extensions.as_ref().and_then(|extensions| extensions.transmission.as_ref());
    if transmission.is_some_and(|transmission| transmission.transmission_factor.0 > 0.0) {
        reader.note(&format!("KHR_materials_transmission has no effect on {SPECULAR_GLOSSINESS}"));
    }
    let texture = glossy.specular_glossiness_texture.as_ref();
    let metallic_roughness = reader.texture(texture, &at("specularGlossinessTexture"), |image| {
        (Content::Roughness { image, glossiness }, ImageValues::Data)
    })?;
    let alpha = alpha(reader)?;
    Ok(Base {
        alpha,
        color: reader.color([r, g, b], "diffuse colour", &at("diffuseFactor"))?,
        opacity: reader.unit(a, "opacity", &at("diffuseFactor"))?,
        metallic: 0.0,
        roughness: if metallic_roughness.is_some() { 1.0 } else { 1.0 - glossiness },
        ior: DEFAULT_IOR,
        f0: reader.color(glossy.specular_factor, "specular colour", &at("specularFactor"))?,
        specular: 1.0,
        transmission: 0.0,
        color_texture: reader.base_texture(glossy.diffuse_texture.as_ref(), (alpha, a), &at("diffuseTexture"))?,
        metallic_roughness,
        specular_texture: None,
        specular_color: reader.color_texture(texture, &at("specularGlossinessTexture"))?,
    })
}

/// The extension of the other model.
const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

/// Index of refraction, ≥ 1; or 0, for which the Fresnel reflectance is defined as 1
/// (KHR_materials_ior).
fn ior(reader: &Reader<'_>) -> Read<f32> {
    let ior = reader.material.extensions.as_ref().and_then(|extensions| extensions.ior.as_ref());
    let ior = ior.map_or(DEFAULT_IOR, |ior| ior.ior.0);
    if ior.is_finite() && (ior >= 1.0 || ior == 0.0) {
        Ok(ior)
    } else {
        fault(
            format!("{}.extensions.KHR_materials_ior.ior", reader.place),
            format!("{ior} is not an index of refraction from 1, nor 0"),
        )
    }
}

/// Reflectance along the normal of an index of refraction.
pub(super) fn normal_reflectance(ior: f32) -> f32 {
    let ior = f64::from(ior);
    ((ior - 1.0) / (ior + 1.0)).powi(2) as f32
}

/// Reads how much of the surface is there.
fn alpha(reader: &mut Reader<'_>) -> Read<Alpha> {
    let cutoff = reader.material.alpha_cutoff.unwrap_or_default().0;
    match reader.material.alpha_mode {
        Checked::Valid(AlphaMode::Opaque) => Ok(Alpha::Opaque),
        Checked::Valid(AlphaMode::Mask) => Ok(Alpha::Mask { cutoff: reader.at_least(0.0, cutoff, "alphaCutoff")? }),
        Checked::Valid(AlphaMode::Blend) => Ok(Alpha::Blend),
        Checked::Invalid => {
            reader.note("its alphaMode is not one of glTF's: it is opaque");
            Ok(Alpha::Opaque)
        }
    }
}
