//! 64-bit FNV-1a: tells one file, text or state from another, and is no protection against forgery.
//!
//!     h ← (h ⊕ byte) p,   p = 2⁴⁰ + 435,   from h₀ = 14695981039346656037
//!
//! Source: G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake, The FNV Non-Cryptographic Hash Algorithm.

use std::fmt;

/// A hash, of the bytes so far; `Display` writes 16 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv(pub u64);

impl Fnv {
    /// The hash of some bytes.
    pub fn of(bytes: impl IntoIterator<Item = u8>) -> Fnv {
        Fnv(0xcbf2_9ce4_8422_2325).and(bytes)
    }

    /// The hash of the bytes before and of these.
    pub fn and(self, bytes: impl IntoIterator<Item = u8>) -> Fnv {
        Fnv(bytes.into_iter().fold(self.0, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)))
    }

    /// The hash of what `Debug` writes: all numbers and names of a thing.
    pub fn of_debug(thing: &dyn fmt::Debug) -> Fnv {
        let mut hash = Fnv::of([]);
        // A hash takes any text.
        let _ = fmt::write(&mut hash, format_args!("{thing:?}"));
        hash
    }
}

impl fmt::Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        *self = self.and(text.bytes());
        Ok(())
    }
}

impl fmt::Display for Fnv {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}
