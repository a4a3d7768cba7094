//! A new text against the blessed one, value by value.

use super::tolerance::{PictureTolerance, Tolerance, Tolerances};
use super::tree::{Token, Tree};
use std::fmt;

/// A place at which two outputs differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// `contacts[3].gap.mmc`
    pub path: String,
    pub blessed: String,
    pub now: String,
    /// What it may differ by there; nothing where the two have to be equal.
    pub allowed: Option<Allowed>,
}

/// A tolerance of what differs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Allowed {
    Number(Tolerance),
    Picture(PictureTolerance),
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} blessed, {} now", self.path, self.blessed, self.now)
    }
}

/// What came of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Settled {
    /// In the order of the blessed text.
    pub differences: Vec<Difference>,
    /// The new text with the blessed digits wherever a number is equal within tolerance: what changes between the blessed
    /// text and this one has to be looked at.
    pub text: String,
}

/// Stands for a side that has nothing there.
const NOTHING: &str = "nothing";

/// Compares `now` with `blessed`; paths begin with `root`, such as `contacts`.
pub fn settle(root: &str, blessed: &str, now: &str, tolerances: &Tolerances) -> Settled {
    let (Some(b), Some(n)) = (Tree::parse(blessed), Tree::parse(now)) else {
        return Settled { differences: first_line(root, blessed, now).into_iter().collect(), text: now.into() };
    };
    let mut judge = Judge { tolerances, path: root.into(), differences: Vec::new(), equal: Vec::new() };
    judge.compare(&b, &n, None);
    Settled { differences: judge.differences, text: replaced(now, &judge.equal) }
}

struct Judge<'t, 'a> {
    tolerances: &'t Tolerances,
    path: String,
    differences: Vec<Difference>,
    /// New tokens that count as equal to blessed ones.
    equal: Vec<(Token<'a>, &'a str)>,
}

impl<'a> Judge<'_, 'a> {
    /// `own`: the tolerance of the nearest named field around.
    fn compare(&mut self, blessed: &Tree<'a>, now: &Tree<'a>, own: Option<Tolerance>) {
        match (blessed, now) {
            (Tree::Leaf(b), Tree::Leaf(n)) if b.text == n.text => {}
            (Tree::Leaf(b), Tree::Leaf(n)) => match self.allowed(b.text, n.text, own) {
                Some((true, _)) => self.equal.push((*n, b.text)),
                allowed => self.differ(b.text.into(), n.text.into(), allowed.map(|(_, tolerance)| tolerance)),
            },
            (Tree::Branch(bh, b), Tree::Branch(nh, n)) if bh == nh => self.compare_items(b, n, own),
            _ => self.differ(blessed.show(), now.show(), None),
        }
    }

    fn compare_items(&mut self, blessed: &[(String, Tree<'a>)], now: &[(String, Tree<'a>)], own: Option<Tolerance>) {
        let length = self.path.len();
        let partner = |i: usize, key: &str| match now.get(i) {
            Some((same, value)) if same == key => Some((i, value)),
            _ if key.is_empty() => None,
            _ => now.iter().enumerate().find(|(_, (k, _))| k == key).map(|(j, (_, value))| (j, value)),
        };
        let mut met = vec![false; now.len()];
        let mut moved = None;
        for (i, (key, value)) in blessed.iter().enumerate() {
            self.descend(key, i);
            match partner(i, key) {
                Some((j, other)) => {
                    met[j] = true;
                    let own = self.tolerances.named.get(key).copied().or(own);
                    self.compare(value, other, own);
                    // With as many on either side, another place is another order and not the trace of one that is lost.
                    let displaced = i != j && blessed.len() == now.len();
                    moved = moved.or_else(|| now.get(i).filter(|_| displaced).map(|(first, _)| (key, first)));
                }
                None => self.differ(value.show(), NOTHING.into(), None),
            }
            self.path.truncate(length);
        }
        let all_met = met.iter().all(|m| *m);
        for (j, (key, value)) in now.iter().enumerate().filter(|(j, _)| !met[*j]) {
            self.descend(key, j);
            self.differ(NOTHING.into(), value.show(), None);
            self.path.truncate(length);
        }
        if let (Some((blessed, now)), true) = (moved, all_met) {
            self.differ(format!("`{blessed}` first"), format!("`{now}` first"), None);
        }
    }

    fn descend(&mut self, key: &str, index: usize) {
        let plain = |c: char| c.is_alphanumeric() || ['_', '[', ']'].contains(&c);
        if key.is_empty() {
            self.path.push_str(&format!("[{index}]"));
        } else if key.chars().all(plain) {
            self.path.push('.');
            self.path.push_str(key);
        } else {
            self.path.push_str(&format!("[\"{key}\"]"));
        }
    }

    fn differ(&mut self, blessed: String, now: String, tolerance: Option<Tolerance>) {
        let allowed = tolerance.map(Allowed::Number);
        self.differences.push(Difference { path: self.path.clone(), blessed, now, allowed });
    }

    /// Whether two numbers count as equal, and by what; nothing for what must be equal.
    fn allowed(&self, blessed: &str, now: &str, own: Option<Tolerance>) -> Option<(bool, Tolerance)> {
        let (b, n) = blessed.parse::<f64>().ok().zip(now.parse::<f64>().ok())?;
        let whole = |text: &str| !text.contains(['.', 'e', 'E']);
        let usual = (!(whole(blessed) && whole(now))).then_some(self.tolerances.decimals);
        let tolerance = own.or(usual)?;
        Some((tolerance.allows(b, n), tolerance))
    }
}

/// `text` with other words in the places of some tokens, which are in no order.
fn replaced(text: &str, tokens: &[(Token, &str)]) -> String {
    let mut tokens: Vec<_> = tokens.iter().collect();
    tokens.sort_by_key(|(token, _)| token.at);
    let (mut out, mut at) = (String::with_capacity(text.len()), 0);
    for (token, word) in tokens {
        out.push_str(&text[at..token.at]);
        out.push_str(word);
        at = token.at + token.text.len();
    }
    out.push_str(&text[at..]);
    out
}

/// Texts that are not RON are compared line by line.
fn first_line(root: &str, blessed: &str, now: &str) -> Option<Difference> {
    let (mut b, mut n) = (blessed.lines(), now.lines());
    for number in 1.. {
        let (b, n) = (b.next(), n.next());
        if b.is_none() && n.is_none() {
            break;
        }
        if b != n {
            let show = |line: Option<&str>| line.unwrap_or("the end").to_string();
            return Some(Difference {
                path: format!("{root} line {number}"),
                blessed: show(b),
                now: show(n),
                allowed: None,
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLESSED: &str = r#"(
        name: "wheel (left)", // a comment
        kind: Cylinder,
        gaps: [(0.004, 0.011), Some(3.5)],
        sizes: {"gear.d": 50.0, "pin[1]": 6.0},
        pixels: (100, 30),
        count: 12,
    )"#;

    fn found(from: &str, to: &str) -> Vec<String> {
        assert!(BLESSED.contains(from), "{from}");
        let tolerances = Tolerances::of("// tolerance: ±0.001 ±0.01 %\n// tolerance of pixels: ±2 ±1 %\n").unwrap();
        let settled = settle("view", BLESSED, &BLESSED.replacen(from, to, 1), &tolerances);
        settled.differences.iter().map(Difference::to_string).collect()
    }

    #[test]
    fn layout_comments_and_rounding_do_not_matter() {
        let other = r#"(name:"wheel (left)",kind:Cylinder,gaps:[(0.0045,0.011),Some(3.5)],
            sizes:{"gear.d":50.0059,"pin[1]":6.0},pixels:(103,31),count:12)"#;
        let tolerances = Tolerances::of("// tolerance: ±0.001 ±0.01 %\n// tolerance of pixels: ±2 ±1 %\n").unwrap();
        let settled = settle("view", BLESSED, other, &tolerances);
        assert_eq!(settled.differences, []);
        assert_eq!(
            settled.text,
            other.replace("0.0045", "0.004").replace("50.0059", "50.0").replace("103", "100").replace("31", "30")
        );
    }

    #[test]
    fn differences_are_named_with_both_values() {
        assert_eq!(found("0.011", "0.016"), ["view.gaps[0][1]: 0.011 blessed, 0.016 now"]);
        assert_eq!(found("Cylinder", "Plane"), ["view.kind: Cylinder blessed, Plane now"]);
        assert_eq!(found("left", "right"), [r#"view.name: "wheel (left)" blessed, "wheel (right)" now"#]);
        assert_eq!(found("50.0", "51.0"), [r#"view.sizes["gear.d"]: 50.0 blessed, 51.0 now"#]);
        assert_eq!(found(", Some(3.5)", ""), ["view.gaps[1]: Some(3.5) blessed, nothing now"]);
        assert_eq!(found("3.5)]", "3.5), 1]"), ["view.gaps[2]: nothing blessed, 1 now"]);
        assert_eq!(found("kind: Cylinder,", ""), ["view.kind: Cylinder blessed, nothing now"]);
        assert_eq!(found("Some(3.5)", "None"), ["view.gaps[1]: Some(3.5) blessed, None now"]);
    }

    #[test]
    fn a_difference_says_what_was_allowed() {
        let tolerances = Tolerances::of("// tolerance: ±0.001 ±0.01 %\n// tolerance of pixels: ±2 ±1 %\n").unwrap();
        let now = BLESSED.replace("0.011", "0.016").replace("100", "110").replace("12", "13").replace("Plane", "Cone");
        let differences = settle("view", BLESSED, &now, &tolerances).differences;
        let allowed: Vec<Option<Allowed>> = differences.iter().map(|d| d.allowed).collect();
        let number = |absolute, share| Some(Allowed::Number(Tolerance { absolute, share }));
        assert_eq!(allowed, [number(0.001, 0.0001), number(2.0, 0.01), None], "{differences:?}");
    }

    #[test]
    fn another_key_is_missing_and_new_at_once() {
        let expected = [
            r#"view.sizes["gear.d"]: 50.0 blessed, nothing now"#.to_string(),
            r#"view.sizes["gear.h"]: nothing blessed, 50.0 now"#.to_string(),
        ];
        assert_eq!(found("gear.d", "gear.h"), expected);
    }

    #[test]
    fn another_order_is_a_difference() {
        let swapped = found(r#""gear.d": 50.0, "pin[1]": 6.0"#, r#""pin[1]": 6.0, "gear.d": 50.0"#);
        assert_eq!(swapped, ["view.sizes: `gear.d` first blessed, `pin[1]` first now"]);
    }

    #[test]
    fn whole_numbers_are_exact_unless_their_field_is_named() {
        assert_eq!(found("count: 12", "count: 13"), ["view.count: 12 blessed, 13 now"]);
        assert_eq!(found("(100, 30)", "(103, 32)"), Vec::<String>::new());
        assert_eq!(found("(100, 30)", "(104, 30)"), ["view.pixels[0]: 100 blessed, 104 now"]);
    }

    #[test]
    fn broken_texts_fall_back_to_lines() {
        let differences = |b, n| settle("a", b, n, &Tolerances::default()).differences;
        assert_eq!(differences("(a: ", "(a: "), []);
        assert_eq!(differences("(a:\n1", "(a:\n2")[0].to_string(), "a line 2: 1 blessed, 2 now");
        assert_eq!(differences("(", "(\n)").len(), 1);
        assert_eq!(differences(&"(".repeat(100_000), "").len(), 1);
    }
}
