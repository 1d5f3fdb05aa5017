//! Runs a study: renders the missing cells and measures all.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use super::{
    cells::{Cells, Key},
    cost::{Meter, Watch, work},
    job::{Job, finer_settings, photon_part, repeats},
    measure::{Row, measure},
    picture::{mean_frame, picture},
    plan::{Combination, Plan, Reference, reference_mode},
};
use crate::{
    error::{Error, Result},
    gpu::Gpu,
    image::Frame,
    progress::{Progress, Silent},
    renderer::{PhotonMaps, Session, check},
    settings::Settings,
    stats::DeviceStats,
};

/// Results of a study.
#[derive(Clone, Debug)]
pub struct Results {
    /// Device on which the cells were rendered.
    pub device: DeviceStats,
    /// Rows in the order of [`Plan::combinations`].
    pub rows: Vec<Row>,
    /// Descriptions of the references, one line each.
    pub references: Vec<String>,
    /// Number of cells rendered by this run.
    pub rendered: usize,
    /// Number of cells found on the disk.
    pub kept: usize,
    /// Failures with their causes, one line each.
    pub failures: Vec<String>,
}

/// Runs the study in the folder, which is created if it does not exist.
///
/// # Errors
/// Fails with the errors of [`Plan::check`], for a folder that cannot be written, or with
/// [`Error::Stopped`]. A failed cell is not an error; its row and [`Results::failures`] record it.
pub fn run(gpu: &Gpu, plan: &Plan, folder: &Path, watch: &dyn Watch) -> Result<Results> {
    plan.check()?;
    let cells = Cells::open(folder)?;
    let study = Study { gpu, plan, cells };
    let mut jobs = study.jobs();
    let all = jobs.len();
    jobs.retain(|job| study.cells.find(&job.key).is_none());
    let meter = Meter::new(watch, jobs.len(), all - jobs.len(), jobs.iter().map(|job| work(&job.settings)).sum());
    let mut failed = BTreeMap::new();
    study.render_all(&jobs, &meter, &mut failed)?;
    let rows = study.rows(&failed, &meter)?;
    Ok(Results {
        device: DeviceStats { name: gpu.name.clone(), driver: gpu.driver.clone() },
        references: study.describe_references(),
        rows,
        rendered: jobs.len() - failed.len(),
        kept: all - jobs.len(),
        failures: failed.into_values().collect(),
    })
}

/// Failed cells and their error messages.
type Failed = BTreeMap<Key, String>;

struct Study<'a> {
    gpu: &'a Gpu,
    plan: &'a Plan,
    cells: Cells,
}

impl Study<'_> {
    /// All renders, each once, references first, ordered so that renders of the same photons are
    /// adjacent.
    fn jobs(&self) -> Vec<Job> {
        let mut jobs: Vec<Job> = Vec::new();
        let mut add = |subject: usize, settings: Settings| {
            let key = self.key(subject, &settings);
            if jobs.iter().all(|job| job.key != key) {
                jobs.push(Job { subject, settings, key });
            }
        };
        for combination in self.plan.combinations.iter() {
            self.reference_cells(combination).into_iter().for_each(|settings| add(combination.subject, settings));
        }
        for combination in &self.plan.combinations {
            repeats(combination).for_each(|settings| add(combination.subject, settings));
        }
        jobs.sort_by_key(|job| (job.subject, serde_json::to_string(&photon_part(&job.settings)).ok()));
        jobs
    }

    fn key(&self, subject: usize, settings: &Settings) -> Key {
        Key::new(self.gpu, &self.plan.subjects[subject].scene, settings)
    }

    /// Settings of the passes of a combination's reference, if the study renders it.
    fn reference_cells(&self, combination: &Combination) -> Vec<Settings> {
        let subject = &self.plan.subjects[combination.subject];
        let (Reference::Finer(finer), true) = (&subject.reference, combination.measured) else { return Vec::new() };
        let mode = reference_mode(combination.settings.photons.mode, subject.scene.has_specular());
        finer_settings(&combination.settings, *finer, mode)
    }

    fn render_all(&self, jobs: &[Job], meter: &Meter, failed: &mut Failed) -> Result<()> {
        let mut warm = BTreeSet::new();
        for of_subject in jobs.chunk_by(|a, b| a.subject == b.subject) {
            let scene = &self.plan.subjects[of_subject[0].subject].scene;
            for sharing in of_subject.chunk_by(|a, b| photon_part(&a.settings) == photon_part(&b.settings)) {
                let settings = &sharing[0].settings;
                let begun = self.begin(&sharing[0], meter);
                let opened =
                    check(scene, settings).and_then(|()| Session::open(self.gpu, scene, &settings.lights, meter));
                let traced = opened.and_then(|session| {
                    begun?;
                    if warm.insert((sharing[0].subject, settings.photons.mode as u32)) {
                        self.warm_up(&session, settings)?;
                    }
                    let maps = session.photon_maps(&settings.photons, meter)?;
                    Ok((session, maps))
                });
                match traced {
                    Ok((session, maps)) => self.render_sharing(&session, &maps, sharing, meter, failed)?,
                    Err(error) => {
                        let text = one_line(error)?;
                        for job in sharing {
                            failed.insert(job.key.clone(), format!("{}: {text}", self.name(job)));
                        }
                        // The first cell was begun above.
                        meter.end();
                        for job in &sharing[1..] {
                            self.begin(job, meter)?;
                            meter.end();
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn begin(&self, job: &Job, meter: &Meter) -> Result<()> {
        meter.check()?;
        meter.begin(self.name(job), &job.settings);
        Ok(())
    }

    /// Renders all pictures of one set of maps.
    fn render_sharing(
        &self,
        session: &Session,
        maps: &PhotonMaps,
        jobs: &[Job],
        meter: &Meter,
        failed: &mut Failed,
    ) -> Result<()> {
        for (i, job) in jobs.iter().enumerate() {
            if i > 0 {
                self.begin(job, meter)?;
            }
            let scene = &self.plan.subjects[job.subject].scene;
            let made = picture(session, maps, &job.settings, meter);
            let kept =
                made.and_then(|(frame, measured)| self.cells.keep(&job.key, scene, &job.settings, &frame, measured));
            if let Err(error) = kept {
                let text = one_line(error)?;
                failed.insert(job.key.clone(), format!("{}: {text}", self.name(job)));
            }
            meter.end();
        }
        Ok(())
    }

    /// Warm-up render before the first timed one: drivers compile kernels at their first dispatch.
    fn warm_up(&self, session: &Session, settings: &Settings) -> Result<()> {
        session.prefetch(settings);
        let tiny = settings.clone().with(|s| {
            s.photons.global = 64;
            s.photons.caustic = 64;
            s.photons.max_paths = Some(1024);
            s.picture.spp = 1;
            s.picture.size = Some((8, 8));
        });
        let maps = session.photon_maps(&tiny.photons, &Silent)?;
        session.picture(&maps, &tiny.estimate, &tiny.picture, &Silent)?;
        Ok(())
    }

    fn rows(&self, failed: &Failed, progress: &dyn Progress) -> Result<Vec<Row>> {
        let mut references = BTreeMap::new();
        let mut rows = Vec::new();
        for combination in &self.plan.combinations {
            progress.check()?;
            let reference = self.reference(combination, failed, &mut references)?;
            let keys: Vec<Key> = repeats(combination).map(|s| self.key(combination.subject, &s)).collect();
            let error = keys.iter().find_map(|key| failed.get(key)).cloned();
            let mut renders = Vec::new();
            for key in keys.iter().filter(|_| error.is_none()) {
                // This run has filled or checked the folder, so its cells exist.
                let lost = || Error::Gpu("a finished cell has gone from the folder; run the study again".to_string());
                renders.push((self.cells.frame(key)?, self.cells.find(key).ok_or_else(lost)?));
            }
            rows.push(measure(self.plan, combination, &renders, reference, error));
        }
        Ok(rows)
    }

    /// Reference picture of the combination; `None` if there is none or its render failed.
    fn reference<'r>(
        &'r self,
        combination: &Combination,
        failed: &Failed,
        known: &'r mut BTreeMap<Vec<Key>, Frame>,
    ) -> Result<Option<&'r Frame>> {
        if !combination.measured {
            return Ok(None);
        }
        if let Reference::Picture { frame, .. } = &self.plan.subjects[combination.subject].reference {
            return Ok(Some(frame));
        }
        let settings = self.reference_cells(combination);
        let keys: Vec<Key> = settings.iter().map(|s| self.key(combination.subject, s)).collect();
        if keys.is_empty() || keys.iter().any(|key| failed.contains_key(key)) {
            return Ok(None);
        }
        if !known.contains_key(&keys) {
            let frames = keys.iter().map(|key| self.cells.frame(key)).collect::<Result<Vec<_>>>()?;
            known.insert(keys.clone(), mean_frame(frames));
        }
        Ok(known.get(&keys))
    }

    fn name(&self, job: &Job) -> String {
        super::measure::name(&self.plan.subjects[job.subject].scene.file_name, &job.settings)
    }

    fn describe_references(&self) -> Vec<String> {
        let describe = |subject: &super::Subject| match &subject.reference {
            Reference::None => None,
            Reference::Picture { name, .. } => Some(format!("{}: {name}", subject.scene.file_name)),
            Reference::Finer(f) => Some(format!(
                "{}: our own finer render, the mean of {} passes of {} photons a map, k = {}, {} samples a pixel",
                subject.scene.file_name,
                f.passes,
                super::numbers::short(f.photons),
                f.neighbors,
                f.spp
            )),
        };
        self.plan.subjects.iter().filter_map(describe).collect()
    }
}

/// Converts the error of a failed cell to one line. A stop request or a lost device is returned as
/// an error and ends the study; finished cells are kept.
fn one_line(error: Error) -> Result<String> {
    match error {
        Error::Stopped | Error::Lost { .. } => Err(error),
        other => Ok(other.to_string().lines().collect::<Vec<_>>().join(" ")),
    }
}
