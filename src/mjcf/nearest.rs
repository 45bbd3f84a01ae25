//! The nearest known name to a misspelt one.

/// The candidate with the fewest edits, if it is near enough to be meant: a third of the name's length.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let len = name.chars().count();
    if len > 40 {
        return None;
    }
    let limit = len.max(3) / 3;
    candidates
        .into_iter()
        // A difference in length is that many edits at least.
        .filter(|candidate| candidate.len() < 4 * 40 && candidate.chars().count().abs_diff(len) <= limit)
        .map(|candidate| (distance(name, candidate), candidate))
        .filter(|(edits, _)| *edits <= limit)
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, candidate)| candidate)
}

/// Edits that turn one name into the other: insert, delete, replace, or swap two neighbours; case counts nothing.
///
/// Source: optimal string alignment (Damerau 1964, Levenshtein 1966).
fn distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.to_lowercase().chars().collect();
    let b: Vec<char> = b.to_lowercase().chars().collect();
    let mut before: Vec<usize> = Vec::new();
    let mut above: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replace = above[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replace.min(above[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(before[j - 2] + 1);
            }
            row.push(best);
        }
        before = std::mem::replace(&mut above, row);
    }
    above[b.len()]
}

#[cfg(test)]
mod tests {
    use super::{distance, nearest};

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
