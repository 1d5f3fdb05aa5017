//! Panics. A panic is a bug, and ends the program like any other failure, with one line in place of
//! a backtrace. `RUST_BACKTRACE=1` shows the backtrace as well.

use std::{
    env,
    panic::{self, AssertUnwindSafe, PanicHookInfo},
    sync::{Mutex, PoisonError},
};

/// Line that describes the last panic.
static SAID: Mutex<String> = Mutex::new(String::new());

/// Returns the result of `work`, or the line to print if it panics.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let usual = env::var_os("RUST_BACKTRACE").map(|_| panic::take_hook());
    panic::set_hook(Box::new(move |info| {
        *SAID.lock().unwrap_or_else(PoisonError::into_inner) = line(info);
        if let Some(usual) = &usual {
            usual(info);
        }
    }));
    panic::catch_unwind(AssertUnwindSafe(work)).map_err(|_| SAID.lock().unwrap_or_else(PoisonError::into_inner).clone())
}

fn line(info: &PanicHookInfo) -> String {
    let message = info.payload_as_str().unwrap_or("panic").split_whitespace().collect::<Vec<_>>().join(" ");
    let at = info.location().map_or(String::new(), |location| format!(" at {}:{}", location.file(), location.line()));
    format!("internal error: {message}{at}; this is a bug of caustica, please report it with the command and the scene")
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_panic_is_one_line_with_its_place() {
        let said = super::caught::<()>(|| panic!("what\n  {}", "happened")).expect_err("it panics");
        assert!(said.starts_with("internal error: what happened at src/cli/bugs.rs:"), "{said}");
        assert!(said.contains("please report") && !said.contains('\n'), "{said}");
        assert_eq!(super::caught(|| 1), Ok(1));
        // Restores the default hook for the panics of other tests.
        let _ = std::panic::take_hook();
    }
}
