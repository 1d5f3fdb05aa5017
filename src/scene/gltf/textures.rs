//! Textures: which image each of them samples, and how.

use std::f32::consts::TAU;

use gltf::json;
use json::material::NormalTexture;
use json::texture::{Info, MagFilter, MinFilter, WrappingMode};
use json::validation::Checked;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::extensions::{BASISU, TEXTURE_TRANSFORM, WEBP};
use super::fault::{Notes, Read, fault};
use super::strict_json::typed;
use crate::scene::{Texture, Wrap};

/// In place of TEXCOORD_n: along what a material without such textures is anisotropic. Tangents of
/// the file, or those of TEXCOORD_0.
pub(super) const AXES: u32 = u32::MAX;

/// How messages name what a primitive lacks of what a material asks for.
pub(super) fn said(lacks: &[u32]) -> String {
    let mut lacks = lacks.to_vec();
    if lacks.contains(&AXES) && !lacks.contains(&0) {
        lacks.insert(0, 0);
    }
    let said = |set: &u32| if *set == AXES { "TANGENT".to_owned() } else { format!("TEXCOORD_{set}") };
    lacks.iter().map(said).collect::<Vec<_>>().join(" and no ")
}

/// A material's reference to a texture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference<'a> {
    /// Valid index into the file's textures.
    pub(super) texture: usize,
    tex_coord: u32,
    extensions: Option<&'a Map<String, Value>>,
}

impl<'a> From<&'a Info> for Reference<'a> {
    fn from(info: &'a Info) -> Self {
        let extensions = info.extensions.as_ref().map(|extensions| &extensions.others);
        Self { texture: info.index.value(), tex_coord: info.tex_coord, extensions }
    }
}

impl<'a> From<&'a NormalTexture> for Reference<'a> {
    fn from(info: &'a NormalTexture) -> Self {
        let extensions = info.extensions.as_ref().map(|extensions| &extensions.others);
        Self { texture: info.index.value(), tex_coord: info.tex_coord, extensions }
    }
}

/// Members of KHR_texture_transform.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Transform {
    offset: [f32; 2],
    rotation: f32,
    scale: [f32; 2],
    tex_coord: Option<u32>,
}

impl Default for Transform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

/// Checks the indices of all textures and images.
pub(super) fn check(root: &json::Root) -> Read<()> {
    let known = |index: usize, count: usize, place: &dyn Fn() -> String| {
        if index < count { Ok(()) } else { fault(place(), format!("{index} of {count}")) }
    };
    for (i, texture) in root.textures.iter().enumerate() {
        let place = format!("textures[{i}]");
        if let Some(sampler) = texture.sampler {
            known(sampler.value(), root.samplers.len(), &|| format!("{place}.sampler"))?;
        }
        if let Some(source) = own_source(texture) {
            known(source, root.images.len(), &|| format!("{place}.source"))?;
        }
        for name in [BASISU, WEBP] {
            if let Some(source) = extension_source(texture, name, &place)? {
                known(source, root.images.len(), &|| format!("{place}.extensions.{name}.source"))?;
            }
        }
    }
    for (i, image) in root.images.iter().enumerate() {
        if let Some(view) = image.buffer_view {
            known(view.value(), root.buffer_views.len(), &|| format!("images[{i}].bufferView"))?;
        }
    }
    Ok(())
}

/// The image that a texture names itself, for readers without its extensions.
fn own_source(texture: &json::Texture) -> Option<usize> {
    // The crate's number for none.
    Some(texture.source.value()).filter(|source| *source != u32::MAX as usize)
}

/// The image that an extension of a texture names.
fn extension_source(texture: &json::Texture, name: &str, place: &str) -> Read<Option<usize>> {
    let extension = texture.extensions.as_ref().and_then(|extensions| extensions.others.get(name));
    let Some(source) = extension.and_then(|extension| extension.get("source")) else { return Ok(None) };
    let index = source.as_u64().and_then(|source| usize::try_from(source).ok());
    index.map_or_else(
        || fault(format!("{place}.extensions.{name}.source"), format!("{source} is not the number of an image")),
        |index| Ok(Some(index)),
    )
}

/// The image of a texture; `None`, with a note, where it names none that can be read. Needs
/// [`check`].
pub(super) fn image(root: &json::Root, index: usize, notes: &mut Notes) -> Read<Option<usize>> {
    let (texture, place) = (&root.textures[index], format!("textures[{index}]"));
    let source = extension_source(texture, WEBP, &place)?.or(own_source(texture));
    if source.is_none() {
        notes.add(format!("{place} names no image that can be read, and is left out"));
    }
    Ok(source)
}

/// A texture without its image: the TEXCOORD_n that it is placed by, and how it is sampled. `place`
/// is that of the reference.
pub(super) fn sampled(
    root: &json::Root,
    reference: Reference<'_>,
    place: &str,
    notes: &mut Notes,
) -> Read<(u32, Texture)> {
    let transform = match reference.extensions.and_then(|extensions| extensions.get(TEXTURE_TRANSFORM)) {
        Some(transform) => {
            let place = format!("{place}.extensions.{TEXTURE_TRANSFORM}");
            let transform = typed::<Transform>(transform, &place)?;
            (transform.rows(&place)?, transform.tex_coord)
        }
        None => (Texture::IDENTITY, None),
    };
    let sampler =
        root.textures[reference.texture].sampler.map(|sampler| (sampler.value(), &root.samplers[sampler.value()]));
    let mut texture = Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        is_linear: true,
        is_mipmapped: true,
        uv_set: 0,
        transform: transform.0,
    };
    if let Some((i, sampler)) = sampler {
        let unknown = [sampler.wrap_s, sampler.wrap_t].contains(&Checked::Invalid)
            || sampler.mag_filter == Some(Checked::Invalid)
            || sampler.min_filter == Some(Checked::Invalid);
        if unknown {
            notes.add(format!("samplers[{i}]: what is not one of glTF's filters and wrappings is as by default"));
        }
        texture.wrap = [wrap(sampler.wrap_s), wrap(sampler.wrap_t)];
        texture.is_linear = sampler.mag_filter != Some(Checked::Valid(MagFilter::Nearest));
        let plain = [MinFilter::Nearest, MinFilter::Linear].map(|filter| Some(Checked::Valid(filter)));
        texture.is_mipmapped = !plain.contains(&sampler.min_filter);
    }
    Ok((transform.1.unwrap_or(reference.tex_coord), texture))
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}

impl Transform {
    /// Scale, then rotation, then offset. A rotation turns texture coordinates counterclockwise
    /// where v points down, as the extension's text and its examples say; its listing of GLSL, read
    /// by columns, turns the other way (KhronosGroup/glTF issue 1563).
    fn rows(&self, place: &str) -> Read<[[f32; 3]; 2]> {
        let ([sx, sy], [ox, oy]) = (self.scale, self.offset);
        let (s, c) = (self.rotation % TAU).sin_cos();
        let rows = [[c * sx, s * sy, ox], [-s * sx, c * sy, oy]];
        if rows.iter().flatten().all(|x| x.is_finite()) {
            Ok(rows)
        } else {
            fault(place, "is not a transform of finite numbers")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transform_scales_then_rotates_then_moves() {
        let rows =
            |transform: Value| Transform::deserialize(&transform).expect("a transform").rows("").expect("finite");
        assert_eq!(rows(serde_json::json!({})), Texture::IDENTITY);
        let turned =
            rows(serde_json::json!({ "offset": [0.5, 1], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2, 3] }));
        // u' = 3 v + 0.5, v' = -2 u + 1.
        let expected = [[0.0, 3.0, 0.5], [-2.0, 0.0, 1.0]];
        let near = turned.iter().flatten().zip(expected.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near, "{turned:?}");
        let endless = Transform { rotation: f32::INFINITY, ..Transform::default() };
        assert!(endless.rows("").is_err());
    }
}
