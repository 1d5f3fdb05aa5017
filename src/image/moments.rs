//! Second moments of the means of passes: their standard error and the regression on their radii.

use std::array;

use super::{
    film::Film,
    film_sums::{Bandwidth, LAYER_COUNT, Moments, finite},
    layers::layer_index,
};

impl Film {
    /// Notes the squared radius of the pass's estimates, relative to that of pass 0.
    #[must_use]
    pub fn with_bandwidth(self, factor: f64) -> Self {
        Self { bandwidth: Bandwidth::of_pass(factor), ..self }
    }

    /// Adds the moments of the passes of another film, before its sums, without cancellation (Chan,
    /// Golub and LeVeque 1983, "Algorithms for Computing the Sample Variance", equation 2.1).
    pub(super) fn merge_moments(&mut self, other: &Self) {
        let (n, m) = (f64::from(self.passes), f64::from(other.passes));
        // Weight of the product of the distances between both means.
        let weight = n * m / (n + m);
        let (here, there) = (self.means(), other.means());
        let shift = other.bandwidth.mean - self.bandwidth.mean;
        let mut moments = self.moments.take().unwrap_or_else(|| self.no_moments());
        for i in 0..LAYER_COUNT {
            let theirs = other.moments.as_ref().map(|moments| moments.deviations[i].as_slice());
            let distances = here[i].iter().zip(&there[i]).map(|(a, b)| f64::from(*b) - f64::from(*a));
            let products = distances.map(|d| d * d * weight);
            add(&mut moments.deviations[i], theirs, products);
        }
        let radiance = layer_index("radiance");
        let theirs = other.moments.as_ref().map(|moments| moments.with_bandwidth.as_slice());
        let distances = here[radiance].iter().zip(&there[radiance]).map(|(a, b)| f64::from(*b) - f64::from(*a));
        add(&mut moments.with_bandwidth, theirs, distances.map(|d| d * shift * weight));
        self.moments = Some(moments);
        self.bandwidth = Bandwidth {
            mean: self.bandwidth.mean + shift * m / (n + m),
            deviations: self.bandwidth.deviations + other.bandwidth.deviations + shift * shift * weight,
            inverse: (n * self.bandwidth.inverse + m * other.bandwidth.inverse) / (n + m),
        };
    }

    /// Standard error over the passes of each of a layer's means; the largest number where its
    /// square has none. `None` for one pass.
    ///
    /// # Panics
    /// If [`super::layers::LAYERS`] has no layer of that name.
    #[must_use]
    pub fn standard_error(&self, layer: &str) -> Option<Vec<f32>> {
        let (i, passes) = (layer_index(layer), f64::from(self.passes));
        let deviations = &self.moments.as_ref()?.deviations[i];
        let error = |deviations: &f32| match *deviations {
            f32::MAX => f32::MAX,
            deviations => (f64::from(deviations) / (passes - 1.0) / passes).sqrt() as f32,
        };
        Some(deviations.iter().map(error).collect())
    }

    /// Estimate of the bias of each of the means of radiance, by linear regression of the passes'
    /// means on their squared radii, to which the bias is proportional at first order (Silverman
    /// 1986, "Density Estimation", section 3.3); `None` unless passes differ in radius. It has a
    /// noise of its own, [`Self::bias_noise`] times the standard error.
    #[must_use]
    pub fn bias(&self) -> Option<Vec<f32>> {
        let moments = self.moments.as_ref().filter(|_| self.bandwidth.deviations > 0.0)?;
        let scale = self.bandwidth.mean / self.bandwidth.deviations;
        Some(moments.with_bandwidth.iter().map(|product| finite(f64::from(*product) * scale)).collect())
    }

    /// Standard error of [`Self::bias`] relative to [`Self::standard_error`], if the variance of a
    /// pass is inverse to its squared radius, as that of a number of photons relative to it is.
    #[must_use]
    pub fn bias_noise(&self) -> Option<f64> {
        let Bandwidth { mean, deviations, inverse } = self.bandwidth;
        let passes = f64::from(self.passes);
        // The variance v/f of a pass of squared radius f gives the mean the variance v Σ 1/f / n²,
        // and the slope v Σ (f − mean)²/f / deviations². The latter sum is n mean (mean inverse −
        // 1).
        let ratio = mean * (mean * inverse - 1.0).max(0.0) / inverse;
        (deviations > 0.0).then(|| mean * passes / deviations * ratio.sqrt())
    }

    /// The moments of one pass.
    fn no_moments(&self) -> Moments {
        Moments {
            deviations: array::from_fn(|i| vec![0.0; self.sums[i].len()]),
            with_bandwidth: vec![0.0; self.sums[layer_index("radiance")].len()],
        }
    }
}

/// Adds the moments of another film, and the products of the distances between both means.
fn add(moments: &mut [f32], theirs: Option<&[f32]>, products: impl Iterator<Item = f64>) {
    for (i, (moment, product)) in moments.iter_mut().zip(products).enumerate() {
        let theirs = theirs.map_or(0.0, |moments| f64::from(moments[i]));
        *moment = finite(f64::from(*moment) + theirs + product);
    }
}

#[cfg(test)]
mod tests {
    use crate::image::film::tests::film;

    #[test]
    fn passes_tell_their_standard_error() {
        let mut merged = film(&[1.0; 6], 4);
        assert_eq!(merged.standard_error("radiance"), None);
        for value in [2.0, 3.0, 6.0] {
            merged.merge(&film(&[value; 6], 4)).expect("they are of one picture");
        }
        // The values 1, 2, 3, 6 of four passes have the mean 3 and the variance 14/3.
        let error = merged.standard_error("radiance").expect("four passes")[0];
        assert!((error - (14.0_f32 / 3.0 / 4.0).sqrt()).abs() < 1e-6, "{error}");
        let mut equal = film(&[1.0; 6], 4);
        equal.merge(&film(&[1.0; 6], 4)).expect("they are of one picture");
        assert_eq!(equal.standard_error("radiance").expect("two passes")[0], 0.0, "control: equal passes");
    }

    #[test]
    fn passes_of_smaller_radii_tell_the_bias() {
        // Means 3 + 2 f of squared radii f: a bias of 2 times the mean of f.
        let bandwidths = [1.0, 0.5, 0.25, 0.125];
        let merged = |value: &dyn Fn(f64) -> f32| {
            let pass = |f: f64| film(&[value(f); 6], 4).with_bandwidth(f);
            let mut merged = pass(bandwidths[0]);
            bandwidths[1..].iter().for_each(|f| merged.merge(&pass(*f)).expect("they are of one picture"));
            merged
        };
        let biased = merged(&|f| (3.0 + 2.0 * f) as f32);
        let bias = biased.bias().expect("radii differ")[0];
        assert!((bias - 2.0 * 1.875 / 4.0).abs() < 1e-6, "{bias}");
        assert!((biased.finish().radiance()[0][0] - bias - 3.0).abs() < 1e-6, "without it, the truth is left");
        assert_eq!(merged(&|_| 3.0).bias().expect("radii differ")[0], 0.0, "control: no bias");
        assert!(film(&[1.0; 6], 4).bias().is_none(), "one pass tells nothing");
        // The slope of two passes is the difference: mean/(f₀ − f₁) times √(v/f₀ + v/f₁), and the
        // standard error half of that root.
        let mut two = film(&[1.0; 6], 4);
        two.merge(&film(&[2.0; 6], 4).with_bandwidth(0.5)).expect("they are of one picture");
        assert!((two.bias_noise().expect("radii differ") - 2.0 * 0.75 / 0.5).abs() < 1e-12);
    }
}
