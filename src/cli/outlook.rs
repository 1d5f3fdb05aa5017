//! Time that a picture will take, from the pace of its own stages.

use caustica::{
    Result,
    progress::Stage,
    scene::Scene,
    settings::{ExtraLayers, Search, Settings},
};

/// What a sample of the camera takes of the time of a ray of final gathering: itself, with light of
/// the caustic map, and each light sample of lights that have an extent. `docs/benchmarks.md` says
/// how well that fits.
const SAMPLE: f64 = 1.4;
const CAUSTICS: f64 = 2.8;
const LIGHT_SAMPLE: f64 = 1.0;
/// The same under an environment: rays that escape to it take little.
const SKY_SAMPLE: f64 = 2.0;
/// Samples that a pixel has besides for each time that some may double, as a fraction of those of
/// every pixel.
const UNEVEN: f64 = 0.05;
/// Time of a further sample, in times of one of those of every pixel: it has fewer queries.
const FURTHER: f64 = 0.6;
/// Part of a stage that has to be done, beyond its first report, before its pace is trusted: the
/// top of a picture may be sky. More where something is known already.
const TRUSTED: f64 = 1.0 / 16.0;
const TRUSTED_AFTER: f64 = 1.0 / 4.0;

/// What is known of a picture before it is begun.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Time of the camera pass, in times of that of the records; `None` without records.
    camera: Option<f64>,
    /// Further samples that were counted in, as a fraction of those of every pixel.
    further: f64,
    /// Groups of lights, each of which has photons and a camera pass of its own.
    groups: usize,
}

impl Plan {
    /// # Errors
    /// Too many groups of lights.
    pub fn new(scene: &Scene, settings: &Settings) -> Result<Self> {
        let Settings { photons, estimate, picture, .. } = settings;
        let has_records = photons.final_gather > 0 && estimate.gather_spacing > 0 && estimate.search != Search::KdTree;
        let light_sample = match scene.environment {
            Some(_) => SKY_SAMPLE,
            None if scene.has_emission() => LIGHT_SAMPLE,
            None => 0.0,
        };
        let sample = SAMPLE
            + light_sample * f64::from(picture.light_samples)
            + if scene.has_specular() { CAUSTICS } else { 0.0 };
        let rays = f64::from(photons.final_gather) / f64::from(estimate.gather_spacing).powi(2);
        let further = UNEVEN * f64::from(picture.doublings());
        let samples = f64::from(picture.spp) * (1.0 + further);
        let by_group = picture.layers.contains(&ExtraLayers::Lights);
        let groups = if by_group { scene.light_groups()?.len().max(1) } else { 1 };
        Ok(Self { camera: has_records.then(|| samples * sample / rays), further, groups })
    }
}

/// Reports of the stage that runs.
#[derive(Clone, Copy, Debug)]
struct Pace {
    stage: Stage,
    /// Time of the first report.
    began: f64,
    /// Time and units of the first report of units that are done: before, kernels may still be
    /// compiled.
    warm: Option<(f64, u64)>,
    /// Units of the last report.
    done: u64,
}

/// Estimates the time that is left.
#[derive(Debug)]
pub struct Outlook {
    plan: Plan,
    pace: Option<Pace>,
    /// Groups of lights that were begun, and when the last of them was.
    groups: usize,
    group_began: f64,
    /// Seconds left, and when that was said.
    left: Option<(f64, f64)>,
    /// Seconds that the camera pass was expected to take when it began, and its samples then.
    camera: Option<(f64, u64)>,
}

impl Outlook {
    pub fn new(plan: Plan) -> Self {
        Self { plan, pace: None, groups: 0, group_began: 0.0, left: None, camera: None }
    }

    /// Takes a report of the render at a time in seconds, and says how many are left, once that is
    /// known.
    pub fn left(&mut self, stage: Stage, done: u64, total: u64, now: f64) -> Option<f64> {
        let pace = match self.pace {
            Some(pace) if pace.stage == stage => pace,
            _ => Pace { stage, began: now, warm: None, done: 0 },
        };
        let begins = self.pace.is_none_or(|before| before.stage != stage);
        if begins && stage == Stage::Photons {
            (self.groups, self.group_began) = (self.groups + 1, now);
        }
        self.pace = Some(Pace { warm: pace.warm.or((done > 0).then_some((now, done))), done, ..pace });
        if begins && stage == Stage::Camera && self.plan.groups <= 1 {
            self.camera = self.plan.camera.and(self.left).map(|(left, told)| (left - (now - told), total));
        }
        // A report of nothing new says nothing of the pace.
        let measured = if done > pace.done { self.measured(pace, done, total, now) } else { None };
        let measured = measured.or_else(|| self.by_samples(stage, done, total));
        if let Some(left) = measured {
            let groups_left = self.plan.groups.saturating_sub(self.groups.max(1));
            let of_group = now - self.group_began + left;
            self.left = Some((left + groups_left as f64 * of_group, now));
        }
        self.left.map(|(left, told)| (left - (now - told)).max(0.0))
    }

    /// Seconds left where pixels need more samples than were counted in, as the first tile shows.
    fn by_samples(&self, stage: Stage, done: u64, total: u64) -> Option<f64> {
        let (seconds, even) = self.camera.filter(|_| stage == Stage::Camera)?;
        let further = total as f64 / even as f64 - 1.0;
        let needed = (1.0 + FURTHER * further) / (1.0 + self.plan.further);
        let is_told_by_pace = done as f64 >= TRUSTED_AFTER * total as f64;
        (needed > 1.0 && !is_told_by_pace).then(|| seconds * needed * (1.0 - done as f64 / total as f64))
    }

    /// Seconds left of this group of lights, by the pace of a stage that says something of it.
    fn measured(&self, pace: Pace, done: u64, total: u64, now: f64) -> Option<f64> {
        let later = match pace.stage {
            Stage::Records => self.plan.camera?,
            Stage::Camera | Stage::Compare => 0.0,
            _ => return None,
        };
        let (since, before) = match pace.warm {
            Some((time, units)) if done > units => (time, units),
            // Of two steps, one has to do.
            None if 2 * done >= total => (pace.began, 0),
            _ => return None,
        };
        let is_known = pace.stage == Stage::Camera && self.plan.camera.is_some();
        let trusted = if is_known { TRUSTED_AFTER } else { TRUSTED };
        if ((done - before) as f64) < trusted * total as f64 {
            return None;
        }
        let unit = (now - since) / (done - before) as f64;
        Some(unit * (total.saturating_sub(done) as f64 + later * total as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outlook(camera: Option<f64>, groups: usize) -> Outlook {
        Outlook::new(Plan { camera, further: 0.0, groups })
    }

    #[test]
    fn time_is_told_once_a_stage_has_a_pace() {
        let mut one = outlook(Some(2.0), 1);
        let mut at = |stage, done, total, now| one.left(stage, done, total, now);
        assert_eq!(at(Stage::Photons, 50, 100, 1.0), None);
        assert_eq!(at(Stage::Cells, 1, 1, 2.0), None);
        assert_eq!(at(Stage::Records, 0, 64, 3.0), None);
        assert_eq!(at(Stage::Records, 16, 64, 9.0), None, "kernels are compiled");
        // 2 s for 16 of 64 rays: 4 s are left of them, and twice 8 s for the camera.
        assert_eq!(at(Stage::Records, 32, 64, 11.0), Some(20.0));
        assert_eq!(at(Stage::Camera, 0, 4, 15.0), Some(16.0), "nothing new, but time went by");
        assert_eq!(at(Stage::Camera, 1, 4, 20.0), Some(11.0));
        assert_eq!(at(Stage::Camera, 2, 4, 23.0), Some(6.0), "measured");
        assert_eq!(at(Stage::Camera, 2, 4, 39.0), Some(0.0), "late, but never less than nothing");
    }

    #[test]
    fn more_samples_than_expected_take_longer() {
        let mut one = Outlook::new(Plan { camera: Some(1.0), further: 0.2, groups: 1 });
        let mut at = |stage, done, total, now| one.left(stage, done, total, now);
        at(Stage::Records, 0, 64, 0.0);
        at(Stage::Records, 32, 64, 4.0);
        assert_eq!(at(Stage::Records, 64, 64, 8.0), Some(8.0));
        assert_eq!(at(Stage::Camera, 0, 4, 8.0), Some(8.0), "nothing is known yet");
        assert_eq!(at(Stage::Camera, 0, 4, 9.0), Some(7.0), "a tile has no further samples");
        assert_eq!(at(Stage::Camera, 0, 24, 10.0), Some(8.0 * 4.0 / 1.2), "five further samples for each");
        assert_eq!(at(Stage::Camera, 3, 24, 13.0), Some(7.0 * 4.0 / 1.2));
        // From here on, by 2 s a sample.
        assert_eq!(at(Stage::Camera, 9, 24, 25.0), Some(30.0));
    }

    #[test]
    fn without_records_the_samples_tell() {
        let mut one = outlook(None, 1);
        let mut at = |done, total, now| one.left(Stage::Camera, done, total, now);
        assert_eq!(at(0, 2, 1.0), None);
        assert_eq!(at(1, 2, 3.0), Some(2.0), "of two steps, the first has to do");
    }

    #[test]
    fn groups_of_lights_take_as_long_as_the_first() {
        let mut three = outlook(None, 3);
        let mut at = |stage, done, total, now| three.left(stage, done, total, now);
        at(Stage::Photons, 0, 100, 10.0);
        at(Stage::Camera, 0, 2, 14.0);
        // 4 s of photons and twice 2 s for tiles, for each of three groups.
        assert_eq!(at(Stage::Camera, 1, 2, 16.0), Some(2.0 + 2.0 * 8.0));
        at(Stage::Photons, 0, 100, 18.0);
        at(Stage::Camera, 0, 2, 22.0);
        assert_eq!(at(Stage::Camera, 1, 2, 24.0), Some(2.0 + 8.0));
    }
}
