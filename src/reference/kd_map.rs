//! Photon map on the CPU: the photons of the device in a kd-tree, and the radiance estimate over
//! them.

use glam::Vec3;
use rayon::prelude::*;

use super::{Found, KdTree, estimate, usable};
use crate::{
    error::Result,
    layout::{PhotonFlux, PhotonPosition, VisiblePoint},
    progress::Progress,
    settings::EstimateSettings,
};

/// Relative difference of squared distances up to which they count as tied: rounding alone decides
/// which is smaller.
pub const TIE: f32 = 1e-6;

/// A photon map in a kd-tree.
#[derive(Clone, Debug)]
pub struct KdMap {
    positions: Vec<PhotonPosition>,
    fluxes: Vec<PhotonFlux>,
    emitted: u64,
    tree: KdTree,
    /// Photons excluded from every search, in ascending order.
    left_out: Vec<u32>,
}

/// Radiance estimate at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Square of the radius, m².
    pub radius_squared: f32,
    /// Number of photons summed.
    pub count: u32,
    /// [`fingerprint`] of the photons summed.
    pub fingerprint: u32,
    /// Whether the last photon summed is tied with the next one, or a photon with the maximum
    /// radius.
    pub tied: bool,
    /// Radiance towards the viewer, W/(m² sr).
    pub radiance: [f64; 3],
}

impl KdMap {
    /// Builds the kd-tree over the photons of `emitted` photon paths.
    ///
    /// # Panics
    /// If there are not as many fluxes as positions.
    #[must_use]
    pub fn new(positions: Vec<PhotonPosition>, fluxes: Vec<PhotonFlux>, emitted: u64) -> Self {
        assert_eq!(positions.len(), fluxes.len(), "every photon has a position and a flux");
        let points: Vec<Vec3> = positions.iter().map(|p| p.position.into()).collect();
        Self { tree: KdTree::new(&points), positions, fluxes, emitted, left_out: Vec::new() }
    }

    /// Number of photons.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether the map has no photon.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Memory of the photons and the tree, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (size_of_val(self.positions.as_slice()) + size_of_val(self.fluxes.as_slice())) as u64 + self.tree.bytes()
    }

    /// Excludes a photon from all further searches.
    pub fn leave_out(&mut self, photon: u32) {
        if let Err(index) = self.left_out.binary_search(&photon) {
            self.left_out.insert(index, photon);
        }
    }

    /// Finds the usable photons nearest to the point, at most `count`, with squared distances below
    /// `limit` (m²). Returns squared distances and indices, nearest first.
    #[must_use]
    pub fn search(&self, point: &VisiblePoint, count: u32, limit: f32) -> Vec<(f32, u32)> {
        let there = |i: usize| self.left_out.is_empty() || self.left_out.binary_search(&(i as u32)).is_err();
        self.tree.search(point.position.into(), count, limit, |i| usable(&self.positions[i], point) && there(i))
    }

    /// Estimates the radiance at a point with `neighbors`, `kernel`, `cone_constant` and
    /// `max_radius` of the settings.
    #[must_use]
    pub fn estimate(&self, point: &VisiblePoint, settings: &EstimateSettings) -> Estimate {
        let k = settings.neighbors;
        let bound = settings.max_radius.map_or(f32::INFINITY, |r| r * r);
        // A photon just beyond the bound may lie just inside it on the device.
        let near = self.search(point, k.saturating_add(1), bound * (1.0 + TIE));
        let inside = near.partition_point(|n| n.0 < bound);
        let found = Found::of(&near[..inside], k, settings.max_radius);
        let count = found.photons.len();
        let last_is_tied = count > 0 && are_tied(near[count - 1].0, found.radius_squared);
        Estimate {
            radius_squared: found.radius_squared,
            count: count as u32,
            fingerprint: fingerprint(&found.photons),
            tied: last_is_tied || near.len() > inside,
            radiance: estimate((&self.positions, &self.fluxes), &found, point, settings.density(), self.emitted, true),
        }
    }

    /// Estimates the radiance at all valid points, on all threads of the rayon pool. Other points
    /// get zeros.
    ///
    /// # Errors
    /// [`crate::Error::Stopped`] if `progress` requests a stop.
    pub fn gather(
        &self,
        points: &[VisiblePoint],
        settings: &EstimateSettings,
        progress: &dyn Progress,
    ) -> Result<Vec<Estimate>> {
        let at = |point: &VisiblePoint| {
            progress.check()?;
            Ok(if point.next_map == 0 { Estimate::default() } else { self.estimate(point, settings) })
        };
        points.par_iter().map(at).collect()
    }
}

/// Whether two squared distances are tied.
#[must_use]
pub fn are_tied(a: f32, b: f32) -> bool {
    (a - b).abs() <= TIE * a.max(b)
}

/// Order-independent hash of a set of photons: the wrapping sum of [`mix`] over their indices.
#[must_use]
pub fn fingerprint(photons: &[u32]) -> u32 {
    photons.iter().fold(0, |sum, &photon| sum.wrapping_add(mix(photon)))
}

/// Bijective integer hash: every output bit depends on every input bit (lowbias32 of Wellons,
/// "hash-prospector").
#[must_use]
pub fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}
