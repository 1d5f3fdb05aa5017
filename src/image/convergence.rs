//! Estimated error of a picture of several passes: noise and bias.

use super::{bias_check::Checked, film::Film, layers::layer_index};
use crate::settings::Crop;

/// Fraction of the mean radiance of all pixels that is added to each pixel's own, so that dark
/// pixels do not decide. Where the mean is 1, the square of the error estimates relMSE.
const FLOOR: f64 = 0.1;
/// Fraction of a number of the picture that counts as right at least, whatever its noise and closer
/// estimates say.
const LEAST_RIGHT: f64 = 0.25;

/// Relative errors of a picture, root mean squares over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Standard error of the means.
    pub noise: f64,
    /// What the error is more than that.
    pub bias: f64,
}

impl ErrorEstimate {
    /// Estimates the errors of a film, or of the pixels of a part of the picture; `None` for one
    /// pass, and for a part without pixels in the film.
    #[must_use]
    pub fn of(film: &Film, region: Option<Crop>) -> Option<Self> {
        let frame = film.finish();
        let errors = film.standard_error("radiance")?;
        let biases = film.bias();
        let width = film.window.width as usize;
        let is_in = |pixel: usize| {
            let (column, row) = ((pixel % width) as u32 + film.window.column, (pixel / width) as u32 + film.window.row);
            region.is_none_or(|region| region.touches((column, row), (1, 1)))
        };
        let count = 3 * (0..frame.pixels()).filter(|pixel| is_in(*pixel)).count();
        let numbers =
            || frame.layer("radiance").iter().map(|x| f64::from(*x)).enumerate().filter(|(i, _)| is_in(i / 3));
        let radiance = frame.layer("radiance");
        let checked = film.check.as_ref().and_then(|check| check.numbers(radiance, film.whole, film.window));
        let checked = checked.map(|all| all.filter(|(place, _)| is_in(*place)).collect::<Vec<_>>());
        let floor = floor_of(numbers().map(|(_, x)| x));
        // A black picture is measured by the light that closer estimates find.
        let closer = || checked.iter().flatten().flat_map(|(_, of_pixel)| of_pixel.map(|number| number.closer));
        let floor = if floor > 0.0 { floor } else { floor_of(closer()) };
        // The right number's square, without bias: one sample that is far too bright does not hide
        // itself.
        let relative = |square: f64, right: f64| square / (right + floor).max(f64::MIN_POSITIVE);
        let mean_square = |of: &[f32]| {
            let right = |i: usize, x: f64| (x * x - f64::from(errors[i]).powi(2)).max(LEAST_RIGHT * x * x);
            let terms = numbers().map(|(i, x)| relative(f64::from(of[i]).powi(2), right(i, x)));
            terms.sum::<f64>() / count as f64
        };
        let noise = (count > 0).then(|| mean_square(&errors))?;
        let unexplained = |biases: Vec<f32>| {
            let ratio = film.bias_noise().unwrap_or(0.0);
            (mean_square(&biases) - ratio * ratio * noise).max(0.0)
        };
        // Squared error beyond the noise, of one pixel. The square of the right number is the
        // product of two independent estimates of it, of which a closer one is the noisier. Where
        // it is low by chance its distance is great: its noise is added, lest such weigh more.
        let beyond = |(place, checked): (usize, [Checked; 3])| {
            let of_channel = |c: usize| {
                let (x, error) = (f64::from(radiance[3 * place + c]).max(0.0), f64::from(errors[3 * place + c]));
                let closer = (checked[c].closer + checked[c].error).clamp(LEAST_RIGHT * x, x);
                relative(checked[c].square - error * error, x * closer)
            };
            (0..3).map(of_channel).sum::<f64>() / 3.0
        };
        let checked = checked.and_then(|all| mean_and_error(all.into_iter().map(beyond)));
        // Few passes find much by chance, of which only what exceeds nothing counts.
        let checked = checked.map(|(mean, error)| mean - error / f64::from(film.passes()));
        let more = checked.unwrap_or_else(|| biases.map_or(0.0, unexplained));
        Some(Self { noise: noise.sqrt(), bias: more.max(0.0).sqrt() })
    }

    /// Both errors together.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.noise.hypot(self.bias)
    }
}

/// Square of the fraction [`FLOOR`] of the mean of numbers.
fn floor_of(numbers: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = numbers.fold((0_u64, 0.0), |(count, sum), x| (count + 1, sum + x));
    (FLOOR * sum / count.max(1) as f64).powi(2)
}

/// Mean of the terms and its standard error; `None` if there are none.
fn mean_and_error(terms: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let sums = |(n, sum, squares): (f64, f64, f64), term: f64| (n + 1.0, sum + term, squares + term * term);
    let (n, sum, squares) = terms.fold((0.0, 0.0, 0.0), sums);
    let mean = sum / n;
    (n > 0.0).then(|| (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt()))
}

impl Film {
    /// Means as by [`Film::finish`], with the channels `standardError.C` and `bias.C` of radiance
    /// if the passes suffice for that.
    #[must_use]
    pub fn finish_with_errors(&self) -> super::Frame {
        let mut frame = self.finish();
        let names = super::layers::LAYERS[layer_index("radiance")].channels;
        for (layer, numbers) in [("standardError", self.standard_error("radiance")), ("bias", self.bias())] {
            for (c, name) in names.iter().enumerate() {
                let Some(numbers) = &numbers else { continue };
                let of_channel = numbers.iter().skip(c).step_by(names.len()).copied().collect();
                frame.add_extra(&format!("{layer}.{name}"), of_channel);
            }
        }
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::PixelGrid;

    /// Two pixels; the second varies between passes.
    fn film(passes: &[(f32, f64)]) -> Film {
        let window = Crop { column: 4, row: 2, width: 2, height: 1 };
        let one = |(value, bandwidth): &(f32, f64)| {
            let mut film = Film::new((8, 8), window, 1).with_bandwidth(*bandwidth);
            film.add((0, 0), &[[1.0, 1.0, 1.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]], 1);
            film.add((1, 0), &[[*value, *value, *value, 0.0], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]], 1);
            film
        };
        let mut merged = one(&passes[0]);
        passes[1..].iter().for_each(|pass| merged.merge(&one(pass)).expect("of one picture"));
        merged
    }

    #[test]
    fn noise_is_relative_and_bias_is_what_follows_the_radius() {
        let noisy = ErrorEstimate::of(&film(&[(0.5, 1.0), (1.5, 1.0), (0.5, 1.0), (1.5, 1.0)]), None).expect("passes");
        // Standard error (1/√3)/2 of one of two pixels, relative to 1 less its square, and 0.1².
        let expected = (1.0 / 12.0 / 2.0 / (11.0 / 12.0 + 0.01_f64)).sqrt();
        assert!((noisy.noise - expected).abs() < 1e-6 && noisy.bias == 0.0, "{noisy:?}");
        let biased = [(2.0, 1.0), (1.5, 0.5), (1.25, 0.25), (1.125, 0.125)];
        let estimate = ErrorEstimate::of(&film(&biased), None).expect("passes");
        assert!(estimate.bias > 0.1 && estimate.total() > estimate.noise, "{estimate:?}");
        assert_eq!(ErrorEstimate::of(&film(&biased[..1]), None), None, "one pass");
    }

    /// A film of a pass of 8 x 8 pixels of that value, and of a closer one at its only checked
    /// pixel.
    fn checked(value: f32, closer: f32) -> Film {
        let whole = Crop { column: 0, row: 0, width: 8, height: 8 };
        let filled = |size: (u32, u32), window: Crop, value: f32| {
            let mut film = Film::new(size, window, 1);
            let places = (0..window.height).flat_map(|row| (0..window.width).map(move |column| (column, row)));
            places.for_each(|place| {
                film.add(place, &[[value, value, value, 0.0], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]], 1)
            });
            film
        };
        let grid = PixelGrid::of((8, 8)).window(whole);
        filled((8, 8), whole, value).checked_by(&filled((grid.width, grid.height), grid, closer))
    }

    #[test]
    fn errors_are_distances_to_closer_estimates_less_their_noise() {
        let merged = |values: [f32; 4], closer: [f32; 4]| {
            let mut films = values.into_iter().zip(closer).map(|(value, closer)| checked(value, closer));
            let mut merged = films.next().expect("a pass");
            films.for_each(|film| merged.merge(&film).expect("of one picture"));
            ErrorEstimate::of(&merged, None).expect("passes")
        };
        let relative = |square: f64, right: f64| (square / (right + 0.01 * 1.3 * 1.3)).sqrt();
        let is_near = |a: f64, b: f64| (a - b).abs() < 1e-5;
        // The mean of the closer ones is 1, its variance 0.02/(3 · 4).
        let (even, around) = ([1.3; 4], [0.9, 1.1, 1.0, 1.0]);
        let right = 1.3 * (1.0 + (0.02_f64 / 12.0).sqrt());
        let estimate = merged(even, around);
        assert!(estimate.noise == 0.0 && is_near(estimate.bias, relative(0.09 - 0.02 / 12.0, right)), "{estimate:?}");
        // Noise of the picture is a part of that error.
        let noisy = [1.1, 1.5, 1.3, 1.3];
        let (noise, variance) = (merged(noisy, around), 0.08 / 12.0);
        assert!(is_near(noise.noise, relative(variance, 1.69 - variance)), "{noise:?}");
        assert!(is_near(noise.bias, relative(0.09 - 0.02 / 12.0 - variance, right)), "{noise:?}");
        // Passes that err oppositely: closer estimates say that their mean is right, by chance.
        let opposite = merged(noisy, [1.3; 4]);
        assert!(opposite.bias == 0.0 && opposite.noise == noise.noise, "{opposite:?}");
        assert_eq!(merged(even, [1.3; 4]).total(), 0.0, "control: no difference");
        // A black picture errs by the light that is missing, relative to a tenth of that.
        let black = merged([0.0; 4], [1.0; 4]);
        assert!(black.noise == 0.0 && is_near(black.bias, 10.0), "{black:?}");
        assert_eq!(merged([0.0; 4], [0.0; 4]).total(), 0.0, "control: it is black");
    }

    #[test]
    fn errors_of_numbers_that_have_no_square_are_finite() {
        for values in [[1e20, 3e20, 2e20, 2e20], [0.0, 3e38, 0.0, 0.0], [3e38, 1e38, 3e38, 3e38]] {
            let pass = |(value, radius): (f32, f64)| checked(value, value).with_bandwidth(radius);
            let mut films = values.into_iter().zip([1.0, 0.5, 0.25, 0.125]).map(pass);
            let mut merged = films.next().expect("a pass");
            films.for_each(|film| merged.merge(&film).expect("of one picture"));
            let estimate = ErrorEstimate::of(&merged, None).expect("passes");
            assert!(estimate.noise.is_finite() && estimate.bias.is_finite(), "{estimate:?}");
            assert!(estimate.noise > 1.0, "no less than it is: {estimate:?}");
            let frame = merged.finish_with_errors();
            assert!(frame.layer("radiance").iter().all(|x| x.is_finite()), "{values:?}");
            assert!(frame.extras().flat_map(|(_, numbers)| numbers).all(|x| x.is_finite()), "{values:?}");
        }
    }

    #[test]
    fn a_region_counts_its_own_pixels() {
        let film = film(&[(0.5, 1.0), (1.5, 1.0)]);
        let of = |column| ErrorEstimate::of(&film, Some(Crop { column, row: 0, width: 1, height: 8 }));
        assert_eq!(of(4).expect("a pixel").noise, 0.0);
        assert!(of(5).expect("a pixel").noise > 0.4);
        assert_eq!(of(6), None);
    }

    #[test]
    fn errors_are_channels_of_files() {
        let names =
            |film: &Film| film.finish_with_errors().extras().map(|(name, _)| name.to_owned()).collect::<Vec<_>>();
        let of = |layer: &str| ["R", "G", "B"].map(|c| format!("{layer}.{c}"));
        assert_eq!(names(&film(&[(1.0, 1.0), (2.0, 0.5)])), [of("standardError"), of("bias")].concat());
        assert_eq!(names(&film(&[(1.0, 1.0), (2.0, 1.0)])), of("standardError"));
        assert_eq!(names(&film(&[(1.0, 1.0)])), [""; 0]);
    }
}
