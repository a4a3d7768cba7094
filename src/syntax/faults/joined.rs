//! Several statements on one line: behind a comma, or behind nothing.
//!
//! A line break ends a statement, so `{ z = -2, rz = free }` and `let a = 3 let b = 4` are two lines each.

use super::super::lines::{line_end, outside_strings, starts_statement, strip_comment};
use super::{Slip, is_word, is_word_letter, line_start, token_at};

/// Recognises at `at` the sign before a second statement of a line, its first word, or the `=` behind that.
pub fn slip(text: &str, at: usize) -> Option<Slip> {
    let line = line_start(text, at);
    let end = line + strip_comment(&text[line..line_end(text, at)]).len();
    let at = at.min(end);
    let (open, inside, depth) = innermost(&text[line..at])?;
    let open = open.map(|i| line + i);
    // `{ mmc 6, lmc 5 }` is a value.
    if inside || open.is_some_and(|i| text[line..i].trim_end().ends_with('=')) {
        return None;
    }
    let from = open.map_or(line, |i| i + 1);
    let close = open.map_or(end, |i| closing(text, i, end));
    let breaks = boundaries(text, from, close);
    // The one that stopped the parser: at it, or at the sign before its word or behind.
    let word = breaks.iter().map(|b| b.word).find(|&word| {
        let name = word + token_at(text, word).len();
        let sign = name + text[name..].len() - text[name..].trim_start_matches(' ').len();
        let before = text[..word].trim_end_matches([' ', ',']).len();
        (before..=sign.max(name)).contains(&at)
    })?;
    let found = token_at(text, word);
    let message = "a statement ends with its line";
    let slip = Slip::new("E0101", word, found.len(), message, "another statement");
    if depth > 1 {
        // What stands round it shares the line, too: one change would not do.
        return Some(slip.help("write each on a line of its own"));
    }
    let indent: String = text[line..].chars().take_while(|c| *c == ' ').collect();
    let inner = if open.is_some() { format!("{indent}    ") } else { indent.clone() };
    let mut edits: Vec<(usize, usize, String)> = Vec::new();
    let room = |at: usize| text[at..].len() - text[at..].trim_start_matches(' ').len();
    if open.is_some() {
        edits.push((from, room(from), format!("\n{inner}")));
    }
    edits.extend(breaks.iter().map(|b| (b.at, b.word - b.at, format!("\n{inner}"))));
    if open.is_some() && text[close..].starts_with('}') {
        let code = text[..close].trim_end_matches(' ').len();
        edits.push((code, close - code, format!("\n{indent}")));
    }
    Some(slip.change("write each on a line of its own", true, edits))
}

/// Where a statement follows another on the same line.
struct Break {
    /// Behind the one before.
    at: usize,
    /// The first letter of the next.
    word: usize,
}

/// The innermost `{` that is open at the end of a line's `start`, whether parentheses are open within, and how many braces
/// are. Nothing where a bracket closes that is not open.
fn innermost(start: &str) -> Option<(Option<usize>, bool, usize)> {
    let mut open: Vec<(usize, u8)> = Vec::new();
    for (i, byte) in outside_strings(start) {
        match byte {
            b'{' | b'(' => open.push((i, byte)),
            b'}' | b')' => drop(open.pop()?),
            _ => {}
        }
    }
    let braces: Vec<usize> = open.iter().filter(|(_, b)| *b == b'{').map(|(i, _)| *i).collect();
    Some((braces.last().copied(), open.last().is_some_and(|(_, b)| *b == b'('), braces.len()))
}

/// The `}` that closes the `{` at `open` on its line, or the end of the line's code.
fn closing(text: &str, open: usize, end: usize) -> usize {
    let mut depth = 0usize;
    for (i, byte) in outside_strings(&text[open..end]) {
        match byte {
            b'{' => depth += 1,
            b'}' if depth == 1 => return open + i,
            b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    text[..end].trim_end().len()
}

/// Every place between `from` and `to`, outside of brackets, where another statement begins.
fn boundaries(text: &str, from: usize, to: usize) -> Vec<Break> {
    let (mut depth, mut found) = (0usize, Vec::new());
    for (i, byte) in outside_strings(&text[from..to]) {
        let at = from + i;
        match byte {
            b'{' | b'(' => depth += 1,
            b'}' | b')' => depth = depth.saturating_sub(1),
            _ if depth == 0 && byte.is_ascii_alphabetic() && !text[..at].ends_with(is_word_letter) => {
                let before = text[from..at].trim_end_matches(' ');
                let code = before.trim_end_matches(',').trim_end();
                if begins(text, at, to) && ends_value(code) && from + before.len() < at {
                    found.push(Break { at: from + code.len(), word: at });
                }
            }
            _ => {}
        }
    }
    found
}

/// `name = …`, or a keyword with what it takes.
fn begins(text: &str, at: usize, to: usize) -> bool {
    let word = token_at(text, at);
    let rest = text[at + word.len()..to].trim_start_matches(' ');
    let field = rest.starts_with('=') && !rest.starts_with("==");
    is_word(word) && (field || starts_statement(&text[at..to]))
}

/// Whether a statement can end here: behind a value, not behind `let`, `add bore` or a sign.
fn ends_value(code: &str) -> bool {
    let word = code.rsplit(|c| !is_word_letter(c)).next().unwrap_or_default();
    let before = code[..code.len() - word.len()].trim_end();
    match code.chars().next_back() {
        Some(')' | '}' | '%' | '°' | '"' | ']') => true,
        Some(c) if is_word_letter(c) => {
            // `add pin head = …` is a name of two words, and so is what follows `let`; `3 rz = …` and `steel roughness = …`
            // are not.
            let keyword = starts_statement(&format!("{word} x"));
            word.starts_with(|c: char| c.is_ascii_digit()) || (before.contains(['=', '{']) && !keyword)
        }
        _ => false,
    }
}
