//! Blessed stage outputs and how new ones are compared with them.
//!
//! In: two texts in RON, the blessed and the new one. Out: the first place where they differ, with both values. Numbers may
//! differ by rounding, everything else must be equal; layout and comments count for nothing. Never touches the file system.

use std::fmt;

/// Numbers this close are equal: what rounding to the decimals of an artifact leaves.
const ABSOLUTE: f64 = 1e-3;
/// Numbers this close relative to their size are equal: areas, volumes and pixel counts on another platform.
const RELATIVE: f64 = 1e-4;
/// Larger goldens are refused: nobody would review them (bytes).
pub const LARGEST: usize = 20 << 10;

/// The first place at which two texts differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// `liaisons[3].gap[0]`.
    pub path: String,
    pub expected: String,
    pub actual: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}, is {}", self.path, self.expected, self.actual)
    }
}

/// Where `actual` first departs from `expected`; `None` when they say the same.
pub fn first_difference(expected: &str, actual: &str) -> Option<Difference> {
    match (parse(expected), parse(actual)) {
        (Some(e), Some(a)) => differ(&e, &a, &mut String::new()),
        _ => first_line(expected, actual),
    }
}

/// Texts that are not RON are compared line by line.
fn first_line(expected: &str, actual: &str) -> Option<Difference> {
    let (mut e, mut a) = (expected.lines(), actual.lines());
    for number in 1.. {
        let (e, a) = (e.next(), a.next());
        if e.is_none() && a.is_none() {
            break;
        }
        if e != a {
            let show = |line: Option<&str>| line.unwrap_or("the end").to_string();
            return Some(Difference { path: format!("line {number}"), expected: show(e), actual: show(a) });
        }
    }
    None
}

/// RON without its layout.
#[derive(Debug, PartialEq)]
enum Tree {
    Leaf(String),
    /// The name before the bracket (often empty) and what is inside, each with its field name, its key or nothing.
    Branch(String, Vec<(String, Tree)>),
}

impl Tree {
    fn show(&self) -> String {
        match self {
            Tree::Leaf(text) => text.clone(),
            Tree::Branch(head, items) => format!("{head}(… {} entries)", items.len()),
        }
    }
}

fn differ(expected: &Tree, actual: &Tree, path: &mut String) -> Option<Difference> {
    let difference = |path: &str, expected: String, actual: String| {
        let path = if path.is_empty() { "the whole" } else { path };
        Some(Difference { path: path.into(), expected, actual })
    };
    match (expected, actual) {
        (Tree::Leaf(e), Tree::Leaf(a)) if same(e, a) => None,
        (Tree::Branch(eh, e), Tree::Branch(ah, a)) if eh == ah => {
            for (index, ((ek, ev), (ak, av))) in e.iter().zip(a).enumerate() {
                let length = path.len();
                descend(path, ek, index);
                if ek != ak {
                    return difference(path, ek.clone(), ak.clone());
                }
                if let Some(found) = differ(ev, av, path) {
                    return Some(found);
                }
                path.truncate(length);
            }
            let counts = [e, a].map(|items| format!("{} entries", items.len()));
            let [expected, actual] = counts;
            if e.len() == a.len() { None } else { difference(path, expected, actual) }
        }
        _ => difference(path, expected.show(), actual.show()),
    }
}

fn descend(path: &mut String, key: &str, index: usize) {
    if key.is_empty() {
        path.push_str(&format!("[{index}]"));
    } else {
        path.push_str(if path.is_empty() { "" } else { "." });
        path.push_str(key);
    }
}

fn same(expected: &str, actual: &str) -> bool {
    if expected == actual {
        return true;
    }
    match (expected.parse::<f64>(), actual.parse::<f64>()) {
        (Ok(e), Ok(a)) => (e - a).abs() <= ABSOLUTE + RELATIVE * e.abs().max(a.abs()),
        _ => false,
    }
}

fn parse(text: &str) -> Option<Tree> {
    let mut tokens = tokens(text)?;
    tokens.reverse();
    let tree = value(&mut tokens)?;
    tokens.is_empty().then_some(tree)
}

/// Brackets, commas and colons by themselves; numbers, names and strings whole. Last first, so that `pop` is next.
fn value(tokens: &mut Vec<&str>) -> Option<Tree> {
    let token = tokens.pop()?;
    match token {
        "(" | "[" | "{" => branch(tokens, ""),
        ")" | "]" | "}" | "," | ":" => None,
        name if tokens.last() == Some(&"(") => {
            tokens.pop();
            branch(tokens, name)
        }
        leaf => Some(Tree::Leaf(leaf.into())),
    }
}

fn branch(tokens: &mut Vec<&str>, head: &str) -> Option<Tree> {
    let mut items = Vec::new();
    loop {
        if matches!(tokens.last()?, &")" | &"]" | &"}") {
            tokens.pop();
            return Some(Tree::Branch(head.into(), items));
        }
        let first = value(tokens)?;
        let item = if tokens.last() == Some(&":") {
            tokens.pop();
            (first.show().trim_matches('"').to_string(), value(tokens)?)
        } else {
            (String::new(), first)
        };
        items.push(item);
        if tokens.last() == Some(&",") {
            tokens.pop();
        }
    }
}

fn tokens(text: &str) -> Option<Vec<&str>> {
    const ALONE: &[char] = &['(', ')', '[', ']', '{', '}', ',', ':'];
    let mut rest = text.trim_start();
    let mut found = Vec::new();
    while let Some(first) = rest.chars().next() {
        let length = if rest.starts_with("//") {
            let length = rest.find('\n').unwrap_or(rest.len());
            rest = rest[length..].trim_start();
            continue;
        } else if ALONE.contains(&first) {
            1
        } else if first == '"' {
            string_length(rest)?
        } else {
            rest.find(|c: char| c.is_whitespace() || ALONE.contains(&c)).unwrap_or(rest.len())
        };
        found.push(&rest[..length]);
        rest = rest[length..].trim_start();
    }
    Some(found)
}

fn string_length(text: &str) -> Option<usize> {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '"' if !escaped => return Some(at + 1),
            '\\' => escaped = !escaped,
            _ => escaped = false,
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
        sizes: {"gear.d": 50.0},
    )"#;

    #[test]
    fn layout_comments_and_rounding_do_not_matter() {
        let other = r#"(name:"wheel (left)",kind:Cylinder,gaps:[(0.00401,0.011),Some(3.5)],sizes:{"gear.d":50.0001})"#;
        assert_eq!(first_difference(BLESSED, other), None);
    }

    #[test]
    fn the_first_difference_is_named_with_both_values() {
        let found = |from: &str, to: &str| first_difference(BLESSED, &BLESSED.replace(from, to)).unwrap().to_string();
        assert_eq!(found("0.011", "0.016"), "gaps[0][1]: expected 0.011, is 0.016");
        assert_eq!(found("Cylinder", "Plane"), "kind: expected Cylinder, is Plane");
        assert_eq!(found("left", "right"), r#"name: expected "wheel (left)", is "wheel (right)""#);
        assert_eq!(found("50.0", "51.0"), "sizes.gear.d: expected 50.0, is 51.0");
        assert_eq!(found("gear.d", "gear.h"), "sizes.gear.d: expected gear.d, is gear.h");
        assert_eq!(found(", Some(3.5)", ""), "gaps: expected 2 entries, is 1 entries");
    }

    #[test]
    fn broken_texts_fall_back_to_lines() {
        assert_eq!(first_difference("(a: ", "(a: "), None);
        let found = first_difference("(a:\n1", "(a:\n2").unwrap();
        assert_eq!(found.to_string(), "line 2: expected 1, is 2");
        assert!(first_difference("(", "(\n)").is_some());
    }
}
