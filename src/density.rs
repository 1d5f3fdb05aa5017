//! Kernels of the radiance estimate: weights of photons over the disc of radius r around a point.
//!
//! The device knows r, the distance of the (k+1)-th photon, only after the photons are summed. It
//! therefore sums the moments Φ tᵐ, t = 1 − (d/s)ᵖ, for a length s slightly below r, and
//! computes Σ K(d/r) Φ from them. This requires a kernel that is a polynomial in qᵖ, q = d/r, or in
//! 1 − qᵖ.

use serde::{Deserialize, Serialize};

/// Shape of the kernel. The estimate divides by its mean over the disc, so each kernel integrates
/// to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DensityKernel {
    /// 1 − q/C (Jensen 2001, "Realistic Image Synthesis Using Photon Mapping", section 7.2.2).
    #[default]
    Cone,
    /// 1: the plain density estimate.
    Constant,
    /// 1 − q² (Epanechnikov 1969; least mean squared error of all non-negative kernels).
    Epanechnikov,
    /// 1 − (1 − exp(−β q²/2)) / (1 − exp(−β)), β = 1.953 (Jensen 2001, section 7.2.2; his factor α
    /// is part of the mean).
    Gaussian,
    /// (1 − q²)² (Silverman 1986, "Density Estimation", equation 4.5, in two dimensions 3/π
    /// (1 − q²)²).
    Silverman,
}

/// An estimate of k photons weighs more than k, and these more softly, if k is below one of these:
/// by (1 − qᵖ)³ below the first, (1 − qᵖ)² below the second, 1 − qᵖ below the third.
const SOFT_BELOW: [u32; 3] = [16, 32, 100];
/// Minimum number of photons that a softened kernel weighs.
const MIN_SOFT: u32 = 12;

/// β of Jensen's Gaussian.
const BETA: f64 = 1.953;
/// Maximum number of coefficients of a polynomial, that is, of moments that the device sums.
pub const MAX_MOMENTS: usize = 5;

/// A kernel with its parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// Shape of the kernel.
    pub kernel: DensityKernel,
    /// C of the cone, ≥ 1; unused by the other kernels.
    pub cone_constant: f32,
}

/// Polynomial Σ over m of `coefficients[m]` q^(`power` m). Coefficients from `moments` on are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polynomial {
    /// 1 or 2.
    pub power: u32,
    /// Number of coefficients in use, 1 to [`MAX_MOMENTS`].
    pub moments: u32,
    /// Coefficients of the polynomial, from the constant term on.
    pub coefficients: [f64; MAX_MOMENTS],
}

impl DensityKernel {
    /// All kernels.
    pub const ALL: [Self; 5] = [Self::Cone, Self::Constant, Self::Epanechnikov, Self::Gaussian, Self::Silverman];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["cone", "constant", "epanechnikov", "gaussian", "silverman"][self as usize]
    }
}

impl Density {
    /// K(q) of a photon at distance q r, 0 ≤ q ≤ 1, by its formula.
    #[must_use]
    pub fn weight(self, q: f64) -> f64 {
        match self.kernel {
            DensityKernel::Cone => 1.0 - q / f64::from(self.cone_constant),
            DensityKernel::Constant => 1.0,
            DensityKernel::Epanechnikov => 1.0 - q * q,
            DensityKernel::Gaussian => gaussian(q * q),
            DensityKernel::Silverman => (1.0 - q * q).powi(2),
        }
    }

    /// Mean of K over the disc, 2 ∫ K(q) q dq from 0 to 1, in closed form.
    #[must_use]
    pub fn mean(self) -> f64 {
        match self.kernel {
            DensityKernel::Cone => 1.0 - 2.0 / (3.0 * f64::from(self.cone_constant)),
            DensityKernel::Constant => 1.0,
            DensityKernel::Epanechnikov => 1.0 / 2.0,
            DensityKernel::Gaussian => {
                let part = 1.0 - (-BETA).exp();
                1.0 - (1.0 - 2.0 / BETA * (1.0 - (-BETA / 2.0).exp())) / part
            }
            DensityKernel::Silverman => 1.0 / 3.0,
        }
    }

    /// Number of photons that an estimate of `k` photons sums, and the softness of the kernel
    /// ([`Self::softened`]).
    ///
    /// The ball up to the (k+1)-th photon holds k of them where photons lie at random, but k + ½ on
    /// average where they lie in a regular pattern, as those of Sobol numbers do. An estimate whose
    /// kernel ends at that ball is then too dark by ½/k. Photons nearer to the middle have no part
    /// in this: among them, the ball's radius is as good as independent of the pattern. With few
    /// photons, the kernel is therefore softened at its rim, and stretched over as many more
    /// photons as leave its variance the same: (∫ K)²/∫ K², times the number of photons, is kept.
    #[must_use]
    pub fn of_few(self, k: u32) -> (u32, u32) {
        let most = if self.kernel == DensityKernel::Constant { 3 } else { 2 };
        let softness = SOFT_BELOW.iter().filter(|below| k < **below).count().min(most);
        if softness == 0 {
            return (k, 0);
        }
        let softness = softness as u32;
        let stretched = f64::from(k) * self.polynomial().spread() / self.softened(softness).spread();
        (MIN_SOFT.max(stretched.ceil() as u32), softness)
    }

    /// The kernel times (1 − qᵖ)^`softness`: at most 3 for the constant kernel, 2 for the others.
    #[must_use]
    pub fn softened(self, softness: u32) -> Polynomial {
        let mut polynomial = self.polynomial();
        if self.kernel == DensityKernel::Gaussian {
            // Fewer coefficients leave room for the factor.
            polynomial.moments = MAX_MOMENTS as u32 - softness;
            polynomial.coefficients = interpolated(gaussian, polynomial.moments as usize);
        }
        for _ in 0..softness {
            (1..MAX_MOMENTS).rev().for_each(|m| polynomial.coefficients[m] -= polynomial.coefficients[m - 1]);
            polynomial.moments += 1;
        }
        polynomial
    }

    /// Polynomial that the device sums: exact but for the Gaussian, which it approximates to 2e-5.
    #[must_use]
    pub fn polynomial(self) -> Polynomial {
        let of = |power, given: &[f64]| {
            let mut coefficients = [0.0; MAX_MOMENTS];
            coefficients[..given.len()].copy_from_slice(given);
            Polynomial { power, moments: given.len() as u32, coefficients }
        };
        match self.kernel {
            DensityKernel::Cone => of(1, &[1.0, -1.0 / f64::from(self.cone_constant)]),
            DensityKernel::Constant => of(2, &[1.0]),
            DensityKernel::Epanechnikov => of(2, &[1.0, -1.0]),
            DensityKernel::Gaussian => of(2, &interpolated(gaussian, MAX_MOMENTS)),
            DensityKernel::Silverman => of(2, &[1.0, -2.0, 1.0]),
        }
    }
}

impl Polynomial {
    /// Value at q.
    #[must_use]
    pub fn at(&self, q: f64) -> f64 {
        let t = q.powi(self.power as i32);
        self.coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c)
    }

    /// Coefficients of the same polynomial in 1 − qᵖ.
    #[must_use]
    pub fn from_rim(&self) -> [f64; MAX_MOMENTS] {
        // Horner's scheme at 1 − s.
        self.coefficients.iter().rev().fold([0.0; MAX_MOMENTS], |sum, c| {
            let mut next = sum;
            (1..MAX_MOMENTS).for_each(|m| next[m] -= sum[m - 1]);
            next[0] += c;
            next
        })
    }

    /// Mean over the disc: divisor of the estimate on the device.
    #[must_use]
    pub fn mean(&self) -> f64 {
        (0..).zip(self.coefficients).map(|(m, c)| 2.0 * c / f64::from(self.power * m + 2)).sum()
    }

    /// (∫ K)²/∫ K² over the disc, relative to its area: the fraction of the photons that counts, if
    /// equal weights of fewer photons would give the same variance.
    fn spread(&self) -> f64 {
        let pairs = (0..MAX_MOMENTS).flat_map(|m| (0..MAX_MOMENTS).map(move |n| (m, n)));
        let term = |(m, n): (usize, usize)| {
            2.0 * self.coefficients[m] * self.coefficients[n] / f64::from(self.power * (m + n) as u32 + 2)
        };
        self.mean().powi(2) / pairs.map(term).sum::<f64>()
    }

    /// Relative radius q within which the given fraction of the integral of the kernel lies, for
    /// 0 ≤ fraction ≤ 1.
    #[must_use]
    pub fn quantile(&self, fraction: f64) -> f64 {
        let integral = |q: f64| -> f64 {
            let term = |m: u32| 2.0 * self.coefficients[m as usize] / f64::from(self.power * m + 2);
            (0..self.moments).map(|m| term(m) * q.powi((self.power * m + 2) as i32)).sum()
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if integral(middle) < fraction * self.mean() { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

/// Jensen's Gaussian without α, as a function of q².
fn gaussian(q2: f64) -> f64 {
    1.0 - (1.0 - (-BETA * q2 / 2.0).exp()) / (1.0 - (-BETA).exp())
}

/// The `n` coefficients of the polynomial that interpolates `f` at the Chebyshev nodes of [0, 1],
/// by Newton's divided differences; zeros behind them.
fn interpolated(f: impl Fn(f64) -> f64, n: usize) -> [f64; MAX_MOMENTS] {
    let node = |i: usize| 0.5 + 0.5 * ((2 * i + 1) as f64 * std::f64::consts::PI / (2 * n) as f64).cos();
    let nodes: [f64; MAX_MOMENTS] = std::array::from_fn(node);
    let mut differences = nodes.map(f);
    for order in 1..n {
        for i in (order..n).rev() {
            differences[i] = (differences[i] - differences[i - 1]) / (nodes[i] - nodes[i - order]);
        }
    }
    // Expands Horner's scheme in (t - node).
    let mut coefficients = [0.0; MAX_MOMENTS];
    for i in (0..n).rev() {
        for m in (1..n).rev() {
            coefficients[m] = coefficients[m - 1] - nodes[i] * coefficients[m];
        }
        coefficients[0] = differences[i] - nodes[i] * coefficients[0];
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> impl Iterator<Item = Density> {
        let cones = [1.0, 1.5, 2.0, 1e6].map(|cone_constant| Density { kernel: DensityKernel::Cone, cone_constant });
        let others = DensityKernel::ALL.into_iter().skip(1).map(|kernel| Density { kernel, cone_constant: 2.0 });
        cones.into_iter().chain(others)
    }

    /// Integral of K(|y|) / (mean π) over the unit disc, by the midpoint rule.
    fn integral(weight: impl Fn(f64) -> f64, mean: f64) -> f64 {
        const STEPS: u32 = 20_000;
        let ring = |i: u32| {
            let q = (f64::from(i) + 0.5) / f64::from(STEPS);
            2.0 * q * weight(q) / f64::from(STEPS)
        };
        (0..STEPS).map(ring).sum::<f64>() / mean
    }

    #[test]
    fn each_kernel_integrates_to_1() {
        for density in all() {
            assert!((integral(|q| density.weight(q), density.mean()) - 1.0).abs() < 1e-6, "{density:?}");
            let polynomial = density.polynomial();
            assert!((integral(|q| polynomial.at(q), polynomial.mean()) - 1.0).abs() < 1e-6, "{density:?}");
            // Control: Jensen's α does not normalise his Gaussian, nor does another kernel's mean.
            let wrong = if density.kernel == DensityKernel::Gaussian { 1.0 / 0.918 } else { 0.9 * density.mean() };
            assert!((integral(|q| density.weight(q), wrong) - 1.0).abs() > 1e-2, "{density:?}");
        }
    }

    #[test]
    fn the_polynomial_is_the_kernel() {
        let farthest = |density: Density, polynomial: Polynomial| {
            let apart = |i: u32| (density.weight(f64::from(i) / 1000.0) - polynomial.at(f64::from(i) / 1000.0)).abs();
            (0..=1000).map(apart).fold(0.0, f64::max)
        };
        for density in all() {
            let polynomial = density.polynomial();
            assert!(farthest(density, polynomial) < 2e-5, "{density:?}");
            assert!(polynomial.coefficients[polynomial.moments as usize..].iter().all(|c| *c == 0.0));
            let rim = |s: f64| polynomial.from_rim().iter().rev().fold(0.0, |sum, c| sum * s + c);
            let q = 0.7_f64;
            assert!((rim(1.0 - q.powi(polynomial.power as i32)) - polynomial.at(q)).abs() < 1e-12, "{density:?}");
            let other =
                if density.kernel == DensityKernel::Silverman { DensityKernel::Cone } else { DensityKernel::Silverman };
            let other = Density { kernel: other, cone_constant: 2.0 };
            assert!(farthest(density, other.polynomial()) > 2e-5, "control: {density:?} as {other:?}");
        }
    }

    #[test]
    fn quantiles_cut_the_integral() {
        for density in all() {
            let polynomial = density.polynomial();
            assert!(polynomial.quantile(0.0) < 1e-4 && polynomial.quantile(1.0) > 1.0 - 1e-4);
            let q = polynomial.quantile(0.3);
            let inside = integral(|x| if x < q { polynomial.at(x) } else { 0.0 }, polynomial.mean());
            assert!((inside - 0.3).abs() < 1e-3, "{density:?}: {inside}");
        }
    }

    #[test]
    fn kernels_of_few_photons_are_soft_at_the_rim_and_of_the_same_variance() {
        for density in all() {
            for k in [1, 2, 5, 10, 20, 30, 50, 99] {
                let (photons, softness) = density.of_few(k);
                let soft = density.softened(softness);
                assert!((integral(|q| soft.at(q), soft.mean()) - 1.0).abs() < 1e-6, "{density:?}, k = {k}");
                assert!(soft.at(1.0).abs() < 1e-9 && soft.at(0.5) > 0.0, "{density:?}, k = {k}");
                let counts = |polynomial: Polynomial| {
                    let mean = integral(|q| polynomial.at(q), 1.0);
                    mean * mean / integral(|q| polynomial.at(q).powi(2), 1.0)
                };
                let ratio = f64::from(photons) * counts(soft) / (f64::from(k) * counts(density.polynomial()));
                let same = ratio > 0.999 && f64::from(photons - 1) * ratio < f64::from(photons);
                assert!(same || photons == MIN_SOFT, "{density:?}, k = {k}: {ratio}");
            }
            assert_eq!(density.of_few(100), (100, 0));
            assert_eq!(density.softened(0), density.polynomial());
            // Control: most plain kernels do not end softly.
            let cone = density.kernel == DensityKernel::Cone && density.cone_constant > 1.0;
            assert!(!cone || density.softened(0).at(1.0) > 0.1, "{density:?}");
        }
    }
}
