//! Slips in `name = value` and in lists of them: a missing or doubled sign, brackets of another kind, a file name without
//! quotes, a count without its x.

use super::super::lines::strip_comment;
use super::{Slip, is_word, is_word_letter, line_start, token_at};

/// Words that begin statements, and are no names of fields where one seems to miss its `=`.
const WORDS: [&str; 21] = [
    "group", "camera", "floor", "vary", "on", "at", "turn", "add", "cut", "keep", "let", "light", "measure", "root",
    "place", "watch", "ignore", "outline", "from", "line", "arc",
];

/// Statements of the form `word name = …`.
const NAMED: [&str; 3] = ["let", "light", "measure"];

/// Recognises a slip at `at`, where one of `expected` was expected.
pub fn slip(text: &str, at: usize, expected: &[&'static str]) -> Option<Slip> {
    let expects = |what: &str| expected.contains(&what);
    commas(text, at)
        .or_else(|| if expects("`name = value`") { no_equals(text, at) } else { None })
        .or_else(|| named_without_equals(text, at))
        .or_else(|| twice_equals(text, at))
        .or_else(|| if expects("arguments in parentheses") { brackets(text, at) } else { None })
        .or_else(|| if expects("a count such as `3x`") { count(text, at) } else { None })
        .or_else(|| if expects("a file name in quotes") { unquoted(text, at) } else { None })
        .or_else(|| dash_in_name(text, at))
}

/// A comma too few before an argument, or one too many.
fn commas(text: &str, at: usize) -> Option<Slip> {
    let before = text[..at].trim_end();
    if text[at..].starts_with(',') && before.ends_with([',', '(']) {
        let slip = Slip::new("E0101", at, 1, "a comma separates two values", "nothing before this comma");
        return Some(slip.fix("remove it", at, 1, ""));
    }
    let closed = strip_comment(&text[line_start(text, at)..at]);
    let open = closed.matches('(').count() > closed.matches(')').count();
    if text[at..].starts_with(',') && !open {
        let slip = Slip::new("E0101", at, 1, "a statement ends with its line", "no comma here");
        return text[at + 1..].lines().next()?.trim().is_empty().then(|| slip.fix("remove it", at, 1, ""));
    }
    // The name before the `=`, whether the parser stopped at it or behind it.
    let key = match text[at..].starts_with('=') {
        true => before.trim_end_matches(is_word_letter).len(),
        false => at,
    };
    let name = token_at(text, key);
    let value = text[..key].trim_end();
    let is_key = is_word(name) && text[key + name.len()..].trim_start_matches([' ', '\t']).starts_with('=');
    let ends_value = value.ends_with(|c: char| c.is_alphanumeric() || matches!(c, ')' | '}' | '%' | '°' | '"' | ']'));
    let in_line = !text[value.len()..key].is_empty();
    (open && is_key && ends_value && in_line).then(|| {
        Slip::new("E0101", key, name.len(), format!("a comma is missing before `{name}`"), "another argument").fix(
            "write the comma",
            value.len(),
            0,
            ",",
        )
    })
}

/// `material steel`, `z 10`, `metal: steel`.
fn no_equals(text: &str, at: usize) -> Option<Slip> {
    let key = token_at(text, at);
    if !is_word(key) || WORDS.contains(&key) {
        return None;
    }
    let end = at + key.len();
    let rest = text[end..].lines().next().unwrap_or_default();
    let (gap, value) = (rest.len() - rest.trim_start().len(), rest.trim_start());
    let sign = if value.starts_with(":=") { 2 } else { usize::from(value.starts_with(':')) };
    let message = format!("expected `=` behind `{key}`");
    if sign > 0 {
        let slip = Slip::new("E0101", end + gap, sign, message, "not expected here");
        return Some(slip.fix(format!("write `{key} = …`"), end, gap + sign, " ="));
    }
    let first = token_at(value, 0);
    let is_value = value.starts_with(|c: char| c.is_ascii_alphanumeric() || matches!(c, '"' | '(' | '-' | '.'));
    let next = value[first.len()..].trim_start();
    // `fillet edge r = 2` is no field.
    let one = !strip_comment(rest).split('(').next().unwrap_or_default().contains('=');
    (gap > 0 && is_value && one && !next.starts_with('=')).then(|| {
        Slip::new("E0101", end + gap, first.len().max(1), message, "not expected here").fix(
            format!("write `{key} = {first}`"),
            end,
            0,
            " =",
        )
    })
}

/// `let size 6`
fn named_without_equals(text: &str, at: usize) -> Option<Slip> {
    let start = line_start(text, at);
    let line = strip_comment(text[start..].lines().next()?);
    let mut words = line.split_whitespace();
    let (word, name, value) = (words.next()?, words.next()?, words.next()?);
    if !NAMED.contains(&word) || !is_word(name) || value.starts_with('=') {
        return None;
    }
    let after_word = line.find(word)? + word.len();
    let end = start + after_word + line[after_word..].find(name)? + name.len();
    let colon = value.starts_with(':');
    let from = end + text[end..].find(value)?;
    let slip = Slip::new(
        "E0101",
        from,
        token_at(text, from).len().max(1),
        format!("expected `=` behind `{word} {name}`"),
        "not expected here",
    );
    let title = format!("write `{word} {name} = …`");
    Some(if colon { slip.fix(title, end, from + 1 - end, " =") } else { slip.fix(title, end, 0, " =") })
}

fn twice_equals(text: &str, at: usize) -> Option<Slip> {
    (text[at..].starts_with('=') && text[..at].ends_with('=')).then(|| {
        Slip::new("E0101", at - 1, 2, "a value is given with one `=`", "two of them").fix("write `=`", at, 1, "")
    })
}

/// `circle[d = 36]`
fn brackets(text: &str, at: usize) -> Option<Slip> {
    let line = text[at..].lines().next()?;
    let (open, close) = [("[", ']'), ("{", '}'), ("<", '>')].into_iter().find(|(open, _)| line.starts_with(open))?;
    let end = line.rfind(close)?;
    let slip = Slip::new("E0101", at, 1, format!("arguments stand in `(` and `)`, not in `{open}`"), "another bracket");
    Some(slip.change("write parentheses", true, vec![(at, 1, "(".into()), (at + end, 1, ")".into())]))
}

/// `3 cylinder(…)`, `3 x cylinder(…)`
fn count(text: &str, at: usize) -> Option<Slip> {
    let number = token_at(text, at);
    let digits = number.len() - number.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let rest = &text[at + digits..];
    let gap = rest.len() - rest.trim_start_matches(' ').len();
    let next = token_at(rest, gap);
    if digits == 0 || gap == 0 && !next.is_empty() && next != "*" {
        return None;
    }
    let message = "copies are counted with an `x`";
    let slip = Slip::new("E0101", at, digits, message, "a number of copies");
    let count = &number[..digits];
    match next {
        "x" | "X" | "*" => Some(slip.fix(format!("write `{count}x`"), at + digits, gap + 1, "x")),
        next if is_word(next) => Some(slip.fix(format!("write `{count}x`"), at + digits, 0, "x")),
        _ => None,
    }
}

/// `use parts/pin.gng`
fn unquoted(text: &str, at: usize) -> Option<Slip> {
    let name = text[at..].split_whitespace().next().filter(|_| !text[at..].starts_with(['\n', '\r']))?;
    let name = name.trim_matches('\'');
    let from = at + text[at..].find(name)?;
    let whole = text[at..].split_whitespace().next()?.len();
    let slip = Slip::new("E0101", at, whole, "a file name stands in quotes", "not in quotes");
    let quoted = format!("\"{name}\"");
    (from <= at + 1 && !name.contains('"')).then(|| slip.fix(format!("write `{quoted}`"), at, whole, quoted.clone()))
}

/// `part pin-a {`
pub fn dash_in_name(text: &str, at: usize) -> Option<Slip> {
    let start = text[..at].trim_end_matches(|c| is_word_letter(c) || c == '-').len();
    let end = at + text[at..].find(|c| !is_word_letter(c) && c != '-').unwrap_or(text.len() - at);
    let name = &text[start..end];
    let is_name =
        text[at..].starts_with('-') && name.split('-').all(|s| !s.is_empty()) && is_word(&name.replace('-', "_"));
    is_name.then(|| {
        let plain = name.replace('-', "_");
        let slip = Slip::new("E0101", start, name.len(), "a name has no `-`", "not one name");
        slip.suggest(format!("write `{plain}`"), start, name.len(), plain.clone())
    })
}
