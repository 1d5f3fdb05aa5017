//! Files that are read and written: scenes, environment maps, pictures; good, bad and hostile ones.

mod assets;
mod exporters;
mod gltf_compressed;
mod gltf_files;
mod loading;
mod loading_attributes;
mod loading_geometry;
mod loading_materials;
mod loading_notes;
mod loading_textures;
mod loading_values;
mod loading_views;
mod outputs;
mod pictures;
