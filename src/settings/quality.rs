//! Sets of settings for pictures of one quality.

use super::Settings;

/// Purposes of a picture: each stands for a set of photons, samples and final gathering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// To look at while a scene is made.
    Draft,
    /// Clean where light is smooth, and at edges.
    #[default]
    Normal,
    /// Clean edges and penumbrae as well.
    High,
    /// Best that the program can do in one pass.
    Final,
}

/// Photons of the global and of the caustic map, neighbours of an estimate, samples of a pixel and
/// most of them, samples of its light, rays of final gathering, pixels between their points, and
/// the radius of the filter, pixels.
type Row = ([u32; 2], u32, u32, u32, u32, u32, u32, f32);

impl Quality {
    /// Width and height of a picture that has all photons of a quality, and of one that has the
    /// fewest; in pixels.
    pub const WHOLE: (u32, u32) = (256, 256);
    /// See [`Self::WHOLE`].
    pub const LEAST: (u32, u32) = (64, 64);

    /// All of them, the quickest first.
    pub const ALL: [Self; 4] = [Self::Draft, Self::Normal, Self::High, Self::Final];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["draft", "normal", "high", "final"][self as usize]
    }

    fn row(self) -> Row {
        match self {
            Self::Draft => ([30_000; 2], 50, 1, 1, 2, 32, 4, 16.0),
            Self::Normal => ([200_000, 100_000], 50, 4, 64, 4, 64, 2, 8.0),
            Self::High => ([300_000; 2], 50, 16, 128, 4, 128, 2, 8.0),
            Self::Final => ([1_000_000; 2], 50, 64, 256, 4, 256, 1, 4.0),
        }
    }

    /// Settings for a picture of that size: those of [`Self::settings`], with fewer photons for a
    /// small picture. Between [`Self::LEAST`] and [`Self::WHOLE`], those of the global map are in
    /// proportion to the number of pixels, so that an estimate is as wide in pixels. Those of the
    /// caustic map are in proportion to its root: lines of light are finer than pixels.
    #[must_use]
    pub fn settings_for(self, size: (u32, u32)) -> Settings {
        for_size(self.settings(), size)
    }

    /// The same without final gathering, as [`Self::without_final_gather`].
    #[must_use]
    pub fn without_final_gather_for(self, size: (u32, u32)) -> Settings {
        for_size(self.without_final_gather(), size)
    }

    /// The defaults of [`Settings`], with those of this quality.
    #[must_use]
    pub fn settings(self) -> Settings {
        let (photons, neighbors, spp, max_spp, light_samples, rays, spacing, radius) = self.row();
        Settings::default().with(|s| {
            [s.photons.global, s.photons.caustic] = photons;
            s.photons.final_gather = rays;
            s.estimate.neighbors = neighbors;
            s.estimate.gather_spacing = spacing;
            s.estimate.gather_radius = radius;
            s.picture.spp = spp;
            s.picture.max_spp = (max_spp > spp).then_some(max_spp);
            s.picture.light_samples = light_samples;
        })
    }

    /// The same without final gathering: light over other surfaces is estimated from photons where
    /// it is seen, over more of them.
    #[must_use]
    pub fn without_final_gather(self) -> Settings {
        let plain = Settings::default();
        self.settings().with(|s| {
            s.photons.global = s.photons.caustic;
            s.photons.final_gather = 0;
            s.estimate = plain.estimate;
            s.picture.max_spp = None;
        })
    }
}

/// The settings with photons for a picture of that size.
fn for_size(settings: Settings, size: (u32, u32)) -> Settings {
    let pixels = |(width, height): (u32, u32)| f64::from(width) * f64::from(height);
    let (least, whole) = (pixels(Quality::LEAST), pixels(Quality::WHOLE));
    let part = pixels(size).clamp(least, whole) / whole;
    settings.with(|s| {
        s.photons.global = (f64::from(s.photons.global) * part) as u32;
        s.photons.caustic = (f64::from(s.photons.caustic) * part.sqrt()) as u32;
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_pictures_have_photons_in_proportion() {
        for quality in Quality::ALL {
            let photons = |size| quality.settings_for(size).photons.global;
            assert_eq!(quality.settings_for((256, 256)), quality.settings());
            assert_eq!(quality.settings_for((65_535, 65_535)), quality.settings());
            assert_eq!(2 * photons((512, 64)), photons((256, 256)), "pixels count, whatever their shape");
            assert_eq!(photons((256, 256)) / 16, photons((64, 64)));
            assert_eq!(quality.settings_for((1, 1)), quality.settings_for((64, 64)));
            assert_eq!(quality.settings_for((64, 64)).picture, quality.settings().picture);
            assert_eq!(quality.without_final_gather_for((256, 256)), quality.without_final_gather());
        }
        let plain = Quality::Normal.without_final_gather_for((128, 128)).photons;
        assert_eq!((plain.global, plain.caustic), (25_000, 50_000), "those of the defaults");
    }

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
