//! Questions: the claims that a figure can test.

use serde::Serialize;

/// A claim of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Question {
    /// Constant total energy over n and k.
    Energy,
    /// Gather time as the largest fraction of the total time.
    GatherDominates,
    /// Growth of the gather time with k.
    TimeWithNeighbors,
    /// Logarithmic growth of the gather time with n.
    TimeWithPhotons,
    /// Optimal k that grows with n.
    Proportion,
    /// Noise exchanged for bias by a larger k.
    NoiseForBias,
    /// Excess brightness near concave corners.
    CornersBright,
    /// Equal direct light by photons and by shadow rays.
    DirectAgrees,
    /// Light by way of specular surfaces, which shadow rays omit and photons carry.
    DeltaShadows,
    /// Three times the light of three lights at the same cost.
    ThreeLights,
}

impl Question {
    /// Questions that a plane of n and k can answer.
    pub(super) const OF_A_PLANE: [Self; 7] = [
        Self::Energy,
        Self::GatherDominates,
        Self::TimeWithNeighbors,
        Self::TimeWithPhotons,
        Self::Proportion,
        Self::NoiseForBias,
        Self::CornersBright,
    ];
}
