//! Words of a file in what is said of it.

/// Characters of a line: names in it may go on without end.
const MOST: usize = 400;

/// A text that may hold words of a file, as one line of bounded length: what would move the cursor or colour the screen is
/// escaped.
pub(super) fn one_line(text: &str) -> String {
    let escape = |c: char| if c.is_control() { c.escape_default().collect() } else { String::from(c) };
    let mut line: String = text.chars().take(MOST).map(escape).collect();
    if text.chars().nth(MOST).is_some() {
        line.push('…');
    }
    line
}

#[cfg(test)]
mod tests {
    use super::{MOST, one_line};

    #[test]
    fn words_of_a_file_stay_in_one_line_and_end() {
        assert_eq!(one_line("extension a is é"), "extension a is é");
        assert_eq!(one_line("a\nb\u{1b}[31mc\td\u{85}"), "a\\nb\\u{1b}[31mc\\td\\u{85}");
        let long = "é".repeat(MOST);
        assert_eq!(one_line(&long), long);
        assert_eq!(one_line(&format!("{long}x")), format!("{long}…"));
    }
}
