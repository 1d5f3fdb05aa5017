//! Shares of mirrors and glass in the photon paths that are aimed at them: by what cameras see
//! about them, where their sizes alone would leave small ones without photons.

use glam::Vec3;
use rayon::prelude::*;

use super::targets::Target;

/// Radius about mirrors and glass in which points count for their share, in that of their sphere;
/// and the least share, in the greatest.
const AROUND: f32 = 3.0;
const LEAST_SHARE: f32 = 1.0 / 64.0;
/// Fraction of the paths to mirrors and glass that are aimed at those that matter to the picture,
/// whatever their size: what a glass throws has as many photons as it needs beside a mirror that
/// fills a wall.
const WHATEVER_SIZE: f32 = 0.5;
/// Ratio of the powers that photons of different targets then have, up to which size alone decides.
const LEVEL: f32 = 4.0;

/// Fraction of the paths that is aimed at each sphere whatever its size; 0 for all where photons
/// have about the same power without that. `points`: what cameras see.
pub(super) fn shares_whatever_size(points: &[Vec3], spheres: &[Target]) -> Vec<f32> {
    let shares = by_sight(points, spheres);
    let aside = if powers_ratio(spheres, &shares) > LEVEL { WHATEVER_SIZE } else { 0.0 };
    shares.into_iter().map(|share| aside * share).collect()
}

/// Shares of spheres by what is seen, 1 in all: as the roots of the density of the points about
/// them, where what they throw is seen.
fn by_sight(points: &[Vec3], spheres: &[Target]) -> Vec<f32> {
    let density = |sphere: &Target| {
        let reach = AROUND * sphere.radius;
        let near = points.iter().filter(|point| point.distance_squared(sphere.center) <= reach * reach).count();
        (near as f32).sqrt() / reach.max(f32::MIN_POSITIVE)
    };
    let roots: Vec<f32> = spheres.par_iter().map(density).collect();
    let least = roots.iter().copied().fold(0.0, f32::max) * LEAST_SHARE;
    let roots: Vec<f32> = roots.into_iter().map(|root| if least > 0.0 { root.max(least) } else { 1.0 }).collect();
    let sum: f32 = roots.iter().sum();
    roots.into_iter().map(|root| root / sum).collect()
}

/// Greatest power of photons of parallel light from one of the targets over the least, if they have
/// these shares.
fn powers_ratio(targets: &[Target], shares: &[f32]) -> f32 {
    let size = |target: &Target| target.radius * target.radius;
    let sum: f32 = targets.iter().map(size).sum();
    let densities = targets.iter().zip(shares).map(|(t, share)| 1.0 / sum + share / size(t).max(f32::MIN_POSITIVE));
    let (least, most) = densities.fold((f32::INFINITY, 0.0_f32), |(least, most), d| (least.min(d), most.max(d)));
    if least > 0.0 && least.is_finite() { most / least } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    #[test]
    fn what_is_seen_close_by_has_the_larger_share() {
        let points: Vec<Vec3> = (0..900).map(|i| vec3(0.01 * (i % 30) as f32, 0.0, 0.01 * (i / 30) as f32)).collect();
        let at = |center: Vec3, radius: f32| Target { center, radius };
        let found =
            by_sight(&points, &[at(vec3(0.1, 0.05, 0.1), 0.03), at(Vec3::ZERO, 2.0), at(vec3(50.0, 0.0, 0.0), 0.1)]);
        assert!((found.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        assert!(found[0] > 5.0 * found[1] && found[1] > found[2] && found[2] > 0.0, "{found:?}");
        assert_eq!(by_sight(&[], &[at(Vec3::ZERO, 1.0), at(Vec3::X, 0.1)]), [0.5, 0.5], "nothing is seen");
        assert!(by_sight(&points, &[]).is_empty());
    }

    #[test]
    fn sizes_decide_among_like_ones() {
        let at = |radius: f32| Target { center: Vec3::ZERO, radius };
        assert_eq!(shares_whatever_size(&[], &[at(1.0), at(1.2)]), [0.0, 0.0]);
        assert_eq!(shares_whatever_size(&[], &[at(1.0), at(0.1)]), [0.25, 0.25]);
    }
}
