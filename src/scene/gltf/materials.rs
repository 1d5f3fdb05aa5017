//! Materials: each is approximated by the nearest of the four surface models, and losses are noted.

use glam::Vec3;
use gltf::json;
use json::validation::Checked;

use super::fault::{Notes, Read, fault};
use crate::scene::{Material, Surface};

/// Roughness below which a lobe is narrower than a pixel and is read as specular.
const SPECULAR_ROUGHNESS: f32 = 0.03;

/// Default index of refraction in glTF.
const DEFAULT_IOR: f32 = 1.5;

/// Name of a file's material.
fn name(material: &json::Material, index: usize) -> String {
    material.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("material {index}"))
}

/// Material of primitives that name none (glTF 2.0, 3.9.6).
pub(super) fn default_material(notes: &mut Notes) -> Read<Material> {
    let name = "default material".to_owned();
    let surface = surface(&json::Material::default(), &name, "materials", notes)?;
    Ok(Material::new(&name, surface))
}

/// A material of the file.
pub(super) fn read(root: &json::Root, index: usize, notes: &mut Notes) -> Read<Material> {
    let material = &root.materials[index];
    let name = name(material, index);
    let place = format!("materials[{index}]");
    let surface = surface(material, &name, &place, notes)?;
    let emission = emission(material, &name, &place, notes)?;
    note_unread(material, notes);
    let priority = priority(material, &place)?;
    Ok(Material { emission, double_sided: material.double_sided, priority, ..Material::new(&name, surface) })
}

/// Rank among overlapping solids: `extras.caustica.priority`, an integer; 0 without one.
fn priority(material: &json::Material, place: &str) -> Read<i32> {
    let extras =
        material.extras.as_ref().and_then(|extras| serde_json::from_str::<serde_json::Value>(extras.get()).ok());
    let Some(priority) = extras.as_ref().and_then(|extras| extras.get("caustica")?.get("priority")) else {
        return Ok(0);
    };
    let integer = priority.as_i64().and_then(|priority| i32::try_from(priority).ok());
    integer.map_or_else(
        || fault(format!("{place}.extras.caustica.priority"), format!("{priority} is not an integer of 32 bits")),
        Ok,
    )
}

/// Nearest surface model.
fn surface(material: &json::Material, name: &str, place: &str, notes: &mut Notes) -> Read<Surface> {
    let pbr = &material.pbr_metallic_roughness;
    let (metallic, roughness) = (pbr.metallic_factor.0, pbr.roughness_factor.0);
    let extensions = material.extensions.as_ref();
    let transmission = extensions.and_then(|e| e.transmission.as_ref()).map_or(0.0, |t| t.transmission_factor.0);
    let thickness = extensions.and_then(|e| e.volume.as_ref()).map_or(0.0, |volume| volume.thickness_factor.0);
    let [r, g, b, _] = pbr.base_color_factor.0;
    let given = Vec3::new(r, g, b);
    let color = given.clamp(Vec3::ZERO, Vec3::ONE);
    if ![metallic, roughness, transmission, thickness].iter().all(|x| x.is_finite()) || !given.is_finite() {
        return fault(place, "a factor is not finite");
    }
    if color != given {
        notes.add(format!("material {name:?}: base colour {r} {g} {b} is clamped to 0..1"));
    }
    if metallic < 0.5 && transmission >= 0.5 {
        if transmission < 1.0 {
            notes.add(format!("material {name:?}: transmission {transmission} is read as 1"));
        }
        note_roughness(roughness, name, notes);
        let ior = ior(material, place)?;
        if ior == 0.0 {
            notes.add(format!("material {name:?}: ior 0 reflects all light, as a white mirror"));
            return Ok(Surface::Mirror { tint: Vec3::ONE });
        }
        return Ok(if thickness > 0.0 {
            Surface::Glass { ior, tint: color }
        } else {
            Surface::Pane { ior, tint: color }
        });
    }
    if transmission > 0.0 {
        notes.add(format!("material {name:?}: transmission {transmission} is read as 0"));
    }
    if metallic >= 0.5 && roughness < SPECULAR_ROUGHNESS {
        if metallic < 1.0 {
            notes.add(format!("material {name:?}: metallic {metallic} is read as 1"));
        }
        note_roughness(roughness, name, notes);
        return Ok(Surface::Mirror { tint: color });
    }
    if metallic > 0.0 {
        let what = format!("metallic {metallic}, roughness {roughness}");
        notes.add(format!("material {name:?} ({what}) is read as diffuse until rough materials come"));
    } else if specular_factor(material) != 0.0 {
        notes.add("the specular coat of dielectrics is not read yet: their base colour alone is diffuse");
    }
    Ok(Surface::Diffuse { albedo: color })
}

/// Notes how the roughness of a mirror or glass is approximated.
fn note_roughness(roughness: f32, name: &str, notes: &mut Notes) {
    if roughness >= SPECULAR_ROUGHNESS {
        notes.add(format!("material {name:?}: roughness {roughness} is read as 0 until rough materials come"));
    } else if roughness > 0.0 {
        notes.add(format!("material {name:?}: roughness {roughness} is small enough to be perfectly smooth"));
    }
}

fn specular_factor(material: &json::Material) -> f32 {
    let specular = material.extensions.as_ref().and_then(|extensions| extensions.specular.as_ref());
    specular.map_or(1.0, |specular| specular.specular_factor.0)
}

/// Index of refraction, ≥ 1; or 0, for which the Fresnel reflectance is defined as 1
/// (KHR_materials_ior).
fn ior(material: &json::Material, place: &str) -> Read<f32> {
    let ior = material.extensions.as_ref().and_then(|extensions| extensions.ior.as_ref());
    let ior = ior.map_or(DEFAULT_IOR, |ior| ior.ior.0);
    if ior.is_finite() && (ior >= 1.0 || ior == 0.0) {
        Ok(ior)
    } else {
        fault(
            format!("{place}.extensions.KHR_materials_ior.ior"),
            format!("{ior} is not an index of refraction from 1, nor 0"),
        )
    }
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
        notes.add(format!("material {name:?}: emissive strength {strength} gives no light"));
    }
    if material.emissive_texture.is_some() && emission != Vec3::ZERO {
        notes.add(format!(
            "material {name:?}: its emissive texture is not read yet: all of its surface gives light by the factor \
             alone, also where the texture is dark"
        ));
    }
    Ok(emission)
}

/// Notes the properties of the material beyond its factors.
fn note_unread(material: &json::Material, notes: &mut Notes) {
    let pbr = &material.pbr_metallic_roughness;
    let extensions = material.extensions.as_ref();
    let transmission = extensions.and_then(|e| e.transmission.as_ref());
    let volume = extensions.and_then(|e| e.volume.as_ref());
    let specular = extensions.and_then(|e| e.specular.as_ref());
    let textured = pbr.base_color_texture.is_some()
        || pbr.metallic_roughness_texture.is_some()
        || material.normal_texture.is_some()
        || material.occlusion_texture.is_some()
        || transmission.is_some_and(|transmission| transmission.transmission_texture.is_some())
        || volume.is_some_and(|volume| volume.thickness_texture.is_some())
        || specular.is_some_and(|s| s.specular_texture.is_some() || s.specular_color_texture.is_some());
    if textured {
        notes.add("textures are not read yet: factors alone are used");
    }
    if volume.is_some_and(|volume| volume.attenuation_distance.0.is_finite() && volume.attenuation_color.0 != [1.0; 3])
    {
        notes.add("attenuation in volumes is not read yet");
    }
    if !matches!(material.alpha_mode, Checked::Valid(json::material::AlphaMode::Opaque)) {
        notes.add("alpha is not read yet: all surfaces are opaque or as their transmission says");
    }
    if extensions.is_some_and(|extensions| extensions.others.contains_key("KHR_materials_unlit")) {
        notes.add("unlit materials are lit like any other");
    }
}
