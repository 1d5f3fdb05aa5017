//! Grid plans: every mode with every n, and every k or number of rays of final gathering.

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
    let mut plan = empty("Study of", subject, look);
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
    let mut plan = empty("Final gathering of", subject, look);
    for &mode in modes {
        let base = settings.clone().with(|s| s.photons.mode = mode);
        let set = |s: &mut Settings, rays| s.photons.final_gather = rays;
        let rows = rows(&mut plan, (0, &base), photons, (rays, &set), repeats);
        let columns = rays.iter().map(|rays| format!("{rays} rays")).collect();
        let (title, plane) = (format!("Mode {}", mode.name()), mode.gathers_finally());
        plan.figures.push(Figure { title, columns, rows, questions: Vec::new(), plane });
    }
    plan
}

fn empty(title: &str, subject: Subject, look: Look) -> Plan {
    let title = format!("{title} {}", subject.scene.file_name);
    Plan { title, subjects: vec![subject], combinations: Vec::new(), figures: Vec::new(), look }
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
    let set = |s: &mut Settings, k| s.estimate.neighbors = k;
    let rows = rows(plan, (subject, base), photons, (neighbors, &set), repeats);
    let columns = neighbors.iter().map(|k| format!("k = {k}")).collect();
    let questions = if base.photons.mode.traces_photons() { Question::OF_A_PLANE.to_vec() } else { Vec::new() };
    plan.figures.push(Figure { title, columns, rows, questions, plane: base.photons.mode.traces_photons() });
}

/// Sets the value of a column.
type Set<'a> = &'a dyn Fn(&mut Settings, u32);

/// Rows of n, with a column for each value that `set` sets; adds their combinations.
fn rows(
    plan: &mut Plan,
    (subject, base): (usize, &Settings),
    photons: &[u32],
    (values, set): (&[u32], Set),
    repeats: u32,
) -> Vec<(String, Vec<Option<usize>>)> {
    let row = |&n: &u32| {
        let cells = values.iter().map(|&value| {
            let settings = base.clone().with(|s| {
                s.photons.global = n;
                s.photons.caustic = n;
                set(s, value);
            });
            Some(plan.add(Combination { subject, settings, repeats, measured: true }))
        });
        (format!("n = {}", short(n)), cells.collect())
    };
    photons.iter().map(row).collect()
}
