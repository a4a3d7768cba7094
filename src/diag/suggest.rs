//! Did you mean …: the known name nearest to an unknown one.

/// Longer words are no slips of the pen (letters).
const LONGEST: usize = 64;
/// More candidates are not looked at: a suggestion is not worth the time.
const MOST: usize = 1000;

/// The candidate that differs least from `word`, if it is near enough to be a slip of the pen: at most a third of its
/// letters (and at least one) may differ. The first of equals wins.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().count();
    if length > LONGEST {
        return None;
    }
    let allowed = (length / 3).max(1);
    let likely =
        candidates.into_iter().take(MOST).filter(|c| c.chars().take(LONGEST + 1).count().abs_diff(length) <= allowed);
    let scored = likely.map(|c| (distance(word, c), c)).filter(|&(d, c)| d <= allowed && c != word);
    scored.min_by_key(|&(d, _)| d).map(|(_, c)| c)
}

/// Edit distance with neighbouring letters swapped counted as one (Damerau 1964, optimal string alignment).
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = cell(&a, &b, &rows, i, j);
        }
    }
    rows[a.len()][b.len()]
}

fn cell(a: &[char], b: &[char], rows: &[Vec<usize>], i: usize, j: usize) -> usize {
    if i == 0 || j == 0 {
        return i + j;
    }
    let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
    let best = replaced.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
    let swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
    if swapped { best.min(rows[i - 2][j - 2] + 1) } else { best }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_known_pairs() {
        for (a, b, d) in
            [("", "abc", 3), ("bore", "bore", 0), ("bore", "bores", 1), ("pni", "pin", 1), ("kitten", "sitting", 3)]
        {
            assert_eq!(distance(a, b), d, "{a} {b}");
            assert_eq!(distance(b, a), d, "{b} {a}");
        }
    }

    #[test]
    fn only_slips_are_suggested() {
        assert_eq!(nearest("pinn", ["plate", "pin"]), Some("pin"));
        assert_eq!(nearest("gear", ["plate", "pin"]), None);
    }
}
