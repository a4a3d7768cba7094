//! Blocks whose `{` is missing or stands on a line of its own.
//!
//! In: a text. Out: the same text with the `{` at the end of its head, byte for byte as long, and a diagnostic for each.

use super::lines::{outside_strings, starts_block_item, strip_comment};
use super::scan::Chunk;
use crate::diag::{Applicability, Diagnostic, Fix, Span};

/// Statements in a block that open a block of their own.
const INNER: [&str; 5] = ["camera", "floor", "vary", "outline", "place"];

/// Mends the heads of blocks in `text`, which belongs to `file`, outside of items that are known to be right.
pub fn mended(text: &str, file: u32, sound: &[Chunk]) -> (String, Vec<Diagnostic>) {
    let mut bytes = text.as_bytes().to_vec();
    let mut diagnostics = Vec::new();
    let mut head: Option<Line> = None;
    for line in lines(text) {
        let is_sound = |head: &Line| sound.iter().any(|chunk| (chunk.start..chunk.end).contains(&head.start));
        if let Some(head) = head.as_ref().filter(|head| head.may_open() && !is_sound(head)) {
            let span = |at: usize, len: usize| Span { file, start: at as u32, end: (at + len) as u32 };
            let end = head.start + head.code.len();
            let blank = text.as_bytes().get(end).is_some_and(u8::is_ascii_whitespace);
            let brace = line.start + line.indent;
            if blank && line.code.trim() == "{" {
                let message = "the `{` stands on the line of what it opens";
                let fault = Diagnostic::error("E0101", span(brace, 1), message)
                    .label("one line too late")
                    .also(span(head.start + head.indent, head.code.len() - head.indent), "opened by this");
                let between = text[end..brace].trim().is_empty();
                diagnostics.push(match between {
                    true => fault.fix("move it up", span(end, brace + 1 - end), " {"),
                    false => fault.help("move it up"),
                });
                (bytes[end], bytes[brace]) = (b'{', b' ');
            } else if blank && head.is_bare_head() && line.indent > head.indent && head.could_hold(&line) {
                let words = head.code.trim();
                let fix = Fix::new(format!("write `{words} {{`"), Applicability::MachineApplicable);
                diagnostics.push(
                    Diagnostic::error(
                        "E0102",
                        span(head.start + head.indent, words.len()),
                        format!("`{words}` has no `{{`"),
                    )
                    .label("a `{` is missing behind this")
                    .also(span(brace, line.code.trim().len()), "this line stands in its block")
                    .with_fix(fix.edit(span(end, 0), " {")),
                );
                bytes[end] = b'{';
            }
        }
        head = Some(line);
    }
    // Blanks and braces only have been replaced, by braces and blanks.
    (String::from_utf8(bytes).unwrap_or_else(|_| text.to_string()), diagnostics)
}

/// A line that is more than a comment, without its comment.
struct Line<'t> {
    start: usize,
    indent: usize,
    code: &'t str,
}

fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let mut start = 0;
    let all = text.split_inclusive('\n').map(move |line| {
        let code = strip_comment(line).trim_end();
        let found = Line { start, indent: code.len() - code.trim_start().len(), code };
        start += line.len();
        found
    });
    all.filter(|line| !line.code.trim().is_empty())
}

impl Line<'_> {
    /// Whether a `{` could follow: no bracket is open, and nothing is to be continued.
    fn may_open(&self) -> bool {
        let count = |bracket: u8| outside_strings(self.code).filter(|&(_, b)| b == bracket).count();
        count(b'(') == count(b')') && !self.code.ends_with(['{', '}', ',', '(', '='])
    }

    /// `part pin`, `place pin on plate`: what opens a block, without one.
    fn is_bare_head(&self) -> bool {
        let words = self.code.trim();
        let first = words.split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default();
        let inner = INNER.contains(&first) && !words[first.len()..].trim_start().starts_with('=');
        !words.contains(['{', '}']) && (self.indent == 0 && starts_block_item(words) || self.indent > 0 && inner)
    }

    /// Whether a line may stand in the block. A `place` needs none, and what stands in it gives one of its fields.
    fn could_hold(&self, line: &Line) -> bool {
        let field = line.code.trim().split_once('=').map(|(name, _)| name.trim());
        let is_field = field.is_some_and(|name| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphabetic()));
        !self.code.trim_start().starts_with("place") || is_field
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::apply;

    fn both(text: &str) -> (String, String) {
        let (read, diagnostics) = mended(text, 0, &[]);
        assert_eq!(read.len(), text.len());
        (read, apply(text, 0, diagnostics.iter().flat_map(|d| &d.fixes)).0)
    }

    #[test]
    fn a_brace_on_the_next_line_moves_up() {
        let (read, fixed) = both("part pin\n{\n    add a = b()\n}\n");
        assert_eq!(read, "part pin{ \n    add a = b()\n}\n");
        assert_eq!(fixed, "part pin {\n    add a = b()\n}\n");
    }

    #[test]
    fn a_head_without_a_brace_gets_one() {
        let (read, fixed) = both("station s // one\n    camera fixed\n        focal = 3\n    }\n}\n");
        assert_eq!(read, "station s{// one\n    camera fixed{        focal = 3\n    }\n}\n");
        assert_eq!(fixed, "station s { // one\n    camera fixed {\n        focal = 3\n    }\n}\n");
    }

    #[test]
    fn what_may_stand_without_a_block_does() {
        for text in [
            "part p {\n    outline = o\n      x\n",
            "    place a on b\n    root c\n",
            "  place a on b\n    place c = 2x d on b\n",
            "a = b(\n{\n",
            "part p // {\n",
        ] {
            assert_eq!(both(text), (text.to_string(), text.to_string()));
        }
    }
}
