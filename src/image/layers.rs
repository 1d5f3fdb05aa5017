//! Table of output layers, from the device's sums to the channels of a file.
//!
//! To add a layer: add a row to [`LAYERS`], or to [`EXTRA_LAYERS`] if only some want it, and the
//! line in `shaders/trace_camera.wesl` that writes its numbers into the sample's rows (`FirstHit`;
//! with more than those have room for, [`crate::layout::LAYER_ROWS`] grows). Film, frame and file
//! follow from the tables.

use serde::{Deserialize, Serialize};

use crate::{map_kind::MapKind, settings::ExtraLayers};

/// Rule by which the sums over a pixel's samples become its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Mean over all samples.
    PerSample,
    /// Mean over the samples whose first ray hit something; 0 if none did.
    PerHit,
    /// Mean over what the layer counts itself, by a number after those of its channels; 0 if that
    /// is 0.
    PerCount,
}

/// Components of the radiance, each by another estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightComponent {
    /// Emission that camera paths meet, and the light of rough lobes.
    Emission,
    /// Direct light, by shadow rays.
    Direct,
    /// Light of a photon map; with final gathering, that of the global map is all light over other
    /// surfaces.
    Map(MapKind),
}

/// Sources of the numbers of an extra layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The samples' rows, as [`Layer::source`].
    Rows((usize, usize)),
    /// A component of the radiance.
    Component(LightComponent),
    /// Radius and number of photons of a map's estimates.
    Estimate(MapKind),
    /// Nowhere: all are 0.
    Nothing,
}

/// A layer that a picture has on request.
#[derive(Clone, Copy, Debug)]
pub struct ExtraLayer {
    /// The request.
    pub of: ExtraLayers,
    /// Names of its channels.
    pub channels: &'static [&'static str],
    /// Source of its numbers.
    pub source: Source,
    /// Rule by which sums become a mean.
    pub rule: Rule,
}

/// One layer: a few numbers for each pixel.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// Name of the layer in [`super::Frame::layer`].
    pub name: &'static str,
    /// Names of its channels in an OpenEXR file.
    pub channels: &'static [&'static str],
    /// Start of its sums in [`crate::layout::PixelSums`]: row, and number in the row.
    pub source: (usize, usize),
    /// Rule by which the sums become a mean.
    pub rule: Rule,
    /// Value of channels that a file lacks; `None`: such a file is refused.
    pub missing: Option<f32>,
}

/// Sums of hits in [`crate::layout::PixelSums`]: row, and number in the row.
pub const HITS: (usize, usize) = (2, 3);
/// Start of the sums of their positions.
pub const POSITIONS: (usize, usize) = (3, 0);

/// All layers.
pub const LAYERS: [Layer; 5] = [
    Layer { name: "radiance", channels: &["R", "G", "B"], source: (0, 0), rule: Rule::PerSample, missing: None },
    Layer { name: "alpha", channels: &["A"], source: HITS, rule: Rule::PerSample, missing: Some(1.0) },
    Layer { name: "depth", channels: &["Z"], source: (1, 3), rule: Rule::PerHit, missing: Some(0.0) },
    Layer { name: "normal", channels: &["N.X", "N.Y", "N.Z"], source: (1, 0), rule: Rule::PerHit, missing: Some(0.0) },
    Layer {
        name: "albedo",
        channels: &["albedo.R", "albedo.G", "albedo.B"],
        source: (2, 0),
        rule: Rule::PerHit,
        missing: Some(0.0),
    },
];

/// A row of [`EXTRA_LAYERS`].
const fn extra(of: ExtraLayers, channels: &'static [&'static str], source: Source, rule: Rule) -> ExtraLayer {
    ExtraLayer { of, channels, source, rule }
}

/// The layers that a picture has on request. Those of [`ExtraLayers::Lights`] follow the scene's
/// lights, and mattes have no sums.
pub const EXTRA_LAYERS: [ExtraLayer; 9] = [
    extra(
        ExtraLayers::Components,
        &["emission.R", "emission.G", "emission.B"],
        Source::Component(LightComponent::Emission),
        Rule::PerSample,
    ),
    extra(
        ExtraLayers::Components,
        &["direct.R", "direct.G", "direct.B"],
        Source::Component(LightComponent::Direct),
        Rule::PerSample,
    ),
    extra(
        ExtraLayers::Components,
        &["global.R", "global.G", "global.B"],
        Source::Component(LightComponent::Map(MapKind::Global)),
        Rule::PerSample,
    ),
    extra(
        ExtraLayers::Components,
        &["caustic.R", "caustic.G", "caustic.B"],
        Source::Component(LightComponent::Map(MapKind::Caustic)),
        Rule::PerSample,
    ),
    extra(
        ExtraLayers::Estimates,
        &["globalEstimate.radius", "globalEstimate.photons"],
        Source::Estimate(MapKind::Global),
        Rule::PerCount,
    ),
    extra(
        ExtraLayers::Estimates,
        &["causticEstimate.radius", "causticEstimate.photons"],
        Source::Estimate(MapKind::Caustic),
        Rule::PerCount,
    ),
    extra(ExtraLayers::Position, &["position.X", "position.Y", "position.Z"], Source::Rows(POSITIONS), Rule::PerHit),
    extra(ExtraLayers::Uv, &["UV.U", "UV.V"], Source::Rows((4, 0)), Rule::PerHit),
    extra(ExtraLayers::Motion, &["motion.X", "motion.Y"], Source::Nothing, Rule::PerHit),
];

/// Index in [`LAYERS`] of the layer of that name.
///
/// # Panics
/// If there is no such layer.
pub(crate) fn layer_index(name: &str) -> usize {
    LAYERS.iter().position(|layer| layer.name == name).unwrap_or_else(|| panic!("no layer {name}"))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{EXTRA_LAYERS, LAYERS, Source};
    use crate::layout::LAYER_ROWS;

    #[test]
    fn layers_have_sources_and_channels_of_their_own() {
        let (mut sources, mut channels, mut count) = (BTreeSet::new(), BTreeSet::<&str>::new(), 0);
        let mut add = |(row, first): (usize, usize), of: &[&'static str]| {
            assert!(row <= LAYER_ROWS && first + of.len() <= 4, "{of:?}");
            sources.extend((first..).take(of.len()).map(|number| (row, number)));
            count += of.len();
        };
        for layer in LAYERS {
            add(layer.source, layer.channels);
            channels.extend(layer.channels);
        }
        let mut named = channels.len();
        for layer in EXTRA_LAYERS {
            if let Source::Rows(source) = layer.source {
                add(source, layer.channels);
            }
            channels.extend(layer.channels);
            named += layer.channels.len();
        }
        assert!(!sources.contains(&(0, 3)), "the number of samples left out is no layer");
        assert_eq!((sources.len(), channels.len()), (count, named));
    }
}
