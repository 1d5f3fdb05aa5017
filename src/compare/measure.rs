//! Statistics over the queries of a comparison.

use crate::{
    layout::{Gathered, VisiblePoint},
    reference::{Estimate, KdMap, TIE, are_tied, mix},
    settings::Settings,
};

/// Maximum number of photons in one tie that is examined.
const MAX_TIED: usize = 16;

/// Result of the grid at each point of a tile.
pub(super) struct GridAnswer {
    pub gathered: Vec<Gathered>,
    pub radiance: Vec<[f32; 4]>,
}

/// Counts and differences over all queries so far. A query is one visible point and one map.
#[derive(Clone, Debug, Default)]
pub(super) struct Measure {
    pub queries: u64,
    /// Number of queries in which both sides summed the same photons.
    pub identical: u64,
    /// Number of queries whose last photon and the next one are tied.
    pub tied: u64,
    /// Number of queries that differ in photons that are not tied.
    pub different: u64,
    pub radiance: Differences,
    pub radius: Differences,
    pub histogram: Histogram,
}

/// Relative differences.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Differences {
    pub max: f64,
    sum: f64,
    count: u64,
}

/// Histogram of queries over the relative difference of their radiance.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Histogram {
    /// Number of queries without any difference.
    pub none: u64,
    /// Counts per bin. Bin `i` ends at 10^([`Self::FIRST`] + (i + 1) / 2). The first bin also holds
    /// smaller values, the last also larger ones.
    pub bins: [u64; 18],
}

impl Measure {
    /// Counts the valid points of a tile. `explains` says whether the photons of a point differ in
    /// tied ones only.
    pub fn add(
        &mut self,
        points: &[VisiblePoint],
        grid: &GridAnswer,
        kdtree: &[Estimate],
        explains: impl Fn(usize, &Gathered) -> bool,
    ) {
        for i in (0..points.len()).filter(|&i| points[i].next_map != 0) {
            let (gathered, estimate) = (&grid.gathered[i], &kdtree[i]);
            let same = sets_agree(gathered, estimate);
            self.queries += 1;
            self.identical += u64::from(same);
            if estimate.tied {
                self.tied += 1;
                self.different += u64::from(!same && !explains(i, gathered));
                continue;
            }
            self.different += u64::from(!same);
            let channel = |c: usize| relative(grid.radiance[i][c].into(), estimate.radiance[c]);
            let radiance = channel(0).max(channel(1)).max(channel(2));
            self.radiance.add(radiance);
            self.histogram.add(radiance);
            let radius = |squared: f32| f64::from(squared).sqrt();
            self.radius.add(relative(radius(gathered.radius_squared), radius(estimate.radius_squared)));
        }
    }
}

impl Differences {
    fn add(&mut self, difference: f64) {
        self.max = self.max.max(difference);
        self.sum += difference;
        self.count += 1;
    }

    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}

impl Histogram {
    /// Exponent of ten at which the first bin begins.
    pub const FIRST: i32 = -9;

    fn add(&mut self, difference: f64) {
        if difference == 0.0 {
            self.none += 1;
        } else {
            let bin = ((difference.log10() - f64::from(Self::FIRST)) * 2.0).clamp(0.0, 17.0);
            self.bins[bin as usize] += 1;
        }
    }
}

/// |a - b| relative to the larger value; infinite if either is NaN.
pub(super) fn relative(a: f64, b: f64) -> f64 {
    match (a - b).abs() {
        0.0 => 0.0,
        difference if difference.is_finite() => difference / a.abs().max(b.abs()),
        _ => f64::INFINITY,
    }
}

/// Whether both sides summed the same photons.
fn sets_agree(grid: &Gathered, kdtree: &Estimate) -> bool {
    grid.fingerprint == kdtree.fingerprint && grid.count == kdtree.count
}

/// Whether exchanging photons tied with the estimate's last one yields the grid's photons.
pub(super) fn explained_by_ties(
    map: &KdMap,
    point: &VisiblePoint,
    settings: &Settings,
    estimate: &Estimate,
    grid: &Gathered,
) -> bool {
    let edge = estimate.radius_squared;
    // The estimate sums k photons or all but one, unless the maximum radius cuts through the tie.
    let cut = settings.estimate.max_radius.is_some_and(|r| are_tied(edge, r * r));
    if !cut && grid.count != estimate.count {
        return false;
    }
    let near = map.search(point, settings.estimate.neighbors + MAX_TIED as u32, edge * (1.0 + 2.0 * TIE));
    let tied: Vec<u32> = near.iter().filter(|n| are_tied(n.0, edge)).map(|n| mix(n.1)).collect();
    let nearer = near.iter().take_while(|n| !are_tied(n.0, edge));
    let (base, certain) = nearer.fold((0_u32, 0), |(sum, n), photon| (sum.wrapping_add(mix(photon.1)), n + 1));
    tied.len() < MAX_TIED
        && (certain..=certain + tied.len() as u32).contains(&grid.count)
        && some_add_up(&tied, grid.count - certain, grid.fingerprint.wrapping_sub(base))
}

/// Whether some `count` of the numbers have the wrapping sum `sum`.
fn some_add_up(numbers: &[u32], count: u32, sum: u32) -> bool {
    match numbers {
        _ if count == 0 => sum == 0,
        [] => false,
        [first, rest @ ..] => some_add_up(rest, count - 1, sum.wrapping_sub(*first)) || some_add_up(rest, count, sum),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        layout::{PhotonFlux, PhotonPosition, octahedral},
        reference::fingerprint,
    };

    const SETTINGS: fn() -> Settings = || Settings::default().with(|s| s.estimate.neighbors = 2);

    /// Photons at these distances along x, all incident from above, with the query point at the
    /// origin.
    fn line(distances: &[f32]) -> (KdMap, VisiblePoint) {
        let photon = |&x: &f32| PhotonPosition { position: [x, 0.0, 0.0], wi: octahedral(glam::Vec3::Y) };
        let flux = PhotonFlux { flux: [1.0; 3], normal: 0 };
        let up = [0.0, 1.0, 0.0];
        let point = VisiblePoint { next_map: 1, ng: up, ns: up, weight: [1.0; 3], ..VisiblePoint::default() };
        (KdMap::new(distances.iter().map(photon).collect(), vec![flux; distances.len()], 1), point)
    }

    /// Counts of a query in which the grid has summed these photons of the line, with the
    /// estimate's radiance times `factor`.
    fn counted(distances: &[f32], summed: &[u32], factor: f32) -> Measure {
        let (map, point) = line(distances);
        let estimate = map.estimate(&point, &SETTINGS().estimate);
        let gathered = Gathered {
            radius_squared: estimate.radius_squared,
            count: summed.len() as u32,
            fingerprint: fingerprint(summed),
            narrow: 0,
        };
        let [r, g, b] = estimate.radiance.map(|x| x as f32);
        let answer = GridAnswer { gathered: vec![gathered], radiance: vec![[r, g * factor, b, 0.0]] };
        let mut measure = Measure::default();
        let explains = |_, gathered: &Gathered| explained_by_ties(&map, &point, &SETTINGS(), &estimate, gathered);
        measure.add(&[point, VisiblePoint::default()], &answer, &[estimate, estimate], explains);
        measure
    }

    /// 2 m, and a distance so close to it that the squares are tied.
    const TIED: [f32; 3] = [2.0, 2.000_000_5, 2.000_000_2];

    #[test]
    fn ties_may_be_exchanged_and_nothing_else() {
        let photons = [1.0, TIED[0], 3.0, TIED[1]];
        for (summed, identical, different) in
            [(&[0, 1][..], 1, 0), (&[0, 3], 0, 0), (&[1, 3], 0, 1), (&[0, 2], 0, 1), (&[0], 0, 1), (&[0, 1, 3], 0, 1)]
        {
            let m = counted(&photons, summed, 2.0);
            assert_eq!((m.queries, m.tied, m.identical, m.different), (1, 1, identical, different), "{summed:?}");
            assert_eq!(m.radiance.max, 0.0, "ties are left out of the differences");
        }
        // Several tied photons, of which the estimate sums two.
        let m = counted(&[TIED[0], TIED[1], TIED[2]], &[1, 2], 1.0);
        assert_eq!((m.tied, m.identical, m.different), (1, 0, 0));
    }

    #[test]
    fn without_a_tie_the_sets_are_equal_and_differences_count() {
        let photons = [1.0, 2.0, 3.0, 4.0];
        let m = counted(&photons, &[0, 1], 1.0);
        assert_eq!((m.queries, m.tied, m.identical, m.different), (1, 0, 1, 0));
        assert!(m.radiance.max < 1e-7 && m.radius.max == 0.0);
        let m = counted(&photons, &[0, 2], 1.01);
        assert_eq!((m.identical, m.different), (0, 1));
        assert!((m.radiance.max - 0.01 / 1.01).abs() < 1e-6 && (m.radiance.mean() - m.radiance.max).abs() < 1e-12);
    }

    #[test]
    fn differences_are_relative_to_the_larger() {
        assert_eq!(relative(0.0, 0.0), 0.0);
        assert_eq!(relative(1.0, 0.0), 1.0);
        assert_eq!(relative(3.0, 4.0), 0.25);
        assert_eq!(relative(f64::NAN, 4.0), f64::INFINITY);
    }

    #[test]
    fn bins_are_half_decades() {
        let mut histogram = Histogram::default();
        for difference in [0.0, 1e-12, 2e-9, 2e-7, 5e-7, 0.5, 1.0, f64::INFINITY] {
            histogram.add(difference);
        }
        assert_eq!(histogram.none, 1);
        let expected = [(0, 2), (4, 1), (5, 1), (17, 3)];
        assert!(expected.iter().all(|&(bin, count)| histogram.bins[bin] == count), "{histogram:?}");
        assert_eq!(histogram.bins.iter().sum::<u64>(), 7);
    }

    #[test]
    fn sums_are_found_only_of_as_many() {
        let numbers = [5, 7, u32::MAX, 11];
        assert!(some_add_up(&numbers, 2, 12) && some_add_up(&numbers, 2, 4) && some_add_up(&numbers, 0, 0));
        assert!(!some_add_up(&numbers, 1, 12) && !some_add_up(&numbers, 3, 12) && !some_add_up(&numbers, 5, 22));
    }
}
