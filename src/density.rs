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
            DensityKernel::Gaussian => of(2, &interpolated(gaussian)),
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

/// Coefficients of the polynomial that interpolates `f` at the Chebyshev nodes of [0, 1], by
/// Newton's divided differences.
fn interpolated(f: impl Fn(f64) -> f64) -> [f64; MAX_MOMENTS] {
    const N: usize = MAX_MOMENTS;
    let node = |i: usize| 0.5 + 0.5 * ((2 * i + 1) as f64 * std::f64::consts::PI / (2 * N) as f64).cos();
    let nodes: [f64; N] = std::array::from_fn(node);
    let mut differences = nodes.map(f);
    for order in 1..N {
        for i in (order..N).rev() {
            differences[i] = (differences[i] - differences[i - 1]) / (nodes[i] - nodes[i - order]);
        }
    }
    // Expands Horner's scheme in (t - node).
    let mut coefficients = [0.0; N];
    for i in (0..N).rev() {
        for m in (1..N).rev() {
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
}
