//! Progressive passes: probabilistic progressive photon mapping (Knaus and Zwicker 2011).
//!
//! A pass has photons, camera samples and radii of its own, which depend on its index and the
//! settings alone. Passes can therefore be rendered in any order and by many machines. Indices of
//! photon paths and of camera samples go on from pass to pass, so that passes together are as well
//! distributed as one long run.

use std::cell::Cell;

use super::session::Session;
use crate::{
    error::{Error, Result},
    image::Film,
    map_kind::ByKind,
    passes::{PathRange, PathRanges},
    progress::{Progress, Stage},
    reference::mix,
    settings::{Emission, EstimateSettings, PassRange, PassSettings, PhotonSettings, PixelGrid, Settings},
    stats::{MapStats, Seconds, Stats},
};

/// Standard deviations of a Poisson count by which a pass stays below the capacity of a map.
const DEVIATIONS: f64 = 8.0;
/// Rays of final gathering of each sample of a pixel of the grid.
const CLOSER_RAYS: u32 = 4;
/// Offset of the numbers that give the seeds of closer estimates (the golden ratio, as a fraction
/// of 2^32).
const CLOSER_SEEDS: u32 = 0x9e37_79b9;
/// Number of a path from which on its random numbers would be those of another light: the upper
/// word of a round has 16 bits for itself.
const PATHS: u64 = 1 << 48;

/// Renders passes of one picture.
#[derive(Debug)]
pub struct Progressive<'a> {
    session: &'a Session<'a>,
    settings: &'a Settings,
    passes: PassSettings,
    /// Maps of pass 0, once they are known.
    first: Cell<Option<ByKind<MapStats>>>,
}

impl<'a> Progressive<'a> {
    /// Passes over the scene of a session.
    ///
    /// # Errors
    /// [`Error::Setting`] with the first setting that is out of range.
    pub fn new(session: &'a Session<'a>, settings: &'a Settings, passes: PassSettings) -> Result<Self> {
        settings.check()?;
        passes.check()?;
        Ok(Self { session, settings, passes, first: Cell::new(None) })
    }

    /// Renders the pass of that index. Pass 0 has the photons of a single picture; its maps say how
    /// many paths the others emit, for which they are traced once if the first pass that is
    /// rendered is another one.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn render(&self, index: u32, progress: &dyn Progress) -> Result<(Film, Stats)> {
        let Settings { photons, estimate, picture, .. } = self.settings;
        PassRange { first: index, end: index + 1 }.check(self.settings)?;
        let paths = if index == 0 { PathRanges::default() } else { self.paths(index, progress)? };
        let mut maps = self.session.photon_maps_of(photons, &paths, progress)?;
        if index == 0 {
            self.first.set(Some(found(maps.stats())));
        }
        maps.first_sample = Some(index * picture.spp);
        let shrunken = self.passes.estimate(estimate, index);
        let (film, mut stats) = self.session.film(&maps, &shrunken, picture, progress)?;
        let film = film.with_bandwidth(self.passes.bandwidth(estimate, index));
        if PixelGrid::of(film.whole()).places(film.window()).next().is_none() {
            return Ok((film, stats));
        }
        drop(maps);
        let closer = self.closer_film(&shrunken, index, &mut stats, &Checking(progress))?;
        Ok((film.checked_by(&closer), stats))
    }

    /// Renders the pixels of the grid by estimates of less bias, from photons and by samples of
    /// their own in each pass: points of the picture's sequences would err as it does, and those of
    /// one sequence opposite to each other.
    fn closer_film(
        &self,
        shrunken: &EstimateSettings,
        index: u32,
        stats: &mut Stats,
        progress: &dyn Progress,
    ) -> Result<Film> {
        let Settings { photons, picture, .. } = self.settings;
        let rays = if photons.mode.gathers_finally() { CLOSER_RAYS } else { 0 };
        let seed = mix(photons.seed ^ mix(index.wrapping_add(CLOSER_SEEDS)));
        let own = PhotonSettings { seed, final_gather: rays, ..photons.clone() };
        let ranges = self.paths(index.max(1), progress)?;
        let from_first = |range: PathRange| PathRange { first: 0, ..range };
        let paths = ByKind { global: from_first(ranges.global), caustic: from_first(ranges.caustic) };
        let mut maps = self.session.photon_maps_of(&own, &paths, progress)?;
        maps.first_sample = Some(0);
        let Seconds { photons, grid, .. } = maps.stats().seconds;
        let seconds = Seconds { photons, grid, ..Seconds::default() };
        stats.add(&Stats { rays: maps.stats().rays, seconds, ..Stats::default() });
        self.session.grid_film(&maps, &PassSettings::closer(shrunken), picture, stats, progress)
    }

    /// Indices of the photon paths of a pass from 1 on.
    fn paths(&self, index: u32, progress: &dyn Progress) -> Result<PathRanges> {
        let first = match self.first.get() {
            Some(first) => first,
            None => found(self.session.photon_maps(&self.settings.photons, progress)?.stats()),
        };
        self.first.set(Some(first));
        let ranges = path_ranges(&self.settings.photons, &first, index);
        let end = |range: &PathRange| range.first.saturating_add(range.count.unwrap_or(0));
        if end(&ranges.global).max(end(&ranges.caustic)) > PATHS {
            let problem = "needs more photon paths than have random numbers of their own".to_owned();
            return Err(Error::Setting { name: "passes.range", value: format!("{index}..{}", index + 1), problem });
        }
        Ok(ranges)
    }
}

/// Work that is not reported but may be stopped.
struct Checking<'a>(&'a dyn Progress);

impl Progress for Checking<'_> {
    fn report(&self, _: Stage, _: u64, _: u64) {}
    fn stop_requested(&self) -> bool {
        self.0.stop_requested()
    }
}

fn found(stats: &Stats) -> ByKind<MapStats> {
    ByKind { global: stats.photons.global, caustic: stats.photons.caustic }
}

/// Indices of the photon paths of pass `index`, from 1 on, given the maps of pass 0. Each of these
/// passes emits as many paths as the others, since a map that ends when it is full is biased by
/// about one photon of all, whatever the number of passes. They are a little fewer than fill the
/// maps.
fn path_ranges(settings: &PhotonSettings, first: &ByKind<MapStats>, index: u32) -> PathRanges {
    let range = |emitted: u64, count: u64| PathRange {
        first: emitted.saturating_add(u64::from(index - 1).saturating_mul(count)),
        count: Some(count),
    };
    let global = (first.global.emitted, paths_that_fit(first.global, settings.global));
    let caustic = (first.caustic.emitted, paths_that_fit(first.caustic, settings.caustic));
    if settings.emission == Emission::Unaimed {
        let ((a, b), (c, d)) = (global, caustic);
        return ByKind { global: range(a.max(c), b.max(d)), caustic: PathRange::default() };
    }
    ByKind { global: range(global.0, global.1), caustic: range(caustic.0, caustic.1) }
}

/// Number of paths, at most those of `map`, whose photons are all but certain to find room.
fn paths_that_fit(map: MapStats, capacity: u32) -> u64 {
    let capacity = f64::from(capacity);
    let room = (capacity - DEVIATIONS * capacity.sqrt()).max(0.5 * capacity);
    (map.emitted as f64 * (room / map.stored.max(1) as f64).min(1.0)) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_passes_follow_each_other() {
        let first = ByKind {
            global: MapStats { emitted: 50_000, stored: 100_000, seen: None },
            caustic: MapStats { emitted: 10_000_000, stored: 70, seen: None },
        };
        let settings = PhotonSettings::default();
        let [one, two, three] = [1, 2, 3].map(|index| path_ranges(&settings, &first, index));
        assert_eq!((one.global.first, one.caustic.first), (50_000, 10_000_000));
        for (a, b) in [(one, two), (two, three)] {
            assert_eq!(a.global.first + a.global.count.expect("given"), b.global.first);
            assert_eq!(a.caustic.first + a.caustic.count.expect("given"), b.caustic.first);
        }
        // A full map leaves room for 8 standard deviations, one that is not full has room.
        assert_eq!(one.global.count, Some(48_735));
        assert_eq!(one.caustic.count, Some(10_000_000));
        let unaimed = PhotonSettings { emission: Emission::Unaimed, ..settings };
        assert_eq!(path_ranges(&unaimed, &first, 1).global.first, 10_000_000, "one emission fills both maps");
    }

    #[test]
    fn small_maps_keep_half_of_their_paths() {
        assert_eq!(paths_that_fit(MapStats { emitted: 10, stored: 10, seen: None }, 10), 5);
        assert_eq!(paths_that_fit(MapStats { emitted: 10, stored: 0, seen: None }, 10), 10);
    }
}
