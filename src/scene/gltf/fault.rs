//! Faults of a file, independent of the file's name, and notes on ignored parts.

use std::{collections::HashSet, path::Path};

use crate::{Error, scene::words::one_line};

/// A fault in the file: `place` is a JSON path or a part of the container.
#[derive(Debug)]
pub(crate) struct Fault {
    place: String,
    problem: String,
}

/// Result of reading a part of a file.
pub(crate) type Read<T> = Result<T, Fault>;

/// Shorthand for an `Err` of [`Read`].
pub(crate) fn fault<T>(place: impl Into<String>, problem: impl Into<String>) -> Read<T> {
    Err(Fault { place: place.into(), problem: problem.into() })
}

impl Fault {
    /// Converts the fault to the error that a user sees.
    pub(crate) fn of(self, path: &Path) -> Error {
        Error::Scene { path: path.to_owned(), place: one_line(&self.place), problem: one_line(&self.problem) }
    }
}

/// Notes on parts that were ignored or read in a special way: each line once, in the order of first
/// appearance.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    lines: Vec<String>,
    known: HashSet<String>,
}

impl Notes {
    pub(crate) fn add(&mut self, note: impl Into<String>) {
        let note = one_line(&note.into());
        if self.known.insert(note.clone()) {
            self.lines.push(note);
        }
    }

    pub(crate) fn into_lines(self) -> Vec<String> {
        self.lines
    }
}
