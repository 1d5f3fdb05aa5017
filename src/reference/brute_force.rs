//! Brute-force search for the k nearest neighbours.

use glam::Vec3;

/// Result of a search for the k nearest usable photons.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Indices of the photons that are summed, nearest first; equal distances in ascending order of
    /// index.
    pub photons: Vec<u32>,
    /// Square of the radius of the estimate, m²; 0 if there is no photon.
    pub radius_squared: f32,
}

impl Found {
    /// Chooses photons and radius from `near`, the squared distances and indices of the nearest
    /// photons in ascending order.
    ///
    /// * More than `k` photons: the first `k`, and the distance of the next one.
    /// * `m <= k` photons: the first `m - 1`, and the distance of the last one.
    /// * `m <= k` photons and a `max_radius`, inside which all of them lie: all of them, and that
    ///   radius.
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

/// Finds the `k` nearest positions that `usable` accepts; the radius is the distance of the next
/// one. If only `m <= k` are usable: the nearest `m - 1`, and the distance of the last one. If
/// `max_radius` is smaller than the distance of the (k+1)-th: all positions inside it.
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

/// Squared distance in single precision, summed in the order of the axes as on the device.
pub(super) fn squared_distance(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x * d.x + d.y * d.y + d.z * d.z
}
