//! Unified diffs of texts, as `patch` and `git apply` read them.
//!
//! In: two texts and a name. Out: text. The shortest edit is found after Myers, "An O(ND) difference algorithm" (1986), up
//! to a bound; texts that differ more are shown as one replaced block.

/// Lines of context around a change.
const CONTEXT: usize = 3;
/// Changed lines up to which the shortest edit is searched: the search keeps the square of this many numbers.
const MOST_CHANGES: usize = 1500;

/// A line of the one text, of the other, or of both: indices from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Keep(usize, usize),
    Delete(usize),
    Insert(usize),
}

/// The difference from `old` to `new`; empty when they are equal.
pub fn unified(name: &str, old: &str, new: &str, colour: bool) -> String {
    let (a, b): (Vec<&str>, Vec<&str>) = (lines(old), lines(new));
    let steps = steps(&a, &b);
    let hunks = hunks(&steps);
    if hunks.is_empty() {
        return String::new();
    }
    let paint = |code: &str, line: String| if colour { format!("\x1b[{code}m{line}\x1b[0m\n") } else { line + "\n" };
    let mut text = paint("1", format!("--- {name}")) + &paint("1", format!("+++ {name}"));
    for hunk in hunks {
        text += &paint("36", header(&steps, hunk.clone()));
        for step in &steps[hunk] {
            let (sign, line, code) = match *step {
                Step::Keep(i, _) => (' ', a[i], None),
                Step::Delete(i) => ('-', a[i], Some("31")),
                Step::Insert(j) => ('+', b[j], Some("32")),
            };
            let body = format!("{sign}{}", line.strip_suffix('\n').unwrap_or(line));
            text += &code.map_or_else(|| body.clone() + "\n", |code| paint(code, body.clone()));
            text += if line.ends_with('\n') { "" } else { "\\ No newline at end of file\n" };
        }
    }
    text
}

fn lines(text: &str) -> Vec<&str> {
    text.split_inclusive('\n').collect()
}

/// Runs of steps with at most twice the context between their changes.
fn hunks(steps: &[Step]) -> Vec<std::ops::Range<usize>> {
    let mut hunks: Vec<std::ops::Range<usize>> = Vec::new();
    for (at, _) in steps.iter().enumerate().filter(|(_, s)| !matches!(s, Step::Keep(..))) {
        let (start, end) = (at.saturating_sub(CONTEXT), (at + 1 + CONTEXT).min(steps.len()));
        match hunks.last_mut() {
            Some(last) if start <= last.end => last.end = end,
            _ => hunks.push(start..end),
        }
    }
    hunks
}

/// `@@ -3,7 +3,8 @@`
fn header(steps: &[Step], hunk: std::ops::Range<usize>) -> String {
    let before = &steps[..hunk.start];
    let count = |steps: &[Step], sides: [bool; 2]| -> usize {
        let counts = |s: &&Step| match s {
            Step::Keep(..) => true,
            Step::Delete(_) => sides[0],
            Step::Insert(_) => sides[1],
        };
        steps.iter().filter(counts).count()
    };
    let range = |sides: [bool; 2]| {
        let (start, length) = (count(before, sides), count(&steps[hunk.clone()], sides));
        // The line before an empty range, the first line of any other.
        let first = if length == 0 { start } else { start + 1 };
        if length == 1 { first.to_string() } else { format!("{first},{length}") }
    };
    format!("@@ -{} +{} @@", range([true, false]), range([false, true]))
}

fn steps(a: &[&str], b: &[&str]) -> Vec<Step> {
    let head = a.iter().zip(b).take_while(|(x, y)| x == y).count();
    let (rest_a, rest_b) = (&a[head..], &b[head..]);
    let tail = rest_a.iter().rev().zip(rest_b.iter().rev()).take_while(|(x, y)| x == y).count();
    let (mid_a, mid_b) = (&rest_a[..rest_a.len() - tail], &rest_b[..rest_b.len() - tail]);
    let mut steps: Vec<Step> = (0..head).map(|i| Step::Keep(i, i)).collect();
    let middle = shortest(mid_a, mid_b).unwrap_or_else(|| replaced(mid_a.len(), mid_b.len()));
    steps.extend(middle.into_iter().map(|step| match step {
        Step::Keep(i, j) => Step::Keep(i + head, j + head),
        Step::Delete(i) => Step::Delete(i + head),
        Step::Insert(j) => Step::Insert(j + head),
    }));
    steps.extend((0..tail).map(|k| Step::Keep(a.len() - tail + k, b.len() - tail + k)));
    steps
}

fn replaced(old: usize, new: usize) -> Vec<Step> {
    (0..old).map(Step::Delete).chain((0..new).map(Step::Insert)).collect()
}

/// The furthest x on every diagonal, per number of changes; `None` when there are too many changes.
fn shortest(a: &[&str], b: &[&str]) -> Option<Vec<Step>> {
    let (n, m) = (a.len() as isize, b.len() as isize);
    let most = (a.len() + b.len()).min(MOST_CHANGES);
    let mut rounds: Vec<Vec<isize>> = Vec::new();
    for d in 0..=most as isize {
        // Diagonals -d, -d + 2, … d.
        let mut reached = Vec::with_capacity(d as usize + 1);
        for k in (-d..=d).step_by(2) {
            let mut x = rounds.last().map_or(0, |last| start(last, d, k));
            while x < n && x - k < m && a[x as usize] == b[(x - k) as usize] {
                x += 1;
            }
            reached.push(x);
            if x >= n && x - k >= m {
                rounds.push(reached);
                return Some(walk_back(&rounds, n, m));
            }
        }
        rounds.push(reached);
    }
    None
}

/// Where the path of `d` changes on diagonal `k` begins, given how far those of `d - 1` came.
fn start(last: &[isize], d: isize, k: isize) -> isize {
    if goes_down(last, d, k) { furthest(last, d, k + 1) } else { furthest(last, d, k - 1) + 1 }
}

/// Whether the last change on the way is an insertion.
fn goes_down(last: &[isize], d: isize, k: isize) -> bool {
    k == -d || (k != d && furthest(last, d, k - 1) < furthest(last, d, k + 1))
}

fn furthest(last: &[isize], d: isize, k: isize) -> isize {
    last[((k + d - 1) / 2) as usize]
}

fn walk_back(rounds: &[Vec<isize>], n: isize, m: isize) -> Vec<Step> {
    let (mut x, mut y) = (n, m);
    let mut steps = Vec::new();
    let keep_down_to = |x: &mut isize, y: &mut isize, to: isize, steps: &mut Vec<Step>| {
        while *x > to {
            (*x, *y) = (*x - 1, *y - 1);
            steps.push(Step::Keep(*x as usize, *y as usize));
        }
    };
    for d in (1..rounds.len() as isize).rev() {
        let (last, k) = (&rounds[d as usize - 1], x - y);
        keep_down_to(&mut x, &mut y, start(last, d, k), &mut steps);
        if goes_down(last, d, k) {
            y -= 1;
            steps.push(Step::Insert(y as usize));
        } else {
            x -= 1;
            steps.push(Step::Delete(x as usize));
        }
    }
    keep_down_to(&mut x, &mut y, 0, &mut steps);
    steps.reverse();
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What `patch` does with a diff.
    fn patched(old: &str, diff: &str) -> String {
        let old = lines(old);
        let (mut out, mut at) = (String::new(), 0);
        let mut rows = diff.split_inclusive('\n').skip(2).peekable();
        while let Some(row) = rows.next() {
            let bare = rows.peek().is_some_and(|next| next.starts_with('\\'));
            let body = if bare { row[1..].trim_end_matches('\n') } else { &row[1..] };
            match row.as_bytes()[0] {
                b'@' => {
                    let range = row.split(['-', ' ']).nth(2).unwrap();
                    let (first, length) = range.split_once(',').unwrap_or((range, "1"));
                    let first = first.parse::<usize>().unwrap() - usize::from(length != "0");
                    out += &old[at..first].concat();
                    at = first;
                }
                b'+' => out += body,
                sign => {
                    assert_eq!(old[at], body);
                    out += if sign == b' ' { body } else { "" };
                    at += 1;
                }
            }
            if bare {
                rows.next();
            }
        }
        out + &old[at..].concat()
    }

    #[test]
    fn a_changed_line_stands_in_its_context() {
        let old: String = (1..=9).map(|i| format!("{i}\n")).collect();
        let new = old.replace("5\n", "five\n");
        let expected = "--- a\n+++ a\n@@ -2,7 +2,7 @@\n 2\n 3\n 4\n-5\n+five\n 6\n 7\n 8\n";
        assert_eq!(unified("a", &old, &new, false), expected);
        assert_eq!(unified("a", &old, &old, false), "");
        assert!(unified("a", &old, &new, true).contains("\x1b[31m-5\x1b[0m\n"));
    }

    #[test]
    fn the_end_of_a_file_may_lack_its_line_break() {
        let diff = unified("a", "x", "x\n", false);
        assert_eq!(diff, "--- a\n+++ a\n@@ -1 +1 @@\n-x\n\\ No newline at end of file\n+x\n");
        assert_eq!(unified("a", "", "x\n", false), "--- a\n+++ a\n@@ -0,0 +1 @@\n+x\n");
    }

    #[test]
    fn texts_that_have_nothing_in_common_are_replaced() {
        let [old, new] = ["a", "b"].map(|c| (0..2 * MOST_CHANGES).map(|i| format!("{c}{i}\n")).collect::<String>());
        assert_eq!(patched(&old, &unified("a", &old, &new, false)), new);
    }

    proptest! {
        #[test]
        fn applying_the_difference_gives_the_other_text(
            old in "([abc]\n){0,30}[ab]?", new in "([abc]\n){0,30}[ab]?"
        ) {
            prop_assert_eq!(patched(&old, &unified("a", &old, &new, false)), new);
        }
    }
}
