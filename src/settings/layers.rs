//! Output layers that a picture has on request.

use serde::{Deserialize, Serialize};

/// Layers of a picture beside its radiance, alpha, depth, normal and albedo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExtraLayers {
    /// The components of the radiance, whose sum it is: emission that the camera sees, direct
    /// light, light of the global and of the caustic map.
    Components,
    /// The radiance that each group of lights gives. Each has photons of its own.
    Lights,
    /// Radius, and number of photons, of the estimates of each map.
    Estimates,
    /// Position of the first hit in the file's coordinates.
    Position,
    /// Texture coordinates of the first hit.
    Uv,
    /// Motion of the first hit across the picture: 0, since nothing moves.
    Motion,
    /// Cryptomatte of the names of nodes.
    Objects,
    /// Cryptomatte of the names of materials.
    Materials,
}

impl ExtraLayers {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Components,
        Self::Lights,
        Self::Estimates,
        Self::Position,
        Self::Uv,
        Self::Motion,
        Self::Objects,
        Self::Materials,
    ];
}
