//! Layers above the base of a material, and what its base has beyond colour and metal.

use glam::Vec3;

use super::super::fault::{Read, fault};
use super::extensions::{Anisotropy, Clearcoat, DiffuseTransmission, Dispersion, Iridescence, Sheen};
use super::reader::Reader;
use crate::scene::{Material, Surface};

/// Reads them.
pub(super) fn read(reader: &mut Reader<'_>, material: &mut Material) -> Read<()> {
    clearcoat(reader, material)?;
    dispersion(reader, material)?;
    sheen(reader, material)?;
    anisotropy(reader, material)?;
    iridescence(reader, material)?;
    diffuse_transmission(reader, material)?;
    note_glass(reader, material);
    Ok(())
}

/// Notes what has no effect on glass.
fn note_glass(reader: &mut Reader<'_>, material: &Material) {
    if !material.surface.transmits() {
        return;
    }
    for (name, has) in [
        ("sheen", material.sheen_color != Vec3::ZERO),
        ("anisotropy", material.anisotropy > 0.0),
        ("diffuse_transmission", material.diffuse_transmission > 0.0),
    ] {
        if has {
            reader.note(&format!("KHR_materials_{name} has no effect on what of it is glass"));
        }
    }
}

fn clearcoat(reader: &mut Reader<'_>, material: &mut Material) -> Read<()> {
    const NAME: &str = "KHR_materials_clearcoat";
    let Some(coat) = reader.extension::<Clearcoat>(NAME)? else { return Ok(()) };
    let at = |member: &str| format!("extensions.{NAME}.{member}");
    material.clearcoat = reader.unit(coat.clearcoat_factor, "clearcoat", &at("clearcoatFactor"))?;
    let roughness = coat.clearcoat_roughness_factor;
    material.clearcoat_roughness = reader.unit(roughness, "clearcoat roughness", &at("clearcoatRoughnessFactor"))?;
    if material.clearcoat == 0.0 {
        return Ok(());
    }
    let textures = &mut material.textures;
    textures.clearcoat = reader.data_texture(coat.clearcoat_texture.as_ref(), &at("clearcoatTexture"))?;
    let roughness = coat.clearcoat_roughness_texture.as_ref();
    textures.clearcoat_roughness = reader.data_texture(roughness, &at("clearcoatRoughnessTexture"))?;
    material.clearcoat_normal_scale = coat.clearcoat_normal_texture.as_ref().map_or(1.0, |normal| normal.scale);
    if !material.clearcoat_normal_scale.is_finite() {
        let place = format!("{}.{}.scale", reader.place, at("clearcoatNormalTexture"));
        return fault(place, format!("{} is not finite", material.clearcoat_normal_scale));
    }
    let normal = coat.clearcoat_normal_texture.as_ref();
    material.textures.clearcoat_normal = reader.data_texture(normal, &at("clearcoatNormalTexture"))?;
    Ok(())
}

fn dispersion(reader: &mut Reader<'_>, material: &mut Material) -> Read<()> {
    const NAME: &str = "KHR_materials_dispersion";
    let Some(Dispersion { dispersion }) = reader.extension(NAME)? else { return Ok(()) };
    material.dispersion = reader.at_least(0.0, dispersion, &format!("extensions.{NAME}.dispersion"))?;
    if material.dispersion > 0.0 && matches!(material.surface, Surface::Pane { .. }) {
        reader.note(&format!("{NAME} has no effect on a thin pane"));
    }
    Ok(())
}

fn sheen(reader: &mut Reader<'_>, material: &mut Material) -> Read<()> {
    const NAME: &str = "KHR_materials_sheen";
    let Some(sheen) = reader.extension::<Sheen>(NAME)? else { return Ok(()) };
    let at = |member: &str| format!("extensions.{NAME}.{member}");
    material.sheen_color = reader.color(sheen.sheen_color_factor, "sheen colour", &at("sheenColorFactor"))?;
    let roughness = sheen.sheen_roughness_factor;
    material.sheen_roughness = reader.unit(roughness, "sheen roughness", &at("sheenRoughnessFactor"))?;
    if material.sheen_color == Vec3::ZERO {
        return Ok(());
    }
    let textures = &mut material.textures;
    textures.sheen_color = reader.color_texture(sheen.sheen_color_texture.as_ref(), &at("sheenColorTexture"))?;
    textures.sheen_roughness =
        reader.data_texture(sheen.sheen_roughness_texture.as_ref(), &at("sheenRoughnessTexture"))?;
    Ok(())
}

fn anisotropy(reader: &mut Reader<'_>, material: &mut Material) -> Read<()> {
    const NAME: &str = "KHR_materials_anisotropy";
    let Some(anisotropy) = reader.extension::<Anisotropy>(NAME)? else { return Ok(()) };
    let at = |member: &str| format!("extensions.{NAME}.{member}");
    material.anisotropy = reader.unit(anisotropy.anisotropy_strength, "anisotropy", &at("anisotropyStrength"))?;
    material.anisotropy_rotation = anisotropy.anisotropy_rotation;
    if !material.anisotropy_rotation.is_finite() {
        let place = format!("{}.{}", reader.place, at("anisotropyRotation"));
        return fault(place, format!("{} is not finite", material.anisotropy_rotation));
    }
    if material.anisotropy == 0.0 {
        return Ok(());
    }
    let texture = anisotropy.anisotropy_texture.as_ref();
    material.textures.anisotropy = reader.data_texture(texture, &at("anisotropyTexture"))?;
    if material.textures.anisotropy.is_none() {
        // Its direction is that of the tangents, which lie along the first set where the file has
        // none. Without both the lobe is as wide in all directions.
        if !reader.axes() {
            material.anisotropy = 0.0;
        }
    }
    Ok(())
}

fn iridescence(reader: &mut Reader<'_>, material: &mut Material) -> Read<()> {
    const NAME: &str = "KHR_materials_iridescence";
    let Some(film) = reader.extension::<Iridescence>(NAME)? else { return Ok(()) };
    let at = |member: &str| format!("extensions.{NAME}.{member}");
    material.iridescence = reader.unit(film.iridescence_factor, "iridescence", &at("iridescenceFactor"))?;
    material.iridescence_ior = reader.at_least(1.0, film.iridescence_ior, &at("iridescenceIor"))?;
    let thickness = [
        (film.iridescence_thickness_minimum, "iridescenceThicknessMinimum"),
        (film.iridescence_thickness_maximum, "iridescenceThicknessMaximum"),
    ];
    for (end, (thickness, member)) in material.iridescence_thickness.iter_mut().zip(thickness) {
        *end = reader.at_least(0.0, thickness, &at(member))?;
    }
    if material.iridescence == 0.0 {
        return Ok(());
    }
    let textures = &mut material.textures;
    textures.iridescence = reader.data_texture(film.iridescence_texture.as_ref(), &at("iridescenceTexture"))?;
    let thickness = film.iridescence_thickness_texture.as_ref();
    textures.iridescence_thickness = reader.data_texture(thickness, &at("iridescenceThicknessTexture"))?;
    Ok(())
}

fn diffuse_transmission(reader: &mut Reader<'_>, material: &mut Material) -> Read<()> {
    const NAME: &str = "KHR_materials_diffuse_transmission";
    let Some(through) = reader.extension::<DiffuseTransmission>(NAME)? else { return Ok(()) };
    let at = |member: &str| format!("extensions.{NAME}.{member}");
    let factor = through.diffuse_transmission_factor;
    material.diffuse_transmission = reader.unit(factor, "diffuse transmission", &at("diffuseTransmissionFactor"))?;
    let color = through.diffuse_transmission_color_factor;
    material.diffuse_transmission_color =
        reader.color(color, "diffuse transmission colour", &at("diffuseTransmissionColorFactor"))?;
    if material.diffuse_transmission == 0.0 {
        return Ok(());
    }
    let volume = reader.material.extensions.as_ref().and_then(|extensions| extensions.volume.as_ref());
    if !material.surface.transmits() && volume.is_some_and(|volume| volume.thickness_factor.0 > 0.0) {
        reader.note("KHR_materials_volume has no effect on diffuse transmission, which is that of a thin sheet");
    }
    let textures = &mut material.textures;
    let texture = through.diffuse_transmission_texture.as_ref();
    textures.diffuse_transmission = reader.data_texture(texture, &at("diffuseTransmissionTexture"))?;
    let texture = through.diffuse_transmission_color_texture.as_ref();
    textures.diffuse_transmission_color = reader.color_texture(texture, &at("diffuseTransmissionColorTexture"))?;
    Ok(())
}
