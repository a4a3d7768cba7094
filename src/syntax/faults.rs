//! What to say about a text that does not parse.
//!
//! In: where the parser gave up and what it would have taken. Out: a diagnostic in the words of the drawing office. The
//! usual slips (a sum without parentheses, deviations without a slash, a pair of fits, a misspelt keyword) are recognised
//! from the text around that place.

use super::scan::strip_comment;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};

/// Where parsing stopped (byte offset) and what would have been accepted there, in words.
pub struct Fault {
    pub at: usize,
    pub expected: Vec<&'static str>,
}

/// The diagnostic for a fault in `text`, which begins at `offset` of file `file`.
pub fn describe(text: &str, fault: &Fault, file: u32, offset: usize) -> Diagnostic {
    let span = |at: usize, len: usize| Span { file, start: (offset + at) as u32, end: (offset + at + len) as u32 };
    if let Some(slip) = dimension_slip(text, fault.at) {
        return Diagnostic::error(slip.code, span(slip.at, slip.len), slip.message).label(slip.label).help(slip.help);
    }
    if let Some((at, word)) = bare_feature(text, fault.at) {
        let message = format!("expected a feature (`add`, `cut`, `keep`), found `{word}`");
        let meant = keyword_meant(word, &["`add`", "`cut`", "`keep`"]).unwrap_or_else(|| format!("add {word}"));
        let help = format!("did you mean `{meant}`?");
        return Diagnostic::error("E0101", span(at, word.len()), message).label("not a feature").help(help);
    }
    if let Some(slip) = placing_slip(text, fault.at) {
        return Diagnostic::error(slip.code, span(slip.at, slip.len), slip.message).label(slip.label).help(slip.help);
    }
    // Inside a token that takes no blanks the parser stops before them; the reader looks at what follows.
    let at = text.len() - text[fault.at..].trim_start_matches([' ', '\t']).len();
    let found = token_at(text, at);
    if let Some((at, word, meant)) = misspelt_before(text, at, &fault.expected) {
        let message = format!("expected {}, found `{word}`", list(&fault.expected));
        let help = format!("did you mean `{meant}`?");
        return Diagnostic::error("E0101", span(at, word.len()), message).label("not expected here").help(help);
    }
    let message = format!("expected {}, found {}", list(&fault.expected), spoken(found));
    let diagnostic = Diagnostic::error("E0101", span(at, found.trim_end().len()), message).label("not expected here");
    match keyword_meant(found, &fault.expected) {
        Some(meant) => diagnostic.help(format!("did you mean `{meant}`?")),
        None => diagnostic,
    }
}

/// The name in a line such as `shank = cylinder(…)`, where the parser took a field and gave up at the parenthesis.
fn bare_feature(text: &str, at: usize) -> Option<(usize, &str)> {
    let line_start = text[..at].rfind('\n').map_or(0, |i| i + 1);
    let (name, shape) = text[line_start..at].split_once('=')?;
    let indent = name.len() - name.trim_start().len();
    let word = |s: &str| !s.is_empty() && s.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    let bare = text[at..].starts_with('(') && word(name.trim()) && word(shape.trim());
    bare.then(|| (line_start + indent, name.trim()))
}

/// Where a statement that stands in the wrong block belongs: first words, block.
const BLOCKS: [(&[&str], &str); 5] = [
    (&["add", "cut", "keep", "outline"], "part"),
    (&["root", "place", "measure"], "assembly"),
    (&["camera", "light", "floor", "vary"], "station"),
    (&["watch", "ignore"], "inspect"),
    (&["from", "line", "arc"], "outline"),
];

/// Recognises a statement in the wrong block, a feature without `=`, a group placed behind its brace, and the words of an
/// outline in the manner of arguments.
fn placing_slip(text: &str, at: usize) -> Option<Slip> {
    let at = text.len() - text[at..].trim_start_matches([' ', '\t']).len();
    let found = token_at(text, at);
    let line_start = text[..at].rfind('\n').map_or(0, |i| i + 1);
    let before = text[line_start..at].trim();
    let line = text[at..].lines().next().unwrap_or_default();
    let slip = |message: String, label, help: String| {
        Some(Slip { code: "E0101", at, len: found.len().max(1), message, label, help })
    };
    let behind = before.rsplit(' ').next().unwrap_or_default();
    match found {
        "on" | "at" | "turn" if before == "}" => slip(
            "a group is placed before its brace".to_string(),
            "too late",
            format!("write `group {} {{`", line.trim_end()),
        ),
        "group" if before.is_empty() => {
            let name = line["group".len()..].trim().trim_end_matches('{').trim();
            let name = if name.is_empty() { "mount" } else { name };
            slip("a group is added, cut or kept".to_string(), "how?", format!("write `cut {name} = group {{`"))
        }
        "=" if ["radius", "round", "chamfer", "to", "within", "from"].contains(&behind) => slip(
            format!("`{behind}` takes no `=`"),
            "not expected here",
            format!("write `{behind} {}`", line[1..].trim()),
        ),
        "left" | "right" if before.ends_with(')') => slip(
            format!("the radius stands before `{found}`"),
            "not expected here",
            format!("write `radius 10 {found}`"),
        ),
        _ if before.is_empty() => {
            let (_, block) = BLOCKS.iter().find(|(words, _)| words.contains(&found))?;
            if let ("part", Some(slip)) = (*block, bare_name(text, at)) {
                return Some(slip);
            }
            let article = if *block == "part" || *block == "station" { "a" } else { "an" };
            slip(
                format!("`{found}` cannot stand here"),
                "not in this block",
                format!("move it into the braces of {article} `{block}`"),
            )
        }
        _ => None,
    }
}

/// The fault of `add mount group {`, whose operation at `at` is well placed: the sign behind the name is missing.
fn bare_name(text: &str, at: usize) -> Option<Slip> {
    let line = text[at..].lines().next()?;
    let mut words = line.split_whitespace();
    let (op, name, next) = (words.next()?, words.next()?, words.next()?);
    let is_name = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    let offset = line.find(name)? + name.len();
    let offset = offset + line[offset..].find(next)?;
    (is_name && next != "=" && op != "outline").then(|| Slip {
        code: "E0101",
        at: at + offset,
        len: token_at(text, at + offset).len().max(1),
        message: format!("expected `=` behind `{op} {name}`"),
        label: "not expected here",
        help: format!("write `{op} {name} = {}`", line[offset..].trim()),
    })
}

/// The word before `at`, if it was read as a unit but is nearly a keyword that is expected.
fn misspelt_before<'t>(text: &'t str, at: usize, expected: &[&str]) -> Option<(usize, &'t str, String)> {
    let before = text[..at].trim_end_matches([' ', '\t']);
    let start = before.trim_end_matches(|c: char| c.is_ascii_alphabetic()).len();
    let word = &before[start..];
    let is_unit = before[..start].trim_end().ends_with(|c: char| c == ')' || c.is_ascii_digit());
    let keywords = expected.iter().filter_map(|w| w.strip_prefix('`')?.strip_suffix('`')).filter(|w| w.len() > 2);
    let meant = nearest(word, keywords)?;
    (is_unit && word.len() > 2).then(|| (start, word, meant.to_string()))
}

struct Slip {
    code: &'static str,
    at: usize,
    len: usize,
    message: String,
    label: &'static str,
    help: String,
}

/// Recognises the usual slips in the dimension around `at`.
fn dimension_slip(text: &str, at: usize) -> Option<Slip> {
    let (start, dim) = dimension_around(text, at)?;
    let words: Vec<&str> = dim.split_whitespace().collect();
    let slip = |code, message: &str, label, help| {
        Some(Slip { code, at: start, len: dim.len(), message: message.to_string(), label, help })
    };
    match words.as_slice() {
        [size, pair] if is_fit_pair(pair) => {
            let (hole, shaft) = pair.split_once('/')?;
            let help = format!("write `{size} {hole}` in the part with the hole and `{size} {shaft}` in the other");
            slip("E0309", &format!("`{pair}` names the fits of two parts"), "one size has one fit", help)
        }
        [size, tolerance] if tolerance.starts_with('±') && tolerance.contains('/') => {
            let (upper, lower) = tolerance.trim_start_matches('±').split_once('/')?;
            let help = format!("write `{size} +{upper}/-{lower}`");
            slip("E0104", "`±` takes one deviation", "two deviations", help)
        }
        [size, upper, lower] if is_signed(upper) && is_signed(lower) => {
            let help = format!("write `{size} {upper}/{lower}`");
            slip("E0104", "a two-sided tolerance needs a slash", "two deviations without a slash", help)
        }
        [size, deviation] if is_signed(deviation) => {
            let sum = format!("({size} {} {})", &deviation[..1], &deviation[1..]);
            let both = if deviation.starts_with('+') { format!("{deviation}/0") } else { format!("0/{deviation}") };
            let help = format!("write `{size} {both}` for a tolerance, or `{sum}` for a sum");
            slip("E0104", "a deviation stands alone", "one deviation", help)
        }
        _ if is_bare_sum(dim) => {
            slip("E0103", "sums need parentheses", "arithmetic outside parentheses", format!("write `({dim})`"))
        }
        _ => None,
    }
}

/// The text between the `=`, `(` or `,` before `at` and the `,`, `)` or line end behind it, with its offset.
fn dimension_around(text: &str, at: usize) -> Option<(usize, &str)> {
    let line_start = text[..at].rfind('\n').map_or(0, |i| i + 1);
    let line_end = text[at..].find('\n').map_or(text.len(), |i| at + i);
    let line_end = line_start + strip_comment(&text[line_start..line_end]).len();
    let start = line_start + text[line_start..at.min(line_end)].rfind(['=', '(', ','])? + 1;
    let end = text[at.min(line_end)..line_end].find([',', ')']).map_or(line_end, |i| at + i);
    let dim = &text[start..end];
    let indent = dim.len() - dim.trim_start().len();
    Some((start + indent, dim.trim()))
}

fn is_signed(word: &str) -> bool {
    word.len() > 1 && word.starts_with(['+', '-']) && word[1..].parse::<f64>().is_ok()
}

fn is_fit_pair(word: &str) -> bool {
    let class = |s: &str| {
        let digits = s.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        !digits.is_empty() && digits.len() < s.len() && digits.bytes().all(|b| b.is_ascii_digit())
    };
    word.split_once('/').is_some_and(|(hole, shaft)| class(hole) && class(shaft))
}

/// Operands joined by operators, and nothing else.
fn is_bare_sum(dim: &str) -> bool {
    let operator = |c: char| matches!(c, '+' | '-' | '*' | '/');
    let operand = |s: &str| {
        let s = s.trim();
        !s.is_empty() && s.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '.' | ' '))
    };
    dim.contains(operator) && dim.split(operator).all(operand)
}

/// The word, number or sign at `at`, or nothing at the end of the line.
fn token_at(text: &str, at: usize) -> &str {
    let rest = &text[at..];
    let word = |c: char| c.is_alphanumeric() || c == '_';
    match rest.chars().next() {
        None | Some('\n' | '\r') => "",
        Some(c) if word(c) => &rest[..rest.find(|c| !word(c)).unwrap_or(rest.len())],
        Some(c) => &rest[..c.len_utf8()],
    }
}

fn spoken(token: &str) -> String {
    if token.is_empty() { "the end of the line".to_string() } else { format!("`{token}`") }
}

/// `a`, `b` or `c`.
fn list(expected: &[&str]) -> String {
    match expected {
        [] => "the end of the line".to_string(),
        [one] => (*one).to_string(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// The keyword that `found` was meant to be: misspelt, or grown together with the name behind it.
fn keyword_meant(found: &str, expected: &[&str]) -> Option<String> {
    let keywords: Vec<&str> = expected
        .iter()
        .filter_map(|w| w.strip_prefix('`')?.strip_suffix('`'))
        .filter(|w| w.starts_with(|c: char| c.is_ascii_alphabetic()))
        .collect();
    let glued = keywords.iter().find(|k| found.len() > k.len() && found.starts_with(**k));
    match glued {
        Some(keyword) => Some(format!("{keyword} {}", found[keyword.len()..].trim_start_matches('_'))),
        None => nearest(found, keywords.iter().copied()).map(str::to_string),
    }
}
