//! Images, their use by materials, and what the corners of triangles carry for them.

use glam::{Vec2, Vec4};

/// An image of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Name in messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// RGBA as the file stores it, row by row from the top; colours are not yet linear.
    pub texels: Vec<[u8; 4]>,
}

/// Texels beyond the border of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image mirrored, then the image again.
    Mirror,
    /// The texels of the border.
    Clamp,
}

/// An image as a property of a material samples it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Index into [`Scene::images`](super::Scene::images).
    pub image: u32,
    /// Along u and v.
    pub wrap: [Wrap; 2],
    /// Texels are interpolated; otherwise the nearest counts.
    pub is_linear: bool,
    /// Smaller versions of the image are read where it is seen from afar.
    pub is_mipmapped: bool,
    /// Index in [`Attributes::uvs`].
    pub uv_set: u32,
    /// Rows of the transform of texture coordinates: u' = row 0 · (u, v, 1), v' = row 1 · (u, v, 1)
    /// (KHR_texture_transform).
    pub transform: [[f32; 3]; 2],
}

impl Texture {
    /// The transform that changes nothing.
    pub const IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
}

/// Sets of texture coordinates that a triangle may have.
pub const UV_SETS: usize = 2;

/// Values at the corners of a triangle, interpolated across its face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attributes {
    /// Texture coordinates; v points down, the image covers 0 to 1.
    pub uvs: [[Vec2; 3]; UV_SETS],
    /// Factors on base colour and opacity, linear.
    pub colors: [Vec4; 3],
    /// Unit tangents of the normal map, and ±1 as in glTF: the bitangent is w · (normal ×
    /// tangent). 0 without a normal map.
    pub tangents: [Vec4; 3],
}

impl Attributes {
    /// In the order of the corners as they are now, see [`Triangle::is_turned`].
    ///
    /// [`Triangle::is_turned`]: super::Triangle::is_turned
    #[must_use]
    pub fn in_order(&self, is_turned: bool) -> Self {
        let mut own = *self;
        if is_turned {
            own.uvs.iter_mut().for_each(|uvs| uvs.swap(1, 2));
            own.colors.swap(1, 2);
            own.tangents.swap(1, 2);
        }
        own
    }
}

impl Default for Attributes {
    fn default() -> Self {
        Self { uvs: [[Vec2::ZERO; 3]; UV_SETS], colors: [Vec4::ONE; 3], tangents: [Vec4::ZERO; 3] }
    }
}
