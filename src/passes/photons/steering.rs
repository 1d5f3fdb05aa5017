//! Which lights photon paths start from, and which photons are stored, so that most of a map lies
//! where the cameras need it. A pilot of few paths from each light tells where the light goes.
//!
//! Of lights that are chosen with the probabilities p, a path brings w/p of importance, and the
//! variance of the sum is least if p is in proportion to the power times the root of the mean
//! square of w. Lights keep a part of their photons by power alone: nothing is lost by what the
//! pilot missed. Photons are stored in proportion to importance up to a bound (compare Suykens and
//! Willems 2000, "Density Control for Photon Maps"; Keller and Wald 2000), so that where it
//! matters, they have the flux with which they arrived.

use crate::emitters::{light_clusters::LightCluster, light_table::BY_POWER};

/// Paths of the mean of all lights that are added to those of each, and the square of importance
/// that a light may have brought unseen.
const PRIOR_PATHS: f64 = 4.0;
const UNSEEN: f64 = 0.02;
/// Lights are chosen by power unless that has more than this times the variance.
const LEAST_GAIN: f64 = 1.25;
/// Paths for each photon that is stored, over those without choice of photons, at most.
const MOST_PATHS: f64 = 20.0;
/// Least fraction of the photons that are needed, and that where much light comes from infinity.
/// Paths of scenes with fewer are aimed at spheres, which pays for parallel light most.
const LEAST_NEEDED: f64 = 1.0 / 2048.0;
const LEAST_NEEDED_OF_FAR: f64 = 1.0 / 64.0;
/// Part of the maps that the most paths fill at least if all photons are stored. Where fewer meet
/// anything, as from lamps that stand around a scene far away, they are aimed at spheres.
const LEAST_FILLED: f64 = 0.25;
/// Greatest fraction of the photons that are stored by importance. Of maps that need more, all
/// photons are stored.
const MOST_STORED: f64 = 0.5;
/// Part of the stored photons that lie where they are hardly needed; and their greatest factor.
const ELSEWHERE: f64 = 0.2;
const LEAST_KEPT: f64 = 1.0 / 128.0;
/// Paths that brought at least that from each light at infinity that has a part of the power of
/// more than the last number.
const FAR_PATHS: usize = 16;
const BROUGHT: f64 = 0.1;
const FAR_POWER: f64 = 0.05;

/// A photon of the pilot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotPhoton {
    pub path: u32,
    /// Flux over what a path of its light starts with.
    pub flux: f64,
    pub importance: f64,
}

/// Paths of the pilot, and the cluster of lights that each started from.
#[derive(Clone, Debug, PartialEq)]
pub struct Pilot {
    pub clusters: Vec<LightCluster>,
    pub cluster_of: Vec<u32>,
    /// In the order of the paths.
    pub photons: Vec<PilotPhoton>,
}

/// How photons are steered.
#[derive(Clone, Debug, PartialEq)]
pub struct Steering {
    /// Factors on the powers of the clusters; `None`: lights are chosen by power.
    pub factors: Option<Vec<f64>>,
    /// See [`layout::PhotonBatch`](crate::layout::PhotonBatch).
    pub kept_scale: f32,
    pub least_kept: f32,
}

impl Pilot {
    /// Rules for the photons of maps that take at most `most_paths` times the paths that fill them
    /// if all photons are stored. `None` if the pilot saw too little.
    #[must_use]
    pub fn steering(&self, chooses_lights: bool, most_paths: f64) -> Option<Steering> {
        let total: f64 = self.clusters.iter().map(|cluster| cluster.power).sum();
        let by_power: Vec<f64> = self.clusters.iter().map(|cluster| cluster.power / total).collect();
        let reference = self.middle_importance(&by_power)?;
        if most_paths < LEAST_FILLED {
            return None;
        }
        let most_paths = most_paths.clamp(1.0, MOST_PATHS);
        // All photons that are likely to be stored count: of those that are needed most, the pilot
        // may have too few to tell the lights apart.
        let (scale, _) = self.scale(&by_power, reference, most_paths);
        let brought = self.brought(scale);
        if !self.far_is_seen(&brought, total) {
            return None;
        }
        let chosen = if chooses_lights { self.choice(&brought, &by_power) } else { None };
        let chances = chosen.as_ref().unwrap_or(&by_power);
        let needed = self.kept(chances, |importance| (importance / reference).min(1.0));
        if needed < if self.has_far(total) { LEAST_NEEDED_OF_FAR } else { LEAST_NEEDED } {
            return None;
        }
        let (scale, stored) = self.scale(chances, reference, most_paths);
        let (kept_scale, least) =
            if stored > MOST_STORED { (0.0, 0.0) } else { (scale, (ELSEWHERE * stored).max(LEAST_KEPT)) };
        let factors = chosen.map(|chosen| chosen.iter().zip(&by_power).map(|(p, power)| p / power).collect());
        Some(Steering { factors, kept_scale: kept_scale as f32, least_kept: least as f32 })
    }

    /// Weight of a photon among those of all paths, if lights are chosen with these probabilities.
    fn weights<'a>(&'a self, chances: &[f64]) -> impl Iterator<Item = (f64, &'a PilotPhoton)> {
        let mut paths = vec![0.0; self.clusters.len()];
        self.cluster_of.iter().for_each(|cluster| paths[*cluster as usize] += 1.0);
        let each: Vec<f64> = chances.iter().zip(paths).map(|(chance, paths)| chance / f64::max(paths, 1.0)).collect();
        self.photons
            .iter()
            .map(move |photon| (each[self.cluster_of[photon.path as usize] as usize] * photon.flux, photon))
    }

    /// Fraction of the photons that is kept.
    fn kept(&self, chances: &[f64], keep: impl Fn(f64) -> f64) -> f64 {
        let sums = self
            .weights(chances)
            .fold((0.0, 0.0), |(kept, all), (weight, photon)| (kept + weight * keep(photon.importance), all + weight));
        if sums.1 > 0.0 { sums.0 / sums.1 } else { 0.0 }
    }

    /// The importance below which half of the importance of all photons lies.
    fn middle_importance(&self, by_power: &[f64]) -> Option<f64> {
        let mut all: Vec<(f64, f64)> =
            self.weights(by_power).map(|(weight, photon)| (photon.importance, weight * photon.importance)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = 0.5 * all.iter().map(|(_, mass)| mass).sum::<f64>();
        let mut sum = 0.0;
        all.into_iter()
            .find(|(_, mass)| {
                sum += mass;
                sum >= half && half > 0.0
            })
            .map(|(importance, _)| importance)
    }

    /// What each path brought: the photons that are stored of it.
    fn brought(&self, scale: f64) -> Vec<f64> {
        let mut brought = vec![0.0; self.cluster_of.len()];
        for photon in &self.photons {
            brought[photon.path as usize] += photon.flux * (scale * photon.importance).min(1.0);
        }
        brought
    }

    /// Clusters of strong lights at infinity.
    fn strong_far(&self, total: f64) -> impl Iterator<Item = u32> {
        let is_strong = move |cluster: &LightCluster| cluster.is_far && cluster.power > FAR_POWER * total;
        (0..).zip(&self.clusters).filter(move |(_, cluster)| is_strong(cluster)).map(|(index, _)| index)
    }

    fn has_far(&self, total: f64) -> bool {
        self.strong_far(total).next().is_some()
    }

    /// Whether the light of each of them was seen to arrive: little of it may be most of what a
    /// camera sees.
    fn far_is_seen(&self, brought: &[f64], total: f64) -> bool {
        self.strong_far(total).all(|index| {
            let own = self.cluster_of.iter().zip(brought).filter(|(cluster, _)| **cluster == index);
            own.filter(|(_, brought)| **brought > BROUGHT).count() >= FAR_PATHS
        })
    }

    /// Probabilities of the clusters by what their paths brought, if that gains enough.
    fn choice(&self, brought: &[f64], by_power: &[f64]) -> Option<Vec<f64>> {
        let mut sums = vec![(0.0, 0.0); self.clusters.len()];
        for (cluster, brought) in self.cluster_of.iter().zip(brought) {
            let (squares, paths) = &mut sums[*cluster as usize];
            *squares += brought * brought;
            *paths += 1.0;
        }
        let mean: f64 =
            sums.iter().zip(by_power).map(|((squares, paths), p)| p * squares / f64::max(*paths, 1.0)).sum();
        let squares: Vec<f64> = sums
            .iter()
            .map(|(squares, paths)| (squares + PRIOR_PATHS * mean + UNSEEN) / (paths + PRIOR_PATHS))
            .collect();
        let roots: Vec<f64> = squares.iter().zip(by_power).map(|(square, p)| p * square.sqrt()).collect();
        let sum: f64 = roots.iter().sum();
        let chosen: Vec<f64> =
            roots.iter().zip(by_power).map(|(root, p)| BY_POWER * p + (1.0 - BY_POWER) * root / sum).collect();
        let variance = |chances: &[f64]| -> f64 {
            squares.iter().zip(by_power).zip(chances).map(|((square, p), chance)| p * p * square / chance).sum()
        };
        (variance(by_power) > LEAST_GAIN * variance(&chosen)).then_some(chosen)
    }

    /// Factor on importance that gives the probability of a photon to be stored, and the fraction
    /// of photons that are stored by it: those of the middle importance at least, and as many more
    /// as the paths allow.
    fn scale(&self, chances: &[f64], reference: f64, most_paths: f64) -> (f64, f64) {
        let stored = |scale: f64| self.kept(chances, |importance| (scale * importance).min(1.0));
        let mut scale = 1.0 / reference;
        while stored(scale) * most_paths < 1.0 && scale.is_finite() {
            scale *= 1.25;
        }
        (scale, stored(scale))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lights of equal power, and photons of that importance from a number of each light's paths.
    fn pilot(lights: &[(bool, usize, f64)]) -> Pilot {
        const PATHS: usize = 1000;
        let clusters =
            lights.iter().map(|(is_far, ..)| LightCluster { power: 1.0, is_far: *is_far, ..LightCluster::default() });
        let cluster_of = (0..lights.len() as u32).flat_map(|light| [light; PATHS]).collect();
        let photons = (0..).step_by(PATHS).zip(lights).flat_map(|(first, (_, needed, importance))| {
            let importance = move |path: u32| if (path as usize) < *needed { *importance } else { 1e-6 };
            (0..PATHS as u32).map(move |path| PilotPhoton {
                path: first + path,
                flux: 1.0,
                importance: importance(path),
            })
        });
        Pilot { photons: photons.collect(), clusters: clusters.collect(), cluster_of }
    }

    #[test]
    fn lights_are_chosen_by_the_root_of_what_arrives() {
        let steering = pilot(&[(false, 400, 1.0), (false, 100, 1.0), (false, 0, 1.0)]).steering(true, 100.0);
        let factors = steering.expect("much is needed").factors.expect("lights differ");
        let ratio = (factors[0] - BY_POWER) / (factors[1] - BY_POWER);
        assert!((ratio - 2.0).abs() < 0.05, "{factors:?}");
        assert!((BY_POWER..0.3).contains(&factors[2]), "{factors:?}");
        assert!((factors.iter().sum::<f64>() - 3.0).abs() < 1e-9, "{factors:?}");
        let alike = pilot(&[(false, 400, 1.0), (false, 380, 1.0)]).steering(true, 100.0).expect("much is needed");
        assert_eq!(alike.factors, None, "control: lights that bring the same");
        let asked = pilot(&[(false, 400, 1.0), (false, 0, 1.0)]).steering(false, 100.0).expect("much is needed");
        assert_eq!(asked.factors, None, "control: the settings choose lights");
    }

    #[test]
    fn photons_are_stored_by_importance_where_few_are_needed() {
        let few = pilot(&[(false, 100, 4.0)]).steering(true, 100.0).expect("enough is needed");
        assert_eq!(few.kept_scale, 0.25);
        assert!((f64::from(few.least_kept) - ELSEWHERE * 0.1).abs() < 1e-4, "{few:?}");
        let most = pilot(&[(false, 700, 4.0)]).steering(true, 100.0).expect("enough is needed");
        assert_eq!(most.kept_scale, 0.0, "control: most photons are needed");
        // Few paths: more photons are stored of each.
        let short = pilot(&[(false, 10, 4.0)]).steering(true, 1.0).expect("enough is needed");
        assert_eq!(short.kept_scale, 0.0);
    }

    #[test]
    fn what_the_pilot_hardly_sees_is_left_alone() {
        assert_eq!(pilot(&[(true, 10, 1.0), (false, 500, 1.0)]).steering(true, 100.0), None);
        assert!(pilot(&[(true, 100, 1.0), (false, 500, 1.0)]).steering(true, 100.0).is_some());
        assert_eq!(pilot(&[(true, 15, 1.0)]).steering(true, 100.0), None);
        assert_eq!(pilot(&[]).steering(true, 100.0), None);
        let starved = |most_paths| pilot(&[(false, 500, 1.0)]).steering(true, most_paths);
        assert!(starved(0.1).is_none() && starved(0.5).is_some(), "most paths meet nothing");
    }
}
