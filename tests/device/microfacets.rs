//! Microfacet lobes in f64, as glTF 2.0 and its extensions define them, and integrals over them.
//! The normal is +Y.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, dvec3};

use super::fresnel::closed_form;

/// Smith's masking and shadowing: of both directions together, or each alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Masking {
    Correlated,
    Separable,
}

/// GGX of these widths along x and z.
#[derive(Clone, Copy, Debug)]
pub struct Facets {
    pub along: f64,
    pub across: f64,
}

impl Facets {
    pub fn of_roughness(roughness: f64) -> Self {
        Self { along: roughness * roughness, across: roughness * roughness }
    }

    /// Density D of normals.
    pub fn density(self, h: DVec3) -> f64 {
        let q = (h.x / self.along).powi(2) + (h.z / self.across).powi(2) + h.y * h.y;
        1.0 / (PI * self.along * self.across * q * q)
    }

    fn lambda(self, w: DVec3) -> f64 {
        let tangent = ((self.along * w.x).powi(2) + (self.across * w.z).powi(2)) / (w.y * w.y);
        ((1.0 + tangent).sqrt() - 1.0) / 2.0
    }

    pub fn masking(self, v: DVec3, l: DVec3, masking: Masking) -> f64 {
        let (v, l) = (self.lambda(v), self.lambda(l));
        match masking {
            Masking::Correlated => 1.0 / (1.0 + v + l),
            Masking::Separable => 1.0 / ((1.0 + v) * (1.0 + l)),
        }
    }

    /// D G/(4 cos cos), 0 below the surface.
    pub fn reflected(self, v: DVec3, l: DVec3, masking: Masking) -> f64 {
        if v.y <= 0.0 || l.y <= 0.0 {
            return 0.0;
        }
        self.density((v + l).normalize()) * self.masking(v, l, masking) / (4.0 * v.y * l.y)
    }

    /// A normal, for two numbers in [0, 1): s and the azimuth, where s (2 - s) is the part of D cos
    /// with smaller slopes.
    fn normal(self, s: f64, turn: f64) -> DVec3 {
        let slope = (s * (2.0 - s)).sqrt() / (1.0 - s);
        let (sine, cosine) = (TAU * turn).sin_cos();
        dvec3(self.along * slope * cosine, 1.0, self.across * slope * sine).normalize()
    }

    /// The numbers of a normal.
    pub fn numbers(self, h: DVec3) -> [f64; 2] {
        let (x, z) = (h.x / self.along / h.y, h.z / self.across / h.y);
        [1.0 - 1.0 / (1.0 + x * x + z * z).sqrt(), (z.atan2(x) / TAU).rem_euclid(1.0)]
    }

    /// Directions that reflect to `v`, at the midpoints of a square of numbers with this number of
    /// points along each side, row by row, and the solid angle of each; 0 for a normal that is not
    /// seen.
    pub fn reflections(self, v: DVec3, side: usize) -> Vec<(DVec3, f64)> {
        let middle = |i: usize| (i as f64 + 0.5) / side as f64;
        let at = |i: usize| {
            let s = middle(i / side);
            let h = self.normal(s, middle(i % side));
            let seen = v.dot(h);
            let angle = 8.0 * (1.0 - s) * seen.max(0.0) / (self.density(h) * h.y) / (side * side) as f64;
            (2.0 * seen * h - v, angle)
        };
        (0..side * side).map(at).collect()
    }

    /// Directions that a medium of index `eta` refracts to `v`, as `reflections` are.
    pub fn refractions(self, v: DVec3, eta: f64, side: usize) -> Vec<(DVec3, f64)> {
        let middle = |i: usize| (i as f64 + 0.5) / side as f64;
        let at = |i: usize| {
            let s = middle(i / side);
            let h = self.normal(s, middle(i % side));
            let (seen, square) = (v.dot(h), 1.0 - (1.0 - v.dot(h).powi(2)) / (eta * eta));
            if seen <= 0.0 || square <= 0.0 {
                return (-v, 0.0);
            }
            let l = (seen / eta - square.sqrt()) * h - v / eta;
            // Walter's equation 17.
            let normals = 2.0 * (1.0 - s) / (self.density(h) * h.y) / (side * side) as f64;
            (l, normals * (seen - eta * square.sqrt()).powi(2) / (eta * eta * square.sqrt()))
        };
        (0..side * side).map(at).collect()
    }

    /// BSDF of a rough dielectric for radiance from `l` to `v` (Walter's equations 20 and 21),
    /// `eta` the index on the far side over that on the side of `v`. The value of what goes through
    /// is that for light of the far side.
    pub fn walter(self, v: DVec3, l: DVec3, eta: f64) -> f64 {
        if l.y > 0.0 {
            let h = (v + l).normalize();
            return self.reflected(v, l, Masking::Separable) * closed_form(v.dot(h), eta);
        }
        let h = (v + eta * l).normalize();
        let h = h * h.y.signum();
        let (vh, lh) = (v.dot(h), l.dot(h));
        if vh <= 0.0 || lh >= 0.0 {
            return 0.0;
        }
        let transmitted = (1.0 - closed_form(vh, eta)) * self.density(h) * self.masking(v, l, Masking::Separable);
        (vh * lh / (v.y * l.y)).abs() * transmitted / (vh + eta * lh).powi(2)
    }

    /// Fraction of light from `v` that is reflected with the reflectance f0 + (1 - f0)(1 - V·H)^5.
    pub fn albedo(self, v: DVec3, f0: f64, masking: Masking, side: usize) -> f64 {
        let all = self.reflections(v, side).into_iter();
        all.map(|(l, angle)| self.reflected(v, l, masking) * schlick(f0, v, l) * l.y.max(0.0) * angle).sum()
    }
}

/// Schlick's reflectance at the half vector; 1 at grazing incidence.
pub fn schlick(f0: f64, v: DVec3, l: DVec3) -> f64 {
    f0 + (1.0 - f0) * (1.0 - v.dot((v + l).normalize()).abs()).powi(5)
}

/// Direction at this cosine.
pub fn at_cosine(mu: f64, azimuth: f64) -> DVec3 {
    let sine = (1.0 - mu * mu).sqrt();
    dvec3(sine * azimuth.cos(), mu, sine * azimuth.sin())
}
