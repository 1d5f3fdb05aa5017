//! Faults that a driver reports outside of any call, kept until they are asked for, and put into
//! words with what to do next.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::error::Error;

/// Kinds of faults.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// No memory was left for something; what it was only the caller knows.
    Memory,
    /// A command broke the rules: a bug of ours or of the driver.
    Refused(String),
    /// The driver failed.
    Internal(String),
    /// The device is gone, and stays gone.
    Lost(String),
}

/// The first fault since the last look: later ones are its consequences, but for the loss of the
/// device, which is the cause of what was reported before.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults(Arc<Mutex<Option<Fault>>>);

impl Faults {
    /// Listens to the device. Without a listener, wgpu panics.
    pub fn of(device: &wgpu::Device) -> Self {
        let faults = Self::default();
        let (on_error, on_loss) = (faults.clone(), faults.clone());
        device.on_uncaptured_error(Arc::new(move |error| {
            on_error.note(match error {
                wgpu::Error::OutOfMemory { .. } => Fault::Memory,
                wgpu::Error::Validation { description, .. } => Fault::Refused(one_line(&description)),
                wgpu::Error::Internal { description, .. } => Fault::Internal(one_line(&description)),
            });
        }));
        device.set_device_lost_callback(move |reason, message| {
            on_loss.note(Fault::Lost(match reason {
                wgpu::DeviceLostReason::Destroyed => "it was closed".to_string(),
                wgpu::DeviceLostReason::Unknown => one_line(&message),
            }));
        });
        faults
    }

    fn slot(&self) -> MutexGuard<'_, Option<Fault>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, fault: Fault) {
        let mut slot = self.slot();
        match (&*slot, &fault) {
            (Some(Fault::Lost(_)), _) => {}
            (_, Fault::Lost(_)) | (None, _) => *slot = Some(fault),
            _ => {}
        }
    }

    /// The fault, which is forgotten unless it lasts.
    pub fn take(&self) -> Option<Fault> {
        let mut slot = self.slot();
        if matches!(*slot, Some(Fault::Lost(_))) { slot.clone() } else { slot.take() }
    }

    /// Whether memory was missing since the last look; forgotten then.
    pub fn take_missing_memory(&self) -> bool {
        self.slot().take_if(|fault| *fault == Fault::Memory).is_some()
    }
}

impl Fault {
    /// Error of that adapter, of whose memory `used` bytes were taken by buffers.
    pub fn into_error(self, adapter: &str, driver: &str, used: u64) -> Error {
        let of = format!("{adapter} ({driver})");
        match self {
            Self::Memory => Error::Memory {
                what: "the driver's own work".to_string(),
                needed: None,
                adapter: adapter.to_string(),
                used,
            },
            Self::Refused(why) => Error::Gpu(format!(
                "{of} refused a command: {why}; this is a bug of caustica or of the driver, please report it"
            )),
            Self::Internal(why) => {
                Error::Gpu(format!("the driver of {of} failed: {why}; update the driver or use another `device`"))
            }
            Self::Lost(why) => Error::Lost { adapter: of, why },
        }
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_fault_is_kept_unless_the_device_was_lost() {
        let faults = Faults::default();
        assert_eq!(faults.take(), None);
        faults.note(Fault::Refused("first".to_string()));
        faults.note(Fault::Memory);
        assert!(!faults.take_missing_memory(), "the second is a consequence of the first");
        assert_eq!(faults.take(), Some(Fault::Refused("first".to_string())));
        assert_eq!(faults.take(), None);
        faults.note(Fault::Memory);
        assert!(faults.take_missing_memory() && !faults.take_missing_memory());
        faults.note(Fault::Internal("before".to_string()));
        faults.note(Fault::Lost("gone".to_string()));
        faults.note(Fault::Lost("again".to_string()));
        for _ in 0..2 {
            assert_eq!(faults.take(), Some(Fault::Lost("gone".to_string())), "a loss lasts");
        }
    }

    #[test]
    fn each_fault_says_what_to_do_in_one_line() {
        let text = |fault: Fault| fault.into_error("X", "Y 1", 3 << 20).to_string();
        for (fault, said) in [
            (Fault::Memory, "`photons.global`"),
            (Fault::Refused(one_line("In a\n  pass")), "In a pass; this is a bug"),
            (Fault::Internal("boom".to_string()), "update the driver"),
            (Fault::Lost("reset".to_string()), "`device`"),
        ] {
            let line = text(fault);
            assert!(line.contains(said) && line.contains('X') && !line.contains('\n'), "{line}");
        }
    }
}
