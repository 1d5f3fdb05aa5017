//! Grid plan: every mode with every n and every k.

use super::{Combination, Figure, Look, Plan, Question, Subject, numbers::short};
use crate::settings::{Mode, Settings};

/// Every combination of the modes, photon counts and neighbours with the other settings as given.
#[must_use]
pub fn grid(
    subject: Subject,
    settings: &Settings,
    modes: &[Mode],
    photons: &[u32],
    neighbors: &[u32],
    repeats: u32,
    look: Look,
) -> Plan {
    let title = format!("Study of {}", subject.scene.file_name);
    let mut plan = Plan { title, subjects: vec![subject], combinations: Vec::new(), figures: Vec::new(), look };
    for &mode in modes {
        let base = settings.clone().with(|s| s.photons.mode = mode);
        let title = format!("Mode {}", mode.name());
        add_plane(&mut plan, 0, &base, photons, neighbors, repeats, title);
    }
    plan
}

/// Every combination of the modes, photon counts and rays of final gathering with the other
/// settings as given.
#[must_use]
pub fn gather_grid(
    subject: Subject,
    settings: &Settings,
    modes: &[Mode],
    photons: &[u32],
    rays: &[u32],
    repeats: u32,
    look: Look,
) -> Plan {
    let title = format!("Final gathering of {}", subject.scene.file_name);
    let mut plan = Plan { title, subjects: vec![subject], combinations: Vec::new(), figures: Vec::new(), look };
    for &mode in modes {
        let base = settings.clone().with(|s| s.photons.mode = mode);
        let rows = photons.iter().map(|&n| {
            let cells = rays.iter().map(|&rays| {
                let settings = base.clone().with(|s| {
                    s.photons.global = n;
                    s.photons.caustic = n;
                    s.photons.final_gather = rays;
                });
                Some(plan.add(Combination { subject: 0, settings, repeats, measured: true }))
            });
            (format!("n = {}", short(n)), cells.collect())
        });
        let rows = rows.collect();
        let columns = rays.iter().map(|rays| format!("{rays} rays")).collect();
        let plane = mode.gathers_finally();
        plan.figures.push(Figure {
            title: format!("Mode {}", mode.name()),
            columns,
            rows,
            questions: Vec::new(),
            plane,
        });
    }
    plan
}

/// Adds a figure with n in rows and k in columns, and its combinations.
pub(super) fn add_plane(
    plan: &mut Plan,
    subject: usize,
    base: &Settings,
    photons: &[u32],
    neighbors: &[u32],
    repeats: u32,
    title: String,
) {
    let rows = photons.iter().map(|&n| {
        let cells = neighbors.iter().map(|&k| {
            let settings = base.clone().with(|s| {
                s.photons.global = n;
                s.photons.caustic = n;
                s.estimate.neighbors = k;
            });
            Some(plan.add(Combination { subject, settings, repeats, measured: true }))
        });
        (format!("n = {}", short(n)), cells.collect())
    });
    let rows = rows.collect();
    let columns = neighbors.iter().map(|k| format!("k = {k}")).collect();
    let questions = if base.photons.mode.traces_photons() { Question::OF_A_PLANE.to_vec() } else { Vec::new() };
    plan.figures.push(Figure { title, columns, rows, questions, plane: base.photons.mode.traces_photons() });
}
