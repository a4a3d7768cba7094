//! Words of other languages and programs in the place of ours.

use super::Slip;

/// Their word, ours.
const KEYWORDS: [(&str, &str); 31] = [
    ("sub", "cut"),
    ("subtract", "cut"),
    ("subtraction", "cut"),
    ("minus", "cut"),
    ("remove", "cut"),
    ("difference", "cut"),
    ("drill", "cut"),
    ("pocket", "cut"),
    ("union", "add"),
    ("plus", "add"),
    ("fuse", "add"),
    ("solid", "add"),
    ("intersect", "keep"),
    ("intersection", "keep"),
    ("common", "keep"),
    ("rotate", "turn"),
    ("rotated", "turn"),
    ("translate", "at"),
    ("move", "at"),
    ("position", "at"),
    ("pattern", "on"),
    ("import", "use"),
    ("include", "use"),
    ("param", "let"),
    ("var", "let"),
    ("const", "let"),
    ("set", "let"),
    ("component", "place"),
    ("insert", "place"),
    ("mate", "place"),
    ("lamp", "light"),
];

/// What the language has in the place of theirs.
const OTHERWISE: [(&str, &str); 12] = [
    ("fillet", ROUNDED),
    ("round", ROUNDED),
    ("chamfer", ROUNDED),
    ("for", "there are no loops: `cut bore = 3x cylinder(d = 6, h = through) on circle(d = 36)`"),
    ("repeat", "there are no loops: `cut bore = 3x cylinder(d = 6, h = through) on circle(d = 36)`"),
    ("if", "there are no conditions: `gonogo check --set size=8` gives a `let` another value"),
    ("module", "a part drawn once for many sizes is a family: `part roller(d, l) {`"),
    ("function", "a part drawn once for many sizes is a family: `part roller(d, l) {`"),
    ("thread", "a thread is a cylinder of its major diameter: `cylinder(d = 6 basic, h = 10)`"),
    ("extrude", "draw an `outline` and write `add rail = prism(outline = …, h = 10)`"),
    ("sketch", "draw an `outline` and write `add rail = prism(outline = …, h = 10)`"),
    ("mirror", "there is no mirror: draw the other side, or turn it about an axis"),
];

const ROUNDED: &str = "corners of an `outline` take `round 1` or `chamfer 1` behind them, a cylinder takes `chamfer = 1`, and \
                       `edge_break` of its material rounds every edge in the picture";

/// The word of the language that `found` was meant to be, if it is one of `expected`.
pub fn keyword(found: &str, expected: &[&str]) -> Option<&'static str> {
    let here = |ours: &str| expected.iter().any(|e| e.trim_matches('`') == ours);
    let found = found.to_ascii_lowercase();
    KEYWORDS.iter().find(|(theirs, ours)| *theirs == found && here(ours)).map(|(_, ours)| *ours)
}

/// A statement that the language has not, at the beginning of a line.
pub fn slip(at: usize, found: &str) -> Option<Slip> {
    let (_, help) = OTHERWISE.iter().find(|(word, _)| *word == found)?;
    Some(Slip::new("E0101", at, found.len(), format!("no statement begins with `{found}`"), "unknown here").help(*help))
}
