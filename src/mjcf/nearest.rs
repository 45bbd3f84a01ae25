//! The nearest known name to a misspelt one.

/// The candidate with the fewest edits, if it is near enough to be meant: a third of the name's length.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = Letters::of(name).filter(|name| name.len <= 40)?;
    let limit = name.len.max(3) / 3;
    candidates
        .into_iter()
        .filter_map(|candidate| Some((Letters::of(candidate)?, candidate)))
        // A difference in length is that many edits at least.
        .filter(|(letters, _)| letters.len.abs_diff(name.len) <= limit)
        .map(|(letters, candidate)| (distance(&name, &letters), candidate))
        .filter(|(edits, _)| *edits <= limit)
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, candidate)| candidate)
}

const LONGEST: usize = 64;

/// A name in lower case, on the stack: thousands are compared where a file has thousands of errors.
struct Letters {
    letters: [char; LONGEST],
    len: usize,
}

impl Letters {
    /// `None`: too long to be compared.
    fn of(name: &str) -> Option<Letters> {
        let mut of = Letters { letters: ['\0'; LONGEST], len: 0 };
        for letter in name.chars().flat_map(char::to_lowercase) {
            *of.letters.get_mut(of.len)? = letter;
            of.len += 1;
        }
        Some(of)
    }

    fn as_slice(&self) -> &[char] {
        &self.letters[..self.len]
    }
}

/// Edits that turn one name into the other: insert, delete, replace, or swap two neighbours; case counts nothing.
///
/// Source: optimal string alignment (Damerau 1964, Levenshtein 1966).
fn distance(a: &Letters, b: &Letters) -> usize {
    let (a, b) = (a.as_slice(), b.as_slice());
    // The rows of i − 2, i − 1 and i.
    let [mut before, mut above, mut row] = [[0; LONGEST + 1]; 3];
    (0..=b.len()).for_each(|j| above[j] = j);
    for i in 1..=a.len() {
        row[0] = i;
        for j in 1..=b.len() {
            let replace = above[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replace.min(above[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(before[j - 2] + 1);
            }
            row[j] = best;
        }
        (before, above, row) = (above, row, before);
    }
    above[b.len()]
}

#[cfg(test)]
mod tests {
    use super::{Letters, nearest};

    fn distance(a: &str, b: &str) -> usize {
        super::distance(&Letters::of(a).unwrap(), &Letters::of(b).unwrap())
    }

    #[test]
    fn edits_are_counted() {
        assert_eq!(distance("fricton", "friction"), 1);
        assert_eq!(distance("fronto", "fromto"), 1);
        assert_eq!(distance("tpye", "type"), 1);
        assert_eq!(distance("euler", "Euler"), 0);
        assert_eq!(distance("", "pos"), 3);
    }

    #[test]
    fn only_near_names_are_suggested() {
        assert_eq!(nearest("fricton", ["mass", "friction"]), Some("friction"));
        assert_eq!(nearest("banana", ["mass", "friction"]), None);
    }
}
