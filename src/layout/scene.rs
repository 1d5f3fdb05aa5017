//! The scene on the device: tree, primitives, materials, textures, media, environment.

use bytemuck::{Pod, Zeroable};

use super::limits::BVH_INDEX_BITS;

/// One interior node of the BVH: boxes and kinds of its children. It consists of vectors of four
/// words, which software Vulkan reads fastest. Interior children come before leaves and are
/// consecutive, as are the primitives of all its leaves. Made by `BvhNode::new` in
/// `src/bvh/node.rs`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct BvhNode {
    /// Words 0 to 2: lower corner of the box around all children, metres, as bits of floats. Word
    /// 3: the shape. Eight bits for each axis are the exponent of its unit, biased as in a float.
    /// From bit 24 on, two bits for each child are the number of primitives of a leaf, less one.
    pub grid: [u32; 4],
    /// Words 0 to 2: for each axis the lower bounds of the children's boxes, eight bits each, in
    /// units from the corner. Word 3: index of the first interior child in 28 bits, above it the
    /// number of interior children.
    pub low: [u32; 4],
    /// Words 0 to 2: the upper bounds. Word 3: index of the leaves' first primitive in 28 bits,
    /// above it the number of all children.
    pub high: [u32; 4],
}

/// Set in [`Primitive::material`] when the primitive is a sphere.
pub const SPHERE_BIT: u32 = 0x8000_0000;

/// Set there when light passes through the primitive's surface, a pane or glass: where surfaces
/// coincide, the others are met first.
pub const TRANSMITS_BIT: u32 = 0x4000_0000;
/// Set there when another surface lies in the same plane: hits within rounding are one interface.
pub const CONTACT_BIT: u32 = 0x2000_0000;
/// Position in [`Primitive::id`] of the rank of a surface among those in contact with it, and the
/// largest one; the mask of the index below it.
pub const RANK_SHIFT: u32 = 28;
pub const MAX_RANK: u32 = 15;
pub const ID_MASK: u32 = (1 << RANK_SHIFT) - 1;
/// Position in the material of the slot of the solid that the primitive bounds, and its mask.
pub const SLOT_SHIFT: u32 = 22;
pub const SLOT_MASK: u32 = 127;
/// Number of slots, and the slot of surfaces that bound no solid.
pub const NO_SLOT: u32 = 127;
/// Set there when parts of the surface are not there: rays ask for its opacity.
pub const ALPHA_BIT: u32 = 1 << 21;
/// Set there when rays to lights pass the surface.
pub const CLEAR_BIT: u32 = 1 << 20;
/// Mask there of the index into the materials.
pub const MATERIAL_MASK: u32 = CLEAR_BIT - 1;
/// In place of the primitive that a path has left: none.
pub const NOTHING_LEFT: u32 = (1 << BVH_INDEX_BITS) - 1;
/// Surfaces that a path of light through mirrors and glass may meet beyond its diffuse bounces.
pub const CHAIN_LIMIT: u32 = 512;
/// Roughness below which a lobe is perfectly specular: narrower than a pixel.
pub const SHARP_ROUGHNESS: f32 = 0.03;
/// Fraction of metal from which on a surface casts caustics.
pub const METAL: f32 = 0.5;
/// Units of lost light in a camera path of weight 1, see [`Counters::lost`](super::Counters::lost).
pub const LOST_SCALE: u32 = 4096;

/// A triangle `v0, v0 + e1, v0 + e2`, or a sphere with centre `v0` and radius `e1.x`, in the order
/// of the BVH's leaves.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Primitive {
    pub v0: [f32; 3],
    /// Index into the materials, with [`SPHERE_BIT`] for a sphere; on the device also
    /// [`TRANSMITS_BIT`], [`CONTACT_BIT`], [`ALPHA_BIT`], [`CLEAR_BIT`] and the slot at
    /// [`SLOT_SHIFT`].
    pub material: u32,
    pub e1: [f32; 3],
    /// Index of the primitive in the scene before the BVH reordered it; on the device with its rank
    /// among those in contact with it at [`RANK_SHIFT`].
    pub id: u32,
    pub e2: [f32; 3],
    /// Index of the primitive's first [`Light`](super::Light), plus one; 0 if it does not emit
    /// light.
    pub emitter: u32,
}

/// In place of [`Primitive::emitter`]: the primitive is the box around an instance, with its lower
/// corner `v0` and its diagonal `e1`. Its material is the index of the [`Instance`].
pub const INSTANCE: u32 = u32::MAX;

/// A shared mesh in one place. Its primitives are numbered as if they were stored for themselves,
/// after all that are. The first of the table is none: its numbers are those of the whole table.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Instance {
    /// Rows of the transform from the mesh to the scene.
    pub to_scene: [[f32; 4]; 3],
    /// Rows of the inverse of its linear part. After the first: number of the first primitive.
    pub from_scene_x: [f32; 3],
    pub first: u32,
    /// After the second: index of the first of the mesh's primitives as they are stored; of the
    /// first of the table, how many instances follow.
    pub from_scene_y: [f32; 3],
    pub stored: u32,
    /// After the third: root of the mesh's tree.
    pub from_scene_z: [f32; 3],
    pub root: u32,
}

/// Texels of an [`Instance`].
pub const INSTANCE_TEXELS: u32 = 6;

/// Interpolated normals of a triangle's corners, octahedral (see
/// [`octahedral`](super::octahedral())); unused for spheres.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Normals {
    pub n0: u32,
    pub n1: u32,
    pub n2: u32,
    /// Lowest bit: the corners' normals all equal the geometric one, so that the surface is flat
    /// and the rest need not be read. Other bits: index of the triangle's [`Attributes`] plus one,
    /// 0 for none.
    pub attributes: u32,
}

/// Texels in a row of a table (`gpu::Table`): the maximum width of a texture that every device
/// supports.
pub const TABLE_COLUMNS: u32 = 2048;

/// Kinds of [`MaterialRecord`].
pub const DIFFUSE: u32 = 0;
pub const MIRROR: u32 = 1;
/// Closed solid with an index of refraction.
pub const GLASS: u32 = 2;
/// Thin pane: light goes straight through.
pub const PANE: u32 = 3;

/// Diffuse base under a dielectric coat, or metal.
pub const LAYERED: u32 = 4;

/// Texels of a [`MaterialRecord`].
pub const MATERIAL_TEXELS: u32 = 10;

/// Bits of [`MaterialRecord::flags`]: the back emits as much as the front; the surface is there
/// where its opacity reaches the cutoff; its opacity is its coverage.
pub const DOUBLE_SIDED_BIT: u32 = 1;
pub const MASK_BIT: u32 = 2;
pub const BLEND_BIT: u32 = 4;
/// The surface is seen in its base colour, whatever lights it.
pub const UNLIT_BIT: u32 = 8;
/// What of it is glass casts caustics however rough it is.
pub const SMALL_GLASS_BIT: u32 = 16;

/// Factors of a material, and where its textures are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MaterialRecord {
    /// Base colour: albedo of the diffuse lobe, reflectance of metal, tint of glass. Each 0..1.
    pub color: [f32; 3],
    /// One of [`DIFFUSE`] … [`LAYERED`].
    pub kind: u32,
    /// Radiance that the front side emits, W/(m² sr).
    pub emission: [f32; 3],
    /// Index of refraction of glass and panes.
    pub ior: f32,
    /// 0: perfectly specular lobes.
    pub roughness: f32,
    pub metallic: f32,
    /// Fraction of the light within glass that is transmitted.
    pub transmission: f32,
    /// [`DOUBLE_SIDED_BIT`], [`MASK_BIT`], [`BLEND_BIT`], [`UNLIT_BIT`], [`SMALL_GLASS_BIT`].
    pub flags: u32,
    /// Reflectance of the coat along the normal, without its strength.
    pub f0: [f32; 3],
    /// Strength of the coat.
    pub specular: f32,
    pub normal_scale: f32,
    pub opacity: f32,
    /// Opacity from which on a masked surface is there.
    pub cutoff: f32,
    /// Fraction of the diffuse light that leaves on the other side, and its colour.
    pub diffuse_transmission: f32,
    pub diffuse_transmission_color: [f32; 3],
    pub clearcoat: f32,
    pub clearcoat_roughness: f32,
    pub clearcoat_normal_scale: f32,
    pub anisotropy: f32,
    /// Radians.
    pub anisotropy_rotation: f32,
    pub sheen_color: [f32; 3],
    pub sheen_roughness: f32,
    pub iridescence: f32,
    pub iridescence_ior: f32,
    /// Thickness of the film where its texture is 0 and where it is 1, nanometres.
    pub iridescence_thickness: [f32; 2],
    /// Texel of the table of materials where its [`TextureRecord`]s begin, in the order of their
    /// roles.
    pub first_texture: u32,
    /// Bit 1 << role for each texture that it has.
    pub textures: u32,
    pub pad: [u32; 2],
}

/// A texture of a material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TextureRecord {
    /// First texel of the image.
    pub first: u32,
    /// Width, and height shifted by 16 bits.
    pub size: u32,
    /// Two bits each for what lies beyond the borders of u and v ([`WRAP_REPEAT`] …), then
    /// [`LINEAR_BIT`], [`SRGB_BIT`], [`SECOND_UV_BIT`]; the texture's role from
    /// [`TEXTURE_ROLE_SHIFT`] on.
    pub flags: u32,
    /// The image, and smaller versions of it that follow.
    pub levels: u32,
    /// Rows of the transform of texture coordinates.
    pub transform: [[f32; 4]; 2],
}

/// Texels beyond the border of an image: the image again, mirrored, or the border's texels.
pub const WRAP_REPEAT: u32 = 0;
pub const WRAP_MIRROR: u32 = 1;
pub const WRAP_CLAMP: u32 = 2;
/// Texels are interpolated.
pub const LINEAR_BIT: u32 = 16;
/// Colours are stored by the sRGB curve.
pub const SRGB_BIT: u32 = 32;
/// The second set of texture coordinates is read.
pub const SECOND_UV_BIT: u32 = 64;
pub const TEXTURE_ROLE_SHIFT: u32 = 8;

/// Texels of a [`TextureRecord`].
pub const TEXTURE_TEXELS: u32 = 3;

/// Roles: what a texture is a factor of.
pub const BASE_COLOR_TEXTURE: u32 = 0;
pub const METALLIC_ROUGHNESS_TEXTURE: u32 = 1;
pub const NORMAL_TEXTURE: u32 = 2;
pub const EMISSION_TEXTURE: u32 = 3;
pub const SPECULAR_TEXTURE: u32 = 4;
pub const SPECULAR_COLOR_TEXTURE: u32 = 5;
pub const TRANSMISSION_TEXTURE: u32 = 6;
pub const DIFFUSE_TRANSMISSION_TEXTURE: u32 = 7;
pub const DIFFUSE_TRANSMISSION_COLOR_TEXTURE: u32 = 8;
pub const CLEARCOAT_TEXTURE: u32 = 9;
pub const CLEARCOAT_ROUGHNESS_TEXTURE: u32 = 10;
pub const CLEARCOAT_NORMAL_TEXTURE: u32 = 11;
pub const SHEEN_COLOR_TEXTURE: u32 = 12;
pub const SHEEN_ROUGHNESS_TEXTURE: u32 = 13;
pub const ANISOTROPY_TEXTURE: u32 = 14;
pub const IRIDESCENCE_TEXTURE: u32 = 15;
pub const IRIDESCENCE_THICKNESS_TEXTURE: u32 = 16;

/// Values at the corners of a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Attributes {
    /// Texture coordinates, both sets of each corner.
    pub uvs: [[f32; 4]; 3],
    /// Factors on base colour and opacity.
    pub colors: [[f32; 4]; 3],
    /// Tangents, octahedral; the lowest bit is set where the bitangent is turned.
    pub tangents: [u32; 3],
    pub pad: u32,
}

/// Texels of [`Attributes`].
pub const ATTRIBUTE_TEXELS: u32 = 7;

/// The medium inside a solid.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Medium {
    /// Factor on light that passes the surface of the solid, each 0..1.
    pub tint: [f32; 3],
    /// Index of refraction.
    pub ior: f32,
    /// Absorption coefficient, 1/m.
    pub absorption: [f32; 3],
    /// 20 over the Abbe number; 0 for an index that does not depend on the wavelength.
    pub dispersion: f32,
}

/// Sphere around all geometry.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SceneSphere {
    /// Metres.
    pub center: [f32; 3],
    pub radius: f32,
}

/// Sphere that photon paths are aimed at.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Target {
    /// Metres.
    pub center: [f32; 3],
    pub radius: f32,
    /// Fraction of the paths that are aimed at it whatever its size; 0 to 1 in all. The others are
    /// shared out by size.
    pub share: f32,
    /// The same of paths of parallel light and of the environment.
    pub parallel_share: f32,
    pub pad0: f32,
    pub pad1: f32,
}

/// Size and rotation of the environment map.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct EnvironmentInfo {
    /// Pixels of the environment map; 0 and 0 without one.
    pub columns: u32,
    pub rows: u32,
    /// Cosine and sine of its rotation about +Y.
    pub rotation_cos: f32,
    pub rotation_sin: f32,
}
