//! Ctrl-C, SIGTERM and the end of a terminal: ask the work to stop, and leave in time even if it
//! does not.

use std::{
    sync::{
        Arc, LazyLock,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

#[cfg(unix)]
use signal_hook::consts::{SIGHUP, SIGXFSZ};
use signal_hook::consts::{SIGINT, SIGTERM};

/// How long the work may take to stop by itself. With the polling below the process is gone in
/// under two seconds.
const GRACE: Duration = Duration::from_millis(1500);
const POLLING: Duration = Duration::from_millis(20);

/// Number of the signal that came last; 0 while none has.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

/// Listens from here on.
pub fn watch() {
    for signal in [SIGINT, SIGTERM].into_iter().chain(hangup()) {
        // Fails only for signals that no process may catch.
        let _ = signal_hook::flag::register_usize(signal, Arc::clone(&SIGNAL), signal as usize);
    }
    // Where a file may not grow as large as it would, the write is to fail, and not the process to
    // die in the middle of it.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
    thread::spawn(|| {
        while !stop_requested() {
            thread::sleep(POLLING);
        }
        // The main thread ends the process before this, unless it waits for the device or the disk.
        thread::sleep(GRACE);
        caustica::image::close_files();
        // Without exit handlers: drivers hang in theirs while the device is busy.
        signal_hook::low_level::exit(exit_code().into());
    });
}

/// The signal of a terminal that goes away, unless it is to be ignored as under `nohup`, which
/// Linux alone tells.
#[cfg(unix)]
fn hangup() -> Option<i32> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    let ignored = u64::from_str_radix(ignored.trim(), 16).ok()?;
    (ignored & (1 << (SIGHUP - 1)) == 0).then_some(SIGHUP)
}

#[cfg(not(unix))]
fn hangup() -> Option<i32> {
    None
}

/// A signal has come.
pub fn stop_requested() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}

/// What a shell reports of a process that the signal ended: 130 for SIGINT, 143 for SIGTERM, 129
/// for SIGHUP.
pub fn exit_code() -> u8 {
    128 + SIGNAL.load(Ordering::Relaxed) as u8
}
