//! Ctrl-C, SIGTERM and SIGHUP. They request the work to stop; the process ends in time even if the
//! work does not.

use std::{
    sync::{
        Arc, LazyLock,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

#[cfg(unix)]
use signal_hook::consts::{SIGHUP, SIGXFSZ};
use signal_hook::consts::{SIGINT, SIGTERM};

/// Time in which the work may stop by itself. With the polling below, the process ends in under two
/// seconds.
const GRACE: Duration = Duration::from_millis(1500);
/// The same for work that writes a checkpoint first. Slurm and Kubernetes kill after 30 seconds.
const LONG_GRACE: Duration = Duration::from_secs(25);
const POLLING: Duration = Duration::from_millis(20);

/// Number of the last signal; 0 before the first.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

/// The work writes a checkpoint when it is asked to stop.
static KEEPS_WORK: AtomicBool = AtomicBool::new(false);

/// Gives the work the time to write a checkpoint when it is asked to stop, which is then no
/// failure.
pub fn keep_work() {
    KEEPS_WORK.store(true, Ordering::Relaxed);
}

/// Starts to listen for signals.
pub fn watch() {
    for signal in [SIGINT, SIGTERM].into_iter().chain(hangup()) {
        // Fails only for signals that no process may catch.
        let _ = signal_hook::flag::register_usize(signal, Arc::clone(&SIGNAL), signal as usize);
    }
    // Without a handler, SIGXFSZ kills the process at a write beyond the file size limit; with one,
    // the write fails.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
    thread::spawn(|| {
        while !stop_requested() {
            thread::sleep(POLLING);
        }
        // The main thread ends the process before this, unless it waits for the device or the disk.
        thread::sleep(if KEEPS_WORK.load(Ordering::Relaxed) { LONG_GRACE } else { GRACE });
        caustica::image::close_files();
        // Skips exit handlers: those of drivers hang while the device is busy.
        signal_hook::low_level::exit(exit_code().into());
    });
}

/// SIGHUP, the signal of a closed terminal, unless the process ignores it, as under `nohup`. Only
/// Linux reports which signals are ignored; `None` elsewhere.
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

/// Whether a signal has arrived.
pub fn stop_requested() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}

/// Exit code of a process ended by the signal, as a shell reports it: 130 for SIGINT, 143 for
/// SIGTERM, 129 for SIGHUP. 0 for SIGTERM, by which queues take back their machines, where the work
/// can be resumed.
pub fn exit_code() -> u8 {
    let signal = SIGNAL.load(Ordering::Relaxed);
    if signal == SIGTERM as usize && KEEPS_WORK.load(Ordering::Relaxed) { 0 } else { 128 + signal as u8 }
}
