//! Two texts side by side as `diff -u` shows them.

/// Lines shown around a change.
const AROUND: usize = 3;
/// Longer stretches than this product of lines are shown as wholly replaced: the table below would grow too large.
const LARGEST_TABLE: usize = 4 << 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Both,
    Old,
    New,
}

/// The unified difference of two texts with their names at its head; empty when they are equal. `patch` can apply it.
pub fn unified(old_name: &str, old: &str, new_name: &str, new: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (old.lines().collect(), new.lines().collect());
    let script = script(&old, &new);
    let mut out = String::new();
    let mut at = 0;
    while let Some(first) = script[at..].iter().position(|(side, _)| *side != Side::Both).map(|i| at + i) {
        if out.is_empty() {
            out = format!("--- {old_name}\n+++ {new_name}\n");
        }
        let begin = first.saturating_sub(AROUND).max(at);
        let end = end_of_hunk(&script, first);
        hunk(&script, begin, end, &mut out);
        at = end;
    }
    out
}

/// Behind the last change whose surroundings touch those of the one before it, and its surroundings.
fn end_of_hunk(script: &[(Side, &str)], first: usize) -> usize {
    let mut last = first;
    for (i, (side, _)) in script.iter().enumerate().skip(first) {
        if *side != Side::Both {
            last = i;
        } else if i - last > 2 * AROUND {
            break;
        }
    }
    (last + 1 + AROUND).min(script.len())
}

fn hunk(script: &[(Side, &str)], begin: usize, end: usize, out: &mut String) {
    let count = |part: &[(Side, &str)], not: Side| part.iter().filter(|(side, _)| *side != not).count();
    let range = |not: Side| {
        let (before, length) = (count(&script[..begin], not), count(&script[begin..end], not));
        // By convention an empty side is named by the line before it.
        format!("{},{length}", if length == 0 { before } else { before + 1 })
    };
    out.push_str(&format!("@@ -{} +{} @@\n", range(Side::New), range(Side::Old)));
    for (side, line) in &script[begin..end] {
        let mark = match side {
            Side::Both => ' ',
            Side::Old => '-',
            Side::New => '+',
        };
        out.push(mark);
        out.push_str(line);
        out.push('\n');
    }
}

/// The shortest way from the old lines to the new: a longest common subsequence, what goes before what comes.
fn script<'a>(old: &[&'a str], new: &[&'a str]) -> Vec<(Side, &'a str)> {
    let head = old.iter().zip(new).take_while(|(a, b)| a == b).count();
    let (old_rest, new_rest) = (&old[head..], &new[head..]);
    let tail = old_rest.iter().rev().zip(new_rest.iter().rev()).take_while(|(a, b)| a == b).count();
    let (old_mid, new_mid) = (&old_rest[..old_rest.len() - tail], &new_rest[..new_rest.len() - tail]);
    let both = |lines: &[&'a str]| lines.iter().map(|l| (Side::Both, *l)).collect::<Vec<_>>();
    let middle = middle(old_mid, new_mid);
    [both(&old[..head]), middle, both(&old_rest[old_rest.len() - tail..])].concat()
}

fn middle<'a>(old: &[&'a str], new: &[&'a str]) -> Vec<(Side, &'a str)> {
    let width = new.len() + 1;
    let mut script = Vec::with_capacity(old.len() + new.len());
    let (mut i, mut j) = (0, 0);
    if (old.len() + 1) * width <= LARGEST_TABLE {
        // common[i][j]: how many lines old[i..] and new[j..] have in common.
        let mut common = vec![0u32; (old.len() + 1) * width];
        for i in (0..old.len()).rev() {
            for j in (0..new.len()).rev() {
                common[i * width + j] = if old[i] == new[j] {
                    common[(i + 1) * width + j + 1] + 1
                } else {
                    common[(i + 1) * width + j].max(common[i * width + j + 1])
                };
            }
        }
        while i < old.len() && j < new.len() {
            if old[i] == new[j] {
                script.push((Side::Both, old[i]));
                (i, j) = (i + 1, j + 1);
            } else if common[(i + 1) * width + j] >= common[i * width + j + 1] {
                script.push((Side::Old, old[i]));
                i += 1;
            } else {
                script.push((Side::New, new[j]));
                j += 1;
            }
        }
    }
    script.extend(old[i..].iter().map(|l| (Side::Old, *l)));
    script.extend(new[j..].iter().map(|l| (Side::New, *l)));
    script
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(count: usize) -> Vec<String> {
        (1..=count).map(|i| format!("line {i}")).collect()
    }

    #[test]
    fn a_change_is_shown_with_three_lines_around() {
        let old = numbered(20).join("\n");
        let new = old.replace("line 9\n", "line nine\n").replace("line 10\n", "");
        let expected = "--- a\n+++ b\n@@ -6,8 +6,7 @@\n line 6\n line 7\n line 8\n-line 9\n-line 10\n+line nine\n \
                        line 11\n line 12\n line 13\n";
        assert_eq!(unified("a", &old, "b", &new), expected);
        assert_eq!(unified("a", &old, "b", &old), "");
    }

    #[test]
    fn far_changes_have_hunks_of_their_own_and_near_ones_share_one() {
        let old = numbered(40).join("\n");
        let hunks = |changed: &[usize]| {
            let new: Vec<String> = numbered(40)
                .iter()
                .enumerate()
                .map(|(i, l)| if changed.contains(&i) { "x".into() } else { l.clone() })
                .collect();
            unified("a", &old, "b", &new.join("\n")).matches("@@ -").count()
        };
        assert_eq!((hunks(&[3, 10]), hunks(&[3, 11]), hunks(&[3, 30]), hunks(&[0, 39])), (1, 2, 2, 2));
    }

    #[test]
    fn nothing_before_and_nothing_after() {
        assert_eq!(unified("a", "", "b", "x\n"), "--- a\n+++ b\n@@ -0,0 +1,1 @@\n+x\n");
        assert_eq!(unified("a", "x\n", "b", ""), "--- a\n+++ b\n@@ -1,1 +0,0 @@\n-x\n");
    }

    /// Applying the script gives the new text: whatever the texts are.
    #[test]
    fn the_script_leads_from_the_old_to_the_new() {
        let mut state = 7u64;
        for _ in 0..200 {
            let mut text = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let letters: Vec<String> = (0..state >> 60).map(|i| format!("{}", state >> (20 + 3 * i) & 3)).collect();
                letters
            };
            let (old, new) = (text(), text());
            let (old, new): (Vec<&str>, Vec<&str>) =
                (old.iter().map(String::as_str).collect(), new.iter().map(String::as_str).collect());
            let script = script(&old, &new);
            let side = |not: Side| script.iter().filter(|(s, _)| *s != not).map(|(_, l)| *l).collect::<Vec<_>>();
            assert_eq!((side(Side::New), side(Side::Old)), (old, new));
        }
    }
}
