//! Text from files, made safe for one-line messages.

/// Maximum number of characters of a line: names in a file have any length.
const MAX_CHARS: usize = 400;

/// Converts a text that may contain names from a file to one line of bounded length. Escapes
/// control characters, which could move the cursor or colour the terminal.
pub(super) fn one_line(text: &str) -> String {
    let escape = |c: char| if c.is_control() { c.escape_default().collect() } else { String::from(c) };
    let mut line: String = text.chars().take(MAX_CHARS).map(escape).collect();
    if text.chars().nth(MAX_CHARS).is_some() {
        line.push('…');
    }
    line
}

#[cfg(test)]
mod tests {
    use super::{MAX_CHARS, one_line};

    #[test]
    fn words_of_a_file_stay_in_one_line_and_end() {
        assert_eq!(one_line("extension a is é"), "extension a is é");
        assert_eq!(one_line("a\nb\u{1b}[31mc\td\u{85}"), "a\\nb\\u{1b}[31mc\\td\\u{85}");
        let long = "é".repeat(MAX_CHARS);
        assert_eq!(one_line(&long), long);
        assert_eq!(one_line(&format!("{long}x")), format!("{long}…"));
    }
}
