//! Progress of a study: each cell is reported once, with the time left.

use std::sync::{Mutex, PoisonError};

use caustica::study::{State, Watch};

use super::{progress::Display, signals, values::words_of_seconds};

/// Shows the progress of a study and passes stop signals to it.
#[derive(Debug)]
pub struct StudyDisplay<'a> {
    pub display: &'a Display,
    /// Number of the cell that was reported last.
    pub told: Mutex<usize>,
}

impl Watch for StudyDisplay<'_> {
    fn report(&self, state: &State) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let new = state.number != *told;
        *told = state.number;
        self.display.state(&line(state), state.done, new);
    }

    fn stop_requested(&self) -> bool {
        signals::stop_requested()
    }
}

fn line(state: &State) -> String {
    let kept = if state.kept > 0 { format!(", {} kept", state.kept) } else { String::new() };
    let known = state.seconds_left.filter(|s| *s >= 0.5);
    let left = known.map(|s| format!(", {} left", words_of_seconds(s))).unwrap_or_default();
    format!("study: {:.0} %{left}; cell {} of {}{kept}: {}", 100.0 * state.done, state.number, state.total, state.cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_the_cell_and_the_time_left() {
        let mut state = State {
            cell: "a.gltf, hybrid".to_string(),
            number: 3,
            total: 8,
            kept: 0,
            done: 0.251,
            seconds_left: Some(75.2),
        };
        assert_eq!(line(&state), "study: 25 %, 75 s left; cell 3 of 8: a.gltf, hybrid");
        (state.kept, state.seconds_left) = (2, None);
        assert_eq!(line(&state), "study: 25 %; cell 3 of 8, 2 kept: a.gltf, hybrid");
        state.seconds_left = Some(0.2);
        assert!(!line(&state).contains("left"), "{}", line(&state));
        assert_eq!([91.0, 3500.0, 12_000.0].map(words_of_seconds), ["2 min", "58 min", "3 h 20 min"]);
    }
}
