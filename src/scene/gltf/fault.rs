//! Faults of a file, independent of the file's name, and notes on ignored parts.

use std::{
    collections::{HashMap, HashSet},
    path::Path,
};

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

/// Number of things of which the same is said in a line each; of more, one line tells the number.
const MOST_ALIKE: usize = 8;

/// Notes on parts that were ignored or read in a special way: each line once, in the order of first
/// appearance.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    lines: Vec<String>,
    known: HashSet<String>,
    /// Lines that say the same of things of one kind, each by its first words and the rest.
    alike: HashMap<(&'static str, String), Vec<usize>>,
}

impl Notes {
    pub(crate) fn add(&mut self, note: impl Into<String>) {
        let note = one_line(&note.into());
        if self.known.insert(note.clone()) {
            self.lines.push(note);
        }
    }

    /// A note on the `kind` of thing of that name, of which there may be very many.
    pub(crate) fn about(&mut self, kind: &'static str, name: &str, rest: &str) {
        let before = self.lines.len();
        self.add(format!("{kind} {name:?}{rest}"));
        if self.lines.len() > before {
            self.alike.entry((kind, rest.to_owned())).or_default().push(before);
        }
    }

    pub(crate) fn into_lines(mut self) -> Vec<String> {
        let mut left_out: HashSet<usize> = HashSet::new();
        for lines in self.alike.values().filter(|lines| lines.len() > MOST_ALIKE) {
            self.lines[lines[0]] += &format!(" (and {} others)", lines.len() - 1);
            left_out.extend(&lines[1..]);
        }
        let kept = self.lines.into_iter().enumerate().filter(|(i, _)| !left_out.contains(i));
        kept.map(|(_, line)| line).collect()
    }
}
