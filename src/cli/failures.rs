//! Failures of several outputs: one that cannot be written keeps none of the others from being
//! written.

use caustica::{Error, Result};

/// Errors of outputs that could not be written.
#[derive(Debug, Default)]
pub struct Failures(Vec<Error>);

impl Failures {
    /// Keeps the error of a result, if it is one. Returns whether it is none.
    pub fn take(&mut self, result: Result<()>) -> bool {
        let is_good = result.is_ok();
        self.0.extend(result.err());
        is_good
    }

    /// All errors as one, if there are any.
    pub fn outcome(mut self) -> Result<()> {
        match self.0.len() {
            0 => Ok(()),
            1 => Err(self.0.remove(0)),
            _ => Err(Error::Incomplete(self.0.iter().map(Error::to_string).collect::<Vec<_>>().join("; "))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_failures_are_one_line() {
        let mut failures = Failures::default();
        assert!(failures.take(Ok(())));
        assert!(!failures.take(Err(Error::Incomplete("a".to_owned()))));
        assert!(!failures.take(Err(Error::Differs("b".to_owned()))));
        assert_eq!(failures.outcome().unwrap_err().to_string(), "a; b");
        let mut one = Failures::default();
        one.take(Err(Error::Stopped));
        assert!(matches!(one.outcome(), Err(Error::Stopped)));
        assert!(Failures::default().outcome().is_ok());
    }
}
