//! Members of the extensions of materials that the crate does not know.

use gltf::json::{material::NormalTexture, texture::Info};
use serde::Deserialize;

/// KHR_materials_clearcoat.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Clearcoat {
    pub(super) clearcoat_factor: f32,
    pub(super) clearcoat_texture: Option<Info>,
    pub(super) clearcoat_roughness_factor: f32,
    pub(super) clearcoat_roughness_texture: Option<Info>,
    pub(super) clearcoat_normal_texture: Option<NormalTexture>,
}

/// KHR_materials_sheen.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Sheen {
    pub(super) sheen_color_factor: [f32; 3],
    pub(super) sheen_color_texture: Option<Info>,
    pub(super) sheen_roughness_factor: f32,
    pub(super) sheen_roughness_texture: Option<Info>,
}

/// KHR_materials_anisotropy.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Anisotropy {
    pub(super) anisotropy_strength: f32,
    pub(super) anisotropy_rotation: f32,
    pub(super) anisotropy_texture: Option<Info>,
}

/// KHR_materials_iridescence.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Iridescence {
    pub(super) iridescence_factor: f32,
    pub(super) iridescence_texture: Option<Info>,
    pub(super) iridescence_ior: f32,
    pub(super) iridescence_thickness_minimum: f32,
    pub(super) iridescence_thickness_maximum: f32,
    pub(super) iridescence_thickness_texture: Option<Info>,
}

impl Default for Iridescence {
    fn default() -> Self {
        Self {
            iridescence_factor: 0.0,
            iridescence_texture: None,
            iridescence_ior: 1.3,
            iridescence_thickness_minimum: 100.0,
            iridescence_thickness_maximum: 400.0,
            iridescence_thickness_texture: None,
        }
    }
}

/// KHR_materials_dispersion.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Dispersion {
    pub(super) dispersion: f32,
}

/// KHR_materials_diffuse_transmission.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct DiffuseTransmission {
    pub(super) diffuse_transmission_factor: f32,
    pub(super) diffuse_transmission_texture: Option<Info>,
    pub(super) diffuse_transmission_color_factor: [f32; 3],
    pub(super) diffuse_transmission_color_texture: Option<Info>,
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self {
            diffuse_transmission_factor: 0.0,
            diffuse_transmission_texture: None,
            diffuse_transmission_color_factor: [1.0; 3],
            diffuse_transmission_color_texture: None,
        }
    }
}

/// KHR_materials_pbrSpecularGlossiness.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SpecularGlossiness {
    pub(super) diffuse_factor: [f32; 4],
    pub(super) diffuse_texture: Option<Info>,
    pub(super) specular_factor: [f32; 3],
    pub(super) glossiness_factor: f32,
    pub(super) specular_glossiness_texture: Option<Info>,
}

impl Default for SpecularGlossiness {
    fn default() -> Self {
        Self {
            diffuse_factor: [1.0; 4],
            diffuse_texture: None,
            specular_factor: [1.0; 3],
            glossiness_factor: 1.0,
            specular_glossiness_texture: None,
        }
    }
}
