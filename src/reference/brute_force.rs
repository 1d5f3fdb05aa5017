//! k nearest neighbours by looking at every point.

use glam::Vec3;

/// What a search for the k nearest usable photons found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Indices of the photons that are summed, nearest first; among equals in rising order.
    pub photons: Vec<u32>,
    /// Radius of the estimate squared, m²; 0 if there is no photon.
    pub radius_squared: f32,
}

impl Found {
    /// Of the nearest photons, as squared distance and index in rising order: the first `k` and the distance of the next one.
    /// Of `m <= k` the first `m - 1` and the distance of the last; with a `max_radius`, inside which they all lie, all
    /// of them and that radius.
    #[must_use]
    pub fn of(near: &[(f32, u32)], k: u32, max_radius: Option<f32>) -> Self {
        let (count, radius_squared) = match (near.get(k as usize), max_radius) {
            (Some((next, _)), _) => (k as usize, *next),
            (None, Some(radius)) => (near.len(), radius * radius),
            (None, None) => (near.len().saturating_sub(1), near.last().map_or(0.0, |last| last.0)),
        };
        Self { photons: near[..count].iter().map(|n| n.1).collect(), radius_squared }
    }
}

/// The `k` nearest of the positions that `usable` accepts, and the distance of the next one. Where only `m <= k` are
/// usable, the nearest `m - 1` and the distance of the last. With a `max_radius` nearer than that of the (k+1)-th, all inside it.
#[must_use]
pub fn brute_force(
    positions: &[Vec3],
    query: Vec3,
    k: u32,
    max_radius: Option<f32>,
    usable: impl Fn(usize) -> bool,
) -> Found {
    let distance = |i: usize| squared_distance(query, positions[i]);
    let mut near: Vec<(f32, u32)> =
        (0..positions.len()).filter(|&i| usable(i)).map(|i| (distance(i), i as u32)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    if let Some(radius) = max_radius {
        near.retain(|(d, _)| *d < radius * radius);
    }
    Found::of(&near, k, max_radius)
}

/// Square of the distance in single precision, the sum in the order of the axes as on the device.
pub(super) fn squared_distance(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x * d.x + d.y * d.y + d.z * d.z
}
