//! Directions as bins of one size, on a sphere that several points see alike. Twin of functions of
//! `shaders/lib/transport/openings.wesl`.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glam::{Vec2, Vec3, vec2, vec3};

use crate::layout::OPENINGS_SIDE;

/// Bins along each side of the square of directions, and all of them. They are of one size.
pub const SIDE: usize = OPENINGS_SIDE as usize;
pub const BINS: usize = SIDE * SIDE;
pub const BIN_SOLID_ANGLE: f32 = 4.0 * PI / BINS as f32;

/// A sphere on which a region sees its openings. An infinite one shows all points the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    pub center: Vec3,
    pub radius: f32,
}

impl Sphere {
    /// Where a ray from within meets the sphere, as the direction from its centre; and the solid
    /// angle there over that at the origin.
    pub fn seen(&self, origin: Vec3, direction: Vec3) -> (Vec3, f32) {
        if self.radius == f32::INFINITY {
            return (direction, 1.0);
        }
        let from = (origin - self.center) / self.radius;
        let along = from.dot(direction);
        let distance = (along * along + 1.0 - from.length_squared()).max(0.0).sqrt() - along;
        let met = (from + distance * direction).normalize();
        (met, distance * distance / met.dot(direction))
    }

    /// Direction from a point within to that on the sphere.
    pub fn direction(&self, origin: Vec3, on_sphere: Vec3) -> Vec3 {
        if self.radius == f32::INFINITY {
            return on_sphere;
        }
        (on_sphere - (origin - self.center) / self.radius).normalize()
    }
}

/// Direction of the middle of a bin.
pub fn middle_of(bin: usize) -> Vec3 {
    direction_of(vec2((bin % SIDE) as f32 + 0.5, (bin / SIDE) as f32 + 0.5) / SIDE as f32)
}

/// Bin of a direction.
pub fn bin_of(direction: Vec3) -> usize {
    let place = (SIDE as f32 * square_of(direction)).as_uvec2().min(glam::UVec2::splat(OPENINGS_SIDE - 1));
    (place.x + OPENINGS_SIDE * place.y) as usize
}

/// Place of a direction in the unit square, by the octahedron, areas kept (Clarberg 2008, "Fast
/// Equal-Area Mapping of the (Hemi)Sphere using SIMD").
fn square_of(direction: Vec3) -> Vec2 {
    let d = direction.abs();
    let r = (1.0 - d.z).max(0.0).sqrt();
    let phi = if d.x == 0.0 && d.y == 0.0 { 0.0 } else { d.y.atan2(d.x) / FRAC_PI_2 };
    let upper = vec2(r - r * phi, r * phi);
    let place = if direction.z < 0.0 { vec2(1.0 - upper.y, 1.0 - upper.x) } else { upper };
    0.5 + 0.5 * vec2(place.x.copysign(direction.x), place.y.copysign(direction.y))
}

/// The direction at a place in the unit square: the inverse of [`square_of`].
pub fn direction_of(place: Vec2) -> Vec3 {
    let centered = 2.0 * place - 1.0;
    let p = centered.abs();
    let inside = 1.0 - (p.x + p.y);
    let r = 1.0 - inside.abs();
    let phi = if r == 0.0 { 1.0 } else { (p.y - p.x) / r + 1.0 } * FRAC_PI_4;
    let z = (1.0 - r * r).copysign(inside);
    let across = r * (2.0 - r * r).max(0.0).sqrt();
    vec3((across * phi.cos()).copysign(centered.x), (across * phi.sin()).copysign(centered.y), z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_bins_belong_together_and_bins_are_of_one_size() {
        let side = 512;
        let mut counts = vec![0_u32; BINS];
        for i in 0..side * side {
            // Uniform over the sphere.
            let z = 1.0 - 2.0 * ((i / side) as f32 + 0.5) / side as f32;
            let (sine, cosine) = (2.0 * PI * ((i % side) as f32 + 0.5) / side as f32).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let direction = vec3(across * cosine, across * sine, z);
            let again = direction_of(square_of(direction));
            assert!(direction.distance(again) < 1e-3, "{direction} comes back as {again}");
            counts[bin_of(direction)] += 1;
        }
        let even = (side * side) as f32 / BINS as f32;
        let off = counts.iter().map(|count| (*count as f32 / even - 1.0).abs()).fold(0.0, f32::max);
        assert!(off < 0.25, "a bin has {off} more or less than its share");
        assert!((0..BINS).all(|bin| bin_of(middle_of(bin)) == bin));
    }

    #[test]
    fn a_sphere_shows_directions_with_their_solid_angles() {
        let sphere = Sphere { center: vec3(0.2, -0.1, 0.4), radius: 3.0 };
        let origin = vec3(1.0, 0.5, -0.3);
        for i in 0..100 {
            let [x, y] = [0.618, 0.755].map(|step| (step * i as f32).fract());
            let direction = direction_of(vec2(x, y));
            let (seen, stretch) = sphere.seen(origin, direction);
            assert!(sphere.direction(origin, seen).distance(direction) < 1e-4);
            // The solid angle of a small triangle there, over that at the origin.
            let (right, up) = direction.any_orthonormal_pair();
            let beside = [right, up].map(|aside| (direction + 0.01 * aside).normalize());
            let area = |d: Vec3, a: Vec3, b: Vec3| (a - d).cross(b - d).length();
            let [a, b] = beside.map(|d| sphere.seen(origin, d).0);
            let ratio = area(seen, a, b) / area(direction, beside[0], beside[1]);
            assert!((ratio / stretch - 1.0).abs() < 0.05, "{ratio} instead of {stretch}");
        }
    }
}
