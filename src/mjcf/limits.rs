//! What a scene may take: one budget for the main file and all that it includes.

/// The budget of a scene, includes counted in. What a scene exceeds is an error that names the limit.
///
/// The defaults are far beyond scenes that people write, and keep a file from strangers within a few GiB and the
/// stack of any thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Elements within elements, and files within files: each include is a level. 200; at most [`Limits::MOST_DEPTH`].
    pub depth: usize,
    /// Files that are included. 1,000.
    pub includes: usize,
    /// Bytes of all files together. 128 MiB; at most [`Limits::MOST_BYTES`].
    pub bytes: usize,
    /// Elements of all files together. 2,000,000.
    pub elements: usize,
    /// Names that elements have. 1,000,000.
    pub names: usize,
    /// Contacts at one time, and pairs of geoms so near that they could touch. 1,000,000, whose rows take some 1 GB.
    pub contacts: usize,
    /// Whether files outside the main file's folder may be included. No.
    pub outside: bool,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            depth: 200,
            includes: 1_000,
            bytes: 128 << 20,
            elements: 2_000_000,
            names: 1_000_000,
            contacts: 1_000_000,
            outside: false,
        }
    }
}

impl Limits {
    /// MuJoCo's own reader takes no more levels; walks over a tree this deep fit a stack of 2 MiB, which is what a
    /// thread has (a test walks one).
    pub const MOST_DEPTH: usize = 500;
    /// Places in a file are 32-bit.
    pub const MOST_BYTES: usize = 1 << 30;
    /// What [`Limits::set`] knows.
    pub const NAMES: [&str; 6] = ["depth", "includes", "bytes", "elements", "names", "contacts"];

    /// Sets a limit by its name.
    ///
    /// Errors: one sentence if there is no such limit or it cannot be so high.
    pub fn set(&mut self, name: &str, value: usize) -> Result<(), String> {
        let (limit, most) = match name {
            "depth" => (&mut self.depth, Self::MOST_DEPTH),
            "includes" => (&mut self.includes, usize::MAX),
            "bytes" => (&mut self.bytes, Self::MOST_BYTES),
            "elements" => (&mut self.elements, u32::MAX as usize),
            "names" => (&mut self.names, usize::MAX),
            "contacts" => (&mut self.contacts, u32::MAX as usize),
            _ => return Err(format!("there is no limit `{name}`: there is {}", Self::NAMES.join(", "))),
        };
        if value > most {
            return Err(format!("`{name}` can be at most {most}"));
        }
        *limit = value;
        Ok(())
    }
}
