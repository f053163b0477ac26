//! Ctrl-C ends a run between two samples, and what was measured until then is still written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status of a process that SIGINT ended, by the shells' convention 128 + 2.
pub const EXIT_STATUS: u8 = 130;

/// A flag that asks the measurement loops to stop. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    requested: Arc<AtomicBool>,
}

impl Interrupt {
    /// A flag that Ctrl-C raises. A second Ctrl-C ends the process at once; files are written by
    /// renaming, so none is left half written.
    ///
    /// # Errors
    /// When the process already has a handler for Ctrl-C, or the system refuses one.
    pub fn on_ctrl_c() -> Result<Self, ctrlc::Error> {
        let interrupt = Self::default();
        let raised = interrupt.clone();
        ctrlc::set_handler(move || {
            if raised.requested.swap(true, Ordering::SeqCst) {
                std::process::exit(EXIT_STATUS.into());
            }
            eprintln!(
                "\nstopping after this sample and writing what was measured; Ctrl-C again to quit at once"
            );
        })?;
        Ok(interrupt)
    }

    /// Raises the flag.
    pub fn request(&self) {
        self.requested.store(true, Ordering::SeqCst);
    }

    /// Whether the flag is up.
    #[must_use]
    pub fn requested(&self) -> bool {
        self.requested.load(Ordering::SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_share_the_flag() {
        let interrupt = Interrupt::default();
        let clone = interrupt.clone();
        assert!(!clone.requested());
        interrupt.request();
        assert!(clone.requested());
        assert!(!Interrupt::default().requested());
    }
}
