//! Questions: the claims that a figure can test.

use serde::Serialize;

/// A claim of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Question {
    Energy,
    GatherDominates,
    TimeWithNeighbors,
    TimeWithPhotons,
    Proportion,
    NoiseForBias,
    CornersBright,
    DirectAgrees,
    DeltaShadows,
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
