//! Output to the user. A closed pipe is no error: `caustica devices | head -1` succeeds.

use std::io::{self, Write};

use caustica::{Error, Result};

use super::flags::with_flags;

/// Prints a line on stderr. Names of the library's settings are replaced by flags.
pub fn say(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", with_flags(line));
}

/// Prints the result of a command on stdout.
///
/// # Errors
/// A full disk behind it, and the like.
pub fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::Io { path: "standard output".into(), source })
        }
        _ => Ok(()),
    }
}
