//! How long trying may take.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A span of real time. What does not fit into it is left out, and said to be.
#[derive(Debug)]
pub struct Budget {
    end: Option<Instant>,
    /// Not 0: no time is left.
    signal: Arc<AtomicUsize>,
    used_up: Cell<bool>,
}

impl Budget {
    /// This many seconds from now.
    pub fn seconds(seconds: f64) -> Budget {
        Budget { end: Some(Instant::now() + Duration::from_secs_f64(seconds)), ..Budget::unlimited() }
    }

    pub fn unlimited() -> Budget {
        Budget::until(Arc::default())
    }

    /// Until a signal is other than 0.
    pub fn until(signal: Arc<AtomicUsize>) -> Budget {
        Budget { end: None, signal, used_up: Cell::new(false) }
    }

    /// Whether there is time left; asked before something is tried.
    pub fn left(&self) -> bool {
        let ended = self.signal.load(Ordering::Relaxed) != 0;
        let left = !ended && self.end.is_none_or(|end| Instant::now() < end);
        self.used_up.set(self.used_up.get() || !left);
        left
    }

    /// Whether something was left out.
    pub fn used_up(&self) -> bool {
        self.used_up.get()
    }
}
