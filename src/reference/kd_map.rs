//! A photon map on the CPU: the photons of the device in a kd-tree, and the device's gather over them.

use glam::Vec3;
use rayon::prelude::*;

use super::{Found, KdTree, estimate, usable};
use crate::{
    error::Result,
    layout::{PhotonFlux, PhotonPlace, VisiblePoint},
    progress::Progress,
    settings::EstimateSettings,
};

/// Two squared distances that differ by at most this fraction are tied: rounding alone decides which is the smaller.
pub const TIE: f32 = 1e-6;

/// Photons in a kd-tree.
#[derive(Clone, Debug)]
pub struct KdMap {
    places: Vec<PhotonPlace>,
    fluxes: Vec<PhotonFlux>,
    emitted: u64,
    tree: KdTree,
    /// Photons that no search finds, in rising order.
    left_out: Vec<u32>,
}

/// The radiance estimate at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Square of the radius, m².
    pub radius_squared: f32,
    /// Photons summed.
    pub count: u32,
    /// [`fingerprint`] of these.
    pub fingerprint: u32,
    /// The last photon that is summed and the next one, or the bound of the radius, are tied.
    pub tied: bool,
    /// Radiance that leaves towards the viewer, W/(m² sr).
    pub radiance: [f64; 3],
}

impl KdMap {
    /// Balances the photons, which `emitted` paths shot.
    ///
    /// # Panics
    /// If there are not as many fluxes as places.
    #[must_use]
    pub fn new(places: Vec<PhotonPlace>, fluxes: Vec<PhotonFlux>, emitted: u64) -> Self {
        assert_eq!(places.len(), fluxes.len(), "every photon has a place and a flux");
        let positions: Vec<Vec3> = places.iter().map(|p| p.position.into()).collect();
        Self { tree: KdTree::new(&positions), places, fluxes, emitted, left_out: Vec::new() }
    }

    /// Photons of the map.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// There is no photon.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Memory of the photons and the tree, bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (size_of_val(self.places.as_slice()) + size_of_val(self.fluxes.as_slice())) as u64 + self.tree.bytes()
    }

    /// Lets no search find this photon any more.
    pub fn leave_out(&mut self, photon: u32) {
        if let Err(place) = self.left_out.binary_search(&photon) {
            self.left_out.insert(place, photon);
        }
    }

    /// The usable photons nearest to the point, `count` at most and nearer than the root of `limit` (m²): squared
    /// distances and indices, nearest first.
    #[must_use]
    pub fn search(&self, point: &VisiblePoint, count: u32, limit: f32) -> Vec<(f32, u32)> {
        let there = |i: usize| self.left_out.is_empty() || self.left_out.binary_search(&(i as u32)).is_err();
        self.tree.search(point.position.into(), count, limit, |i| usable(&self.places[i], point) && there(i))
    }

    /// The estimate at a point with `neighbors`, `kernel`, `cone_constant` and `max_radius` of the settings.
    #[must_use]
    pub fn estimate(&self, point: &VisiblePoint, settings: &EstimateSettings) -> Estimate {
        let k = settings.neighbors;
        let bound = settings.max_radius.map_or(f32::INFINITY, |r| r * r);
        // What lies just beyond the bound could on the device lie just inside.
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
            radiance: estimate((&self.places, &self.fluxes), &found, point, settings.density(), self.emitted, true),
        }
    }

    /// The estimates at all valid points, on all threads of rayon's pool; zeros at the others.
    ///
    /// # Errors
    /// [`crate::Error::Stopped`] when `progress` says so.
    pub fn gather(
        &self,
        points: &[VisiblePoint],
        settings: &EstimateSettings,
        progress: &dyn Progress,
    ) -> Result<Vec<Estimate>> {
        let at = |point: &VisiblePoint| {
            progress.check()?;
            Ok(if point.valid == 0 { Estimate::default() } else { self.estimate(point, settings) })
        };
        points.par_iter().map(at).collect()
    }
}

/// Whether two squared distances are tied.
#[must_use]
pub fn are_tied(a: f32, b: f32) -> bool {
    (a - b).abs() <= TIE * a.max(b)
}

/// A number that tells sets of photons apart, whatever their order: the wrapping sum of their mixed indices.
#[must_use]
pub fn fingerprint(photons: &[u32]) -> u32 {
    photons.iter().fold(0, |sum, &photon| sum.wrapping_add(mix(photon)))
}

/// A bijection whose every output bit depends on every input bit (lowbias32 of Wellons, "hash-prospector").
#[must_use]
pub fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}
