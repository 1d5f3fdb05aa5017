//! Bounds of lights: where they are and where they shine (Pharr et al. 2023, "Physically Based
//! Rendering", section 12.6.3, after Conty Estevez and Kulla 2018, "Importance Sampling of Many
//! Lights with Adaptive Tree Splitting").

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Quat, Vec3};

use crate::{
    layout::{self, BOTH_WAYS_BIT, FAR_BIT, LightNode, octahedral},
    scene::Bounds,
};

/// Angle added to cones against the rounding of their unions, radians.
const ANGLE_SLACK: f32 = 1e-5;
/// Steps from 0 to 1 of the cosines of spread and falloff, and those by which the falloff's is
/// lowered for the rounding of axes.
const SPREAD_STEPS: f32 = i16::MAX as f32;
const FALLOFF_STEPS: f32 = i8::MAX as f32;
const FALLOFF_SLACK: f32 = 1.0;
/// Part of the light that must shine along its mean direction for that to be the axis of a cone.
const LEAST_DIRECTED: f32 = 1e-3;

/// Bounds of one light or several. Lights at infinity (`is_far`) have no
/// position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightBounds {
    pub bounds: Bounds,
    /// Cone that holds the normals of surfaces and the inner cones of spots: its axis, a unit
    /// vector, and its half angle, radians.
    pub axis: Vec3,
    pub spread: f32,
    /// Angle from there on beyond which nothing shines, radians.
    pub falloff: f32,
    /// Surfaces shine along the opposite cone as well.
    pub both_ways: bool,
    pub is_far: bool,
    /// Sum of the [`strength`] of all.
    pub intensity: f32,
    /// Sum of intensities times normals of surfaces. Of those that shine both ways, the normal
    /// that is nearer to the sum of the others; of points and spots 0.
    pub directed: Vec3,
}

impl LightBounds {
    /// Bounds of one light of that intensity. `None` if it gives none, or
    /// its bounds are not finite.
    pub fn new(light: &layout::Light, intensity: f64) -> Option<Self> {
        let [position, e1, e2] = [light.position, light.e1, light.e2].map(Vec3::from_array);
        let point = |p: Vec3| Bounds { min: p, max: p };
        let (bounds, axis, spread, falloff) = match light.kind {
            layout::SPOT_LIGHT => {
                let [inner, outer] = [e2.x - e2.y, e2.x].map(angle_of_height);
                (point(position), e1, inner, outer - inner)
            }
            layout::TRIANGLE_LIGHT => {
                let corners = point(position).union(point(position + e1)).union(point(position + e2));
                let normal = e1.as_dvec3().cross(e2.as_dvec3()).normalize_or_zero().as_vec3();
                (corners, normal, 0.0, FRAC_PI_2)
            }
            layout::SPHERE_LIGHT => (Bounds { min: position - e1.x, max: position + e1.x }, Vec3::Y, PI, FRAC_PI_2),
            layout::DIRECTIONAL_LIGHT => (point(Vec3::ZERO), e1, 0.0, 0.0),
            layout::ENVIRONMENT_LIGHT => (point(Vec3::ZERO), Vec3::Y, PI, 0.0),
            _ => (point(position), Vec3::Y, PI, FRAC_PI_2),
        };
        // A light whose fraction of the sum is too small for a float is chosen nevertheless.
        let weak = intensity.max(f32::MIN_POSITIVE.into()) as f32;
        let is_finite =
            (bounds.max - bounds.min).length_squared().is_finite() && axis.is_finite() && axis != Vec3::ZERO;
        let is_surface = light.kind == layout::TRIANGLE_LIGHT;
        (intensity > 0.0 && weak.is_finite() && is_finite).then_some(Self {
            bounds,
            axis,
            spread,
            falloff,
            both_ways: is_surface && light.solid_angle > 1.5 * PI,
            is_far: matches!(light.kind, layout::DIRECTIONAL_LIGHT | layout::ENVIRONMENT_LIGHT),
            intensity: weak,
            directed: if is_surface { weak * axis } else { Vec3::ZERO },
        })
    }

    /// Bounds of both.
    pub fn union(self, other: Self) -> Self {
        let (axis, spread) = union_of_cones((self.axis, self.spread), (other.axis, other.spread));
        let is_turned = self.both_ways && other.both_ways && self.directed.dot(other.directed) < 0.0;
        Self {
            bounds: self.bounds.union(other.bounds),
            axis,
            spread,
            falloff: self.falloff.max(other.falloff),
            both_ways: self.both_ways || other.both_ways,
            is_far: self.is_far,
            intensity: self.intensity + other.intensity,
            directed: self.directed + if is_turned { -other.directed } else { other.directed },
        }
    }

    /// The same with the mean direction of surfaces as the axis of the cone. `all`: what is
    /// bounded.
    pub fn about_mean<'a>(self, all: impl Iterator<Item = &'a Self>) -> Self {
        let is_directed = self.directed.length() > LEAST_DIRECTED * self.intensity;
        if !is_directed || self.both_ways || self.spread == 0.0 {
            return self;
        }
        let axis = self.directed.normalize();
        let reach = |light: &Self| angle_between(axis, light.axis) + light.spread;
        let spread = all.map(reach).fold(0.0, f32::max) + ANGLE_SLACK;
        Self { axis, spread: spread.min(PI), ..self }
    }

    /// Point by which lights are split: their positions, or their directions if they are at
    /// infinity.
    pub fn middle(&self) -> Vec3 {
        if self.is_far { self.axis } else { 0.5 * (self.bounds.min + self.bounds.max) }
    }

    /// Cost of choosing among these lights (12.6.3, `EvaluateCost`), with the square of the box's
    /// diagonal instead of its area, which is 0 for lamps along a line.
    pub fn cost(&self) -> f32 {
        let size = if self.is_far { 1.0 } else { (self.bounds.max - self.bounds.min).length_squared() };
        self.intensity * solid_angle_measure(self.spread, self.falloff) * size
    }

    /// The node of these bounds. `next` as in [`LightNode::next`], without its bits for bounds.
    pub fn node(&self, next: u32) -> LightNode {
        let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        let lowered = |cosine: f32, steps: f32, slack: f32| ((cosine * steps).floor() - slack).max(-steps);
        // A single direction is exact.
        let spread = if self.spread > 0.0 { lowered(self.spread.cos(), SPREAD_STEPS, 0.0) } else { SPREAD_STEPS };
        let falloff = lowered(self.falloff.cos(), FALLOFF_STEPS, FALLOFF_SLACK);
        let along = (self.directed.dot(self.axis) / self.intensity).clamp(0.0, 1.0);
        let scatter = ((1.0 - along * along).sqrt() * f32::from(u8::MAX)).round();
        let cones =
            u32::from(spread as i16 as u16) | (u32::from(scatter as u8) << 16) | (u32::from(falloff as i8 as u8) << 24);
        let next = next | bit(self.both_ways, BOTH_WAYS_BIT) | bit(self.is_far, FAR_BIT);
        LightNode {
            center: (0.5 * (self.bounds.min + self.bounds.max)).to_array(),
            half: packed_half(0.5 * (self.bounds.max - self.bounds.min)),
            shine: [octahedral(self.axis), cones, self.intensity.to_bits(), next],
        }
    }
}

/// Greatest radiant intensity of a surface, W/sr, and four times that of what shines to all sides
/// alike, as a ball of such surfaces does; of a light at infinity the irradiance that it gives,
/// W/m².
pub(super) fn strength(light: &layout::Light, power: f64, sky: f64) -> f64 {
    let mean = light.emission.iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0;
    match light.kind {
        layout::DIRECTIONAL_LIGHT => mean,
        layout::ENVIRONMENT_LIGHT => sky,
        // A sphere shows a quarter of its surface.
        layout::SPHERE_LIGHT | layout::TRIANGLE_LIGHT => power / f64::from(light.solid_angle),
        _ => 4.0 * power / f64::from(light.solid_angle),
    }
}

/// [`LightNode::half`], rounded up.
fn packed_half(half: Vec3) -> u32 {
    if half.max_element() <= 0.0 {
        return 0;
    }
    // The smallest power of two of which 255 reach the largest extent, at least the smallest float.
    let least = (half.max_element() / 255.0).max(f32::MIN_POSITIVE);
    let exponent = (least.to_bits() >> 23) + 1;
    let steps = half / f32::from_bits(exponent << 23);
    let [x, y, z] = steps.to_array().map(|x| (x.ceil() as u32).min(255));
    (exponent << 24) | (x << 16) | (y << 8) | z
}

/// The angle of which 1 − cos is `height`.
fn angle_of_height(height: f32) -> f32 {
    2.0 * (0.5 * height.clamp(0.0, 2.0)).sqrt().min(1.0).asin()
}

/// Of unit vectors, by half of their distance, which small angles do not round away.
fn angle_between(a: Vec3, b: Vec3) -> f32 {
    2.0 * (0.5 * a.distance(b)).min(1.0).asin()
}

/// The cone around two cones, each an axis and a half angle.
fn union_of_cones(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    if wide.1 >= PI {
        return wide;
    }
    let between = angle_between(wide.0, narrow.0);
    if between + narrow.1 <= wide.1 {
        return wide;
    }
    let half = 0.5 * (wide.1 + between + narrow.1) + ANGLE_SLACK;
    let Some(around) = wide.0.cross(narrow.0).try_normalize() else {
        // The same axis within rounding, or the opposite one.
        return if between < 1.0 { (wide.0, wide.1.max(half + between)) } else { (wide.0, PI) };
    };
    if half >= PI {
        return (wide.0, PI);
    }
    ((Quat::from_axis_angle(around, half - wide.1) * wide.0).normalize(), half)
}

/// Integral of the falloff's bound over the directions (12.6.3, `M_omega`), sr.
fn solid_angle_measure(spread: f32, falloff: f32) -> f32 {
    if spread >= PI {
        return 2.0 * TAU;
    }
    let edge = (spread + falloff).min(PI);
    let (sin, cos) = spread.sin_cos();
    TAU * (1.0 - cos) + FRAC_PI_2 * (2.0 * edge * sin - (spread - 2.0 * edge).cos() - 2.0 * spread * sin + cos)
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    fn within(cone: (Vec3, f32), direction: Vec3) -> bool {
        cone.0.as_dvec3().angle_between(direction.as_dvec3()) <= f64::from(cone.1) + 1e-6
    }

    #[test]
    fn the_union_of_cones_holds_both_and_little_else() {
        let mut axis = vec3(0.3, -0.5, 0.8).normalize();
        for i in 0..2000 {
            let turn = Quat::from_axis_angle(vec3(0.2, (i as f32).sin(), 0.7).normalize(), 0.001 * i as f32);
            let (a, b) = ((axis, 0.0004 * i as f32), (turn * axis, 0.3 / (1.0 + i as f32)));
            let both = union_of_cones(a, b);
            for (axis, half) in [a, b] {
                let side = axis.any_orthonormal_vector();
                for k in 0..8 {
                    let rim = Quat::from_axis_angle(axis, k as f32) * (Quat::from_axis_angle(side, half) * axis);
                    assert!(within(both, rim), "{a:?} and {b:?} are not in {both:?}");
                }
            }
            let apart = a.0.angle_between(b.0);
            assert!(both.1 <= a.1.max(b.1).max(0.5 * (a.1 + b.1 + apart)) + 1e-3, "{both:?} of {a:?} and {b:?}");
            axis = b.0;
        }
        assert!(!within(union_of_cones((Vec3::Y, 0.1), (Vec3::X, 0.1)), Vec3::NEG_Z), "control");
        assert_eq!(union_of_cones((Vec3::Y, 0.1), (Vec3::NEG_Y, 0.1)).1, PI);
    }

    #[test]
    fn a_measure_is_the_integral_of_the_cosine_beyond_the_cone() {
        // A single normal: the integral of the cosine over a hemisphere. All directions: 4π.
        assert!((solid_angle_measure(0.0, FRAC_PI_2) - PI).abs() < 1e-5);
        assert!((solid_angle_measure(PI - 1e-4, FRAC_PI_2) - 2.0 * TAU).abs() < 1e-2);
        assert!((solid_angle_measure(0.0, 0.0)).abs() < 1e-6, "control: one direction");
    }

    #[test]
    fn packed_extents_are_those_or_little_more() {
        for half in [vec3(1.0, 0.02, 0.0), vec3(1e-30, 3e-30, 2e-31), vec3(255.0, 256.0, 1e5), vec3(3e38, 1.0, 0.0)] {
            let word = packed_half(half);
            let unit = f64::from(f32::from_bits((word >> 24) << 23));
            let read = [16, 8, 0].map(|shift| f64::from((word >> shift) & 255) * unit);
            for (read, right) in read.into_iter().zip(half.to_array().map(f64::from)) {
                assert!(read >= right && read <= right + f64::from(half.max_element()) / 127.0, "{read} for {right}");
            }
        }
        assert_eq!(packed_half(Vec3::ZERO), 0);
    }

    #[test]
    fn what_is_no_light_has_no_bounds() {
        let point = layout::Light { kind: layout::POINT_LIGHT, ..Default::default() };
        assert!(LightBounds::new(&point, 1.0).is_some());
        let nowhere = layout::Light { position: [f32::NAN, 0.0, 0.0], ..point };
        let flat = layout::Light { kind: layout::TRIANGLE_LIGHT, e1: [1.0, 0.0, 0.0], ..point };
        for (light, intensity) in [(point, 0.0), (point, f64::NAN), (point, f64::INFINITY), (nowhere, 1.0), (flat, 1.0)]
        {
            assert_eq!(LightBounds::new(&light, intensity), None, "{light:?} of {intensity}");
        }
    }
}
