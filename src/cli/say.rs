//! Lines to the user. A reader that has gone away is no error: `caustica devices | head -1` ends well.

use std::io::{self, Write};

/// One line on stderr.
pub fn say(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Text on stdout: what was asked for.
pub fn print(text: &str) {
    let mut out = io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}
