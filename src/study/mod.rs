//! Photons against neighbours: renders many combinations of settings, measures each, and reports them together.
//!
//! A [`Plan`] lists [`Combination`]s of a scene and settings, and [`Figure`]s that arrange them in rows and columns and
//! put [`Question`]s to them. [`fn@run`] makes one render a combination and repeat, a cell, with photons traced once for
//! all cells that share them. Finished cells are kept in the folder under a hash of all that decides them, so that an
//! interrupted study goes on where it stopped. Out come [`Results`]: a [`Row`] a combination, and answers. [`fn@write`]
//! makes tables, a contact sheet, plots and a page of them.

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
pub use grid::grid;
pub use measure::{MapRow, Row};
pub use plan::{Combination, Figure, Finer, Look, Plan, Reference, Subject};
pub use preset::report;
pub use question::Question;
pub use radii::Radii;
pub use run::{Results, run};
pub use summary::summary;
pub use write::write;
