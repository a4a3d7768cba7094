//! What to say about a text that does not parse.
//!
//! In: where the parser gave up and what it would have taken. Out: a diagnostic in the words of the drawing office. The
//! usual slips (a sum without parentheses, deviations without a slash, a pair of fits, a forgotten comma, a misspelt
//! keyword) are recognised from the text around that place, and come with their fix.

mod calls;
mod dimension;
mod elsewhere;
mod fields;
mod joined;
mod placing;

use crate::diag::suggest::nearest;
use crate::diag::{Applicability, Diagnostic, Fix, Span};

/// What may begin a statement outside all braces.
const ITEMS: [&str; 11] = [
    "`gonogo`",
    "`units`",
    "`tolerances`",
    "`use`",
    "`let`",
    "`material`",
    "`part`",
    "`assembly`",
    "`station`",
    "`inspect`",
    "`train`",
];

/// Where parsing stopped (byte offset) and what would have been accepted there, in words.
pub struct Fault {
    pub at: usize,
    pub expected: Vec<&'static str>,
}

/// A mistake that is recognised, with the changes that would mend it; offsets are those of the text.
struct Slip {
    code: &'static str,
    at: usize,
    len: usize,
    message: String,
    label: &'static str,
    help: Option<String>,
    changes: Vec<Change>,
}

struct Change {
    title: String,
    certain: bool,
    /// Start, length, text.
    edits: Vec<(usize, usize, String)>,
}

impl Slip {
    fn new(code: &'static str, at: usize, len: usize, message: impl Into<String>, label: &'static str) -> Slip {
        Slip { code, at, len, message: message.into(), label, help: None, changes: Vec::new() }
    }

    fn help(mut self, text: impl Into<String>) -> Slip {
        self.help = Some(text.into());
        self
    }

    /// The one change that mends it.
    fn fix(self, title: impl Into<String>, at: usize, len: usize, text: impl Into<String>) -> Slip {
        self.change(title, true, vec![(at, len, text.into())])
    }

    /// A change that may be what was meant.
    fn suggest(self, title: impl Into<String>, at: usize, len: usize, text: impl Into<String>) -> Slip {
        self.change(title, false, vec![(at, len, text.into())])
    }

    fn change(mut self, title: impl Into<String>, certain: bool, edits: Vec<(usize, usize, String)>) -> Slip {
        self.changes.push(Change { title: title.into(), certain, edits });
        self
    }

    fn diagnostic(self, span: impl Fn(usize, usize) -> Span) -> Diagnostic {
        let mut diagnostic =
            Diagnostic::error(self.code, span(self.at, self.len), self.message).label(self.label.to_string());
        diagnostic.help = self.help;
        for Change { title, certain, edits } in self.changes {
            let applicability = if certain { Applicability::MachineApplicable } else { Applicability::MaybeIncorrect };
            let fix = Fix::new(title, applicability);
            let fix = edits.into_iter().fold(fix, |fix, (at, len, text)| fix.edit(span(at, len), text));
            diagnostic = diagnostic.with_fix(fix);
        }
        diagnostic
    }
}

/// The diagnostic for a fault in `text`, which begins at `offset` of file `file`.
pub fn describe(text: &str, fault: &Fault, file: u32, offset: usize) -> Diagnostic {
    let span = |at: usize, len: usize| Span { file, start: (offset + at) as u32, end: (offset + at + len) as u32 };
    // Inside a token that takes no blanks the parser stops before them; the reader looks at what follows.
    let at = text.len() - text[fault.at..].trim_start_matches([' ', '\t']).len();
    let slip = dimension::slip(text, fault.at)
        .or_else(|| bare_feature(text, fault.at))
        .or_else(|| foreign_statement(text, at))
        .or_else(|| calls::slip(text, at, &fault.expected))
        .or_else(|| fields::slip(text, at, &fault.expected))
        .or_else(|| placing::slip(text, at))
        .or_else(|| joined::slip(text, at))
        .or_else(|| title_line(text, at))
        .or_else(|| misspelt_before(text, at, &fault.expected));
    slip.unwrap_or_else(|| unexpected(text, at, &fault.expected)).diagnostic(span)
}

/// What no slip explains: what was expected, and the keyword that may have been meant.
fn unexpected(text: &str, at: usize, expected: &[&'static str]) -> Slip {
    let found = token_at(text, at);
    let begins = text[..at].trim().is_empty() || text[..at].trim_end_matches([' ', '\t']).ends_with('\n');
    let expected = if expected.is_empty() && begins { &ITEMS[..] } else { expected };
    if let (true, true, false) = (std::ptr::eq(expected, &ITEMS[..]), begins, found.is_empty()) {
        return begins_nothing(at, found);
    }
    let others: Vec<&str> = expected.iter().copied().filter(|e| e.trim_matches('`') != found).collect();
    let message = match others.is_empty() && !expected.is_empty() {
        true => format!("this {} cannot be read", spoken(found)),
        false => format!("expected {}, found {}", list(&others), spoken(found)),
    };
    let slip = Slip::new("E0101", at, found.trim_end().len(), message, "not expected here");
    match (elsewhere::keyword(found, expected), keyword_meant(found, expected)) {
        (Some(ours), _) => slip.suggest(format!("write `{ours}`"), at, found.len(), ours),
        (None, Some(meant)) => slip.fix(format!("did you mean `{meant}`?"), at, found.len(), meant),
        (None, None) => slip,
    }
}

/// A line outside all braces that begins with no word for it.
fn begins_nothing(at: usize, found: &str) -> Slip {
    if ITEMS.iter().any(|item| item.trim_matches('`') == found) {
        let slip = Slip::new("E0101", at, found.len(), format!("`{found}` cannot stand here"), "not in this block");
        return slip.help("move it out of all braces");
    }
    let slip = Slip::new("E0101", at, found.len(), format!("no statement begins with `{found}`"), "unknown here");
    match (elsewhere::keyword(found, &ITEMS), keyword_meant(found, &ITEMS)) {
        (Some(ours), _) => slip.suggest(format!("write `{ours}`"), at, found.len(), ours),
        (None, Some(meant)) => slip.fix(format!("did you mean `{meant}`?"), at, found.len(), meant),
        (None, None) => slip.help(format!("outside of braces a line begins with {}", list(&ITEMS))),
    }
}

/// The name in a line such as `shank = cylinder(…)`, where the parser took a field and gave up at the parenthesis.
fn bare_feature(text: &str, at: usize) -> Option<Slip> {
    let line_start = line_start(text, at);
    let (name, shape) = text[line_start..at].split_once('=')?;
    let start = line_start + name.len() - name.trim_start().len();
    let name = name.trim();
    if !(text[at..].starts_with('(') && is_word(name) && is_word(shape.trim())) {
        return None;
    }
    let message = format!("expected a feature (`add`, `cut`, `keep`), found `{name}`");
    let slip = Slip::new("E0101", start, name.len(), message, "not a feature");
    Some(match keyword_meant(name, &["`add`", "`cut`", "`keep`"]) {
        Some(meant) => slip.fix(format!("did you mean `{meant}`?"), start, name.len(), meant),
        None => slip.suggest(format!("did you mean `add {name}`?"), start, 0, "add "),
    })
}

/// `fillet edge r = 2`: a statement of other languages, at the beginning of a line.
fn foreign_statement(text: &str, at: usize) -> Option<Slip> {
    let begins = text[line_start(text, at)..at].trim().is_empty();
    let found = token_at(text, at);
    // `round = 1` is a field, and an unknown one is reported with those that there are.
    let field = text[at + found.len()..].trim_start_matches(' ').starts_with('=');
    if begins && !field { elsewhere::slip(at, found) } else { None }
}

/// `units mm`, and `assembly: name {`.
fn title_line(text: &str, at: usize) -> Option<Slip> {
    let line = line_start(text, at);
    let head = &text[line..at];
    let words: Vec<&str> = head.split_whitespace().collect();
    match words.as_slice() {
        ["units", unit] if token_at(text, at).is_empty() => {
            let angle = matches!(*unit, "deg" | "rad" | "°");
            let both = if angle { format!("mm {unit}") } else { format!("{unit} deg") };
            let from = line + head.find(unit)?;
            let slip = Slip::new("E0101", from, unit.len(), "units are two: of lengths and of angles", "one of them");
            Some(slip.fix(format!("write `units {both}`"), from, unit.len(), both))
        }
        [kind] if text[at..].starts_with(':') && ITEMS.iter().any(|item| item.trim_matches('`') == *kind) => {
            let slip = Slip::new("E0101", at, 1, format!("no `:` stands behind `{kind}`"), "not expected here");
            let blanks = text[at + 1..].len() - text[at + 1..].trim_start_matches(' ').len();
            Some(slip.fix("remove it", at, 1 + blanks, " "))
        }
        _ => None,
    }
}

/// The word before `at`, if it was read as a unit but is nearly a keyword that is expected.
fn misspelt_before(text: &str, at: usize, expected: &[&'static str]) -> Option<Slip> {
    let before = text[..at].trim_end_matches([' ', '\t']);
    let start = before.trim_end_matches(|c: char| c.is_ascii_alphabetic()).len();
    let word = &before[start..];
    let is_unit = before[..start].trim_end().ends_with(|c: char| c == ')' || c.is_ascii_digit());
    let keywords = expected.iter().filter_map(|w| w.strip_prefix('`')?.strip_suffix('`')).filter(|w| w.len() > 2);
    let meant = nearest(word, keywords)?;
    if !is_unit || word.len() <= 2 {
        return None;
    }
    let message = format!("expected {}, found `{word}`", list(expected));
    let slip = Slip::new("E0101", start, word.len(), message, "not expected here");
    Some(slip.fix(format!("did you mean `{meant}`?"), start, word.len(), meant))
}

/// Start of the line that `at` stands on.
fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |i| i + 1)
}

fn is_word(s: &str) -> bool {
    !s.is_empty() && s.chars().all(is_word_letter) && !s.starts_with(|c: char| c.is_ascii_digit())
}

fn is_word_letter(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
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

/// The keyword that `found` was meant to be: in other letters, misspelt, or grown together with the name behind it.
fn keyword_meant(found: &str, expected: &[&str]) -> Option<String> {
    let keywords: Vec<&str> = expected
        .iter()
        .filter_map(|w| w.strip_prefix('`')?.strip_suffix('`'))
        .filter(|w| w.starts_with(|c: char| c.is_ascii_alphabetic()))
        .collect();
    // One letter too many is a slip of the finger: `onn` is no `on n`.
    let glued = keywords.iter().find(|k| found.len() > k.len() + 1 && found.starts_with(**k));
    let same = keywords.iter().find(|k| k.eq_ignore_ascii_case(found));
    match (same, glued) {
        (Some(keyword), _) => Some(keyword.to_string()),
        (None, Some(keyword)) => Some(format!("{keyword} {}", found[keyword.len()..].trim_start_matches('_'))),
        (None, None) => nearest(found, keywords.iter().copied()).map(str::to_string),
    }
}
