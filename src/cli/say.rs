//! Lines to the user. A reader that has gone away is no error: `caustica devices | head -1` ends
//! well.

use std::io::{self, Write};

use super::flags::with_flags;

/// One line on stderr; settings that the library names are flags in it.
pub fn say(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", with_flags(line));
}

/// Text on stdout: what was asked for.
pub fn print(text: &str) {
    let mut out = io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}
