//! Table of output layers, from the device's sums to the channels of a file.
//!
//! To add a layer: add a row to [`LAYERS`], and the line in `shaders/trace_camera.wesl` that writes
//! its numbers into the sample's rows (`FirstHit`; with more than eight numbers in all,
//! [`crate::layout::LAYER_ROWS`] grows). Film, frame and file follow from the table.

/// Rule by which the sums over a pixel's samples become its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Mean over all samples.
    PerSample,
    /// Mean over the samples whose first ray hit something; 0 if none did.
    PerHit,
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

/// All layers.
pub const LAYERS: [Layer; 5] = [
    Layer { name: "radiance", channels: &["R", "G", "B"], source: (0, 0), rule: Rule::PerSample, missing: None },
    Layer { name: "alpha", channels: &["A"], source: (2, 3), rule: Rule::PerSample, missing: Some(1.0) },
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

    use super::LAYERS;
    use crate::layout::LAYER_ROWS;

    #[test]
    fn layers_have_sources_and_channels_of_their_own() {
        let (mut sources, mut channels, mut count) = (BTreeSet::new(), BTreeSet::<&str>::new(), 0);
        for layer in LAYERS {
            let (row, first) = layer.source;
            assert!(row <= LAYER_ROWS && first + layer.channels.len() <= 4, "{}", layer.name);
            sources.extend((first..).take(layer.channels.len()).map(|number| (row, number)));
            channels.extend(layer.channels);
            count += layer.channels.len();
        }
        assert!(!sources.contains(&(0, 3)), "the number of samples left out is no layer");
        assert_eq!((sources.len(), channels.len()), (count, count));
    }
}
