//! The best-of list, kept in the user's own data folder.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// A goal worth remembering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    pub points: u64,
    pub level: String,
    /// s from the serve to the goal.
    pub time: f64,
    pub law: String,
    pub seed: u64,
}

/// Entries of the list.
const LENGTH: usize = 10;

/// Where the list is kept: `$XDG_DATA_HOME/penny/best.json`, or the same under `~/.local/share` or `%APPDATA%`.
pub fn path() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let folder = set("XDG_DATA_HOME")
        .or_else(|| set("APPDATA"))
        .or_else(|| set("HOME").map(|home| home.join(".local").join("share")))?;
    Some(folder.join("penny").join("best.json"))
}

/// The list, best first; empty if there is none yet. One that cannot be read is kept aside, as `best.damaged.json`, so
/// that the next goal does not overwrite it.
pub fn load(path: &Path) -> Vec<Entry> {
    let Ok(bytes) = std::fs::read(path) else { return Vec::new() };
    serde_json::from_slice(&bytes).unwrap_or_else(|_| {
        let free = |n: &usize| !damaged(path, *n).exists();
        if let Some(n) = (0..).find(free) {
            let _ = std::fs::rename(path, damaged(path, n));
        }
        Vec::new()
    })
}

fn damaged(path: &Path, n: usize) -> PathBuf {
    let ending = if n == 0 { "damaged.json".to_owned() } else { format!("damaged-{n}.json") };
    path.with_extension(ending)
}

/// Adds an entry where it belongs and returns its place (from 0), or none if it is not among the best.
pub fn insert(list: &mut Vec<Entry>, entry: Entry) -> Option<usize> {
    let better = |e: &Entry| e.points > entry.points || (e.points == entry.points && e.time <= entry.time);
    let place = list.iter().take_while(|e| better(e)).count();
    list.insert(place, entry);
    list.truncate(LENGTH);
    (place < LENGTH).then_some(place)
}

pub fn save(path: &Path, list: &[Entry]) -> std::io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    penny::draft::write(path, serde_json::to_string_pretty(list)?)
}
