//! Reading a scene from a file.

use std::path::Path;

use super::{LoadOptions, contents::Scene};
use crate::Result;

impl Scene {
    /// Reads a `.gltf` or `.glb` file and the buffers beside it.
    ///
    /// # Errors
    /// [`crate::Error::Io`] where the file cannot be read; [`crate::Error::Scene`] with the JSON
    /// path of what is wrong in it.
    pub fn load(path: &Path) -> Result<Self> {
        Self::load_with(path, &LoadOptions::default())
    }

    /// Reads a file as [`Scene::load`], with options.
    ///
    /// # Errors
    /// As [`Scene::load`]; [`crate::Error::Setting`], which lists the scenes of the file, if the
    /// requested scene is not among them.
    pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Self> {
        super::gltf::load(path, options)
    }

    /// Reads the bytes of a `.gltf` or `.glb` file as if they were read from `path`, which need not
    /// exist. Buffers are searched beside it.
    ///
    /// # Errors
    /// As [`Scene::load_with`].
    pub fn read(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Self> {
        super::gltf::read(bytes, path, options)
    }
}
