//! Error type of the crate: the problem, its location, and advice.

use std::path::PathBuf;

/// Failure of an operation, displayed as one line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A scene file that cannot be rendered: `place` names the element, as a JSON path where there
    /// is one.
    #[error("{}: {place}: {problem}", path.display())]
    Scene {
        /// The file.
        path: PathBuf,
        /// JSON path of the element.
        place: String,
        /// The problem with it.
        problem: String,
    },
    /// No usable adapter, or none of the requested name.
    #[error("{0}")]
    Device(String),
    /// A size exceeds a limit of the adapter.
    #[error("{what} needs {needed} {unit}, but {limit} of {adapter} allows {allowed}; {advice}")]
    Limit {
        /// Name of what does not fit.
        what: String,
        /// Its size, in `unit`.
        needed: u64,
        /// Unit of `needed` and `allowed`.
        unit: &'static str,
        /// Name of the limit.
        limit: &'static str,
        /// Name of the adapter.
        adapter: String,
        /// Value of the limit, in `unit`.
        allowed: u64,
        /// Advice to the user.
        advice: String,
    },
    /// Device memory is exhausted.
    #[error(
        "no device memory is left for {what}{}; {adapter} has given {} MiB; ask for fewer `photons.global`, for a smaller scene, or \
        use another `device`",
        needed.map_or(String::new(), |bytes| format!(" of {bytes} bytes")),
        used >> 20
    )]
    Memory {
        /// Name of what does not fit.
        what: String,
        /// Bytes; `None` where only the driver knows.
        needed: Option<u64>,
        /// Name of the adapter.
        adapter: String,
        /// Bytes of the buffers that were allocated before.
        used: u64,
    },
    /// The device was lost during the work.
    #[error(
        "the device was lost: {adapter}: {why}; run it again, with fewer `photons.global` or a smaller `estimate.neighbors` if work took too long, or \
        with another `device`"
    )]
    Lost {
        /// Name of the adapter.
        adapter: String,
        /// The driver's message.
        why: String,
    },
    /// The driver reported an error during the work.
    #[error("{0}")]
    Gpu(String),
    /// A setting outside its range.
    #[error("{name} {value}: {problem}")]
    Setting {
        /// Path of the setting in [`crate::Settings`], such as `picture.spp`, or the name of
        /// another input.
        name: &'static str,
        /// Its value.
        value: String,
        /// The range, or what it conflicts with.
        problem: String,
    },
    /// Two things that should be equal differ.
    #[error("{0}")]
    Differs(String),
    /// Part of the work failed; the rest was done.
    #[error("{0}")]
    Incomplete(String),
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped,
}

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
