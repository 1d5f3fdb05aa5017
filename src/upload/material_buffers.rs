//! Materials, their textures, and what the corners of triangles carry for them, in tables.

use glam::Vec4;

use super::texels::Texels;
use crate::{
    emitters::light_table::emission_in,
    error::{Error, Result},
    gpu::{Gpu, Table},
    layout::{
        self, BLEND_BIT, DOUBLE_SIDED_BIT, LINEAR_BIT, MASK_BIT, MATERIAL_MASK, MATERIAL_TEXELS, MaterialRecord,
        SECOND_UV_BIT, SMALL_GLASS_BIT, SRGB_BIT, TEXTURE_ROLE_SHIFT, TEXTURE_TEXELS, TextureRecord, UNLIT_BIT,
        WRAP_CLAMP, WRAP_MIRROR, WRAP_REPEAT, octahedral,
    },
    scene::{Alpha, Attributes, ImageValues, Material, SHARP_ROUGHNESS, Scene, Surface, Texture, Wrap},
    settings::LightUnit,
};

/// The materials on the device.
#[derive(Debug)]
pub struct MaterialBuffers {
    materials: Table,
    attributes: Table,
    texels: Table,
    /// Some material has lobes beside one that is diffuse or perfectly specular.
    pub has_layers: bool,
    /// Some material has more than a base and its coat.
    pub has_finishes: bool,
    /// Some material is iridescent.
    pub has_films: bool,
    /// Some material has a rough lobe, which is lit at every vertex.
    pub has_rough: bool,
    /// Some material has a texture, or some triangle has colours.
    pub has_textures: bool,
    /// Some surface is not there everywhere.
    pub has_alpha: bool,
    /// Some surface is there in part.
    pub has_veils: bool,
    /// Some material is a pane that rays to lights pass.
    pub has_clear_panes: bool,
}

impl MaterialBuffers {
    /// Uploads materials and textures.
    ///
    /// # Errors
    /// [`crate::Error::Limit`] if a table cannot hold them, [`crate::Error::Scene`] if there are
    /// more materials than a primitive can name.
    pub fn new(gpu: &Gpu, scene: &Scene, unit: LightUnit) -> Result<Self> {
        if scene.materials.len() > MATERIAL_MASK as usize {
            let problem = format!("{} materials in use; at most {MATERIAL_MASK}", scene.materials.len());
            return Err(Error::Scene { path: scene.path.clone(), place: "materials".to_owned(), problem });
        }
        let mut texels = Texels::new(&scene.images);
        let rows = rows(scene, unit, &mut texels);
        let materials = || scene.materials.iter();
        let attributes: Vec<_> = in_order(scene).iter().map(attributes).collect();
        Ok(Self {
            has_textures: !attributes.is_empty(),
            has_layers: materials().any(is_layered),
            has_finishes: materials().any(Material::is_finished),
            has_films: materials().any(|m| m.is_finished() && m.iridescence > 0.0),
            has_rough: materials().any(is_rough),
            has_alpha: materials().any(|m| m.alpha != Alpha::Opaque),
            has_veils: materials().any(|m| may_be_veil(scene, m)),
            has_clear_panes: materials().any(Material::is_clear_pane),
            materials: Table::new(gpu, "materials", &rows)?,
            attributes: Table::layered(gpu, "attributes of triangles", &attributes)?,
            texels: Table::layered(gpu, "texels", &texels.into_words())?,
        })
    }

    /// The materials of the same scene with other emission.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn relit(&self, gpu: &Gpu, scene: &Scene, unit: LightUnit) -> Result<Self> {
        let rows = rows(scene, unit, &mut Texels::new(&scene.images));
        let (attributes, texels) = (self.attributes.clone(), self.texels.clone());
        Ok(Self { materials: Table::new(gpu, "materials", &rows)?, attributes, texels, ..*self })
    }
    /// The tables by name.
    #[must_use]
    pub fn tables(&self) -> [(&'static str, &Table); 3] {
        [("materials", &self.materials), ("attributes", &self.attributes), ("texels", &self.texels)]
    }
}

/// Rows of the table of materials, followed by those of their textures.
fn rows(scene: &Scene, unit: LightUnit, texels: &mut Texels<'_>) -> Vec<[u32; 4]> {
    let first_row = scene.materials.len() as u32 * MATERIAL_TEXELS;
    let mut textures = Vec::new();
    let record = |(material, small): (&Material, bool)| {
        let record = record(material, unit, first_row, &mut textures, texels);
        let small = if small { SMALL_GLASS_BIT } else { 0 };
        MaterialRecord { flags: record.flags | small, ..record }
    };
    let records: Vec<MaterialRecord> = scene.materials.iter().zip(scene.small_glass()).map(record).collect();
    [bytemuck::cast_slice(&records), bytemuck::cast_slice(&textures)].concat()
}

/// Whether a material has more lobes than the kernels' shorter code follows.
fn is_layered(material: &Material) -> bool {
    let is_layered = matches!(material.surface, Surface::Layered { .. })
        || is_rough(material)
        || (material.surface.transmits() && (material.transmission < 1.0 || material.textures.transmission.is_some()))
        || (material.surface.transmits() && material.metallic > 0.0)
        || material.is_finished();
    is_layered && !material.unlit
}

fn is_rough(material: &Material) -> bool {
    let has_gloss = !matches!(material.surface, Surface::Diffuse { .. });
    let is_opaque = !material.surface.transmits() || material.transmission < 1.0;
    let is_rough = (has_gloss && material.roughness >= SHARP_ROUGHNESS) || material.clearcoat > 0.0;
    is_rough || (material.is_finished() && is_opaque)
}

/// Whether a material may have an opacity between 0 and 1.
fn may_be_veil(scene: &Scene, material: &Material) -> bool {
    let varies = |texture: &Texture| scene.images[texture.image as usize].texels.iter().any(|texel| texel[3] < u8::MAX);
    let is_in_part = || {
        material.opacity < 1.0
            || material.textures.base_color.as_ref().is_some_and(varies)
            || scene.attributes.iter().any(|own| own.colors.iter().any(|color| color.w < 1.0))
    };
    material.alpha == Alpha::Blend && material.opacity > 0.0 && is_in_part()
}

/// The attributes of the triangles, in the order of the corners as they are now.
fn in_order(scene: &Scene) -> Vec<Attributes> {
    let mut all = scene.attributes.clone();
    for triangle in scene.triangles.iter().filter(|triangle| triangle.is_turned && triangle.attributes > 0) {
        let own = &mut all[triangle.attributes as usize - 1];
        *own = own.in_order(true);
    }
    all
}

fn attributes(own: &Attributes) -> layout::Attributes {
    let tangent = |t: Vec4| (octahedral(t.truncate()) & !1) | u32::from(t.w < 0.0);
    let uvs = |i: usize| [own.uvs[0][i].x, own.uvs[0][i].y, own.uvs[1][i].x, own.uvs[1][i].y];
    layout::Attributes {
        uvs: [0, 1, 2].map(uvs),
        colors: own.colors.map(|c| c.to_array()),
        tangents: own.tangents.map(tangent),
        pad: 0,
    }
}

/// The record of a material. Those of its textures are added to `textures`, which begin at row
/// `first_row` of the table, and their images to `texels`.
fn record(
    material: &Material,
    unit: LightUnit,
    first_row: u32,
    textures: &mut Vec<TextureRecord>,
    texels: &mut Texels<'_>,
) -> MaterialRecord {
    let surface = &material.surface;
    let (metallic, f0, specular) = match *surface {
        Surface::Layered { metallic, f0, specular, .. } => (metallic, f0.to_array(), specular),
        Surface::Mirror { .. } => (1.0, [0.0; 3], 0.0),
        Surface::Glass { ior, .. } | Surface::Pane { ior, .. } => {
            (material.metallic, [((ior - 1.0) / (ior + 1.0)).powi(2); 3], 1.0)
        }
        Surface::Diffuse { .. } => (0.0, [0.0; 3], 0.0),
    };
    let alpha = match material.alpha {
        Alpha::Opaque => 0,
        Alpha::Mask { .. } => MASK_BIT,
        Alpha::Blend => BLEND_BIT,
    };
    let first_texture = textures.len() as u32;
    let mut roles = 0;
    for (role, texture, values) in by_role(material) {
        roles |= 1 << role;
        textures.push(texture_record(&texture, role, values, texels));
    }
    // Finishes are those of layers.
    let is_finished = material.is_finished() && !surface.transmits();
    MaterialRecord {
        color: surface.color().to_array(),
        kind: match surface {
            _ if is_finished => layout::LAYERED,
            Surface::Diffuse { .. } => layout::DIFFUSE,
            Surface::Mirror { .. } => layout::MIRROR,
            Surface::Glass { .. } => layout::GLASS,
            Surface::Pane { .. } => layout::PANE,
            Surface::Layered { .. } => layout::LAYERED,
        },
        emission: emission_in(material.emission, unit).to_array(),
        ior: surface.ior().unwrap_or(1.0),
        roughness: material.roughness,
        metallic,
        transmission: material.transmission,
        flags: alpha
            | if material.double_sided { DOUBLE_SIDED_BIT } else { 0 }
            | if material.unlit { UNLIT_BIT } else { 0 },
        f0,
        specular,
        normal_scale: material.normal_scale,
        opacity: material.opacity,
        cutoff: if let Alpha::Mask { cutoff } = material.alpha { cutoff } else { 0.0 },
        diffuse_transmission: material.diffuse_transmission,
        diffuse_transmission_color: material.diffuse_transmission_color.to_array(),
        clearcoat: material.clearcoat,
        clearcoat_roughness: material.clearcoat_roughness,
        clearcoat_normal_scale: material.clearcoat_normal_scale,
        anisotropy: material.anisotropy,
        anisotropy_rotation: material.anisotropy_rotation,
        sheen_color: material.sheen_color.to_array(),
        sheen_roughness: material.sheen_roughness,
        iridescence: material.iridescence,
        iridescence_ior: material.iridescence_ior,
        iridescence_thickness: material.iridescence_thickness,
        first_texture: first_row + first_texture * TEXTURE_TEXELS,
        textures: roles,
        pad: [0; 2],
    }
}

/// The textures of a material with their roles, in the order of these, and what they are of.
fn by_role(material: &Material) -> impl Iterator<Item = (u32, Texture, ImageValues)> {
    let all = &material.textures;
    let of_colors = |role, texture: Option<Texture>| texture.map(|texture| (role, texture, ImageValues::Colors));
    let of_data = |role, texture: Option<Texture>| texture.map(|texture| (role, texture, ImageValues::Data));
    let base = ImageValues::of_colors(material.alpha, material.opacity);
    [
        all.base_color.map(|texture| (layout::BASE_COLOR_TEXTURE, texture, base)),
        of_data(layout::METALLIC_ROUGHNESS_TEXTURE, all.metallic_roughness),
        of_data(layout::NORMAL_TEXTURE, all.normal),
        of_colors(layout::EMISSION_TEXTURE, all.emission),
        of_data(layout::SPECULAR_TEXTURE, all.specular),
        of_colors(layout::SPECULAR_COLOR_TEXTURE, all.specular_color),
        of_data(layout::TRANSMISSION_TEXTURE, all.transmission),
        of_data(layout::DIFFUSE_TRANSMISSION_TEXTURE, all.diffuse_transmission),
        of_colors(layout::DIFFUSE_TRANSMISSION_COLOR_TEXTURE, all.diffuse_transmission_color),
        of_data(layout::CLEARCOAT_TEXTURE, all.clearcoat),
        of_data(layout::CLEARCOAT_ROUGHNESS_TEXTURE, all.clearcoat_roughness),
        of_data(layout::CLEARCOAT_NORMAL_TEXTURE, all.clearcoat_normal),
        of_colors(layout::SHEEN_COLOR_TEXTURE, all.sheen_color),
        of_data(layout::SHEEN_ROUGHNESS_TEXTURE, all.sheen_roughness),
        of_data(layout::ANISOTROPY_TEXTURE, all.anisotropy),
        of_data(layout::IRIDESCENCE_TEXTURE, all.iridescence),
        of_data(layout::IRIDESCENCE_THICKNESS_TEXTURE, all.iridescence_thickness),
    ]
    .into_iter()
    .flatten()
}

fn texture_record(texture: &Texture, role: u32, values: ImageValues, texels: &mut Texels<'_>) -> TextureRecord {
    let wrap = |wrap| match wrap {
        Wrap::Repeat => WRAP_REPEAT,
        Wrap::Mirror => WRAP_MIRROR,
        Wrap::Clamp => WRAP_CLAMP,
    };
    let [u, v] = texture.wrap.map(wrap);
    let bit = |is: bool, bit: u32| if is { bit } else { 0 };
    let image = texels.add(texture.image, values, texture.is_mipmapped);
    let row = |row: [f32; 3]| [row[0], row[1], row[2], 0.0];
    TextureRecord {
        first: image.first,
        size: image.width | (image.height << 16),
        flags: u
            | (v << 2)
            | bit(texture.is_linear, LINEAR_BIT)
            | bit(values.are_colors(), SRGB_BIT)
            | bit(texture.uv_set == 1, SECOND_UV_BIT)
            | (role << TEXTURE_ROLE_SHIFT),
        levels: image.levels,
        transform: texture.transform.map(row),
    }
}
