//! Ranges of numeric settings.

use std::fmt;

use super::fail;
use crate::error::Result;

/// Numbers that a [`Range`] can bound.
pub trait Number: Copy + PartialOrd + fmt::Display + fmt::LowerExp {
    /// Largest finite value.
    const MAX: Self;
    /// From here on a bound is written with an exponent.
    const LONG: Self;
}

macro_rules! number {
    ($($type:ty: $long:expr),+) => {
        $(impl Number for $type {
            const MAX: Self = <$type>::MAX;
            const LONG: Self = $long;
        })+
    };
}

number!(u32: u32::MAX, u64: u64::MAX, f32: 1e9, f64: 1e9);

/// Values that a setting can have. Infinities and NaN are in no range. Displayed as
/// `from 1 to 1000`, `at least 1`, `above 0` or `above 0, at most 1e18`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range<T> {
    least: T,
    most: T,
    /// The lower end is not in the range.
    open: bool,
}

impl<T: Number> Range<T> {
    /// All values from `least` to `most`.
    #[must_use]
    pub const fn closed(least: T, most: T) -> Self {
        Self { least, most, open: false }
    }

    /// All finite values from `least` on.
    #[must_use]
    pub const fn at_least(least: T) -> Self {
        Self::closed(least, T::MAX)
    }

    /// All values above `limit`, up to `most`.
    #[must_use]
    pub const fn above(limit: T, most: T) -> Self {
        Self { least: limit, most, open: true }
    }

    /// Smallest value, or with [`Self::above`] the value that all are larger than.
    #[must_use]
    pub const fn least(&self) -> T {
        self.least
    }

    /// Largest value.
    #[must_use]
    pub const fn most(&self) -> T {
        self.most
    }

    /// The range has this value.
    #[must_use]
    pub fn contains(&self, value: T) -> bool {
        let from_least = if self.open { value > self.least } else { value >= self.least };
        from_least && value <= self.most
    }

    /// [`crate::Error::Setting`] if the value of the setting `name` is not in the range.
    pub(crate) fn check(&self, name: &'static str, value: T) -> Result<()> {
        if self.contains(value) { Ok(()) } else { fail(name, value.to_string(), &format!("must be {self}")) }
    }
}

impl<T: Number> fmt::Display for Range<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = |value: T| if value < T::LONG { value.to_string() } else { format!("{value:e}") };
        let (least, most) = (end(self.least), end(self.most));
        match (self.open, self.most < T::MAX) {
            (false, false) => write!(f, "at least {least}"),
            (false, true) => write!(f, "from {least} to {most}"),
            (true, false) => write!(f, "above {least}"),
            (true, true) => write!(f, "above {least}, at most {most}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_belong_to_a_range_unless_it_is_open() {
        let closed = Range::closed(1_u32, 1000);
        assert_eq!([0, 1, 1000, 1001].map(|n| closed.contains(n)), [false, true, true, false]);
        let open = Range::above(0.0_f32, 1e18);
        assert_eq!([0.0, 1e-30, 1e18, 1.1e18].map(|x| open.contains(x)), [false, true, true, false]);
        assert!([f32::NAN, f32::INFINITY, -f32::INFINITY].iter().all(|x| !Range::at_least(-1.0).contains(*x)));
    }

    #[test]
    fn a_range_is_told_by_its_ends() {
        assert_eq!(Range::closed(1_u32, 1000).to_string(), "from 1 to 1000");
        assert_eq!(Range::closed(0.0_f32, 2.0).to_string(), "from 0 to 2");
        assert_eq!(Range::at_least(1_u64).to_string(), "at least 1");
        assert_eq!(Range::above(0.0_f32, 1e18).to_string(), "above 0, at most 1e18");
        assert_eq!(Range::above(0.0_f64, f64::MAX).to_string(), "above 0");
        let error = Range::at_least(1_u32).check("picture.spp", 0).expect_err("0 is below 1").to_string();
        assert_eq!(error, "picture.spp 0: must be at least 1");
    }
}
