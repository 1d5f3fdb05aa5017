//! Small images and textured files built in the tests.

use std::io::Cursor;

use base64::Engine as _;
use image::{DynamicImage, ImageFormat, Rgba, RgbaImage};
use serde_json::{Value, json};
use support::gltf::{add_accessor, floats, lambert, push, triangle};

/// An image of four texels: red, green; blue, white of half opacity.
pub fn four() -> RgbaImage {
    let texels = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 128]];
    RgbaImage::from_fn(2, 2, |x, y| Rgba(texels[(x + 2 * y) as usize]))
}

/// An image of one colour.
pub fn uniform(width: u32, height: u32, texel: [u8; 4]) -> RgbaImage {
    RgbaImage::from_pixel(width, height, Rgba(texel))
}

/// The bytes of an image file.
pub fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).expect("it can be written");
    bytes.into_inner()
}

pub fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
    encoded(image, ImageFormat::Png)
}

/// An image in a data URI.
pub fn image_uri(bytes: &[u8]) -> Value {
    let text = base64::engine::general_purpose::STANDARD.encode(bytes);
    json!({ "uri": format!("data:image/png;base64,{text}") })
}

/// A triangle whose texture coordinates are its x and y, with a texture of [`four`] texels as its
/// base colour.
pub fn textured() -> Value {
    let mut gltf = triangle();
    gltf["images"] = json!([image_uri(&png(four()))]);
    gltf["textures"] = json!([{ "source": 0 }]);
    gltf["materials"][0] = lambert([1.0; 3]);
    gltf["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    let uvs = add_accessor(&mut gltf, &floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]), 5126, 3, "VEC2");
    gltf["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uvs.into();
    gltf
}

/// Adds an image of those bytes, and a texture of it. Returns the index of the texture.
pub fn add_texture(gltf: &mut Value, bytes: &[u8]) -> usize {
    let image = push(gltf, "images", image_uri(bytes));
    push(gltf, "textures", json!({ "source": image }))
}
