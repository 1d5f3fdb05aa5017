//! The figures of a university report on photon mapping, on the scenes of this project.

use std::path::Path;

use super::{Combination, Figure, Finer, Look, Plan, Question, Reference, Subject, grid::add_plane, numbers::short};
use crate::{
    error::Result,
    scene::Scene,
    settings::{Mode, Settings},
};

const PHOTONS: [u32; 4] = [1_000, 10_000, 50_000, 100_000];
const NEIGHBORS: [u32; 4] = [1, 10, 50, 100];

/// Scenes, in the order of the indices used here; the report numbers them 1, 2 and 4.
const MIRROR_AND_GLASS: usize = 0;
const DIFFUSE: usize = 1;
const DIFFUSE_IN_GLASS: usize = 2;
const ONE_LIGHT: usize = 3;
const THREE_LIGHTS: usize = 4;
const FILES: [&str; 5] =
    ["mirror-and-glass.gltf", "diffuse.gltf", "diffuse-in-glass.gltf", "one-light.gltf", "three-lights.gltf"];

/// Plans the report's figures, each with its own n and k and otherwise the given settings. `scale`
/// multiplies every n; 1 reproduces the report. Where a figure needs a reference, the study renders
/// it.
///
/// # Errors
/// Fails if a scene is missing in the folder or cannot be read.
pub fn report(folder: &Path, settings: &Settings, repeats: u32, scale: f64, look: Look) -> Result<Plan> {
    let scenes = FILES.iter().map(|file| Scene::load(&folder.join(file))).collect::<Result<Vec<_>>>()?;
    let scaled = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
    let subjects = scenes.into_iter().enumerate().map(|(i, scene)| {
        let finer = Finer::than(scaled(PHOTONS[3]), settings.picture.spp);
        let reference = if i <= DIFFUSE { Reference::Finer(finer) } else { Reference::None };
        Subject { scene, reference }
    });
    let title = "Photon mapping: what a report claims, and what was measured".to_string();
    let subjects = subjects.collect();
    let plan = Plan { title, subjects, combinations: Vec::new(), figures: Vec::new(), look };
    let mut figures = Figures { plan, settings, repeats, scaled: &scaled };
    figures.direct_light();
    figures.delta_shadows();
    figures.plane();
    figures.corners();
    figures.diffuse_in_glass();
    figures.lights();
    Ok(figures.plan)
}

/// Builder that adds figures to a plan.
struct Figures<'a> {
    plan: Plan,
    settings: &'a Settings,
    repeats: u32,
    scaled: &'a dyn Fn(u32) -> u32,
}

impl Figures<'_> {
    fn add(&mut self, subject: usize, mode: Mode, n: u32, k: u32, measured: bool) -> Option<usize> {
        let n = (self.scaled)(n);
        let settings = self.settings.clone().with(|s| {
            s.photons.mode = mode;
            s.photons.global = n;
            s.photons.caustic = n;
            s.estimate.neighbors = k;
        });
        Some(self.plan.add(Combination { subject, settings, repeats: 1, measured }))
    }

    fn figure(
        &mut self,
        title: &str,
        columns: Vec<String>,
        rows: Vec<(String, Vec<Option<usize>>)>,
        questions: &[Question],
    ) {
        let (title, questions) = (title.to_string(), questions.to_vec());
        self.plan.figures.push(Figure { title, columns, rows, questions, plane: false });
    }

    fn direct_light(&mut self) {
        let modes = [Mode::DirectRays, Mode::DirectPhotons];
        let row = |figures: &mut Self, label: &str, subject| {
            let cells = modes.iter().map(|&mode| figures.add(subject, mode, 100_000, 30, false)).collect();
            (label.to_string(), cells)
        };
        let rows = vec![row(self, "scene 2", DIFFUSE), row(self, "scene 1", MIRROR_AND_GLASS)];
        let title = format!("Direct light by rays and by photons (n = {}, k = 30)", self.n(100_000));
        self.figure(&title, names(&modes), rows, &[Question::DirectAgrees]);
    }

    fn delta_shadows(&mut self) {
        let modes = [Mode::DirectRays, Mode::DirectPhotons, Mode::Hybrid];
        let cells = modes.iter().map(|&mode| self.add(MIRROR_AND_GLASS, mode, 100_000, 100, false)).collect();
        let title = format!("Shadows of mirror and glass (n = {}, k = 100)", self.n(100_000));
        self.figure(&title, names(&modes), vec![("scene 1".to_string(), cells)], &[Question::DeltaShadows]);
    }

    /// Adds the whole plane of n and k, and the report's two lines through it.
    fn plane(&mut self) {
        let photons = PHOTONS.map(self.scaled);
        let along_n = self.add_plane(&photons, &[10], "More photons at k = 10 (scene 1)".to_string());
        (along_n.plane, along_n.questions) =
            (false, vec![Question::Energy, Question::GatherDominates, Question::TimeWithPhotons]);
        transpose(along_n);
        let title = format!("More neighbours at n = {} (scene 1)", short(photons[3]));
        let along_k = self.add_plane(&photons[3..], &NEIGHBORS, title);
        (along_k.plane, along_k.questions) = (
            false,
            vec![Question::Energy, Question::GatherDominates, Question::TimeWithNeighbors, Question::NoiseForBias],
        );
        let whole = self.add_plane(&photons, &NEIGHBORS, "All n and k (scene 1)".to_string());
        whole.questions = vec![Question::Proportion];
    }

    /// Adds a figure of scene 1 with n in rows and k in columns.
    fn add_plane(&mut self, photons: &[u32], neighbors: &[u32], title: String) -> &mut Figure {
        let base = self.settings.clone().with(|s| s.photons.mode = Mode::Hybrid);
        add_plane(&mut self.plan, MIRROR_AND_GLASS, &base, photons, neighbors, self.repeats, title);
        self.plan.figures.last_mut().expect("it was added")
    }

    fn corners(&mut self) {
        let row = |figures: &mut Self, mode: Mode| {
            let cells = NEIGHBORS.iter().map(|&k| figures.add(DIFFUSE, mode, 100_000, k, true)).collect();
            (mode.name().to_string(), cells)
        };
        let rows = vec![row(self, Mode::Hybrid), row(self, Mode::Photons)];
        let title = format!("Corners (scene 2, n = {})", self.n(100_000));
        let columns = NEIGHBORS.iter().map(|k| format!("k = {k}")).collect();
        self.figure(&title, columns, rows, &[Question::CornersBright]);
    }

    fn diffuse_in_glass(&mut self) {
        let modes = [Mode::Hybrid, Mode::Photons, Mode::DirectRays, Mode::DirectPhotons];
        let row = |figures: &mut Self, n: u32, k: u32| {
            let cells = modes.iter().map(|&mode| figures.add(DIFFUSE_IN_GLASS, mode, n, k, false)).collect();
            (format!("n = {}, k = {k}", figures.n(n)), cells)
        };
        let rows = vec![row(self, 100_000, 100), row(self, 10_000, 50)];
        let title = "A diffuse ball in glass (scene 4): all light by both ways, and direct light only";
        self.figure(title, names(&modes), rows, &[Question::GatherDominates]);
    }

    fn lights(&mut self) {
        let cells = [ONE_LIGHT, THREE_LIGHTS].map(|subject| self.add(subject, Mode::Hybrid, 10_000, 50, false));
        let title = format!("One light against three (n = {}, k = 50)", self.n(10_000));
        let columns = ["one light", "three lights"].map(str::to_string).to_vec();
        self.figure(&title, columns, vec![("hybrid".to_string(), cells.to_vec())], &[Question::ThreeLights]);
    }

    fn n(&self, n: u32) -> String {
        short((self.scaled)(n))
    }
}

fn names(modes: &[Mode]) -> Vec<String> {
    modes.iter().map(|mode| mode.name().to_string()).collect()
}

/// Swaps rows and columns, since a row of pictures takes less space than a column.
fn transpose(figure: &mut Figure) {
    let columns = figure.rows.iter().map(|(label, _)| label.clone()).collect();
    let row = |c: usize| {
        let cells = figure.rows.iter().map(|(_, cells)| cells[c]).collect();
        (figure.columns[c].clone(), cells)
    };
    let rows = (0..figure.columns.len()).map(row).collect();
    (figure.columns, figure.rows) = (columns, rows);
}
