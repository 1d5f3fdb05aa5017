//! Studies of photon count against neighbour count: renders many combinations of settings, measures
//! each, and reports them together.
//!
//! A [`Plan`] lists [`Combination`]s of a scene and settings, and [`Figure`]s that arrange them in
//! rows and columns and ask [`Question`]s about them. [`fn@run`] makes one render, a cell, per
//! combination and repeat, and traces photons once for all cells with the same maps. Finished cells
//! are stored in the folder under a hash of all their inputs, so that an interrupted study resumes.
//! The [`Results`] hold a [`Row`] per combination and the answers. [`fn@write`] writes them as
//! tables, a contact sheet, plots and a page.

mod cells;
mod chart;
mod claims;
mod corners;
mod cost;
mod findings;
mod grid;
mod job;
mod measure;
mod numbers;
mod page;
mod picture;
mod plan;
mod plots;
mod preset;
mod question;
mod radii;
mod run;
mod sheet;
mod spread;
mod summary;
mod table;
mod write;

pub use claims::{Claim, Verdict};
pub use cost::{State, Watch};
pub use grid::{gather_grid, grid};
pub use measure::{MapRow, Row};
pub use plan::{Combination, Figure, Finer, Look, Plan, Reference, Subject};
pub use preset::report;
pub use question::Question;
pub use radii::Radii;
pub use run::{Results, run};
pub use summary::summary;
pub use write::write;
