//! Radiance estimate over any search result.

use glam::Vec3;

use super::{Found, above::mean_transmittance};
use crate::{
    density::Density,
    layout::{MAX_NORMAL_WEIGHT, PhotonFlux, PhotonPosition, VisiblePoint, from_octahedral},
};

/// The photon came from the viewer's side of the surface.
#[must_use]
pub fn usable(photon: &PhotonPosition, point: &VisiblePoint) -> bool {
    from_octahedral(photon.wi).dot(Vec3::from(point.ng)) > 0.0
}

/// Weight of light from `wi` in the diffuse lobe of `point`: twin of `diffuse_flux_weight` in
/// `shaders/lib/transport/lambert.wesl`.
fn normal_weight(point: &VisiblePoint, wi: Vec3) -> f32 {
    (wi.dot(point.ns.into()) / wi.dot(point.ng.into())).clamp(0.0, MAX_NORMAL_WEIGHT)
}

/// Radiance that leaves `point` towards the viewer: L = beta f_r / (mean π r²) Σ K(d/r) w_n Φ /
/// paths. The weight w_n of the interpolated normal is 1 without the side test.
#[must_use]
pub fn estimate(
    (photons, fluxes): (&[PhotonPosition], &[PhotonFlux]),
    found: &Found,
    point: &VisiblePoint,
    density: Density,
    emitted: u64,
    side_test: bool,
) -> [f64; 3] {
    let r2 = f64::from(found.radius_squared);
    if r2 <= 1e-35 {
        return [0.0; 3];
    }
    let mut sum = [0.0; 3];
    for &i in &found.photons {
        let (photon, flux) = (&photons[i as usize], &fluxes[i as usize].flux);
        let wi = from_octahedral(photon.wi);
        let d = (Vec3::from(point.position).as_dvec3() - Vec3::from(photon.position).as_dvec3()).length();
        let from_side = if side_test { normal_weight(point, wi) } else { 1.0 };
        let weight = density.weight(d / r2.sqrt()) * f64::from(from_side);
        for c in 0..3 {
            sum[c] += weight * f64::from(flux[c]);
        }
    }
    let area = density.mean() * std::f64::consts::PI * r2 * emitted as f64;
    let transmittance = f64::from(mean_transmittance(point));
    std::array::from_fn(|c| f64::from(point.weight[c]) * transmittance * sum[c] / area)
}
