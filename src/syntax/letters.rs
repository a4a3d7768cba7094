//! Signs that are not of the language but that every drawing and every word processor has: dashes, no-break spaces, Ø, ×,
//! curly quotes, semicolons, comments in the manner of other languages.
//!
//! In: a text. Out: the same text with what was meant in their place, byte for byte as long, so that every span holds for
//! both, and one diagnostic for every kind of sign. The parser reads on as if nothing had been.

use super::lines::{outside_strings, strip_comment};
use crate::diag::{Applicability, Diagnostic, Fix, Span};
use std::collections::BTreeMap;

/// Places shown of one kind of sign; all are mended.
const SHOWN: usize = 3;

/// The text as it was meant, what was wrong with it, and the stretches that are lost.
pub struct Cleaned {
    pub text: String,
    pub diagnostics: Vec<Diagnostic>,
    pub lost: Vec<Span>,
}

/// Replaces foreign signs outside strings and comments.
pub fn clean(text: &str, file: u32) -> Cleaned {
    let mut cleaner = Cleaner {
        file,
        text: text.as_bytes().to_vec(),
        kinds: BTreeMap::new(),
        words: BTreeMap::new(),
        diagnostics: Vec::new(),
        lost: Vec::new(),
    };
    if text.starts_with('\u{feff}') {
        cleaner.blank(0, '\u{feff}'.len_utf8());
    }
    let inside = cleaner.block_comments(text);
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        if !covered(&inside, at, at + line.trim_end().len()) {
            cleaner.line(at, line, &inside);
        }
        at += line.len();
    }
    cleaner.finish(text)
}

/// A sign that was found, and what it stands for.
struct Found {
    sign: char,
    span: Span,
    meant: String,
}

struct Cleaner {
    file: u32,
    text: Vec<u8>,
    kinds: BTreeMap<char, Vec<Found>>,
    words: BTreeMap<String, Vec<Span>>,
    diagnostics: Vec<Diagnostic>,
    lost: Vec<Span>,
}

impl Cleaner {
    /// Reports `/* … */` and takes them out of the text; their stretches.
    fn block_comments(&mut self, text: &str) -> Vec<(usize, usize)> {
        let mut found = Vec::new();
        let (mut at, mut skip) = (0, 0);
        for line in text.split_inclusive('\n') {
            let code = strip_comment(line);
            let open = code.find("/*").filter(|&i| at + i >= skip && outside_strings(code).any(|(j, _)| i == j));
            if let Some(open) = open {
                let open = at + open;
                let close = text[open + 2..].find("*/").map(|i| open + 2 + i + 2);
                skip = close.unwrap_or(text.len());
                self.block_comment(text, open, close);
                found.push((open, skip));
            }
            at += line.len();
        }
        found
    }

    fn block_comment(&mut self, text: &str, open: usize, close: Option<usize>) {
        let end = close.unwrap_or(text.len());
        let span = self.span(open, 2);
        let message = "comments begin with `//` and end with the line";
        let mut diagnostic = Diagnostic::error("E0101", span, message).label("not a comment here");
        diagnostic = match close {
            None => diagnostic.note("nor does this one end with `*/`"),
            Some(_) => diagnostic,
        };
        let ends_its_line = text[end..].lines().next().unwrap_or_default().trim().is_empty();
        if close.is_some() && ends_its_line {
            let title = "write `//` before every line of it";
            let mut fix = Fix::new(title, Applicability::MachineApplicable).edit(span, "//");
            let mut at = open;
            for line in text[open..end - 2].split_inclusive('\n') {
                if at > open && !line.trim().is_empty() {
                    let indent = line.len() - line.trim_start().len();
                    fix = fix.edit(self.span(at + indent, 0), "// ");
                }
                at += line.len();
            }
            let body = text[open..end - 2].trim_end().len();
            fix = fix.edit(self.span(open + body, end - open - body), "");
            diagnostic = diagnostic.with_fix(fix);
        }
        self.diagnostics.push(diagnostic);
        self.blank(open, end);
    }

    fn line(&mut self, start: usize, line: &str, comments: &[(usize, usize)]) {
        let mut at = 0;
        let (mut quoted, mut before) = (None, ' ');
        let end = strip_comment(line).len();
        let code = &line[..end];
        while let Some(c) = code[at..].chars().next() {
            let here = start + at;
            let rest = &code[at + c.len_utf8()..];
            let in_comment = covered(comments, here, here + 1);
            match c {
                _ if in_comment || here == 0 && c == '\u{feff}' => {}
                '"' if quoted.is_none() && before.is_ascii_digit() => self.inches(here),
                '"' | '“' | '”' | '„' | '‟' => {
                    quoted = if quoted.is_some() { None } else { Some(here) };
                    if c != '"' {
                        self.quote(c, here, quoted.is_some());
                    }
                }
                _ if quoted.is_some() => {}
                '#' if before == ' ' || before == '\t' => {
                    self.note(c, here, "//");
                    return self.blank(here, start + line.trim_end().len());
                }
                ';' => self.semicolon(here, rest, line),
                c if c.is_ascii() => {}
                c if is_foreign_letter(c, rest) => {
                    let word_start = code[..at].trim_end_matches(is_word).len();
                    let word = &code[word_start..];
                    let word = &word[..word.find(|c| !is_word(c)).unwrap_or(word.len())];
                    self.word(word, start + word_start);
                    at = word_start + word.len();
                    continue;
                }
                c => self.sign(c, here, &code[..at], rest),
            }
            before = c;
            at += c.len_utf8();
        }
        if let Some(open) = quoted {
            self.unclosed_string(open, start, line);
        }
    }

    /// A curly quote: the straight one stands where the string begins or ends.
    fn quote(&mut self, c: char, here: usize, opens: bool) {
        self.note(c, here, "\"");
        let end = here + c.len_utf8();
        self.blank(here, end);
        self.text[if opens { end - 1 } else { here }] = b'"';
    }

    /// `3"` on a drawing in inches.
    fn inches(&mut self, here: usize) {
        let span = self.span(here, 1);
        let fault = Diagnostic::error("E0204", span, "inches are `in`").label("no unit");
        self.diagnostics.push(fault.fix("write `in`", span, " in"));
        self.blank(here, here + 1);
    }

    fn semicolon(&mut self, here: usize, rest: &str, line: &str) {
        let ends = rest.trim_end_matches([';', '\r', '\n']).trim().is_empty();
        let indent = &line[..line.len() - line.trim_start().len()];
        let meant = if ends { String::new() } else { format!("\n{indent}") };
        self.note(';', here, &meant);
        self.text[here] = if ends { b' ' } else { b'\n' };
    }

    fn sign(&mut self, c: char, here: usize, before: &str, rest: &str) {
        let Some(meant) = meant(c, before, rest) else { return };
        self.note(c, here, meant);
        let end = here + c.len_utf8();
        self.blank(here, end);
        let meant = if meant == "d = " { "d=" } else { meant };
        // A sign belongs to the number behind it, the x of `3x` to the one before.
        let room = if meant == "x" { here..end } else { end - meant.len().min(end - here)..end };
        for (slot, byte) in room.zip(meant.bytes()) {
            self.text[slot] = byte;
        }
    }

    fn note(&mut self, c: char, here: usize, meant: &str) {
        let span = self.span(here, c.len_utf8());
        self.kinds.entry(kind(c)).or_default().push(Found { sign: c, span, meant: meant.to_string() });
    }

    /// A name with letters that no name has: read with underscores in their place.
    fn word(&mut self, word: &str, here: usize) {
        let span = self.span(here, word.len());
        self.words.entry(word.to_string()).or_default().push(span);
        for (i, c) in word.char_indices().filter(|(_, c)| !c.is_ascii()) {
            self.text[here + i..here + i + c.len_utf8()].fill(b'_');
        }
    }

    fn unclosed_string(&mut self, open: usize, start: usize, line: &str) {
        let end = start + line.trim_end().len();
        let diagnostic = Diagnostic::error("E0101", self.span(open, 1), "this `\"` is never closed")
            .label("opened here")
            .fix("a `\"` is missing before the end of the line", self.span(end, 0), "\"");
        self.diagnostics.push(diagnostic);
        self.lost.push(self.span(start, end - start));
        self.blank(start, end);
    }

    fn blank(&mut self, from: usize, to: usize) {
        self.text[from..to].iter_mut().filter(|b| !matches!(b, b'\n' | b'\r')).for_each(|b| *b = b' ');
    }

    fn span(&self, at: usize, len: usize) -> Span {
        Span { file: self.file, start: at as u32, end: (at + len) as u32 }
    }

    fn finish(mut self, original: &str) -> Cleaned {
        let signs = self.kinds.values().map(|found| foreign_sign(found));
        self.diagnostics.extend(signs.collect::<Vec<_>>());
        let words = self.words.iter().map(|(word, spans)| foreign_word(word, spans));
        self.diagnostics.extend(words.collect::<Vec<_>>());
        // Only whole characters are replaced, by ASCII.
        let text = String::from_utf8(self.text).unwrap_or_else(|_| original.to_string());
        Cleaned { text, diagnostics: self.diagnostics, lost: self.lost }
    }
}

/// What a foreign sign was meant to be; nothing for signs of the language and signs nobody can guess.
fn meant(c: char, before: &str, rest: &str) -> Option<&'static str> {
    let digit = |c: char| c.is_ascii_digit();
    let is_count = before.ends_with(digit) && !rest.trim_start().starts_with(digit);
    let is_extent = before.trim_end().ends_with(digit) && rest.trim_start().starts_with(digit);
    Some(match c {
        '\u{2010}'..='\u{2015}' | '﹣' | '－' => "-",
        '\u{a0}' | '\u{2000}'..='\u{200a}' | '\u{202f}' | '\u{205f}' | '\u{3000}' => " ",
        '\u{ad}' | '\u{200b}'..='\u{200d}' | '\u{2060}' | '\u{feff}' => "",
        'º' | '˚' => "°",
        'Ø' | 'ø' | '⌀' | '∅' if before.trim_end().ends_with(['(', ',']) => "d = ",
        'Ø' | 'ø' | '⌀' | '∅' => "",
        // `3×` and `640 × 480`, or a product.
        '×' | '✕' if is_count || is_extent => "x",
        '×' | '✕' | '·' | '⋅' | '∙' => "*",
        '÷' | '∕' | '⁄' => "/",
        '…' => "..",
        '，' => ",",
        '（' => "(",
        '）' => ")",
        '＝' => "=",
        '＋' => "+",
        _ => return None,
    })
}

/// Whether a stretch lies inside one of those in a sorted list.
fn covered(stretches: &[(usize, usize)], from: usize, to: usize) -> bool {
    let before = stretches.partition_point(|&(start, _)| start <= from);
    before > 0 && to <= stretches[before - 1].1
}

/// Signs that are one fault.
fn kind(c: char) -> char {
    match c {
        '”' | '„' | '‟' => '“',
        'ø' | '⌀' | '∅' => 'Ø',
        c => c,
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// A letter that no name and no unit has; the Ø before a number is a sign.
fn is_foreign_letter(c: char, rest: &str) -> bool {
    let diameter = matches!(c, 'Ø' | 'ø') && !rest.starts_with(|c: char| c.is_alphabetic() || c == '_');
    c.is_alphabetic() && !matches!(c, 'µ' | 'μ' | 'º') && !diameter
}

fn foreign_sign(found: &[Found]) -> Diagnostic {
    let Found { sign: c, meant, .. } = &found[0];
    let c = *c;
    let (message, title) = match (c, meant.trim_matches(' ')) {
        (';', _) => ("a statement ends with its line, not with `;`".to_string(), "remove the `;`".to_string()),
        ('Ø' | 'ø' | '⌀' | '∅', "d =") => (format!("`{c}` is the argument `d`"), "write `d = `".to_string()),
        ('Ø' | 'ø' | '⌀' | '∅', _) => {
            (format!("`{c}` is not needed: the argument `d` is a diameter"), format!("remove the `{c}`"))
        }
        ('#', _) => ("comments begin with `//`".to_string(), "write `//`".to_string()),
        (_, "") if meant.is_empty() => (format!("an invisible sign (U+{:04X})", u32::from(c)), "remove it".to_string()),
        (_, "") => (format!("a blank of another width (U+{:04X})", u32::from(c)), "write a plain blank".to_string()),
        (_, meant) => (format!("`{c}` (U+{:04X}) is not `{meant}`", u32::from(c)), format!("write `{meant}`")),
    };
    let mut diagnostic = Diagnostic::error("E0101", found[0].span, message).label("not a sign of the language");
    for again in found[1..].iter().take(SHOWN - 1) {
        diagnostic = diagnostic.also(again.span, "here too");
    }
    if found.len() > SHOWN {
        diagnostic = diagnostic.note(format!("{} times in this file", found.len()));
    }
    let fix = Fix::new(title, Applicability::MachineApplicable);
    // Neighbours are one edit: edits of a fix do not touch.
    let mut edits: Vec<(Span, String)> = Vec::new();
    for Found { span, meant, .. } in found {
        match edits.last_mut() {
            Some((last, text)) if last.end == span.start => (last.end, *text) = (span.end, format!("{text}{meant}")),
            _ => edits.push((*span, meant.clone())),
        }
    }
    diagnostic.with_fix(edits.into_iter().fold(fix, |fix, (span, text)| fix.edit(span, text)))
}

fn foreign_word(word: &str, spans: &[Span]) -> Diagnostic {
    let plain: String = word.chars().map(plain_letter).collect();
    let foreign = word.chars().find(|c| !c.is_ascii()).unwrap_or_default();
    let title = format!("write `{plain}`");
    let mut diagnostic = Diagnostic::error("E0101", spans[0], format!("`{word}` has a letter that names have not"))
        .label(format!("`{foreign}`"))
        .note("names are of the letters a to z and A to Z, digits and `_`");
    for again in spans[1..].iter().take(SHOWN - 1) {
        diagnostic = diagnostic.also(*again, "here too");
    }
    let fix = Fix::new(title, Applicability::MaybeIncorrect);
    diagnostic.with_fix(spans.iter().fold(fix, |fix, span| fix.edit(*span, &plain)))
}

/// As it is written where there is no such letter.
fn plain_letter(c: char) -> String {
    match c {
        'ä' => "ae".into(),
        'ö' | 'ø' => "oe".into(),
        'ü' => "ue".into(),
        'Ä' => "Ae".into(),
        'Ö' | 'Ø' => "Oe".into(),
        'Ü' => "Ue".into(),
        'ß' => "ss".into(),
        'å' => "aa".into(),
        'à' | 'á' | 'â' | 'ã' => "a".into(),
        'è' | 'é' | 'ê' | 'ë' => "e".into(),
        'ì' | 'í' | 'î' | 'ï' => "i".into(),
        'ò' | 'ó' | 'ô' | 'õ' => "o".into(),
        'ù' | 'ú' | 'û' => "u".into(),
        'ç' => "c".into(),
        'ñ' => "n".into(),
        c if c.is_ascii() => c.into(),
        _ => "_".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::apply;

    /// The text as the parser reads it, and as the fixes leave it.
    fn both(text: &str) -> (String, String) {
        let cleaned = clean(text, 0);
        assert_eq!(cleaned.text.len(), text.len());
        let fixes: Vec<&Fix> = cleaned.diagnostics.iter().flat_map(|d| &d.fixes).collect();
        (cleaned.text, apply(text, 0, fixes).0)
    }

    #[test]
    fn plain_texts_stay_as_they_are() {
        let text = "let a = 6 ±0.1 // – × Ø ; # /* ä\nuse \"gehäuse;–.gng\"\nlet b = 5 µm\nlet c = −3°\n";
        let cleaned = clean(text, 0);
        assert!(cleaned.text == text && cleaned.diagnostics.is_empty(), "{:?}", cleaned.diagnostics);
    }

    #[test]
    fn signs_of_the_drawing_office_are_understood() {
        let (read, fixed) =
            both("let a = –3;\ncut b = 3× c(d = Ø9,\u{a0}h = 2)\nimage = 640×480 px\nlet c = (2 · 3)\n");
        assert_eq!(read, "let a =   -3 \ncut b = 3x  c(d =   9,  h = 2)\nimage = 640x 480 px\nlet c = (2  * 3)\n");
        assert_eq!(fixed, "let a = -3\ncut b = 3x c(d = 9, h = 2)\nimage = 640x480 px\nlet c = (2 * 3)\n");
    }

    #[test]
    fn comments_of_other_languages_are_comments() {
        let (read, fixed) = both("let a = 3 # three\n/* two\n   lines */\nlet b = 4 /* four */\n");
        assert_eq!(read, "let a = 3        \n      \n           \nlet b = 4           \n");
        assert_eq!(fixed, "let a = 3 // three\n// two\n   // lines\nlet b = 4 // four\n");
    }

    #[test]
    fn strings_have_straight_quotes_and_an_end() {
        assert_eq!(both("use “a.gng”\n"), ("use   \"a.gng\"  \n".into(), "use \"a.gng\"\n".into()));
        let (read, fixed) = both("use \"a.gng\nlet b = 1\n");
        assert_eq!((read.as_str(), fixed.as_str()), ("          \nlet b = 1\n", "use \"a.gng\"\nlet b = 1\n"));
    }

    #[test]
    fn inches_have_a_unit_of_letters() {
        assert_eq!(both("let a = 3\"\n"), ("let a = 3 \n".into(), "let a = 3 in\n".into()));
        let (read, fixed) = both("add b = box(x = 3\", y = 2\")\nuse \"std/iso4762\"\n");
        assert_eq!(read, "add b = box(x = 3 , y = 2 )\nuse \"std/iso4762\"\n");
        assert_eq!(fixed, "add b = box(x = 3 in, y = 2 in)\nuse \"std/iso4762\"\n");
    }

    #[test]
    fn a_foreign_letter_is_one_fault_however_often_it_stands() {
        let (read, fixed) = both("part gehäuse {\n}\nroot gehäuse\n");
        assert_eq!(read, "part geh__use {\n}\nroot geh__use\n");
        assert_eq!(fixed, "part gehaeuse {\n}\nroot gehaeuse\n");
        assert_eq!(clean("part gehäuse {\n}\nroot gehäuse\n", 0).diagnostics.len(), 1);
    }
}
