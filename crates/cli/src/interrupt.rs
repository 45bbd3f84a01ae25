//! Ctrl-C and SIGTERM: what is being done ends after the step that it is in, and its files are whole.

use std::io::Result;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use penny_lab::explain::Budget;

/// Whether somebody wants the program to end.
pub struct Interrupt {
    signal: Arc<AtomicUsize>,
}

impl Interrupt {
    /// From here on a signal is noticed instead of ending the program; a second one ends it at once.
    pub fn watch() -> Result<Interrupt> {
        let (signal, again) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        for number in [SIGINT, SIGTERM] {
            flag::register_conditional_shutdown(number, 128 + number, again.clone())?;
            flag::register(number, again.clone())?;
            flag::register_usize(number, signal.clone(), number as usize)?;
        }
        Ok(Interrupt { signal })
    }

    /// Time without end, until a signal comes.
    pub fn budget(&self) -> Budget {
        Budget::until(self.signal.clone())
    }

    /// The exit code that shells expect of a program that a signal has ended: 130 or 143.
    pub fn code(&self) -> Option<u8> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            number => Some(128 + number as u8),
        }
    }
}
