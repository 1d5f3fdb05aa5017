//! What a run in passes says of itself.

use std::time::Duration;

use caustica::{image::ErrorEstimate, settings::PassRange};

use super::values::words_of_seconds;

/// Passes from which on their spread is trusted to end a run.
const LEAST_PASSES: u32 = 4;

/// Whether passes enough to trust their spread have an error of the target at most.
pub fn is_reached(target: f64, error: &ErrorEstimate, passes: u32) -> bool {
    passes >= LEAST_PASSES && error.total() <= target
}

/// Fraction of the run that is done, and seconds left, by the passes and the time that are wanted;
/// of a run that a target alone ends, nothing is known.
pub fn outlook(
    time: Option<Duration>,
    count: Option<u32>,
    done: u32,
    elapsed: Duration,
    each: Duration,
) -> (f64, Option<f64>) {
    let of_passes = count.map(|count| {
        let left = each.as_secs_f64() * f64::from(count.saturating_sub(done));
        (f64::from(done) / f64::from(count), left)
    });
    let of_time = time.map(|time| {
        let part = elapsed.as_secs_f64() / time.as_secs_f64().max(f64::MIN_POSITIVE);
        (part, time.saturating_sub(elapsed).as_secs_f64())
    });
    let ends = || of_passes.into_iter().chain(of_time);
    let fraction = ends().map(|(fraction, _)| fraction).fold(0.0, f64::max);
    (fraction.min(1.0), ends().map(|(_, left)| left).reduce(f64::min))
}

/// A fraction in percent with two decimals, or with as many as two of its digits take.
fn percent(x: f64) -> String {
    let percent = 100.0 * x;
    let decimals = if percent > 0.0 { (1.0 - percent.log10().floor()).clamp(2.0, 12.0) } else { 2.0 };
    format!("{percent:.*} %", decimals as usize)
}

/// State of a run in one line: passes that are done, of how many, the time left, the error and that
/// which is wanted, and its parts. What matters most stands first: a terminal may cut the end.
pub fn line(
    done: u32,
    count: Option<u32>,
    wanted: Option<f64>,
    error: Option<&ErrorEstimate>,
    left: Option<f64>,
) -> String {
    let of = count.map_or(String::new(), |count| format!(" of {count}"));
    let left = left.filter(|left| *left >= 0.5);
    let left = left.map_or(String::new(), |left| format!("; {} left", words_of_seconds(left)));
    let wanted = wanted.map_or(String::new(), |wanted| format!(", {} wanted", percent(wanted)));
    let error = error.map_or(String::new(), |error| {
        let (total, noise, bias) = (percent(error.total()), percent(error.noise), percent(error.bias));
        format!("; estimated error {total}{wanted} (noise {noise}, bias {bias})")
    });
    format!("passes: {done}{of}{left}{error}")
}

/// Whether a run reached the error that was wanted, in one line.
pub fn verdict(target: f64, error: Option<&ErrorEstimate>, passes: Option<PassRange>) -> String {
    let count = passes.map_or(0, |passes| passes.count());
    let after = if count == 1 { "1 pass".to_owned() } else { format!("{count} passes") };
    match error {
        Some(error) if is_reached(target, error, count) => {
            format!("--target-error {target} is reached after {after}: {}", percent(error.total()))
        }
        Some(error) if error.total() > target => {
            format!("warning: --target-error {target} is not reached after {after}: {}", percent(error.total()))
        }
        _ => format!(
            "warning: --target-error {target} is not known to be reached after {after}: it takes {LEAST_PASSES} to tell"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_passes_error_and_time() {
        let error = ErrorEstimate { noise: 0.03, bias: 0.04 };
        let expected = "passes: 2 of 8; 12 s left; estimated error 5.00 % (noise 3.00 %, bias 4.00 %)";
        assert_eq!(line(2, Some(8), None, Some(&error), Some(12.0)), expected);
        let expected = "passes: 5; estimated error 5.00 %, 1.00 % wanted (noise 3.00 %, bias 4.00 %)";
        assert_eq!(line(5, None, Some(0.01), Some(&error), None), expected);
        assert_eq!(line(5, None, None, None, Some(8.0)), "passes: 5; 8 s left");
        assert_eq!(line(1, None, Some(0.01), None, None), "passes: 1");
    }

    #[test]
    fn small_errors_have_digits() {
        let said = [0.2053, 0.01, 1e-3, 1.5e-4, 1e-5, 1.234e-7, 0.0].map(percent);
        assert_eq!(said, ["20.53 %", "1.00 %", "0.10 %", "0.015 %", "0.0010 %", "0.000012 %", "0.00 %"]);
    }

    #[test]
    fn time_left_is_that_of_the_earlier_end() {
        let at = |time, count| outlook(time, count, 5, Duration::from_secs(10), Duration::from_secs(2));
        let seconds = |time| Some(Duration::from_secs(time));
        assert_eq!(at(None, Some(10)), (0.5, Some(10.0)));
        assert_eq!(at(seconds(12), Some(10)), (10.0 / 12.0, Some(2.0)));
        assert_eq!(at(seconds(100), Some(10)), (0.5, Some(10.0)));
        assert_eq!(at(seconds(40), None), (0.25, Some(30.0)));
        assert_eq!(at(None, None), (0.0, None), "nobody knows when a target is reached");
    }

    #[test]
    fn a_target_is_reached_or_not() {
        let error = ErrorEstimate { noise: 0.03, bias: 0.04 };
        let passes = |end| Some(PassRange { first: 0, end });
        let said = |target, end| verdict(target, Some(&error), passes(end));
        assert_eq!(said(0.06, 9), "--target-error 0.06 is reached after 9 passes: 5.00 %");
        assert_eq!(said(0.01, 9), "warning: --target-error 0.01 is not reached after 9 passes: 5.00 %");
        let unknown = "warning: --target-error 0.06 is not known to be reached after 1 pass: it takes 4 to tell";
        assert_eq!(verdict(0.06, None, passes(1)), unknown);
        assert_eq!(said(0.06, 3), unknown.replace("1 pass", "3 passes"));
    }
}
