//! Materials: factors, textures and the surface that they make.

use glam::Vec3;
use gltf::json;

use super::extras;
use super::fault::{Notes, Read, fault};
use super::images::ImageList;
use crate::scene::{Alpha, Material, SHARP_ROUGHNESS, Surface};

mod base;
mod coats;
mod extensions;
mod reader;

use base::Base;
use reader::Reader;

/// A material as meshes show it that have certain sets of texture coordinates.
#[derive(Debug)]
pub(super) struct ReadMaterial {
    pub(super) material: Material,
    /// TEXCOORD_n behind each of the triangles' sets of texture coordinates.
    pub(super) sets: Vec<u32>,
    /// TEXCOORD_n of all textures, also of those that are left out.
    pub(super) asked: Vec<u32>,
}

/// A material of the file, or the one of primitives that name none (glTF 2.0, 3.9.6). Textures of
/// sets of texture coordinates that the mesh `lacks` are left out. `images` gets those of the
/// others.
pub(super) fn read(
    root: &json::Root,
    index: Option<usize>,
    lacks: &[u32],
    images: &mut ImageList,
    notes: &mut Notes,
) -> Read<ReadMaterial> {
    let default = json::Material::default();
    let (material, name, place) = match index {
        Some(i) => (&root.materials[i], name(&root.materials[i], i), format!("materials[{i}]")),
        None => (&default, "default material".to_owned(), "materials".to_owned()),
    };
    let (sets, asked) = (Vec::new(), Vec::new());
    let mut reader = Reader { root, material, name, place, lacks, sets, asked, images, notes };
    let material = reader.material()?;
    let Reader { sets, asked, .. } = reader;
    Ok(ReadMaterial { material, sets, asked })
}

/// Name of a file's material.
pub(super) fn name(material: &json::Material, index: usize) -> String {
    material.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("material {index}"))
}

impl Reader<'_> {
    fn material(&mut self) -> Read<Material> {
        let extensions = self.material.extensions.as_ref();
        let unlit = extensions.is_some_and(|extensions| extensions.others.contains_key("KHR_materials_unlit"));
        let base = if unlit { base::of_unlit(self)? } else { base::read(self)? };
        let mut material = Material::new(&self.name, Surface::Diffuse { albedo: base.color });
        material.double_sided = self.material.double_sided;
        material.alpha = base.alpha;
        material.opacity = if base.alpha == Alpha::Opaque { 1.0 } else { base.opacity };
        material.priority = extras::priority(&self.material.extras, &self.place)?;
        material.group = extras::group(&self.material.extras, &self.place)?;
        material.textures.base_color = base.color_texture;
        material.unlit = unlit;
        material.roughness = base.roughness;
        if unlit {
            // All but the colour is for readers without the extension.
            material.roughness = 1.0;
            return Ok(material);
        }
        material.surface = self.surface(&base, &mut material)?;
        if matches!(material.surface, Surface::Layered { .. }) || material.surface.transmits() {
            material.textures.metallic_roughness = base.metallic_roughness;
            material.textures.specular = base.specular_texture;
            material.textures.specular_color = base.specular_color;
        }
        material.normal_scale = self.material.normal_texture.as_ref().map_or(1.0, |normal| normal.scale);
        if !material.normal_scale.is_finite() {
            let problem = format!("{} is not finite", material.normal_scale);
            return fault(format!("{}.normalTexture.scale", self.place), problem);
        }
        material.textures.normal = self.data_texture(self.material.normal_texture.as_ref(), "normalTexture")?;
        material.emission = emission(self.material, &self.name, &self.place, self.notes)?;
        if material.emission != Vec3::ZERO {
            material.textures.emission =
                self.color_texture(self.material.emissive_texture.as_ref(), "emissiveTexture")?;
        }
        coats::read(self, &mut material)?;
        Ok(material)
    }

    /// The surface that the base makes. Sets what the material has of transmission.
    fn surface(&mut self, base: &Base, material: &mut Material) -> Read<Surface> {
        if base.transmits() {
            return self.transmitting(base, material);
        }
        if base.transmission > 0.0 {
            let why = if base.ior == 0.0 { "ior 0 reflects all light" } else { "it is of metal" };
            self.note(&format!("transmits nothing, because {why}"));
        }
        Ok(if base.is_metal() && base.roughness < SHARP_ROUGHNESS {
            Surface::Mirror { tint: base.color }
        } else if base.metallic == 0.0 && base.specular == 0.0 {
            Surface::Diffuse { albedo: base.color }
        } else {
            Surface::Layered { base: base.color, metallic: base.metallic, f0: base.f0, specular: base.specular }
        })
    }

    /// Glass or a thin pane, as the thickness says.
    fn transmitting(&mut self, base: &Base, material: &mut Material) -> Read<Surface> {
        let extensions = self.material.extensions.as_ref();
        let is_textured = extensions
            .and_then(|extensions| extensions.specular.as_ref())
            .is_some_and(|specular| specular.specular_texture.is_some() || specular.specular_color_texture.is_some());
        let is_given = base.specular != 1.0 || base.f0 != Vec3::splat(base::normal_reflectance(base.ior));
        if is_given || is_textured {
            self.note("KHR_materials_specular does not change the reflection of glass, which its ior decides");
        }
        (material.transmission, material.metallic) = (base.transmission, base.metallic);
        let texture = extensions.and_then(|e| e.transmission.as_ref()?.transmission_texture.as_ref());
        let at = "extensions.KHR_materials_transmission.transmissionTexture";
        material.textures.transmission = self.data_texture(texture, at)?;
        let Some(volume) = extensions.and_then(|extensions| extensions.volume.as_ref()) else {
            return Ok(Surface::Pane { ior: base.ior, tint: base.color });
        };
        const VOLUME: &str = "extensions.KHR_materials_volume";
        let thickness = self.at_least(0.0, volume.thickness_factor.0, &format!("{VOLUME}.thicknessFactor"))?;
        if thickness == 0.0 {
            return Ok(Surface::Pane { ior: base.ior, tint: base.color });
        }
        let color =
            self.color(volume.attenuation_color.0, "attenuation colour", &format!("{VOLUME}.attenuationColor"))?;
        let distance = volume.attenuation_distance.0;
        if distance == 0.0 {
            self.note("attenuationDistance 0 is no distance: light is not attenuated");
        } else if distance.is_nan() || distance < 0.0 {
            let place = format!("{}.{VOLUME}.attenuationDistance", self.place);
            return fault(place, format!("{distance} is not a positive number"));
        } else {
            material.absorption = absorption(color, distance);
        }
        Ok(Surface::Glass { ior: base.ior, tint: base.color })
    }
}

/// Absorption coefficient by which white light has that colour after that distance, 1/m. The
/// smallest number of f32 stands for black.
fn absorption(color: Vec3, distance: f32) -> Vec3 {
    let of = |channel: f32| (channel.max(f32::MIN_POSITIVE).recip().ln() / distance).clamp(0.0, f32::MAX);
    Vec3::from_array(color.to_array().map(of))
}

/// Emitted radiance: emissive factor times strength, with nits read as W/(m² sr).
fn emission(material: &json::Material, name: &str, place: &str, notes: &mut Notes) -> Read<Vec3> {
    let factor = Vec3::from_array(material.emissive_factor.0);
    if !factor.is_finite() || factor.min_element() < 0.0 {
        let [r, g, b] = factor.to_array();
        return fault(format!("{place}.emissiveFactor"), format!("{r} {g} {b} is not a colour of positive numbers"));
    }
    let strength = material.extensions.as_ref().and_then(|extensions| extensions.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |strength| strength.emissive_strength.0);
    let emission = factor * strength;
    if !(strength >= 0.0 && strength.is_finite() && emission.is_finite()) {
        let at = format!("{place}.extensions.KHR_materials_emissive_strength.emissiveStrength");
        return fault(at, format!("{strength} is not a positive number that its factor can be multiplied by"));
    }
    if factor != Vec3::ZERO && emission == Vec3::ZERO {
        notes.about("material", name, &format!(": emissive strength {strength} gives no light"));
    }
    let has_texture = material.emissive_texture.is_some();
    // Exporters write strength 1, the default, for every material.
    if factor == Vec3::ZERO && (has_texture || (strength > 0.0 && strength != 1.0)) {
        let what = if has_texture { "texture" } else { "strength" };
        let note = format!(": its emissiveFactor is 0, so that its emissive {what} gives no light");
        notes.about("material", name, &note);
    }
    Ok(emission)
}
