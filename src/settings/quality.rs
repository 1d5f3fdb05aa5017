//! Sets of settings for pictures of one quality.

use super::Settings;

/// Purposes of a picture: each stands for a set of photons, samples and final gathering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// To look at while a scene is made.
    Draft,
    /// Clean where light is smooth; edges of 4 samples.
    #[default]
    Normal,
    /// Clean edges and penumbrae as well.
    High,
    /// Best that the program can do in one pass.
    Final,
}

/// Photons of each map, neighbours of an estimate, samples of a pixel and of its light, rays of
/// final gathering, pixels between their points, and the radius of the filter, pixels.
type Row = (u32, u32, u32, u32, u32, u32, f32);

impl Quality {
    /// All of them, the quickest first.
    pub const ALL: [Self; 4] = [Self::Draft, Self::Normal, Self::High, Self::Final];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["draft", "normal", "high", "final"][self as usize]
    }

    fn row(self) -> Row {
        match self {
            Self::Draft => (30_000, 50, 1, 2, 32, 4, 16.0),
            Self::Normal => (100_000, 50, 4, 4, 64, 2, 8.0),
            Self::High => (300_000, 50, 16, 4, 128, 2, 8.0),
            Self::Final => (1_000_000, 50, 64, 4, 256, 1, 4.0),
        }
    }

    /// The defaults of [`Settings`], with those of this quality.
    #[must_use]
    pub fn settings(self) -> Settings {
        let (photons, neighbors, spp, light_samples, rays, spacing, radius) = self.row();
        Settings::default().with(|s| {
            s.photons.global = photons;
            s.photons.caustic = photons;
            s.photons.final_gather = rays;
            s.estimate.neighbors = neighbors;
            s.estimate.gather_spacing = spacing;
            s.estimate.gather_radius = radius;
            s.picture.spp = spp;
            s.picture.light_samples = light_samples;
        })
    }

    /// The same without final gathering: light over other surfaces is estimated from photons where
    /// it is seen, over more of them.
    #[must_use]
    pub fn without_final_gather(self) -> Settings {
        let plain = Settings::default();
        self.settings().with(|s| {
            s.photons.final_gather = 0;
            s.estimate = plain.estimate;
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_takes_more_work_than_the_one_before() {
        let work = |quality: Quality| {
            let s = quality.settings();
            s.check().expect("in range");
            (s.photons.global, s.picture.spp, s.photons.final_gather)
        };
        for pair in Quality::ALL.windows(2) {
            let (less, more) = (work(pair[0]), work(pair[1]));
            assert!(less.0 < more.0 && less.1 < more.1 && less.2 < more.2, "{pair:?}");
        }
        assert_eq!(Quality::Normal.without_final_gather(), Settings::default());
    }
}
