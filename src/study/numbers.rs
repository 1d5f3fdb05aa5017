//! Numbers formatted as text.

/// Formats 1000 as `1k` and 1500000 as `1.5M`; exact.
pub(super) fn short(n: u32) -> String {
    match n {
        0 => "0".to_string(),
        _ if n.is_multiple_of(100_000) && n >= 1_000_000 => format!("{}M", f64::from(n) / 1e6),
        _ if n.is_multiple_of(100) && n >= 1000 => format!("{}k", f64::from(n) / 1e3),
        _ => n.to_string(),
    }
}

/// Formats a number with three significant digits.
pub(super) fn brief(x: f64) -> String {
    let magnitude = if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 };
    if x != 0.0 && !(-3..=5).contains(&magnitude) {
        return format!("{x:.1e}");
    }
    format!("{x:.*}", (2 - magnitude).clamp(0, 5) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_brief() {
        for (x, text) in [(0.0, "0.00"), (1.0, "1.00"), (12.345, "12.3"), (0.012345, "0.0123"), (1e-5, "1.0e-5")] {
            assert_eq!(brief(x), text);
        }
        assert_eq!(brief(123_456.0), "123456");
    }
}
