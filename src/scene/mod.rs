//! Scene description: geometry, materials, lights and cameras, independent of the file format.
//! Coordinates are metres, right-handed, +Y up, relative to [`Scene::center`].

mod camera;
mod complete_tree;
mod contents;
mod describe;
mod describe_materials;
mod emission_map;
mod environment;
mod gltf;
mod image_values;
mod instance;
mod light;
mod light_groups;
mod load;
mod material;
mod shape;
mod solids;
mod texel_map;
mod texture;
mod words;

pub use crate::settings::LoadOptions;
pub use camera::{Camera, Projection};
pub(crate) use complete_tree::{CompleteTree, Visit};
pub use contents::Scene;
pub use describe::{CameraInfo, EmitterInfo, LightInfo, SceneInfo};
pub use describe_materials::{ImageInfo, MaterialInfo, TextureInfo};
pub(crate) use emission_map::{Cut, EmissionMap, Emitted, Subtriangle};
pub use environment::Environment;
pub(crate) use image_values::ImageValues;
pub use instance::{Instance, SharedMesh};
pub(crate) use instance::{instance_bounds, reach_of_instances};
pub(crate) use light::spot_heights;
pub use light::{LUMENS_PER_WATT, Light, LightKind};
pub use material::{Alpha, Material, Medium, SHARP_ROUGHNESS, Surface, Textures};
pub(crate) use shape::vertex_bits;
pub use shape::{Bounds, Sphere, Triangle};
pub use solids::{NO_SLOT, Solids};
pub(crate) use solids::{Surfaces, hidden_backs};
pub use texture::{Attributes, Image, Texture, UV_SETS, Wrap};
